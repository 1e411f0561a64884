package flyframe.host

import chisel3._
import chisel3.util._
import chisel3.util.random.LFSR
import flyframe.lanes.Lanes
import flyframe.memory.HostPort
import flyframe.params.EscParams

/** What is at the pins of a host interface: makes accesses there of those that a test asks for at a
  * [[HostPort]], so that every test of a controller runs through every interface.
  */
object HostOf {
  def apply(p: EscParams, pins: Bundle, host: HostPort): Unit = pins match {
    case port: HostPort => port <> host
    case _: NoHostPins =>
      host.ack   := false.B
      host.rdata := 0.U
    case pins: AvalonPins          => connect(Module(new AvalonHost(host.be.getWidth)), pins, host)
    case pins: AxiLitePins         => connect(Module(new AxiLiteHost), pins, host)
    case pins: WishbonePins        => connect(Module(new WishboneHost(host.be.getWidth)), pins, host)
    case pins: SpiPins             => connect(Module(new SpiHost(p)), pins, host)
    case pins: MicrocontrollerPins => connect(Module(new MicrocontrollerHost(p)), pins, host)
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

/** Makes an access by SPI of each byte, with a clock of a quarter of the core's. What it could do in another
  * way it does at random.
  */
class SpiHost(p: EscParams) extends TestHost(p.lanes) {
  val spi  = IO(Flipped(new SpiPins))
  def pins = spi

  private object State extends ChiselEnum {

    /** What goes on: nothing; a byte's access is prepared; it is selected; a byte of it goes over the wires;
      * the pause behind that; the pause behind the access, as nothing tells that a byte has been written; on
      * to the next lane; all is done.
      */
    val rest, choose, lead, bits, gap, settle, next, end = Value
  }
  import State._
  private val state = RegInit(rest)
  private val count = Reg(UInt(7.W)) // cycles in that state
  private val last  = WireDefault(state)
  count := Mux(last === state, count + 1.U, 0.U)
  state := last
  private def after(cycles: Int, following: State.Type): Unit = when(count === (cycles - 1).U) {
    last := following
  }

  private val lane  = Reg(UInt(2.W))
  private val index = Reg(UInt(3.W)) // of the byte that is sent
  private val long  = Reg(Bool())    // the address has three bytes
  private val pause = Reg(Bool())
  private val in    = Reg(UInt(8.W))
  private val data  = Reg(UInt((8 * p.lanes).W))

  private val address  = (host.addr >> log2Ceil(p.lanes) << log2Ceil(p.lanes)).asUInt + lane
  private val isWanted = (host.be >> lane)(0)
  private val command  = Mux(host.write, 4.U(3.W), Mux(pause, 3.U(3.W), 2.U(3.W)))
  private val sent = VecInit(
    address(12, 5),
    Cat(address(4, 0), Mux(long, 6.U(3.W), command)),
    Cat(address(15, 13), command, 0.U(2.W)),
    0xff.U(8.W),
    Mux(host.write, Lanes.bytes(host.wdata, p.lanes)(Lanes.of(lane, p.lanes)), 0xff.U(8.W))
  )
  private val isSent = Seq(true.B, true.B, long, pause && !host.write, true.B)

  // A bit takes four cycles.
  private val pulse = (if (p.spiMode % 2 == 0) count(1) else !count(1)) && state === bits
  spi.sel  := RegNext((state === lead || state === bits || state === gap) === (p.spiSelHigh == 1).B)
  spi.clk  := RegNext(if (p.spiMode >= 2) !pulse else pulse)
  spi.mosi := RegNext(sent(index)(~count(4, 2)))
  private val samples = state === bits && count(1, 0) === 2.U
  when(if (p.spiLateSample == 1) RegNext(RegNext(samples)) else samples) { in := Cat(in(6, 0), spi.miso) }

  switch(state) {
    is(rest) {
      lane := 0.U
      data := 0.U
      when(host.req) { last := choose }
    }
    is(choose) {
      long  := address(15, 13).orR || now(0)
      pause := now(1)
      index := 0.U
      last  := Mux(isWanted, lead, next)
    }
    is(lead) { when(now(2)) { last := bits } }
    is(bits) { after(32, gap) }
    is(gap) {
      // Without a byte of pause the data of a read need time.
      val waits = !host.write && !pause && Mux(long, index === 2.U, index === 1.U)
      when(!waits || count === 100.U) {
        index := PriorityEncoder(isSent.zipWithIndex.map { case (is, i) => is && i.U > index })
        last  := Mux(index === 4.U, settle, bits)
      }
    }
    is(settle) { after(80, next) }
    is(next) {
      when(isWanted) {
        data := data | (in << (lane << 3)).asUInt
      }
      lane := lane + 1.U
      last := Mux(lane === (p.lanes - 1).U, end, choose)
    }
    is(end) { last := rest }
  }
  ends(state === end, data)
}

/** Makes an access of the microcontroller bus of each. Strobes and data come one after the other, in any
  * order that is allowed; behind its end a write needs time, as nothing tells that it is carried out.
  */
class MicrocontrollerHost(p: EscParams) extends TestHost(p.lanes) {
  val bus  = IO(Flipped(new MicrocontrollerPins(p.lanes)))
  def pins = bus

  private object State extends ChiselEnum {
    val rest, lead, strobe, settle, end = Value
  }
  import State._
  private val state = RegInit(rest)
  private val count = Reg(UInt(7.W))
  private val data  = Reg(UInt((8 * p.lanes).W))
  count := count + 1.U

  private val (level, drive) = (bus.busy, bus.busy_drive)
  private val waits = p.busBusyDriver match {
    case 0 => !level
    case 1 => drive && !level
    case 2 => level
    case _ => drive && level
  }
  switch(state) {
    is(rest) { when(host.req) { state := lead } }
    is(lead) {
      count := 0.U
      when(now(0)) { state := strobe }
    }
    is(strobe) {
      when(count > 8.U && !waits) {
        data  := bus.d_out
        state := settle
        count := 0.U
      }
    }
    is(settle) { when(count === 60.U) { state := end } }
    is(end) { state := rest }
  }
  private val strobes = state === strobe
  private val stands  = state === lead || strobes || RegNext(strobes)
  bus.cs_n := !RegNext(strobes, false.B)
  bus.wr_n := !RegNext(strobes && host.write, false.B)
  bus.rd   := RegNext(strobes && !host.write, false.B) === (p.busReadHigh == 1).B
  bus.be   := Fill(p.lanes, (p.busByteEnableHigh == 0).B) ^ Mux(stands, host.be, 0.U)
  bus.a    := Mux(stands, host.addr >> log2Ceil(p.lanes), 0.U)
  bus.d_in := Mux(stands && host.write, host.wdata, 0x5a.U)
  assert(
    bus.d_drive === RegNext(strobes && !host.write, false.B),
    "the data pins are driven by the wrong side"
  )
  ends(state === end, data)
}
