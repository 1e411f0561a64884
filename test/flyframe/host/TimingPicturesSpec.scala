package flyframe.host

import java.nio.file.{Files, Paths}
import scala.collection.mutable.ArrayBuffer
import chisel3._
import chiseltest._
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.{ControllerUnderTest, RtlBench, Simulation}
import flyframe.params.{EscParams, Presets}
import flyframe.report.{TimingPicture, Wave}

/** The pictures of docs/hosts.md are recordings of what is done here: a write to the process data RAM of a
  * controller, and its read, at the pins of each host interface. `make pictures` writes them.
  */
class TimingPicturesSpec extends AnyFlatSpec with ChiselScalatestTester {
  private val writes  = sys.env.contains("FLYFRAME_PICTURES")
  private val Address = 0x1000

  /** Notes the pins in each core cycle, when they have settled. */
  private class Recorder(dut: ControllerUnderTest, pins: Seq[(String, Data)], driven: Map[String, Bool]) {
    private val values = pins.map(_ => ArrayBuffer.empty[BigInt])
    private val drives = pins.map(_ => ArrayBuffer.empty[Boolean])
    def cycle(): Unit = {
      for (((name, pin), i) <- pins.zipWithIndex) {
        values(i) += pin.asInstanceOf[Bits].peek().litValue
        drives(i) += driven.get(name).forall(_.peekBoolean())
      }
      dut.clock.step()
    }
    def cycles(n: Int): Unit = for (_ <- 0 until n) cycle()
    def until(what: => Boolean): Unit = {
      var waited = 0
      while (!what) {
        cycle()
        waited += 1
        assert(waited < 200)
      }
    }
    def waves: Seq[Wave] = pins.zipWithIndex.map { case ((name, pin), i) =>
      Wave(name, pin.getWidth, values(i).toSeq, if (driven.contains(name)) drives(i).toSeq else Nil)
    }
  }

  private def picture(
      name: String,
      title: String,
      interface: Int,
      change: EscParams => EscParams = identity
  )(record: (ControllerUnderTest, EscParams, Bundle) => Recorder): Unit =
    s"Picture docs/hosts/$name.svg" should "show what a controller does" in {
      val preset = Presets.named("cyclone4-min").get.params
      val p      = change(preset.copy(hostInterface = interface))
      test(new ControllerUnderTest(p, rawHost = true)).withAnnotations(Simulation.annotations(this, name)) {
        dut =>
          val bench = new RtlBench(dut, p)
          bench.idle(20)
          val recorder = record(dut, p, dut.hostPins.get)
          val mhz      = p.coreClockMhz
          val text     = TimingPicture(name, s"$title; core clock $mhz MHz", 1000.0 / mhz, recorder.waves)
          val file     = Paths.get(s"docs/hosts/$name.svg")
          if (writes) Files.writeString(file, text)
          assert(Files.readString(file) == text, "make pictures")
      }
    }

  picture("avalon", "Avalon-MM, 8 bits: write of 0xa5 to 0x1000, and its read", 1) { (dut, _, bundle) =>
    val pins = bundle.asInstanceOf[AvalonPins]
    val all = Seq(
      "address"     -> pins.address,
      "write"       -> pins.write,
      "read"        -> pins.read,
      "byteenable"  -> pins.byteenable,
      "writedata"   -> pins.writedata,
      "waitrequest" -> pins.waitrequest,
      "readdata"    -> pins.readdata
    )
    val r = new Recorder(dut, all, Map.empty)
    r.cycles(2)
    pins.address.poke(Address)
    pins.byteenable.poke(1)
    pins.writedata.poke(0xa5)
    pins.write.poke(true)
    r.until(!pins.waitrequest.peekBoolean())
    r.cycle()
    pins.write.poke(false)
    pins.writedata.poke(0)
    pins.read.poke(true)
    r.until(!pins.waitrequest.peekBoolean())
    pins.readdata.expect(0xa5)
    r.cycle()
    pins.read.poke(false)
    r.cycles(2)
    r
  }

  picture("wishbone", "Wishbone B4, 8 bits: write of 0xa5 to 0x1000, and its read", 3) { (dut, _, bundle) =>
    val pins = bundle.asInstanceOf[WishbonePins]
    val all = Seq(
      "cyc"   -> pins.cyc,
      "stb"   -> pins.stb,
      "we"    -> pins.we,
      "adr"   -> pins.adr,
      "sel"   -> pins.sel,
      "dat_w" -> pins.dat_w,
      "stall" -> pins.stall,
      "ack"   -> pins.ack,
      "dat_r" -> pins.dat_r
    )
    val r = new Recorder(dut, all, Map.empty)
    def strobe(on: Boolean): Unit = {
      pins.cyc.poke(on)
      pins.stb.poke(on)
    }
    r.cycles(2)
    for (write <- Seq(true, false)) {
      strobe(true)
      pins.we.poke(write)
      pins.adr.poke(Address)
      pins.sel.poke(1)
      pins.dat_w.poke(if (write) 0xa5 else 0)
      r.until(pins.ack.peekBoolean())
      if (!write) pins.dat_r.expect(0xa5)
      r.cycle()
      strobe(false)
      pins.we.poke(false)
      r.cycles(2)
    }
    r
  }

