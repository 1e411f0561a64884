package flyframe.relay

import flyframe.params.CanParams

/** When the node does what follows from a bit, in core cycles behind its end (RB-21). All is done before the
  * next end: at 50 MHz that leaves 25 cycles.
  *
  * @param isLong
  *   bits leave time for a register behind the memory of [[TransitLists]], which a clock of 100 MHz needs
  */
final case class Schedule(isLong: Boolean) {

  /** Cycles from the address of an entry of [[TransitLists]] to where it counts. */
  private[relay] val entryCycles: Int = if (isLong) 2 else 1

  /** Cycles from the record of an own frame to what becomes of it. */
  private[relay] val recordCycles: Int = if (isLong) 1 else 0

  /** How long a walk through a list takes, its first cycle counted: at its end another one may begin. */
  private[relay] val walkCycles: Int = TransitLists.Most + entryCycles

  private[relay] val changes: Seq[Int] = Seq(1, 2)

  /** The lists are asked what a report needs, which is done when they have told it; meanwhile a walk begins.
    */
  private[relay] val reports: Seq[Int] = Seq(3, 3 + walkCycles)
  private[relay] val tells: Seq[Int]   = reports.map(_ + entryCycles)

  /** The first entries are looked at. */
  private[relay] val looks: Seq[Int] = Seq(0, 1).map(reports(1) + walkCycles + _)

  /** It is decided what leaves; that begins a cycle later. */
  private[relay] val decisions: Seq[Int] = looks.map(_ + entryCycles)

  /** All is done. */
  private[relay] val rest: Int = decisions(1) + 2
}

object Schedule {

  /** That of a node. */
  def apply(p: CanParams): Schedule = Schedule(
    LinkTiming.least(p.coreClockMhz) >= Schedule(isLong = true).rest
  )
}
