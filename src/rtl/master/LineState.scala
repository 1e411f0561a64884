package flyframe.master

import chisel3._

/** What a line is like (LM-05, LM-11), for signals, host and reports. */
class LineState extends Bundle {

  /** There was smoke since the last reset; an alarm is not silenced yet; there is smoke now. */
  val fire     = Bool()
  val sounding = Bool()
  val alarm    = Bool()

  /** No slave answers. */
  val dead = Bool()

  /** Of a master with two line ports: frames do not come round the ring; they do. */
  val ringOpen   = Bool()
  val ringClosed = Bool()

  /** Slaves are missing, others than expected are there, or more than the table has places for. */
  val wrong = Bool()

  /** A slave has a fault; one is disabled; one is being tested. */
  val slaveFault = Bool()
  val disabled   = Bool()
  val testing    = Bool()

  /** Slaves that answer, slaves in the table, and the first slave behind the cut of a ring. */
  val present = UInt(8.W)
  val known   = UInt(8.W)
  val cut     = UInt(8.W)
}
