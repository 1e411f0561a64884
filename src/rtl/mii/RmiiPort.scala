package flyframe.mii

import chisel3._
import chisel3.util._
import flyframe.clocks.MiiSymbol
import flyframe.params.EscParams

/** The pins of a PHY with RMII; `link` is high while it reports a link. */
class RmiiPins extends Bundle {

  /** 50 MHz, the same that the PHY gets, from the same PLL as the core clock. */
  val ref_clk = Input(Clock())
  val crs_dv  = Input(Bool())
  val rx_er   = Input(Bool())
  val rxd     = Input(UInt(2.W))
  val link    = Input(Bool())
  val tx_en   = Output(Bool())
  val txd     = Output(UInt(2.W))
}

/** Makes symbols of MII from what an RMII PHY gives, in the PHY's reference clock (RMII specification 1.2,
  * section 5).
  *
  * CRS_DV rises with the carrier, before there are data: RXD is 00 until the preamble begins. When the
  * carrier ends, the PHY still has data: CRS_DV falls in the first half of each nibble and is high in the
  * second until they have gone. So it is the second half that says whether a nibble is valid.
  *
  * Two symbols are never closer than two cycles, as [[flyframe.clocks.MiiRxCrossing]] wants them. Where the
  * nibbles of a frame begin turns out to be in the other half, its symbols come a cycle later from there on.
  *
  * No register has a reset: without a carrier they all get where they belong within a nibble.
  */
class RmiiSymbols extends Module {
  val crsDv = IO(Input(Bool()))
  val rxEr  = IO(Input(Bool()))
  val rxd   = IO(Input(UInt(2.W)))

  /** With `valid`, at most once in two cycles: what MII would have. */
  val symbol = IO(Output(new MiiSymbol))
  val valid  = IO(Output(Bool()))

  private val inFrame    = Reg(Bool())
  private val inPreamble = Reg(Bool())
  private val isFalse    = Reg(Bool()) // this carrier is a false one: no data of it count
  private val second     = Reg(Bool()) // the second half of a nibble is at the pins
  private val low        = Reg(UInt(2.W))
  private val lowEr      = Reg(Bool())
  private val late       = Reg(Bool()) // symbols come a cycle later

  private val complete = Wire(Bool())
  private val waits    = RegNext(complete)

  // Half nibbles of the preamble are all alike; where nibbles begin is sure at the end of the SFD only. A PHY
  // may have lost an odd number of halves: then the SFD's second half stands where a first one is expected.
  private val isIdle   = !inFrame && crsDv
  private val falseNow = isIdle && (isFalse || rxd(1))
  private val starts   = isIdle && !isFalse && rxd === 1.U && !(late && waits)
  private val sfdNow   = inFrame && inPreamble && rxd === 3.U
  private val isOdd    = sfdNow && !second
  private val er       = rxEr || falseNow

  private val found = Wire(new MiiSymbol)
  complete   := !starts && (second || sfdNow)
  found.dv   := inFrame && crsDv
  found.er   := er || (second && lowEr)
  found.data := Mux(isOdd, 0xd.U, Cat(rxd, low))

  private val kept = RegNext(found)
  valid  := Mux(late, waits, complete && !isOdd && !RegNext(valid))
  symbol := Mux(late, kept, found)

  low     := rxd
  lowEr   := er
  isFalse := falseNow
  when(isOdd) { late := true.B }.elsewhen(waits && !kept.dv) { late := false.B }
  when(starts) {
    inFrame    := true.B
    inPreamble := true.B
    second     := true.B
    late       := false.B
  }.otherwise {
    second := !complete
    when(complete) { inFrame := found.dv }
    when(sfdNow) { inPreamble := false.B }
  }
}

/** A port to a PHY with RMII: half nibbles at 50 MHz. What is sent leaves one core cycle later than at a port
  * with MII.
  */
class RmiiPort(p: EscParams, number: Int) extends Port(p, number) {

  /** CRS_DV, RX_ER and RXD in `ref_clk`; TX_EN and TXD in the core clock. */
  val pins     = IO(new RmiiPins)
  def pinsName = "rmii"

  private val symbols = withClock(pins.ref_clk)(Module(new RmiiSymbols))
  symbols.crsDv    := pins.crs_dv
  symbols.rxEr     := pins.rx_er
  symbols.rxd      := pins.rxd
  crossing.rxClock := pins.ref_clk
  crossing.pins    := symbols.symbol
  crossing.valid   := symbols.valid
  setLink(pins.link)

  // Straight from registers to the pins.
  private val halfway = ShiftRegister(core.transmitStep, p.cyclesPerNibble / 2, false.B, true.B)
  private val second  = Reg(Bool()) // no reset: right after the first slot
  when(core.transmitStep) { second := false.B }.elsewhen(halfway) { second := true.B }
  private val enable = RegNext(transmitter.txEn, false.B) // reset: nothing leaves
  private val half   = RegNext(Mux(second, transmitter.txd(3, 2), transmitter.txd(1, 0)))
  pins.tx_en := shifted(enable)
  pins.txd   := shifted(half)
}
