package flyframe.mii

import chisel3._
import chisel3.util._
import flyframe.clocks.{LevelCrossing, MiiRxCrossing}
import flyframe.params.EscParams

/** The link of a port, if more than its input decides on it. */
class LinkSignals extends Bundle {

  /** The link input says that there is one; and whether there is. */
  val signal = Output(Bool())
  val link   = Input(Bool())
}

/** A port as the rest of a controller sees it, in the core clock, whatever interface its PHY has.
  *
  * @param detectsLinks
  *   more than the link input decides on a link
  */
class PortSignals(detectsLinks: Boolean = false) extends Bundle {

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

  /** Core cycles that the first symbol of the frame has waited, while the first nibble comes. */
  val waited = Output(UInt(4.W))

  /** No frame is being received; none is being sent. */
  val receiverIdle    = Output(Bool())
  val transmitterIdle = Output(Bool())

  /** What decides on `link` beside `enable`. */
  val detection = Option.when(detectsLinks)(new LinkSignals)
}

/** One port of a controller: its receiver, transmitter and link, with the pins of its PHY. A frame is cut off
  * when the link goes down (B-30).
  *
  * @param p
  *   `coreClockMhz`, `txShift`, `linkLowPorts`
  */
abstract class Port(p: EscParams, number: Int) extends Module {
  val core = IO(new PortSignals(p.detectsLinks))

  /** The pins of its PHY, and what their names at the top begin with. */
  def pins: Bundle
  def pinsName: String

  protected val crossing    = Module(new MiiRxCrossing(p.coreClockMhz))
  protected val transmitter = Module(new MiiTransmitter)
  private val receiver      = Module(new MiiReceiver)

  private val waited = Reg(UInt(4.W))
  when(receiver.idle) { waited := Mux(crossing.read.available, waited + 1.U, 0.U) }

  receiver.symbols <> crossing.read
  receiver.tick        := core.receiveStep
  receiver.cut         := RegNext(core.link, false.B) && !core.link
  crossing.shortMargin := core.shortMargin
  transmitter.tick     := core.transmitStep
  transmitter.in       := core.toWire
  core.fromWire        := receiver.out
  core.events          := receiver.events
  core.receiverIdle    := receiver.idle
  core.waited          := waited
  core.transmitterIdle := !transmitter.txEn

  protected def setLink(pin: Bool): Unit = {
    def signal = LevelCrossing(if (p.isLinkLow(number)) !pin else pin) && core.enable
    core.detection match {
      case None => core.link := signal
      case Some(detection) =>
        detection.signal := signal
        core.link        := detection.link
    }
  }

  /** What leaves, `txShift` core cycles later. */
  protected def shifted[T <: Data](pin: T): T = ShiftRegister(pin, p.txShift)
}

object Port {

  /** Port number `number` of a controller, with the interface its parameters say. */
  def apply(p: EscParams, number: Int): Port =
    if (p.isRmii(number)) Module(new RmiiPort(p, number)) else Module(new MiiPort(p, number))

  /** Pins of the top module for all `ports`, by their numbers. */
  def pins(ports: Seq[Port]): Seq[Bundle] = ports.zipWithIndex.map { case (port, number) =>
    val pins = IO(chiselTypeOf(port.pins)).suggestName(s"${port.pinsName}_$number")
    pins <> port.pins
    pins
  }
}
