package flyframe.frame

import chisel3._
import chisel3.util._
import flyframe.lanes.Lanes
import flyframe.mii.NibbleStream
import flyframe.protocol.DatagramLayout.{Ado, Adp, Command}

/** What the header of the datagram at hand asks of this controller. All of it is steady from the last byte of
  * the header to the end of the datagram; some of it, as noted, is so earlier.
  *
  * @param hasLogical
  *   logical commands are executed
  */
class DatagramRequest(hasLogical: Boolean) extends Bundle {

  /** Data is to be read from here into the frame. */
  val read = Bool()

  /** Data of the frame is to be written here. */
  val write = Bool()

  /** Every controller is addressed: what is read is OR-ed into the frame. */
  val broadcast = Bool()

  /** The command reads and writes. The working counter then rises by 1 for reading and by 2 for writing
    * (FP-29).
    */
  val readWrite = Bool()

  /** ADP is incremented while it passes. Steady from the command byte on. */
  val incrementsAdp = Bool()

  /** The address is a logical one: an FMMU decides where each byte is. */
  val logical = Bool()

  /** The logical address, if FMMUs are built; else, and for a command without, ADO, the local address
    * (FP-18): of the first data byte from the last nibble of ADO on, then as it is counted. One bit more than
    * the address has, so that it cannot wrap (B-18).
    */
  val address = UInt((if (hasLogical) 33 else 17).W)
}

/** Collects command and address of a datagram nibble by nibble and compares ADP while it passes (FP-14 to
  * FP-18, FP-22, FP-24).
  *
  * @param logical
  *   true: logical commands are executed, for which FMMUs are needed; false: they pass unchanged
  */
class DatagramHeader(logical: Boolean) extends Module {
  val step           = IO(Input(Bool()))
  val in             = IO(Input(new NibbleStream))
  val position       = IO(Input(new FramePosition))
  val stationAddress = IO(Input(UInt(16.W)))
  val stationAlias   = IO(Input(UInt(16.W)))
  val aliasEnable    = IO(Input(Bool()))
  val request        = IO(Output(new DatagramRequest(logical)))

  /** Count the address. */
  val advance = IO(Input(Bool()))

  // Data path registers: each is written before it is read in every datagram, so none needs a reset.
  private val code         = Reg(UInt(4.W))
  private val reserved     = Reg(Bool())                           // command 16 to 255
  private val high         = Reg(UInt((if (logical) 17 else 1).W)) // upper part of `request.address`
  private val low          = Reg(UInt(16.W))
  private val zero         = Reg(Bool())
  private val stationMatch = Reg(Bool())
  private val aliasMatch   = Reg(Bool())

  private val adpNibble = Cat(position.byte(0), position.high) // ADP begins with an even byte

  when(step && in.valid && position.part === Part.header) {
    switch(position.byte) {
      is(Command.offset.U) {
        when(position.high) { reserved := in.data =/= 0.U }.otherwise { code := in.data }
        zero         := true.B
        stationMatch := true.B
        aliasMatch   := aliasEnable
      }
      is(Adp.offset.U, Adp.last.U) {
        low := Cat(in.data, low(15, 4))
        when(in.data =/= 0.U) { zero := false.B }
        when(in.data =/= Lanes.nibbles(stationAddress, 4)(adpNibble)) { stationMatch := false.B }
        when(in.data =/= Lanes.nibbles(stationAlias, 4)(adpNibble)) { aliasMatch := false.B }
      }
      is(Ado.offset.U, Ado.last.U) {
        if (logical)
          when(CommandDecode.logical(code)) { high := Cat(0.U(1.W), in.data, high(15, 4)) }.otherwise {
            high := 0.U
            low  := Cat(in.data, low(15, 4))
          }
        else {
          high := 0.U
          low  := Cat(in.data, low(15, 4))
        }
      }
    }
  }
  when(advance) {
    val next = Cat(high, low) + 1.U
    high := next >> 16
    low  := next
  }

  private val hit       = Mux(CommandDecode.byPosition(code), zero, stationMatch || aliasMatch)
  private val broadcast = CommandDecode.broadcast(code)
  private val others    = CommandDecode.readsOneWritesOthers(code)
  request.broadcast := broadcast
  private val byFmmu    = if (logical) CommandDecode.logical(code) else false.B
  private val addressed = Mux(CommandDecode.logical(code), byFmmu, hit || broadcast)
  request.read          := !reserved && addressed && (CommandDecode.reads(code) || others)
  request.write         := !reserved && Mux(others, !hit, addressed && CommandDecode.writes(code))
  request.logical       := byFmmu
  request.readWrite     := CommandDecode.reads(code) && CommandDecode.writes(code)
  request.incrementsAdp := !reserved && CommandDecode.incrementsAdp(code)
  request.address       := Cat(high, low)
}
