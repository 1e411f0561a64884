package flyframe.host

import chisel3._
import flyframe.memory.HostPort
import flyframe.params.EscParams

/** How a host is connected: makes accesses to a controller's host port of what it does at its pins. Each kind
  * is one file; parameter `hostInterface` chooses. An access, once begun, is held until its end, as each of
  * these buses demands of its host.
  */
abstract class HostInterface(p: EscParams) extends Module {

  /** To the controller. */
  val port = IO(Flipped(new HostPort(p.lanes)))

  /** From the host. */
  def pins: Bundle

  /** What the names of the pins begin with. */
  def prefix: String
}

object HostInterface {

  /** Makes the interface that the parameters ask for in the top module at hand: its pins there, and the port
    * behind it. Without one the port itself is at the pins.
    */
  def apply(p: EscParams): (Bundle, HostPort) = p.hostInterface match {
    case 1 => atPins(Module(new AvalonInterface(p)))
    case 2 => atPins(Module(new AxiLiteInterface(p)))
    case 3 => atPins(Module(new WishboneInterface(p)))
    case _ =>
      val port = IO(new HostPort(p.lanes)).suggestName("host")
      (port, port)
  }

  private def atPins(interface: HostInterface): (Bundle, HostPort) = {
    val pins = IO(chiselTypeOf(interface.pins)).suggestName(interface.prefix)
    interface.suggestName("hostInterface").pins <> pins
    (pins, interface.port)
  }
}
