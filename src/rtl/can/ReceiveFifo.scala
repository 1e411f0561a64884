package flyframe.can

import chisel3._
import chisel3.util._
import flyframe.ram.{DualPortRam, DualPortRamIO}

/** The frames that were received, oldest first (CAN-44), four words each, in block RAM. A frame is written
  * behind the others while it comes in, and counts when it is accepted; there is a place for that beyond
  * those that count.
  *
  * @param frames
  *   that it holds
  * @param newRam
  *   makes the RAM; another one for proofs, which cannot see into a black box
  * @param hasBridge
  *   a bridge reads frames, too
  */
class ReceiveFifo(
    frames: Int,
    newRam: (Int, Int, Clock) => DualPortRamIO = DualPortRam(_, _)(_).io,
    hasBridge: Boolean = false
) extends Module {
  private val places    = frames + 1
  private val placeBits = ReceiveFifo.placeBits(frames)

  /** A word of the frame that comes in. */
  val store = IO(Input(Valid(UInt(2.W))))
  val word  = IO(Input(UInt(32.W)))

  /** It is complete with this second word: accept it, or drop it if all places are taken. */
  val accept = IO(Input(Bool()))
  val second = IO(Input(UInt(32.W)))
  val drops  = IO(Output(Bool()))

  /** Drops the oldest one, if there is one. */
  val releases = IO(Input(Bool()))

  /** Frames, 0 to `frames`. */
  val level = IO(Output(UInt(8.W)))

  /** Reads a word of the oldest one; `data` has it in the next cycle. */
  val read = IO(Input(UInt(2.W)))
  val data = IO(Output(UInt(32.W)))

  /** Where the next frame goes; reads this word instead. */
  val place: Option[UInt]          = Option.when(hasBridge)(IO(Output(UInt(placeBits.W))))
  val instead: Option[Valid[UInt]] = Option.when(hasBridge)(IO(Input(Valid(UInt((placeBits + 2).W)))))

  // Reset: empty.
  private val first  = RegInit(0.U(placeBits.W))
  private val next   = RegInit(0.U(placeBits.W))
  private val count  = RegInit(0.U(8.W))
  private val isFull = count === frames.U
  private val takes  = accept && !isFull
  private val leaves = releases && count =/= 0.U

  private def behind(place: UInt) = Mux(place === (places - 1).U, 0.U, place + 1.U)
  when(takes) { next := behind(next) }
  when(leaves) { first := behind(first) }
  count := count + takes - leaves
  level := count
  drops := accept && isFull

  private val ram = newRam(4 * places, 32, clock)
  // A bridge reads what finds no room, too.
  ram.write        := store.valid || (if (hasBridge) accept else takes)
  ram.writeAddress := next ## Mux(accept, 1.U(2.W), store.bits)
  ram.writeData    := Mux(accept, second, word)
  ram.readAddress  := instead.foldLeft(first ## read)((own, i) => Mux(i.valid, i.bits, own))
  place.foreach(_ := next)
  data := ram.readData
}

object ReceiveFifo {

  /** Bits of a place in a FIFO that holds so many frames. */
  def placeBits(frames: Int): Int = log2Ceil(frames + 1)
}
