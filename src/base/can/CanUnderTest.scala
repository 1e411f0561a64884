package flyframe.can

import scala.collection.immutable.ArraySeq

/** A CAN controller with one port, fresh out of reset, as a tester meets it: the golden model or the RTL.
  *
  * Time runs in core cycles (CB-01). A level is true for recessive. In each cycle the controller drives
  * [[driven]], which follows from the cycles before only, so that a tester may compute the level of the bus
  * from it and hand that to [[step]], which ends the cycle.
  */
trait CanUnderTest {

  /** Core cycles since reset. */
  def cycle: Long

  /** The level at its pin in the present cycle. */
  def driven: Boolean

  /** Ends the present cycle, in which the level heard was `heard`. */
  def step(heard: Boolean): Unit

  /** The host writes bytes, ascending from `address` of the register map (port F, see
    * [[flyframe.registers.CanRegisters]]).
    *
    * This may pass up to [[CanUnderTest.AccessCycles]] core cycles for each four bytes, in which the others
    * on the bus are recessive. When it returns the write has its effect.
    */
  def write(address: Int, bytes: Seq[Int]): Unit

  /** The host reads `count` bytes; time passes as for [[write]]. */
  def read(address: Int, count: Int): Seq[Int]

  /** Runs `cycles` core cycles in which the others drive `others`. The bus is what all together drive; if it
    * is `forced`, the controller hears `others` whatever it drives itself.
    *
    * @return
    *   the level that the controller drove in each of them
    */
  def run(others: Boolean, cycles: Int, forced: Boolean = false): IndexedSeq[Boolean] = {
    val levels = new Array[Boolean](cycles)
    for (i <- levels.indices) {
      levels(i) = driven
      step(others && (forced || levels(i)))
    }
    ArraySeq.unsafeWrapArray(levels)
  }
}

object CanUnderTest {

  /** What an access of four bytes may last, in core cycles. */
  val AccessCycles = 64

  /** The us counter, 32 bits, at the host port. */
  val TimeAddress = 0x001c
}
