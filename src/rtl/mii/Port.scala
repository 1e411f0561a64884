package flyframe.mii

import chisel3._
import chisel3.util._
import flyframe.clocks.{LevelCrossing, MiiRxCrossing}
import flyframe.params.EscParams

/** A port as the rest of a controller sees it, in the core clock, whatever interface its PHY has. */
class PortSignals extends Bundle {

  /** The steps of a nibble slot in which the port receives and sends. */
  val receiveStep  = Input(Bool())
  val transmitStep = Input(Bool())

  /** Low: as without a link. */
  val enable = Input(Bool())

  /** The first symbol of a frame waits half as long (LP-12). */
  val shortMargin = Input(Bool())

  val toWire   = Input(new NibbleStream)
  val fromWire = Output(new NibbleStream)
  val link     = Output(Bool())
  val events   = Output(new ReceiverEvents)

  /** No frame is being received; none is being sent. */
  val receiverIdle    = Output(Bool())
  val transmitterIdle = Output(Bool())
}

/** One port of a controller: its receiver, transmitter and link, with the pins of its PHY. A frame is cut off
  * when the link goes down (B-30).
  *
  * @param p
  *   `coreClockMhz`, `txShift`
  */
abstract class Port(p: EscParams) extends Module {
  val core = IO(new PortSignals)

  /** The pins of its PHY, and what their names at the top begin with. */
  def pins: Bundle
  def pinsName: String

  protected val crossing    = Module(new MiiRxCrossing(p.coreClockMhz))
  protected val transmitter = Module(new MiiTransmitter)
  private val receiver      = Module(new MiiReceiver)

  receiver.symbols <> crossing.read
  receiver.tick        := core.receiveStep
  receiver.cut         := RegNext(core.link, false.B) && !core.link
  crossing.shortMargin := core.shortMargin
  transmitter.tick     := core.transmitStep
  transmitter.in       := core.toWire
  core.fromWire        := receiver.out
  core.events          := receiver.events
  core.receiverIdle    := receiver.idle
  core.transmitterIdle := !transmitter.txEn

  protected def setLink(pin: Bool): Unit = core.link := LevelCrossing(pin) && core.enable

  /** What leaves, `txShift` core cycles later. */
  protected def shifted[T <: Data](pin: T): T = ShiftRegister(pin, p.txShift)
}

object Port {

  /** Port number `number` of a controller, with the interface its parameters say. */
  def apply(p: EscParams, number: Int): Port =
    if (p.isRmii(number)) Module(new RmiiPort(p)) else Module(new MiiPort(p))

  /** Pins of the top module for all `ports`, by their numbers. */
  def pins(ports: Seq[Port]): Seq[Bundle] = ports.zipWithIndex.map { case (port, number) =>
    val pins = IO(chiselTypeOf(port.pins)).suggestName(s"${port.pinsName}_$number")
    pins <> port.pins
    pins
  }
}
