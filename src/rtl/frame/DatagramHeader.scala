package flyframe.frame

import chisel3._
import chisel3.util._
import flyframe.lanes.Lanes
import flyframe.mii.NibbleStream
import flyframe.protocol.DatagramLayout.{Ado, Adp, Command}

/** What the header of the datagram at hand asks of this controller. All of it is steady from the last byte of
  * the header to the end of the datagram; some of it, as noted, is so earlier.
  */
class DatagramRequest extends Bundle {

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

  /** The logical address of the first data byte, if FMMUs are built. */
  val logicalAddress = UInt(32.W)

  /** ADO, the local address of the first data byte (FP-18). Steady from its own last nibble on. */
  val address = UInt(16.W)
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
  val request        = IO(Output(new DatagramRequest))

  // Data path registers: each is written before it is read in every datagram, so none needs a reset.
  private val code         = Reg(UInt(4.W))
  private val reserved     = Reg(Bool()) // command 16 to 255
  private val address      = Reg(UInt(16.W))
  private val adp          = Reg(UInt(16.W))
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
        adp := Cat(in.data, adp(15, 4))
        when(in.data =/= 0.U) { zero := false.B }
        when(in.data =/= Lanes.nibbles(stationAddress, 4)(adpNibble)) { stationMatch := false.B }
        when(in.data =/= Lanes.nibbles(stationAlias, 4)(adpNibble)) { aliasMatch := false.B }
      }
      is(Ado.offset.U, Ado.last.U) {
        address := Cat(in.data, address(15, 4))
      }
    }
  }

  private val hit       = Mux(CommandDecode.byPosition(code), zero, stationMatch || aliasMatch)
  private val broadcast = CommandDecode.broadcast(code)
  private val others    = CommandDecode.readsOneWritesOthers(code)
  request.broadcast := broadcast
  private val byFmmu    = if (logical) CommandDecode.logical(code) else false.B
  private val addressed = Mux(CommandDecode.logical(code), byFmmu, hit || broadcast)
  request.read           := !reserved && addressed && (CommandDecode.reads(code) || others)
  request.write          := !reserved && Mux(others, !hit, addressed && CommandDecode.writes(code))
  request.logical        := byFmmu
  request.logicalAddress := (if (logical) Cat(address, adp) else 0.U)
  request.readWrite      := CommandDecode.reads(code) && CommandDecode.writes(code)
  request.incrementsAdp  := !reserved && CommandDecode.incrementsAdp(code)
  request.address        := address
}
