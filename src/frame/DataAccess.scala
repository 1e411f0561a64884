package flyframe.frame

import chisel3._
import chisel3.util._
import flyframe.memory.EcatAccess
import flyframe.mii.NibbleStream
import flyframe.registers.RegisterMap

/** Moves the data of a datagram between wire and memory: reads each word ahead, picks bytes, gathers written
  * bytes to words.
  *
  * A slot of two cycles and more leaves a cycle between the wire path and the memory; shorter slots use the
  * answer in the very cycle it arrives.
  *
  * @param lanes
  *   bytes per access
  * @param cyclesPerNibble
  *   core cycles per nibble slot
  */
class DataAccess(lanes: Int, cyclesPerNibble: Int) extends Module {
  val step     = IO(Input(Bool()))
  val in       = IO(Input(new NibbleStream))
  val position = IO(Input(new FramePosition))
  val request  = IO(Input(new DatagramRequest))
  val enable   = IO(Input(Bool())) // the datagram is one of those to process
  val memory   = IO(new EcatAccess(lanes))

  /** The nibble read at this place, and whether it replaces or is OR-ed into the one received. */
  val readNibble = IO(Output(UInt(4.W)))
  val readNow    = IO(Output(Bool()))

  /** Some byte of the datagram so far was read, was written (FP-28). */
  val readSuccess  = IO(Output(Bool()))
  val writeSuccess = IO(Output(Bool()))

  private val laneBits = log2Ceil(lanes)
  private val inData   = position.part === Part.data
  private val inHeader = position.part === Part.header
  private val active   = step && in.valid && in.payload

  // Address of the byte at hand; one bit more than 16, so that it cannot wrap (B-18).
  private val address = Reg(UInt(17.W))
  private val lane    = if (lanes == 1) 0.U else address(laneBits - 1, 0)
  private val ahead   = address + 1.U
  private val first   = active && inHeader && position.byte === 6.U && !position.high
  private val byteEnd = active && inData && position.high
  private val wordEnd = lane === (lanes - 1).U || position.dataLeft === 1.U

  private def staged[T <: Data](signal: T): T = if (cyclesPerNibble == 1) signal else RegNext(signal)
  memory.read        := staged(first || (byteEnd && wordEnd))
  memory.readAddress := staged(Mux(inHeader, request.address, ahead))
  when(first) { address := request.address }.elsewhen(byteEnd) { address := ahead }

  // The word read last.
  private class Answer extends Bundle {
    val data     = UInt((8 * lanes).W)
    val readable = UInt(lanes.W)
    val writable = UInt(lanes.W)
  }
  private val arriving = RegNext(memory.read, false.B)
  private val arrived  = Wire(new Answer)
  arrived.data     := memory.readData
  arrived.readable := memory.readable
  arrived.writable := memory.writable
  private val kept   = RegEnable(arrived, arriving)
  private val answer = if (cyclesPerNibble <= 2) Mux(arriving, arrived, kept) else kept

  private def laneOf(bits: UInt, width: Int): UInt =
    VecInit((0 until lanes).map(i => bits(width * i + width - 1, width * i)))(if (lanes == 1) 0.U else lane)
  private val readByte = laneOf(answer.data, 8)
  readNow    := inData && enable && request.read && laneOf(answer.readable, 1).asBool
  readNibble := Mux(position.high, readByte(7, 4), readByte(3, 0))

  // Writing: a byte counts when its high nibble has come.
  private val low        = RegEnable(in.data, step)
  private val toRegister = address < RegisterMap.UserRamStart.U
  private val accept = byteEnd && enable && request.write && laneOf(answer.writable, 1).asBool &&
    !(toRegister && memory.logFull)
  private val gatheredMask = RegInit(0.U(lanes.W)) // reset: nothing to write
  private val gatheredData = Reg(UInt((8 * lanes).W))
  private val byteMask     = Mux(accept, UIntToOH(lane, lanes), 0.U)
  private val written      = Cat(in.data, low)
  private val wordMask     = gatheredMask | byteMask
  private val wordData = VecInit((0 until lanes).map { i =>
    Mux(byteMask(i), written, gatheredData(8 * i + 7, 8 * i))
  }).asUInt
  private val flush = active && inData && ((position.high && wordEnd) || in.last)

  memory.logByte      := accept && toRegister
  memory.write        := flush && wordMask.orR
  memory.writeAddress := address(15, 0)
  memory.writeMask    := wordMask
  memory.writeData    := wordData
  if (lanes > 1) {
    when(flush) { gatheredMask := 0.U }.elsewhen(accept) { gatheredMask := wordMask }
    when(accept) { gatheredData := wordData }
  }

  private val anyRead  = Reg(Bool())
  private val anyWrite = Reg(Bool())
  when(first) {
    anyRead  := false.B
    anyWrite := false.B
  }.otherwise {
    when(byteEnd && readNow) { anyRead := true.B }
    when(accept) { anyWrite := true.B }
  }
  readSuccess  := anyRead
  writeSuccess := anyWrite

  memory.frameStart := step && in.valid && !in.payload
  memory.commit     := false.B // the frame processor knows; see there
}
