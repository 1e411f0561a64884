package flyframe.frame

import chisel3._
import chisel3.util._
import flyframe.memory.EcatAccess
import flyframe.mii.NibbleStream

/** What moves the data of a datagram between wire and memory: [[DataAccess]], or with FMMUs and SyncManagers
  * between them [[TranslatedAccess]].
  *
  * @param lanes
  *   bytes per access
  */
abstract class DataAccessUnit(lanes: Int) extends Module {
  val step     = IO(Input(Bool()))
  val in       = IO(Input(new NibbleStream))
  val position = IO(Input(new FramePosition))
  val request  = IO(Input(new DatagramRequest))
  val enable   = IO(Input(Bool())) // the datagram is one of those to process
  val memory   = IO(new EcatAccess(lanes))

  /** The nibble read at this place, and which of its bits replace or are OR-ed into those received. */
  val readNibble = IO(Output(UInt(4.W)))
  val readMask   = IO(Output(UInt(4.W)))

  /** Some byte of the datagram so far was read, was written (FP-28). */
  val readSuccess  = IO(Output(Bool()))
  val writeSuccess = IO(Output(Bool()))

  /** A byte of DL status, of AL status was read (IRQ-02). */
  val readDlStatus = IO(Output(Bool()))
  val readAlStatus = IO(Output(Bool()))

  private val laneBits = log2Ceil(lanes)

  /** The byte of its word that `address` means. */
  protected def lane(address: UInt): UInt = if (lanes == 1) 0.U else address(laneBits - 1, 0)

  /** Field number `lane` of `bits`, fields of `width` bits. */
  protected def laneOf(bits: UInt, lane: UInt, width: Int): UInt =
    VecInit((0 until lanes).map(i => bits(width * i + width - 1, width * i)))(lane)
}
