package flyframe.frame

import chisel3._
import flyframe.memory.EcatAccess
import flyframe.mii.NibbleStream

/** The unit that moves the data of a datagram between wire and memory. There are two of them: [[DataAccess]]
  * in a controller without FMMUs and SyncManagers, [[TranslatedAccess]] in one that has them.
  *
  * @param lanes
  *   bytes per access
  */
abstract class DataAccessUnit(lanes: Int) extends Module {

  /** Once per nibble slot: `in` is over and the next nibble begins. */
  val step     = IO(Input(Bool()))
  val in       = IO(Input(new NibbleStream))
  val position = IO(Input(new FramePosition))
  val request  = IO(Input(new DatagramRequest))

  /** The datagram is to be executed; those behind the first `maxSubTelegrams` of a frame are not. */
  val enable = IO(Input(Bool()))
  val memory = IO(new EcatAccess(lanes))

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

  /** The master has just read a byte of DL status, of AL status: that takes back an event request (IRQ-02).
    */
  val readDlStatus = IO(Output(Bool()))
  val readAlStatus = IO(Output(Bool()))

  /** `address` is that of a byte of the register of two bytes at `register`. */
  protected def isWord(address: UInt, register: Int): Bool = {
    require(register % 2 == 0, f"the register is at 0x$register%04x but must be at an even address.")
    address(16, 1) === (register >> 1).U
  }
}
