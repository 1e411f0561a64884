package flyframe

import chisel3._
import chisel3.experimental.noPrefix
import flyframe.host.HostSplit
import flyframe.memory.HostPort
import flyframe.params.EscParams

/** A slave with a fibre ring under it (GW-01): slave controller and ring node in one chip, at one host port.
  * The node's registers are in the upper half of the address space ([[EscParams.RingSpace]]); neither half
  * knows of the other, and what passes between them does so in the host's program (`ring_gateway`).
  */
class RingGateway private (p: EscParams, node: NodeInGateway) extends SlaveController(p, Nil, node.beside) {
  val optical_1: OpticalPins = node.optical(0)
  val optical_2: OpticalPins = node.optical(1)

  /** Of the twisted pair. */
  val can: Option[CanPins] = node.can

  /** Interrupt to the host, a level: an event of the node that its mask lets pass. */
  val ring_irq = IO(Output(Bool()))
  ring_irq := node.irq
}

object RingGateway {

  /** That of parameters `p`, which have a ring. */
  def apply(p: EscParams): RingGateway = new RingGateway(p, new NodeInGateway(p))
}

/** The ring node of a gateway: a part of the controller that makes it, with its pins. */
private class NodeInGateway(p: EscParams) {
  private lazy val node = Module(new RingNode(p.ringNode)).suggestName("node")

  /** Connects the node to the upper half of the host's address space; the rest of it. */
  def beside(host: HostPort): HostPort = noPrefix { // of whatever the controller does with it
    val split = Module(new HostSplit(p.lanes)).suggestName("hostSplit")
    split.host <> host
    node.hostPins <> split.upper
    val lower = Wire(new HostPort(p.lanes)).suggestName("slaveHost")
    lower <> split.lower
    lower
  }

  /** Pins of optical port `n`, 0 or 1. */
  def optical(n: Int): OpticalPins = {
    val pins = IO(new OpticalPins).suggestName(s"optical_${n + 1}")
    Seq(node.optical_1, node.optical_2)(n) <> pins
    pins
  }

  def can: Option[CanPins] = node.can.map { port =>
    val pins = IO(new CanPins).suggestName("can")
    port <> pins
    pins
  }

  def irq: Bool = node.irq
}
