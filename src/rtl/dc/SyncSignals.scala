package flyframe.dc

import chisel3._
import chisel3.util._
import flyframe.memory.RegisterBus

/** The cyclic unit with SYNC0 and SYNC1 (DC-26 to DC-36).
  *
  * @param pins
  *   high while a signal is active
  * @param on
  *   the unit is there; else it is not active
  */
private[dc] class SyncSignals(clocks: ClockEngine, pins: Vec[Bool], on: Bool) {
  import ClockProgram.{Is, Out}
  private val p   = clocks.p
  private val two = p.syncSignals > 1

  def connect(bus: RegisterBus): Unit = {
    // Who may write what (DC-40): SYNC1 belongs to the side of SYNC0, or to the other one.
    val owner0 = bus.bool("sync0_by_pdi")
    val owner1 = if (two) owner0 ^ bus.bool("sync1_by_other") else owner0
    bus.guard("sync0_of_ecat") := !owner0
    bus.guard("sync0_of_pdi")  := owner0
    if (two) {
      bus.guard("sync1_of_ecat") := !owner1
      bus.guard("sync1_of_pdi")  := owner1
    }
    bus.guard("sync_of_ecat") := !(owner0 && owner1)
    bus.guard("sync_of_pdi")  := owner0 || owner1

    /** A bit of the activation becomes 1: its owner writes it. */
    def becomes(field: String, owner: Bool): Bool = {
      val written = bus.written(field)
      written.valid && bus.writtenByHost === owner && written.bits(0)
    }

    /** A bit of the activation, which is written by its owner, or becomes 1 by itself. */
    def bit(field: String, owner: Bool, sets: Bool = false.B): (Bool, Bool) = {
      val value   = RegInit(false.B).suggestName(field) // reset: not active
      val begins  = sets || becomes(field, owner)
      val written = bus.written(field).valid && bus.writtenByHost === owner
      when(written || sets) { value := begins }
      when(!on) { value := false.B }
      bus.status(field) := value
      (value, begins && !value)
    }

    /** The same of the extended activation, where that is built (DC-36). */
    def extended(field: String): Bool = if (p.hasEnhancedSync) bit(field, owner0)._1 else false.B
    val isExtended                    = extended("start_time_extended")
    val isChecked                     = extended("start_time_checked")
    val isNear                        = extended("near_future")
    val startBytes                    = bus.writtenBytes("start_time").map(_.valid)
    val automatic =
      extended("auto_activation") && Mux(isExtended, startBytes(3), startBytes.last)
    val (active, activated) = bit("cyclic_active", owner0, sets = automatic)
    val enables = bit("sync0_enable", owner0)._1 +:
      Option.when(two)(bit("sync1_enable", owner1)._1).toSeq
    val byHand = if (p.hasEnhancedSync) RegNext(becomes("debug_pulse", owner0), false.B) else false.B

    val signals = enables.indices.map(n => Module(new SyncSignal(p.clockPeriodNs)).suggestName(s"sync$n"))

    // The start time is taken when the unit becomes active; before that the register shows it.
    val ends   = RegNext(active, false.B) && !active
    val starts = takesStart(bus, active, activated || ends || (bus.writes("start_time") && !active))
    clocks.is(Is.Extended, isExtended)
    clocks.is(Is.Checked, isChecked && active)
    clocks.is(Is.Near, isNear)

    val runs    = RegInit(false.B)              // a pulse of SYNC0 is to come; reset: none
    val started = RegInit(false.B)              // there has been one; reset: none
    val follows = RegInit(false.B)              // SYNC1 follows a pulse of SYNC0; reset: none
    val fired   = Seq.fill(2)(RegInit(false.B)) // the engine does not know yet; reset: none
    // It may have been of a pulse before the unit became active again.
    when(clocks.command(Out.Stop) && !starts) { runs := false.B }
    when(clocks.command(Out.Follow)) { follows := true.B }
    for ((signal, n) <- signals.zipWithIndex) when(signal.fires) {
      fired(n)            := true.B
      if (n == 0) started := true.B else follows := false.B
    }
    when(activated) {
      runs    := true.B
      started := false.B
    }
    when(!active) {
      follows := false.B
      fired.foreach(_ := false.B)
      when(!activated) { runs := false.B }
    }
    for (n <- 0 to 1) when(clocks.ask(Task(s"fired$n"), fired(n))) { fired(n) := false.B }

    val waits = Seq(
      runs && !signals.head.armed && !fired.head && !starts,
      if (two) follows && !signals.last.armed && !fired.last && !starts else false.B
    )
    clocks.is(Is.Waiting0, waits.head)
    clocks.is(Is.Waiting1, waits.last)
    clocks.is(Is.Started, started)
    clocks.is(Is.Following, if (two) follows else true.B)

    // Pulses are armed when they come within 65 us; it is looked at them every 256 cycles.
    val looks = RegInit(false.B) // reset: not yet
    when(clocks.ask(Task("check"), looks)) { looks := false.B }
    when(Counter(true.B, 256)._2) { looks := waits.reduce(_ || _) }

    val length = bus.value("sync_pulse_length")
    if (p.hasEnhancedSync) {
      bus.status("debug_pulse") := false.B
      for ((signal, n) <- signals.zipWithIndex) {
        val waits = RegInit(false.B).suggestName(s"sync${n}_waits") // reset: not active
        when(signal.fires || !active) { waits := false.B }
        when(activated) { waits := true.B }
        bus.status(s"sync${n}_pending") := waits
      }
    }

    for ((signal, n) <- signals.zipWithIndex) {
      val status = s"sync${n}_status"
      signal.active      := active
      signal.byHand      := byHand
      signal.enabled     := enables(n)
      signal.arm         := clocks.command(if (n == 0) Out.Arm0 else Out.Arm1) && waits(n)
      signal.value       := clocks.result
      signal.passes      := clocks.passes
      signal.length      := length
      signal.acknowledge := bus.acknowledges(status)
      bus.status(status) := signal.level
      pins(n)            := RegNext(signal.level, false.B)
      if (p.hasApplicationLayer) bus.status(s"sync${n}_event") := signal.level && isMapped(bus, 4 * n + 3)
    }
  }

  /** The start time is taken, and first completed and checked where that is built (DC-36), when `changed`.
    * True until that begins.
    */
  private def takesStart(bus: RegisterBus, active: Bool, changed: Bool): Bool = {
    val takes = RegInit(false.B) // reset: nothing is written
    when(clocks.ask(Task("start"), takes && !bus.writesPending)) { takes := false.B }
    if (!p.hasEnhancedSync) {
      when(changed) { takes := true.B }
      takes
    } else {
      val prepares    = RegInit(false.B) // reset: nothing is written
      val implausible = RegInit(false.B) // reset: not active yet
      when(clocks.ask(Task("prepare"), prepares && !bus.writesPending)) {
        prepares := false.B
        takes    := true.B
        when(active) { implausible := false.B }
      }
      when(changed) { prepares := true.B }
      when(clocks.command(Out.Implausible) && active) { implausible := true.B }
      bus.status("start_implausible") := implausible
      takes || prepares
    }
  }

  /** Bit `bit` of 0x0151, from the EEPROM: the signal is an event of the host (DC-35); without it is one. */
  private def isMapped(bus: RegisterBus, bit: Int): Bool = if (!p.hasSii) true.B
  else {
    val written = bus.writtenBytes("pdi_configuration").last
    val mapped  = RegInit(false.B) // reset: as the register
    when(written.valid) { mapped := written.bits(bit) }
    mapped
  }
}
