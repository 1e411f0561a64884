package flyframe.frame

import chisel3._
import chisel3.util._
import flyframe.mii.NibbleStream

/** What the header of the running datagram asks of this ESC. Steady from its last byte to the end of the
  * datagram.
  */
class DatagramRequest extends Bundle {
  val read      = Bool()
  val write     = Bool()
  val broadcast = Bool()

  /** Reading and writing count separately, 1 and 2 (FP-29). */
  val readWrite = Bool()

  /** ADP is incremented; steady from the command byte on. */
  val incrementsAdp = Bool()

  /** An FMMU decides on each byte. */
  val logical = Bool()

  /** The logical address of the first data byte, if FMMUs are built. */
  val logicalAddress = UInt(32.W)

  /** ADO, the local address of the first data byte (FP-18); steady from its last nibble on. */
  val address = UInt(16.W)
}

/** Collects command and address of a datagram nibble by nibble and compares ADP while it passes (FP-14 to
  * FP-18, FP-22, FP-24).
  *
  * @param logical
  *   logical commands are executed
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

  private def nibbleOf(word: UInt, index: UInt): UInt =
    VecInit((0 until 4).map(i => word(4 * i + 3, 4 * i)))(index)
  private val adpNibble = Cat(position.byte(0), position.high) // ADP is bytes 2 and 3

  when(step && in.valid && position.part === Part.header) {
    switch(position.byte) {
      is(0.U) {
        when(position.high) { reserved := in.data =/= 0.U }.otherwise { code := in.data }
        zero         := true.B
        stationMatch := true.B
        aliasMatch   := aliasEnable
      }
      is(2.U, 3.U) {
        adp := Cat(in.data, adp(15, 4))
        when(in.data =/= 0.U) { zero := false.B }
        when(in.data =/= nibbleOf(stationAddress, adpNibble)) { stationMatch := false.B }
        when(in.data =/= nibbleOf(stationAlias, adpNibble)) { aliasMatch := false.B }
      }
      is(4.U, 5.U) {
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
