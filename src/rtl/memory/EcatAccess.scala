package flyframe.memory

import chisel3._

/** The frame processor's access to registers and memory, a word of `lanes` bytes at a time. All addresses are
  * byte addresses, of which the bits within a word are ignored. An address with bit 16 set lies past the end
  * of the address space: nothing is there.
  *
  * A read answers in the cycle after `read`, or one later (`EscMemory.readCycles`). Writes to memory act at
  * once, writes to registers go to the write log and act after `commit` (FP-32 to FP-34).
  *
  * @param lanes
  *   bytes per word: 1, 2 or 4
  */
class EcatAccess(lanes: Int) extends Bundle {

  /** A new frame starts: what the last one has logged is forgotten. */
  val frameStart = Output(Bool())

  val read        = Output(Bool())
  val readAddress = Output(UInt(17.W))
  val readData    = Input(UInt((8 * lanes).W))

  /** Bytes of the word that was read which the master may read; the others do not count. */
  val readable = Input(UInt(lanes.W))

  /** Bytes of the word that was read which may be written. */
  val writable = Input(UInt(lanes.W))

  /** The frame may not write more register bytes (B-17). */
  val logFull = Input(Bool())

  /** A register byte was taken from the frame; it counts against the limit. */
  val logByte = Output(Bool())

  val write        = Output(Bool())
  val writeAddress = Output(UInt(16.W))
  val writeMask    = Output(UInt(lanes.W))
  val writeData    = Output(UInt((8 * lanes).W))

  /** Bits of each byte that are written, at places that can be written bit by bit (FMMU-10). Everywhere else
    * all bits are written.
    */
  val writeBits = Output(UInt(8.W))

  /** The frame ended without error: let its register writes take effect. */
  val commit = Output(Bool())
}

/** What a frame asks of the receive times (DC-07). */
class StampRequest extends Bundle {

  /** A byte of the frame is being written to 0x0900. */
  val written = Bool()

  /** With `written`: the command is one that has the times at the ports kept, too. */
  val ofPorts = Bool()
}
