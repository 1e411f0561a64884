package flyframe.host

import chisel3._
import chisel3.util._
import flyframe.clocks.LevelCrossing
import flyframe.memory.{HostPort, RegisterBus, RegisterUnit}
import flyframe.params.EscParams
import flyframe.protocol.AlState
import flyframe.registers.DigitalOutputRegisters

/** Digital outputs and inputs, and what goes with them where there is no host. */
class DigitalPins(p: EscParams) extends Bundle {
  private def inputs = p.isDigitalIo && p.digitalInputs > 0
  private def events = p.isDigitalIo && p.digitalOutputs > 0

  val output        = Option.when(p.digitalOutputs > 0)(Output(UInt((8 * p.digitalOutputs).W)))
  val output_driven = Option.when(p.digitalOutputs > 0)(Output(Bool()))
  val output_valid  = Option.when(events)(Output(Bool()))
  val output_enable = Option.when(events)(Input(Bool()))
  val input         = Option.when(inputs)(Input(UInt((8 * p.digitalInputs).W)))
  val latch         = Option.when(inputs && p.digitalInputEvent == 1)(Input(Bool()))
  val frame_begins  = Option.when(p.isDigitalIo)(Output(Bool()))
}

/** Digital outputs behind their register (SM-26, PDI-11, B-68); without a host also their events, and digital
  * inputs (B-118).
  *
  * @param host
  *   where there is no host: the port that one would have
  * @param syncs
  *   SYNC signals of distributed clocks
  * @param triggers
  *   something triggers the process data watchdog
  */
class DigitalIo(
    p: EscParams,
    val pins: DigitalPins,
    host: Option[HostPort],
    val syncs: Seq[Bool],
    triggers: => Bool
) extends RegisterUnit(if (p.digitalOutputs > 0) DigitalOutputRegisters(p) else Nil) {

  def connect(bus: RegisterBus): Unit = host match {
    case Some(port) => alone(bus, port)
    case None =>
      pins.output.get := bus.value("digital_output")
      pins.output_driven.get :=
        bus.bool("pdi_operational") && bus.bool("watchdog_process_data", default = true)
  }

  /** A pulse for a pin: as long as two nibbles, from the next cycle on. */
  private def pulse(happens: Bool): Bool = {
    val left = RegInit(0.U(log2Ceil(2 * p.cyclesPerNibble).W)) // reset: none
    when(happens) { left := (2 * p.cyclesPerNibble - 1).U }.elsewhen(left =/= 0.U) { left := left - 1.U }
    RegNext(happens || left =/= 0.U, false.B)
  }
  private def rises(level: Bool): Bool = level && !RegNext(level, true.B) // reset: a high level is no edge

  private def alone(bus: RegisterBus, port: HostPort): Unit = {
    pins.frame_begins.get := pulse(bus.frame.begins)
    pins.output.foreach(outputs(bus, _))
    pins.input match {
      case None =>
        Seq(port.req, port.write, port.addr, port.wdata, port.be).foreach(s => s := 0.U.asTypeOf(s))
      case Some(levels) =>
        val inputs = Module(new DigitalInputs(p.digitalInputs, p.lanes)).suggestName("digitalInputs")
        inputs.port <> port
        inputs.levels := levels
        inputs.take := (p.digitalInputEvent match {
          case 0 => bus.frame.begins
          case 1 => rises(LevelCrossing(pins.latch.get))
          case n => rises(syncs(n - 2))
        })
    }
  }

  private def outputs(bus: RegisterBus, levels: UInt): Unit = {
    // A frame has ended well and its register writes have taken effect; AL status follows two cycles later.
    val commits = RegInit(false.B) // reset: no frame
    val written = commits && !bus.writesPending
    when(written) { commits := false.B }
    when(bus.commits) { commits := true.B }
    val ended = RegNext(RegNext(written, false.B), false.B)

    val triggered = RegInit(false.B) // since the last frame has ended; reset: not
    when(ended) { triggered := false.B }
    when(triggers) { triggered := true.B }

    // All outputs change at once, so that a SYNC signal within the register writes of a frame waits for them.
    def together(sync: Bool): Bool = {
      val waits = RegInit(false.B) // reset: there was none
      val due   = rises(sync) || waits
      waits := due && bus.writesPending
      due && !bus.writesPending
    }

    val unit =
      Module(new DigitalOutputs(p.digitalOutputs, p.digitalWatchdogLate == 1)).suggestName("digitalOutputs")
    unit.written := bus.value("digital_output")
    unit.running := bus.bool("watchdog_process_data")
    unit.allowed := bus.bool("pdi_operational") && LevelCrossing(pins.output_enable.get) &&
      bus.value("al_status")(3, 0) === AlState.Operational.U
    unit.update := (p.digitalOutputEvent match {
      case 0 => ended
      case 1 => ended && triggered
      case n => together(syncs(n - 2))
    })
    levels                 := unit.levels
    pins.output_driven.get := unit.driven
    pins.output_valid.get  := pulse(unit.valid)
  }
}
