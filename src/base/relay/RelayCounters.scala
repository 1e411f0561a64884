package flyframe.relay

import flyframe.registers.RingRegisters

/** Counters of relay mode: those of 8 bits stop at 255, those of 32 bits go round. */
class RelayCounters {
  import RelayCounter._
  private val values = Array.fill(Count)(0L)

  def count(which: Int): Unit =
    values(which) = if (which >= Passed) values(which) + 1 & 0xffffffffL else (values(which) + 1) min 255

  /** What was counted last, by a counter of 32 bits, has not happened. */
  def takeBack(which: Int): Unit = values(which) = values(which) - 1 & 0xffffffffL

  def apply(which: Int): Long = values(which)

  /** The counter of a register's name. */
  def named(name: String): Option[Long] = {
    val i = RingRegisters.RelayCounterNames.indexOf(name)
    if (i < 0) None else Some(values(i))
  }
}

/** The order of [[flyframe.registers.RingRegisters.RelayCounterNames]]. */
object RelayCounter {
  val BadHeader = 0  // and 1, for the two ports
  val BadFrame  = 2
  val Stray     = 4
  val Doubles   = 5
  val Repeated  = 6
  val Failed    = 7
  val Aborted   = 8
  val Wrapped   = 9
  val Passed    = 10 // 1 to 2, and 2 to 1
  val OwnSent   = 12
  val Confirmed = 13
  val Count     = 14
}