  private def axi(p: EscParams) = p.copy(dataBusWidth = 32)
  picture("axi", "AXI4-Lite: write of 0x600df00d to 0x1000, and its read", 2, axi) { (dut, _, bundle) =>
    val pins = bundle.asInstanceOf[AxiLitePins]
    val all = Seq(
      "awvalid" -> pins.awvalid,
      "awready" -> pins.awready,
      "awaddr"  -> pins.awaddr,
      "wvalid"  -> pins.wvalid,
      "wready"  -> pins.wready,
      "wdata"   -> pins.wdata,
      "wstrb"   -> pins.wstrb,
      "bvalid"  -> pins.bvalid,
      "bready"  -> pins.bready,
      "arvalid" -> pins.arvalid,
      "arready" -> pins.arready,
      "araddr"  -> pins.araddr,
      "rvalid"  -> pins.rvalid,
      "rready"  -> pins.rready,
      "rdata"   -> pins.rdata
    )
    val r    = new Recorder(dut, all, Map.empty)
    val data = BigInt("600df00d", 16)
    pins.bready.poke(true)
    pins.rready.poke(true)
    r.cycles(2)
    pins.awaddr.poke(Address)
    pins.wdata.poke(data)
    pins.wstrb.poke(15)
    pins.awvalid.poke(true)
    pins.wvalid.poke(true)
    r.until(pins.awready.peekBoolean() && pins.wready.peekBoolean())
    r.cycle()
    pins.awvalid.poke(false)
    pins.wvalid.poke(false)
    r.until(pins.bvalid.peekBoolean())
    r.cycle()
    pins.araddr.poke(Address)
    pins.arvalid.poke(true)
    r.until(pins.arready.peekBoolean())
    r.cycle()
    pins.arvalid.poke(false)
    r.until(pins.rvalid.peekBoolean())
    pins.rdata.expect(data)
    r.cycles(3)
    r
  }

  private val bus = "Microcontroller bus, 8 bits, a write carried out as it ends: write of 0xa5 to 0x1000, " +
    "and its read"
  picture("bus", bus, 5) { (dut, p, bundle) =>
    val pins = bundle.asInstanceOf[MicrocontrollerPins]
    val all = Seq(
      "cs_n"  -> pins.cs_n,
      "wr_n"  -> pins.wr_n,
      "rd"    -> pins.rd,
      "be"    -> pins.be,
      "a"     -> pins.a,
      "d_in"  -> pins.d_in,
      "d_out" -> pins.d_out,
      "busy"  -> pins.busy
    )
    val r                   = new Recorder(dut, all, Map("d_out" -> pins.d_drive, "busy" -> pins.busy_drive))
    def isBusy              = pins.busy_drive.peekBoolean() && !pins.busy.peekBoolean()
    def reads(on: Boolean)  = pins.rd.poke(on == (p.busReadHigh == 1))
    def enable(on: Boolean) = pins.be.poke(if (on == (p.busByteEnableHigh == 1)) 1 else 0)
    def rest(): Unit = {
      pins.cs_n.poke(true)
      pins.wr_n.poke(true)
      reads(false)
      enable(false)
    }
    rest()
    r.cycles(4)
    pins.cs_n.poke(false)
    pins.a.poke(Address)
    enable(true)
    r.cycles(3)
    pins.d_in.poke(0xa5)
    pins.wr_n.poke(false)
    r.cycles(6)
    rest()
    r.cycles(3)
    pins.d_in.poke(0)
    pins.cs_n.poke(false)
    enable(true)
    r.cycles(4)
    r.until(!isBusy)
    reads(true)
    r.cycles(4)
    r.until(!isBusy)
    pins.d_out.expect(0xa5)
    r.cycles(3)
    rest()
    r.cycles(4)
    r
  }

  private val spi =
    "SPI, mode 3, a clock of a quarter: write of 0xa5 to 0x1000, and its read with a byte of pause"
  picture("spi", spi, 4, _.copy(spiMode = 3)) { (dut, p, bundle) =>
    val pins  = bundle.asInstanceOf[SpiPins]
    val wires = new SpiWires(p, pins)
    val all   = Seq("sel" -> pins.sel, "clk" -> pins.clk, "mosi" -> pins.mosi, "miso" -> pins.miso)
    val r     = new Recorder(dut, all, Map("miso" -> pins.miso_drive))
    def access(sent: Int*): Seq[Int] = {
      wires.forget()
      for (cycle <- wires.access(sent, 4)) {
        wires.drive(cycle)
        r.cycle()
      }
      wires.bytes
    }
    r.cycles(4)
    access(SpiWires.head(Address, 4, long = false) :+ 0xa5: _*)
    r.cycles(40)
    assert(access(SpiWires.head(Address, 3, long = false) ++ Seq(0xff, 0xff): _*).last == 0xa5)
    r
  }
}
