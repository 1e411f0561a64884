package flyframe.memory

import chisel3._

/** The frame processor's access to registers and memory, a word of `lanes` bytes at a time; all addresses are
  * byte addresses, the bits within the word ignored. Bit 16 of an address set = past the end of the address
  * space.
  *
  * A read answers in the cycle after `read`, or one later (`EscMemory.readCycles`). Writes to memory act at
  * once, writes to registers go to the write log and act after `commit` (FP-32 to FP-34).
  *
  * @param lanes
  *   bytes per word: 1, 2 or 4
  */
class EcatAccess(lanes: Int) extends Bundle {

  /** A new frame starts: forget what the last one logged. */
  val frameStart = Output(Bool())

  val read        = Output(Bool())
  val readAddress = Output(UInt(17.W))
  val readData    = Input(UInt((8 * lanes).W))
  val readable    = Input(UInt(lanes.W))

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

  /** Bits of each byte that are written, where that is possible (FMMU-10); else all. */
  val writeBits = Output(UInt(8.W))

  /** The frame ended without error: let its register writes take effect. */
  val commit = Output(Bool())
}
