package flyframe.application

import chisel3._
import chisel3.util._
import flyframe.memory.{RegisterBus, RegisterUnit}
import flyframe.params.EscParams
import flyframe.registers.WatchdogRegisters

/** A watchdog ([[flyframe.registers.WatchdogRegisters]]): counts ticks from its last trigger and expires at
  * tick `timeTicks` + 1 (WD-02, B-61).
  */
class Watchdog extends Module {
  val tick = IO(Input(Bool()))

  /** Watchdog time in ticks; 0: off. Not `time`, which Verilog has for itself. */
  val timeTicks = IO(Input(UInt(16.W)))
  val trigger   = IO(Input(Bool()))

  /** The time was written. */
  val restart = IO(Input(Bool()))

  /** 1: running or off; 0: expired, or never triggered. */
  val running = IO(Output(Bool()))
  val expired = IO(Output(Bool())) // one cycle

  private val left  = Reg(UInt(16.W))
  private val alive = RegInit(false.B) // reset: expired until the first trigger (B-61)
  private val off   = timeTicks === 0.U
  expired := alive && tick && left === 0.U && !off
  when(tick) { left := left - 1.U }
  when(expired) { alive := false.B }
  when(trigger) { alive := true.B }
  when(trigger || restart) { left := timeTicks }
  running := alive || off
}

/** The common divider (WD-01). */
class WatchdogDivider(cyclesPerNibble: Int) extends Module {
  val divider = IO(Input(UInt(16.W)))
  val tick    = IO(Output(Bool()))

  // From the divider down to 0, and one slot to begin anew.
  private val slot   = if (cyclesPerNibble == 1) true.B else Counter(cyclesPerNibble).inc()
  private val left   = RegInit(0.U(16.W)) // reset: any phase will do
  private val begins = RegInit(true.B)
  private val end    = slot && !begins && left === 0.U
  when(slot) {
    begins := left === 0.U && !begins
    left   := Mux(begins, divider, left - 1.U)
  }
  tick := end
}

/** Both watchdogs behind their registers.
  *
  * @param bufferWritten
  *   triggers that of the process data (WD-04), where there are SyncManagers
  */
class Watchdogs(p: EscParams, bufferWritten: Option[Bool]) extends RegisterUnit(WatchdogRegisters.all) {
  private val divider     = Module(new WatchdogDivider(p.cyclesPerNibble)).suggestName("watchdogDivider")
  private val processData = Module(new Watchdog).suggestName("watchdog_process_data")
  private val pdi         = Module(new Watchdog).suggestName("watchdog_pdi")

  /** Pulses: they expire. */
  val processDataExpires: Bool = processData.expired
  val pdiExpires: Bool         = pdi.expired

  /** Something triggers that of the process data. */
  val triggers: Bool = Wire(Bool())

  def connect(bus: RegisterBus): Unit = {
    triggers :=
      bufferWritten.getOrElse(if (p.outputsTrigger) bus.writes("digital_output") else false.B)
    divider.divider     := bus.value("watchdog_divider")
    processData.trigger := triggers
    pdi.trigger         := bus.hostAccess
    for ((name, watchdog) <- Seq("process_data" -> processData, "pdi" -> pdi)) {
      val time = s"watchdog_time_$name"
      watchdog.tick                       := divider.tick
      watchdog.timeTicks                  := bus.value(time)
      watchdog.restart                    := RegNext(bus.writes(time), false.B)
      bus.status(s"watchdog_$name")       := watchdog.running
      bus.counts(s"watchdog_count_$name") := watchdog.expired
    }
    bus.status("pdi_watchdog") := pdi.running
    bus.status("watchdog_event") := bus
      .untilAcknowledged("watchdog_status_process_data")(processData.expired)
      .suggestName("watchdog_event")
  }
}
