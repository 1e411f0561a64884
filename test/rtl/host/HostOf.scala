package flyframe.host

import chisel3._
import chisel3.util._
import chisel3.util.random.LFSR
import flyframe.memory.HostPort

/** What is at the pins of a host interface: makes accesses there of those that a test asks for at a
  * [[HostPort]], so that every test of a controller runs through every interface.
  */
object HostOf {
  def apply(pins: Bundle, host: HostPort): Unit = pins match {
    case port: HostPort     => port <> host
    case pins: AvalonPins   => connect(Module(new AvalonHost(host.be.getWidth)), pins, host)
    case pins: AxiLitePins  => connect(Module(new AxiLiteHost), pins, host)
    case pins: WishbonePins => connect(Module(new WishboneHost(host.be.getWidth)), pins, host)
  }
  private def connect(module: TestHost, pins: Bundle, host: HostPort): Unit = {
    module.pins <> pins
    module.host <> host
  }
}

/** A host of a test. Its pins change at random moments, as far as its bus allows that. */
abstract class TestHost(lanes: Int) extends Module {
  val host = IO(new HostPort(lanes))
  def pins: Bundle

  private val random              = LFSR(16)
  protected def now(i: Int): Bool = random(i) // often enough

  /** The access is over; until then `host.req` is high, and then it is low for a cycle. */
  protected def ends(done: Bool, data: UInt): Unit = {
    host.ack   := done
    host.rdata := data
  }
}

class AvalonHost(lanes: Int) extends TestHost(lanes) {
  val avalon = IO(Flipped(new AvalonPins(lanes)))
  def pins   = avalon

  // The next access may follow at once: nothing is between them here, as the one in front has its pause.
  avalon.read       := host.req && !host.write
  avalon.write      := host.req && host.write
  avalon.address    := host.addr >> log2Ceil(lanes)
  avalon.byteenable := host.be
  avalon.writedata  := host.wdata
  ends(host.req && !avalon.waitrequest, avalon.readdata)
}

class WishboneHost(lanes: Int) extends TestHost(lanes) {
  val wb   = IO(Flipped(new WishbonePins(lanes)))
  def pins = wb

  // A cycle that is longer than its access.
  wb.cyc   := host.req || now(0)
  wb.stb   := host.req
  wb.we    := host.write
  wb.adr   := host.addr >> log2Ceil(lanes)
  wb.sel   := host.be
  wb.dat_w := host.wdata
  assert(!wb.ack || (wb.cyc && wb.stb), "an answer that nobody has asked for")
  assert(wb.stall === !wb.ack, "a pipelined master would ask a second time")
  ends(wb.ack, wb.dat_r)
}

class AxiLiteHost extends TestHost(4) {
  val axi  = IO(Flipped(new AxiLitePins))
  def pins = axi

  // Channels of a write begin one after the other, in any order; answers are taken sooner or later.
  private val reads  = host.req && !host.write
  private val writes = host.req && host.write
  private def channel(wanted: Bool, i: Int, ready: Bool): (Bool, Bool) = {
    val valid = RegInit(false.B)
    val done  = RegInit(false.B)
    when(wanted && !done && now(i)) { valid := true.B }
    when(valid && ready) {
      valid := false.B
      done  := true.B
    }
    when(!wanted) { done := false.B }
    (valid, done)
  }
  private val (aw, awDone) = channel(writes, 1, axi.awready)
  private val (w, wDone)   = channel(writes, 2, axi.wready)
  private val (ar, arDone) = channel(reads, 3, axi.arready)
  axi.awvalid := aw
  axi.wvalid  := w
  axi.arvalid := ar
  axi.awaddr  := host.addr
  axi.araddr  := host.addr
  axi.awprot  := 0.U
  axi.arprot  := 0.U
  axi.wdata   := host.wdata
  axi.wstrb   := host.be
  axi.bready  := now(4) && awDone && wDone
  axi.rready  := now(5) && arDone
  assert(!axi.bvalid || (awDone && wDone), "an answer before its request")
  assert(!axi.rvalid || arDone, "an answer before its request")
  ends((axi.bvalid && axi.bready) || (axi.rvalid && axi.rready), axi.rdata)
}
