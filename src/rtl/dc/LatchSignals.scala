package flyframe.dc

import chisel3._
import chisel3.util._
import flyframe.clocks.LevelCrossing
import flyframe.memory.RegisterBus

/** LATCH0 and LATCH1: the system time of their edges (DC-37 to DC-41).
  *
  * @param on
  *   the unit is there; else it has no events
  */
private[dc] class LatchSignals(clocks: ClockEngine, pins: Vec[Bool], on: Bool) {
  import ClockProgram.{Out, Shown}
  private val p = clocks.p

  def connect(bus: RegisterBus): Unit = {
    val singles =
      for (n <- pins.indices; edge <- Seq("positive", "negative"))
        yield bus.bool(s"latch${n}_${edge}_single")
    val latest   = Reg(UInt(2.W)) // the edge whose time is being taken
    val isCaught = clocks.command(Out.Caught)
    val may      = Counter(true.B, 256)._2

    val events = for ((pin, n) <- pins.zipWithIndex) yield {
      val owner = bus.bool(s"latch${n}_by_pdi")
      bus.guard(s"latch${n}_of_ecat") := !owner
      bus.guard(s"latch${n}_of_pdi")  := owner
      val level  = LevelCrossing(pin)
      val before = RegNext(level)
      val seen = for ((edge, e) <- Seq("positive", "negative").zipWithIndex) yield {
        val number = 2 * n + e
        val unit   = Module(new LatchEdge(p.acknowledgesByWrite)).suggestName(s"latch${n}_$edge")
        val caught = isCaught && latest === number.U
        val taken  = clocks.ask(Task("latch", Shown.Latch + number), unit.asks, unit.age)
        val time   = s"latch${n}_${edge}_time"
        when(taken) { latest := number.U }
        unit.on           := on
        unit.edge         := (if (e == 0) level && !before else !level && before)
        unit.may          := may
        unit.single       := singles(number)
        unit.byHost       := owner
        unit.taken        := taken
        unit.caught       := caught
        unit.copied       := clocks.copied(Shown.Latch + number)
        unit.acknowledges := (if (p.acknowledgesByWrite) bus.hostBegins(time) else bus.hostReads(time))
        unit.begins       := bus.frame.begins
        unit.reads        := bus.frame.reads.pulse(time)
        unit.good         := bus.frame.good
        unit.bad          := bus.frame.bad
        bus.status(s"latch${n}_$edge") := unit.event
        unit.event
      }
      bus.status(s"latch${n}_pin") := level
      (seen.reduce(_ || _), owner)
    }
    if (p.hasApplicationLayer) {
      bus.status("latch_event")      := events.map { case (event, owner) => event && owner }.reduce(_ || _)
      bus.status("ecat_latch_event") := events.map { case (event, owner) => event && !owner }.reduce(_ || _)
    }
  }
}
