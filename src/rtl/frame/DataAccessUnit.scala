package flyframe.frame

import chisel3._
import chisel3.util._
import flyframe.memory.{EcatAccess, ProtectedWrite}
import flyframe.mii.NibbleStream
import flyframe.registers.{FieldRecord, Register}

/** The unit that moves the data of a datagram between wire and memory. There are two of them: [[DataAccess]]
  * in a controller without FMMUs and SyncManagers, [[TranslatedAccess]] in one that has them.
  *
  * @param lanes
  *   bytes per access
  * @param logical
  *   logical commands are executed
  * @param acknowledged
  *   registers whose reading by the bus is told of
  * @param isProtected
  *   what is written may be refused (SYS-02, SYS-03)
  */
abstract class DataAccessUnit(
    lanes: Int,
    logical: Boolean,
    acknowledged: Seq[Register],
    isProtected: Boolean
) extends Module {

  /** Once per nibble slot: `in` is over and the next nibble begins. */
  val step     = IO(Input(Bool()))
  val in       = IO(Input(new NibbleStream))
  val position = IO(Input(new FramePosition))
  val request  = IO(Input(new DatagramRequest(logical)))

  /** The datagram is to be executed; those behind the first `maxSubTelegrams` of a frame are not. */
  val enable = IO(Input(Bool()))
  val memory = IO(new EcatAccess(lanes))

  val protection = Option.when(isProtected)(IO(new ProtectedWrite))

  /** The address in `request` goes on to the next byte. */
  val advance = IO(Output(Bool()))

  /** The nibble that was read for this place of the frame. Bits with a 1 in `readMask` replace those
    * received, or are OR-ed into them if the command is a broadcast; the others pass unchanged.
    */
  val readNibble = IO(Output(UInt(4.W)))
  val readMask   = IO(Output(UInt(4.W)))

  /** At least one byte of the datagram has been read, has been written so far (FP-28): the working counter
    * rises for that.
    */
  val readSuccess  = IO(Output(Bool()))
  val writeSuccess = IO(Output(Bool()))

  /** By register: the master has just read a byte of it. That takes back an event request (IRQ-02). */
  val reads = IO(Output(FieldRecord.pulses(acknowledged.map(_.name))))

  /** `writes`, unless the byte in `protection` must not be written. */
  protected def permitted(writes: Bool): Bool = protection.fold(writes)(writes && !_.refused)

  /** A byte is read, where `isAt` tells whether it is one of a register. */
  protected def tellReads(read: Bool, isAt: (UInt => Bool) => Bool): Unit =
    for (r <- acknowledged) reads.pulse(r.name) := read && isAt(isIn(_, r))

  /** `address`, of 17 bits, is that of a byte of the register. */
  private def isIn(address: UInt, r: Register): Bool =
    if (isPow2(r.bytes) && r.address % r.bytes == 0)
      address(16, log2Ceil(r.bytes)) === (r.address / r.bytes).U
    else r.range.map(address === _.U).reduce(_ || _)
}
