package flyframe.fibre

import chisel3._

/** What follows on a number of few bits, without a carry chain: for counters that also are cleared or loaded
  * this takes half the logic.
  */
object ShortCounter {

  /** One more; behind all ones comes 0. */
  def up(count: UInt): UInt = flipped(count, count)

  /** One less; behind 0 come all ones. */
  def down(count: UInt): UInt = flipped(count, ~count)

  /** Each bit changes when the ones below it are all set in `when`. */
  private def flipped(count: UInt, when: UInt): UInt =
    VecInit.tabulate(count.getWidth)(i => if (i == 0) !count(0) else count(i) ^ when(i - 1, 0).andR).asUInt
}
