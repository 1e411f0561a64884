package flyframe.memory

import chisel3._
import chisel3.util._
import flyframe.lanes.Lanes
import flyframe.ram.DualPortRam

/** One logged register write: a word address, the bytes of it that are written, and the word.
  *
  * @param bitWrites
  *   some registers are written bit by bit
  */
class RegisterWrite(lanes: Int, bitWrites: Boolean) extends Bundle {
  val address = UInt((12 - log2Ceil(lanes)).W) // word address
  val mask    = UInt(lanes.W)
  val data    = UInt((8 * lanes).W)
  val bits    = UInt((if (bitWrites) 8 * lanes else 0).W)

  /** Address of the first byte. */
  def byteAddress: UInt = Cat(address, 0.U(log2Ceil(lanes).W))

  /** The byte that is written to the register byte at `place`, valid if `valid` is and the write reaches it.
    */
  def byteAt(valid: Bool, place: Int): Valid[UInt] = {
    val lane   = place % lanes
    val result = Wire(Valid(UInt(8.W)))
    result.valid := valid && address === (place / lanes).U && mask(lane)
    result.bits  := Lanes.byte(data, lane)
    result
  }

  /** Mask and data within an aligned group of `bytes`, a power of two of at least `lanes`. */
  def maskIn(bytes: Int): UInt = {
    val group = log2Ceil(bytes / lanes)
    if (group == 0) mask else (mask << (address(group - 1, 0) * lanes.U))(bytes - 1, 0)
  }
  def dataIn(bytes: Int): UInt = Fill(bytes / lanes, data)
}

/** A register byte written by a unit of the controller. */
class UnitWrite extends Bundle {
  val address = UInt(12.W)
  val data    = UInt(8.W)
}

/** Holds the register writes of a frame back until the frame has ended well (FP-32, FP-33), in block RAM.
  *
  * `commit` plays them back in order, one per cycle. The next frame may start meanwhile:
  * [[flyframe.params.EscParams.longestWriteLog]] allows no log that lasts until it asks for registers.
  *
  * @param lanes
  *   bytes per word
  * @param depth
  *   most register bytes of one frame
  * @param bitWrites
  *   see [[RegisterWrite]]
  */
class WriteLog(lanes: Int, depth: Int, bitWrites: Boolean = false) extends Module {
  val frameStart = IO(Input(Bool()))
  val write      = IO(Input(Valid(new RegisterWrite(lanes, bitWrites))))
  val commit     = IO(Input(Bool()))

  /** Nothing is played in the next cycle. */
  val hold = IO(Input(Bool()))

  /** A register byte was accepted. */
  val byteAccepted = IO(Input(Bool()))

  /** No further register byte may be accepted (B-17). */
  val full = IO(Output(Bool()))

  /** The writes, when they take effect. */
  val replay = IO(Output(Valid(new RegisterWrite(lanes, bitWrites))))

  /** Entries are still to be played. */
  val busy = IO(Output(Bool()))

  /** A commit begins: the registers still hold what they held during the frame. */
  val replayStarts = IO(Output(Bool()))

  private val countBits = log2Ceil(depth + 1)
  private val ram       = DualPortRam(depth, write.bits.getWidth)(clock)
  private val entries   = RegInit(0.U(countBits.W)) // reset: nothing logged
  private val bytes     = if (lanes == 1) entries else RegInit(0.U(countBits.W))

  private def inLog(count: UInt) = count(log2Ceil(depth) - 1, 0)
  ram.io.write        := write.valid
  ram.io.writeAddress := inLog(entries)
  ram.io.writeData    := write.bits.asUInt
  when(write.valid) { entries := entries + 1.U }
  if (lanes > 1) when(byteAccepted) { bytes := bytes + 1.U }
  when(frameStart) {
    entries := 0.U
    bytes   := 0.U
  }
  full := bytes === depth.U

  // Playback. A frame commits behind its last nibble, at least 20 slots before the next `frameStart`.
  private val next    = RegInit(0.U(countBits.W)) // entry to be read; reset: nothing to play
  private val end     = RegInit(0.U(countBits.W))
  private val reading = next =/= end && !hold
  when(commit) {
    next := 0.U
    end  := entries
  }.elsewhen(reading) {
    next := next + 1.U
  }
  ram.io.readAddress := inLog(next)
  replay.valid       := RegNext(reading && !commit, false.B)
  replay.bits        := ram.io.readData.asTypeOf(new RegisterWrite(lanes, bitWrites))
  replayStarts       := commit
  busy               := next =/= end
}
