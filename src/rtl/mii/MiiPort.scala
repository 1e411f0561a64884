package flyframe.mii

import chisel3._
import flyframe.params.EscParams

/** The pins of a PHY with MII; `link` is high while it reports a link. */
class MiiPins extends Bundle {
  val rx_clk = Input(Clock())
  val rx_dv  = Input(Bool())
  val rx_er  = Input(Bool())
  val rxd    = Input(UInt(4.W))
  val link   = Input(Bool())
  val tx_en  = Output(Bool())
  val txd    = Output(UInt(4.W))
}

/** A port to a PHY with MII. */
class MiiPort(p: EscParams, number: Int) extends Port(p, number) {

  /** RX_DV, RX_ER and RXD in `rx_clk`; TX_EN and TXD in the core clock. */
  val pins     = IO(new MiiPins)
  def pinsName = "mii"

  crossing.rxClock   := pins.rx_clk
  crossing.pins.dv   := pins.rx_dv
  crossing.pins.er   := pins.rx_er
  crossing.pins.data := pins.rxd
  crossing.valid     := true.B
  setLink(pins.link)
  pins.tx_en := shifted(transmitter.txEn)
  pins.txd   := shifted(transmitter.txd)
}
