package flyframe.syncmanager

import chisel3._
import chisel3.util._
import flyframe.memory.{BufferEvents, RegisterBus, RegisterUnit}
import flyframe.params.EscParams
import flyframe.registers.SyncManagerRegisters

/** [[SyncManagers]] behind their registers. */
class SyncManagerUnit(p: EscParams) extends RegisterUnit(SyncManagerRegisters(p)) {
  private val unit = Module(new SyncManagers(p)).suggestName("syncManagers")

  /** What the two sides see. */
  val ecat: AreaPort = unit.ecat
  val pdi: AreaPort  = unit.pdi

  /** No access of the host is under way; to be connected. */
  val hostIsQuiet: Bool = Wire(Bool())

  /** All buffers a good frame has closed have changed hands: one pulse. */
  val settled: Bool = unit.settled

  /** A buffer with watchdog trigger has been written (WD-04). */
  val trigger: Bool = unit.trigger

  /** What happens to buffers, where its times are kept (DC-42). */
  val events: Option[BufferEvents] = unit.events

  def connect(bus: RegisterBus): Unit = {
    unit.write   := bus.write
    unit.table   := bus.tableWrite
    unit.ramOpen := bus.bool("pdi_operational")
    unit.good    := bus.frame.good
    unit.bad     := bus.frame.bad
    val noFrame = !bus.frame.busy && !ShiftRegister(bus.frame.busy, 8, false.B, true.B)
    unit.noFrame := noFrame
    unit.quiet   := hostIsQuiet && noFrame
    for (n <- 0 until p.syncManagers) {
      unit.enable(n)                    := bus.bool(s"sm${n}_enable")
      bus.guard(s"sm${n}_disabled")     := !bus.bool(s"sm${n}_enable")
      bus.status(s"sm${n}_deactivated") := unit.deactivated(n)
      if (p.hasEventTimes) {
        unit.latchEcat(n) := bus.bool(s"sm${n}_latch_ecat")
        unit.latchPdi(n)  := bus.bool(s"sm${n}_latch_pdi")
      }
      if (p.hasDeactivationDelay) {
        unit.delays(n)                     := bus.bool(s"sm${n}_deactivation_delay")
        bus.status(s"sm${n}_delay_active") := unit.delayActive(n)
      }
    }
    val status = bus.keptRead("sm0_status")
    unit.statusIndex                  := (status.address << log2Ceil(p.lanes)) >> 3
    unit.statusByPdi                  := status.host.reads
    status.data                       := unit.status << (8 * (SyncManagerRegisters.Status % p.lanes))
    status.host.ready                 := true.B
    bus.status("sm_ecat_event")       := unit.ecatEvent.asUInt
    bus.status("sm_al_event")         := unit.alEvent.asUInt
    bus.status("sm_activation_event") := VecInit((0 until p.syncManagers).map(activation(bus, _))).asUInt.orR
  }

  /** The host has not acknowledged yet that the activate register has changed: it does so by reading that
    * one, or by writing the first one for all (PDI-09).
    */
  private def activation(bus: RegisterBus, n: Int): Bool = {
    val acknowledged = if (p.acknowledgesByWrite) 0 else n
    def changes(field: String) = {
      val written = bus.written(field)
      written.valid && written.bits =/= bus.value(field)
    }
    bus
      .untilAcknowledged(s"sm${acknowledged}_activate")(
        changes(s"sm${n}_enable") || changes(s"sm${n}_repeat_request")
      )
      .suggestName(s"sm${n}_changed")
  }
}
