package flyframe.lanes

import chisel3._
import chisel3.util.log2Ceil

/** The parts of a word: bytes as they lie in the lanes of a bus, or nibbles. Part 0 is the lowest one. */
object Lanes {

  /** Byte `number` of a word, 8 bits. */
  def byte(word: UInt, number: Int): UInt = part(word, number, 8)

  /** The first `count` bytes of a word, to choose from by a signal. */
  def bytes(word: UInt, count: Int): Vec[UInt] = parts(word, count, 8)

  /** The first `count` nibbles of a word, to choose from by a signal. */
  def nibbles(word: UInt, count: Int): Vec[UInt] = parts(word, count, 4)

  /** The first `count` bits of a word, to choose from by a signal: one for each lane. */
  def bits(word: UInt, count: Int): Vec[UInt] = parts(word, count, 1)

  private def parts(word: UInt, count: Int, width: Int): Vec[UInt] =
    VecInit((0 until count).map(part(word, _, width)))

  /** The lane of the byte at `address`, on a bus with `lanes` bytes, a power of two. */
  def of(address: UInt, lanes: Int): UInt = if (lanes == 1) 0.U else address(log2Ceil(lanes) - 1, 0)

  private def part(word: UInt, number: Int, width: Int): UInt =
    word(width * number + width - 1, width * number)
}
