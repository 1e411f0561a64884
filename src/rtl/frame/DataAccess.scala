package flyframe.frame

import chisel3._
import chisel3.util._
import flyframe.lanes.Lanes
import flyframe.protocol.DatagramLayout.Ado
import flyframe.registers.{Register, RegisterMap}

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
  * @param acknowledged
  *   registers whose reading by the bus is told of
  * @param isProtected
  *   what is written may be refused (SYS-02, SYS-03)
  */
class DataAccess(
    lanes: Int,
    cyclesPerNibble: Int,
    acknowledged: Seq[Register],
    isProtected: Boolean = false
) extends DataAccessUnit(lanes, logical = false, acknowledged, isProtected) {
  private val inData   = position.part === Part.data
  private val inHeader = position.part === Part.header
  private val active   = step && in.valid && in.payload

  // Address of the byte at hand.
  private val address = request.address(16, 0)
  private val here    = Lanes.of(address, lanes)
  private val first   = active && inHeader && position.byte === (Ado.last + 1).U && !position.high
  private val byteEnd = active && inData && position.high
  private val wordEnd = here === (lanes - 1).U || position.dataLeft === 1.U

  // In the cycle behind the nibble the address is already that of the next byte.
  private val asks = first || (byteEnd && wordEnd)
  advance            := byteEnd
  memory.read        := (if (cyclesPerNibble == 1) asks else RegNext(asks))
  memory.readAddress := (if (cyclesPerNibble == 1) Mux(inHeader, address, address + 1.U) else address)

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

  private val readByte = Lanes.bytes(answer.data, lanes)(here)
  private val readNow  = inData && enable && request.read && Lanes.bits(answer.readable, lanes)(here).asBool
  readMask   := Fill(4, readNow)
  readNibble := Mux(position.high, readByte(7, 4), readByte(3, 0))

  // Writing: a byte counts when its high nibble has come.
  private val low        = RegEnable(in.data, step)
  private val toRegister = address < RegisterMap.UserRamStart.U
  private val accept = permitted(
    byteEnd && enable && request.write && Lanes.bits(answer.writable, lanes)(here).asBool &&
      !(toRegister && memory.logFull)
  )
  for (byte <- protection) {
    byte.address    := address
    byte.isRegister := toRegister
    byte.accepted   := accept
  }
  private val gatheredMask = RegInit(0.U(lanes.W)) // reset: nothing to write
  private val gatheredData = Reg(UInt((8 * lanes).W))
  private val byteMask     = Mux(accept, UIntToOH(here, lanes), 0.U)
  private val written      = Cat(in.data, low)
  private val wordMask     = gatheredMask | byteMask
  private val wordData = VecInit((0 until lanes).map { i =>
    Mux(byteMask(i), written, Lanes.byte(gatheredData, i))
  }).asUInt
  private val flush = (byteEnd && wordEnd) || (step && in.end && inData)

  memory.logByte      := accept && toRegister
  memory.write        := flush && wordMask.orR
  memory.writeAddress := address(15, 0)
  memory.writeMask    := wordMask
  memory.writeData    := wordData
  memory.writeBits    := 0xff.U
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
  tellReads(byteEnd && readNow, isAt => isAt(address))

  memory.frameStart := step && in.valid && !in.payload
  memory.commit     := false.B // the frame processor knows; see there
}
