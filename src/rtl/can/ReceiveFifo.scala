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
  */
class ReceiveFifo(frames: Int, newRam: (Int, Int, Clock) => DualPortRamIO = DualPortRam(_, _)(_).io)
    extends Module {
  private val places    = frames + 1
  private val placeBits = log2Ceil(places)

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
  ram.write        := store.valid || takes
  ram.writeAddress := next ## Mux(accept, 1.U(2.W), store.bits)
  ram.writeData    := Mux(accept, second, word)
  ram.readAddress  := first ## read
  data             := ram.readData
}
