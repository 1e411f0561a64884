package flyframe.host

import chisel3._
import chisel3.util.Valid
import flyframe.memory.HostPort
import flyframe.params.EscParams

/** How a host is connected: makes accesses to a controller's host port of what it does at its pins. Each kind
  * is one file; parameter `hostInterface` chooses. An access, once begun, is held until its end, as each of
  * these buses demands of its host.
  */
abstract class HostInterface(p: EscParams) extends Module {

  /** To the controller. */
  val port = IO(Flipped(new HostPort(p.lanes)))

  /** What is shown and told beside accesses. */
  val side = IO(new HostSide)

  /** From the host. */
  def pins: Bundle

  /** What the names of the pins begin with. */
  def prefix: String

  /** Keeps an access at the port until it is done, as it was when it began: also one that the host has
    * withdrawn, which then gets no answer.
    *
    * @param reads
    *   the host asks for a read, until it is answered; its pause is made here
    * @param writes
    *   the same for a write
    * @param asked
    *   what the host asks for, if it writes (1) or reads (0)
    * @param writeFirst
    *   of both, the write comes first
    */
  protected def hold(reads: Bool, writes: Bool, writeFirst: Bool = true.B)(
      asked: Bool => HostRequest
  ): HeldAccess = {
    // reset: no access
    val rests     = RegNext(port.ack, false.B)
    val open      = RegNext(port.req && !port.ack, false.B)
    val withdrawn = RegInit(false.B)
    val isWrite   = Reg(Bool())
    val kept      = Reg(new HostRequest(p.lanes))
    val drops     = open && !withdrawn && !Mux(isWrite, writes, reads)
    val write     = writes && (writeFirst || !reads)
    val request   = Mux(open, kept, asked(write))
    when(drops) { withdrawn := true.B }
    when(port.ack) { withdrawn := false.B }
    port.req   := open || ((reads || writes) && !rests)
    port.write := Mux(open, isWrite, write)
    port.addr  := request.addr
    port.wdata := request.wdata
    port.be    := request.be
    isWrite    := port.write
    kept       := request
    val answered = port.ack && !withdrawn
    HeldAccess(answered && isWrite, answered && !isWrite, answered && !drops, drops)
  }
}

/** What a host asks for, beside the direction, as at the [[flyframe.memory.HostPort]]. */
class HostRequest(lanes: Int) extends Bundle {
  val addr  = UInt(16.W)
  val wdata = UInt((8 * lanes).W)
  val be    = UInt(lanes.W)
}

/** How an access that is held stands.
  *
  * @param writeReady
  *   a write is done, unless its host withdraws it in this cycle; it does not depend on what the host does in
  *   this cycle
  * @param readReady
  *   the same of a read
  * @param done
  *   an access is done that its host has not withdrawn
  * @param withdrawn
  *   it has withdrawn it, one cycle
  */
final case class HeldAccess(writeReady: Bool, readReady: Bool, done: Bool, withdrawn: Bool)

/** What a host interface shows and tells of beside accesses. */
class HostSide extends Bundle {

  /** The AL event request, or what interrupts the host of a master. */
  val events = Input(UInt(24.W))

  /** An access was in error, and how (0x030E). */
  val error = Output(Valid(UInt(16.W)))
}

/** The pins of a host where there is none. */
class NoHostPins extends Bundle

object HostInterface {

  /** How the host is connected: at these pins, by way of this port, and what is beside it, if there is. */
  final case class Connection(pins: Bundle, port: HostPort, side: Option[HostSide])

  /** Makes the interface that the parameters ask for in the top module at hand: its pins there, and the port
    * behind it. Without one the port itself is at the pins; without a host [[DigitalIo]] has it.
    */
  def apply(p: EscParams): Connection = p.hostInterface match {
    case 1 => atPins(Module(new AvalonInterface(p)))
    case 2 => atPins(Module(new AxiLiteInterface(p)))
    case 3 => atPins(Module(new WishboneInterface(p)))
    case 4 => atPins(Module(new SpiInterface(p)))
    case 5 => atPins(Module(new MicrocontrollerInterface(p)))
    case 6 => Connection(new NoHostPins, Wire(new HostPort(p.lanes)).suggestName("host"), None)
    case _ =>
      val port = IO(new HostPort(p.lanes)).suggestName("host")
      Connection(port, port, None)
  }

  private def atPins(interface: HostInterface) = {
    val pins = IO(chiselTypeOf(interface.pins)).suggestName(interface.prefix)
    interface.suggestName("hostInterface").pins <> pins
    Connection(pins, interface.port, Some(interface.side))
  }
}
