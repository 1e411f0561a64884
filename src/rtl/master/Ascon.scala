package flyframe.master

import chisel3._
import chisel3.util._
import flyframe.ram.DualPortRam

/** The state of Ascon, five words of 64 bits, and its round (NIST SP 800-232), in pieces of 16 bits.
  *
  * It is kept as it is behind the substitution layer: a pass through the four pieces completes a round with
  * the linear layer and does the first half of the next one. What is added to the state between two rounds,
  * such as a block of the message, is added on the way, and takes no time of its own.
  *
  * The pieces are in block RAM, twice: the old state and the new one. A rotation needs bits of two
  * neighbouring pieces, so pieces are read in the order 1, 0, 3, 2, 1, 0: the first two only to have the
  * neighbours of 3. The last pieces read are kept here as far as needed. Rotations by more than two pieces
  * read from a copy of two words that is two pieces ahead.
  */
class Ascon extends Module {
  import Ascon._

  /** The piece to be read, and which of the two states is the old one. */
  val piece = IO(Input(UInt(2.W)))
  val side  = IO(Input(Bool()))

  /** The piece read is completed a cycle later, and becomes one of the new state. */
  val write = IO(Input(Bool()))

  /** In that cycle: what is added to it, word by word; or it becomes 0. */
  val add   = IO(Input(Vec(Words, UInt(PieceBits.W))))
  val clear = IO(Input(Bool()))

  /** In that cycle: the piece with what is added, before the substitution layer. */
  val sum = IO(Output(Vec(Words, UInt(PieceBits.W))))

  private val next   = Wire(Vec(Words, UInt(PieceBits.W)))
  private val writes = RegNext(write, false.B)
  private val target = RegNext(Cat(!side, piece))
  private def memory(width: Int, address: UInt, data: UInt): UInt = {
    val ram = DualPortRam(8, width)(clock)
    ram.io.write        := writes
    ram.io.writeAddress := target
    ram.io.writeData    := data
    ram.io.readAddress  := address
    ram.io.readData
  }
  // Two memories of 36 bits, the widest there are: of word 1, bits 14 to 7 only.
  private val here = Cat(
    memory(36, Cat(side, piece), Cat(next(0), next(2), next(3)(15, 12))),
    memory(36, Cat(side, piece), Cat(next(3)(11, 0), next(4), next(1)(14, 7)))
  )
  private val ahead = memory(32, Cat(side, piece ^ 2.U), Cat(next(1), next(4)))

  // The piece of each word at hand, and those 1, 2, 3 further on, as far as they are used.
  private val x0    = here(71, 56)
  private val x0by1 = RegNext(x0)
  private val x0by2 = RegNext(x0by1(11, 0))
  private val x1by2 = ahead(31, 16)
  private val x1by3 = RegNext(Cat(x1by2(15, 13), x1by2(6, 0))) // its ends
  private val x1low = RegNext(x1by3(6, 0))
  private val x1top = RegNext(x1by3(9))
  private val x1    = Cat(x1top, here(7, 0), x1low)
  private val x2    = here(55, 40)
  private val x2by1 = RegNext(x2(5, 0))
  private val x3    = here(39, 24)
  private val x3by1 = RegNext(x3)
  private val x3by2 = RegNext(x3by1(0))
  private val x4    = here(23, 8)
  private val x4by1 = RegNext(x4(6, 0))
  private val x4by2 = ahead(15, 0)
  private val x4by3 = RegNext(x4by2(8, 0))

  // The linear layer: each word, and it rotated to the right by two numbers.
  private val linear = Seq(
    x0 ^ Cat(x0by2(2, 0), x0by1(15, 3)) ^ Cat(x0by2(11, 0), x0by1(15, 12)), // 19, 28
    x1 ^ Cat(x1(12, 0), x1by3(9, 7)) ^ Cat(x1by3(6, 0), x1by2(15, 7)),      // 61, 39
    x2 ^ Cat(x2by1(0), x2(15, 1)) ^ Cat(x2by1(5, 0), x2(15, 6)),            // 1, 6
    x3 ^ Cat(x3by1(9, 0), x3(15, 10)) ^ Cat(x3by2, x3by1(15, 1)),           // 10, 17
    x4 ^ Cat(x4by1(6, 0), x4(15, 7)) ^ Cat(x4by3(8, 0), x4by2(15, 9))       // 7, 41
  )
  sum := VecInit(linear.zip(add).map { case (word, added) => word ^ added })

  // The substitution layer.
  private val Seq(s0, s1, s2, s3, s4) = {
    val Seq(a0, a1, a2, a3, a4) = Seq(sum(0) ^ sum(4), sum(1), sum(2) ^ sum(1), sum(3), sum(4) ^ sum(3))
    val Seq(b0, b1, b2, b3, b4) =
      Seq(a0 ^ (~a1 & a2), a1 ^ (~a2 & a3), a2 ^ (~a3 & a4), a3 ^ (~a4 & a0), a4 ^ (~a0 & a1))
    Seq(b0 ^ b4, b1 ^ b0, ~b2, b3 ^ b2, b4)
  }
  next := VecInit(Seq(s0, s1, s2, s3, s4).map(_ & Fill(PieceBits, !clear)))
}

object Ascon {

  /** Words of the state, and bits of a piece. */
  val Words     = 5
  val PieceBits = 16
}
