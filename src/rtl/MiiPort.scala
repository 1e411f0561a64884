package flyframe

import chisel3._
import flyframe.clocks.MiiRxCrossing
import flyframe.mii.MiiReceiver

/** The pins of one MII port; `link` is high while the PHY reports a link. */
class MiiPort extends Bundle {
  val rx_clk = Input(Clock())
  val rx_dv  = Input(Bool())
  val rx_er  = Input(Bool())
  val rxd    = Input(UInt(4.W))
  val link   = Input(Bool())
  val tx_en  = Output(Bool())
  val txd    = Output(UInt(4.W))
}

object MiiPort {

  /** The receiver of a port: frames from its pins in the core clock.
    *
    * @param link
    *   in the core clock; its fall cuts a frame off
    * @param tick
    *   once per nibble slot
    */
  def receiver(port: MiiPort, link: Bool, tick: Bool, shortMargin: Bool, coreClockMhz: Int): MiiReceiver = {
    val crossing = Module(new MiiRxCrossing(coreClockMhz))
    val receiver = Module(new MiiReceiver)
    crossing.rxClock     := port.rx_clk
    crossing.pins.dv     := port.rx_dv
    crossing.pins.er     := port.rx_er
    crossing.pins.data   := port.rxd
    crossing.shortMargin := shortMargin
    receiver.symbols <> crossing.read
    receiver.tick := tick
    receiver.cut  := RegNext(link, false.B) && !link
    receiver
  }
}
