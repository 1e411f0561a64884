package flyframe.host

import chisel3._
import chisel3.util._
import chisel3.util.random.LFSR
import chiseltest._
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.DirectSimulation
import flyframe.memory.HostPort
import flyframe.params.EscParams

/** A memory behind a host port, which answers sooner or later and asserts what the port demands: an access
  * stays as it is until it is done, and a cycle without one follows.
  *
  * @param latency
  *   cycles until it answers; 0: any number
  */
class PortMemory(lanes: Int, latency: Int = 0) extends Module {
  val port = IO(new HostPort(lanes))

  /** Accesses, and bytes of reads. */
  val accesses = IO(Output(UInt(16.W)))

  private val bytes  = Mem(256, UInt(8.W))
  private val random = LFSR(16)
  private val waited = RegInit(0.U(8.W))
  waited := Mux(port.req && !port.ack, waited + 1.U, 0.U)
  // As the controller's, its answer does not come in the cycle in which an access begins.
  private val done =
    port.req && waited =/= 0.U && (if (latency == 0) random(2, 0) === 0.U else waited === latency.U)
  private val place = (port.addr(7, 0) >> log2Ceil(lanes)) << log2Ceil(lanes)
  port.ack   := done
  port.rdata := Mux(done, VecInit((0 until lanes).map(i => bytes((place + i.U)(7, 0)))).asUInt, 0.U)
  for (i <- 0 until lanes)
    when(done && port.write && port.be(i)) { bytes((place + i.U)(7, 0)) := port.wdata(8 * i + 7, 8 * i) }
  private val count = RegInit(0.U(16.W))
  when(done) { count := count + 1.U }
  accesses := count

  private val asked = RegNext(port.req && !port.ack, false.B)
  assert(!RegNext(port.ack, false.B) || !port.req, "no cycle without an access")
  assert(!asked || port.req, "an access that is not held")
  for (field <- Seq(port.write, port.addr, port.be))
    assert(!asked || field.asUInt === RegNext(field.asUInt), "an access that changes")
  assert(!asked || !port.write || port.wdata === RegNext(port.wdata), "data that change")
}

/** An interface in front of a memory. */
class InterfaceUnderTest[I <: HostInterface](make: => I, lanes: Int) extends Module {
  private val interface = Module(make)
  private val memory    = Module(new PortMemory(lanes))
  memory.port <> interface.port
  interface.side.events := 0.U
  val error = IO(Output(Valid(UInt(16.W))))
  error := interface.side.error
  val pins = IO(chiselTypeOf(interface.pins))
  pins <> interface.pins
  val accesses = IO(Output(UInt(16.W)))
  accesses := memory.accesses
}

class HostInterfaceSpec extends AnyFlatSpec with ChiselScalatestTester {
  private val backend = Seq(DirectSimulation)
  private def word(i: Int, bits: Int): BigInt =
    BigInt("9e3779b97f4a7c15", 16) * (i + 1) >> 7 & (BigInt(1) << bits) - 1

  for (width <- Seq(8, 16, 32)) {
    val p     = EscParams(dataBusWidth = width)
    val count = 256 / p.lanes

    "B-114: Avalon-MM" should s"carry out accesses that follow each other at once, $width bits" in
      test(new InterfaceUnderTest(new AvalonInterface(p), p.lanes)).withAnnotations(backend) { dut =>
        val pins = dut.pins.asInstanceOf[AvalonPins]
        def access(write: Boolean, i: Int, data: BigInt, enable: Int): BigInt = {
          pins.read.poke(!write)
          pins.write.poke(write)
          pins.address.poke(i)
          pins.byteenable.poke(enable)
          pins.writedata.poke(data)
          var cycles = 0
          while (pins.waitrequest.peekBoolean()) {
            dut.clock.step()
            cycles += 1
            assert(cycles < 200)
          }
          val result = pins.readdata.peekInt()
          dut.clock.step()
          result
        }
        val all = (1 << p.lanes) - 1
        for (i <- 0 until count) access(write = true, i, word(i, width), all)
        for (i <- 0 until count) assert(access(write = false, i, 0, all) == word(i, width))
        // The first byte of each word alone.
        for (i <- 0 until count) access(write = true, i, ~word(i, width) & (BigInt(1) << width) - 1, 1)
        for (i <- 0 until count) assert(access(write = false, i, 0, all) == (word(i, width) ^ 0xff))
        pins.read.poke(false)
        pins.write.poke(false)
        for (_ <- 0 until 20) {
          dut.clock.step()
          pins.waitrequest.expect(true)
        }
        dut.accesses.expect(4 * count)
      }

    "B-116: Avalon-MM" should s"count an access that is withdrawn, and answer the next one, $width bits" in
      test(new InterfaceUnderTest(new AvalonInterface(p), p.lanes))
        .withAnnotations(backend) { dut =>
          val pins   = dut.pins.asInstanceOf[AvalonPins]
          val random = new scala.util.Random(1)
          val all    = (1 << p.lanes) - 1
          var codes  = Vector.empty[BigInt]
          def step(): Unit = {
            if (dut.error.valid.peekBoolean()) codes :+= dut.error.bits.peekInt()
            dut.clock.step()
          }
          def access(write: Boolean, i: Int, data: BigInt): BigInt = {
            pins.read.poke(!write)
            pins.write.poke(write)
            pins.address.poke(i)
            pins.byteenable.poke(all)
            pins.writedata.poke(data)
            var cycles = 0
            while (pins.waitrequest.peekBoolean()) {
              step()
              cycles += 1
              assert(cycles < 200)
            }
            val result = pins.readdata.peekInt()
            step()
            result
          }
          def none(): Unit = {
            pins.read.poke(false)
            pins.write.poke(false)
          }
          for (i <- 0 until count) access(write = true, i, word(i, width))
          none()
          step()
          var withdrawn = 0
          val content   = Array.tabulate(count)(word(_, width))
          for (i <- 0 until 100) {
            // What it asks for is that of its first cycle, whatever comes next.
            val write = random.nextBoolean()
            if (write) content(i % count) = word(i + count, width)
            pins.address.poke(i % count)
            pins.writedata.poke(content(i % count))
            pins.byteenable.poke(all)
            pins.read.poke(!write)
            pins.write.poke(write)
            var left = 1 + random.nextInt(3)
            while (left > 0 && pins.waitrequest.peekBoolean()) {
              step()
              left -= 1
            }
            if (left == 0 && pins.waitrequest.peekBoolean()) withdrawn += 1
            else step()
            none()
            for (_ <- 0 until 1 + random.nextInt(4)) {
              pins.waitrequest.expect(true)
              step()
            }
            val other = (i * 7 + 3) % count
            if (random.nextBoolean()) {
              content(other) = word(i, width)
              access(write = true, other, content(other))
            } else assert(access(write = false, other, 0) == content(other), "not what was withdrawn")
            none()
            step()
          }
          for (i <- 0 until count) assert(access(write = false, i, 0) == content(i))
          none()
          step()
          assert(withdrawn > 10 && codes == Vector.fill(withdrawn)(BigInt(2)))
          // Both at once: a write, and an error.
          codes = Vector.empty
          pins.address.poke(3)
          pins.writedata.poke(0x11)
          pins.read.poke(true)
          pins.write.poke(true)
          while (pins.waitrequest.peekBoolean()) step()
          step()
          none()
          step()
          assert(codes == Seq(BigInt(1)))
          assert(access(write = false, 3, 0) == BigInt(0x11))
        }

    "B-114: Wishbone" should s"carry out accesses that follow each other at once, $width bits" in
      test(new InterfaceUnderTest(new WishboneInterface(p), p.lanes)).withAnnotations(backend) { dut =>
        val pins = dut.pins.asInstanceOf[WishbonePins]
        def access(write: Boolean, i: Int, data: BigInt): BigInt = {
          pins.cyc.poke(true)
          pins.stb.poke(true)
          pins.we.poke(write)
          pins.adr.poke(i)
          pins.sel.poke((1 << p.lanes) - 1)
          pins.dat_w.poke(data)
          var cycles = 0
          while (!pins.ack.peekBoolean()) {
            pins.stall.expect(true)
            dut.clock.step()
            cycles += 1
            assert(cycles < 200)
          }
          pins.stall.expect(false)
          val result = pins.dat_r.peekInt()
          dut.clock.step()
          result
        }
        for (i <- 0 until count) access(write = true, i, word(i, width))
        for (i <- 0 until count) assert(access(write = false, i, 0) == word(i, width))
        // Half of the request is none.
        for ((cyc, stb) <- Seq((true, false), (false, true)); _ <- 0 until 20) {
          pins.cyc.poke(cyc)
          pins.stb.poke(stb)
          dut.clock.step()
          pins.ack.expect(false)
        }
        dut.accesses.expect(2 * count)
      }
  }

  "B-116: Wishbone" should "count an access that is withdrawn, and answer the next one" in {
    val p = EscParams()
    test(new InterfaceUnderTest(new WishboneInterface(p), p.lanes))
      .withAnnotations(backend) { dut =>
        val pins = dut.pins.asInstanceOf[WishbonePins]
        def access(write: Boolean, i: Int, data: Int, most: Int): Option[BigInt] = {
          pins.cyc.poke(true)
          pins.stb.poke(true)
          pins.we.poke(write)
          pins.adr.poke(i)
          pins.sel.poke(1)
          pins.dat_w.poke(data)
          var (cycles, errors) = (0, 0)
          def step(): Unit = {
            if (dut.error.valid.peekBoolean()) {
              dut.error.bits.expect(2)
              errors += 1
            }
            dut.clock.step()
          }
          while (!pins.ack.peekBoolean() && cycles < most) {
            step()
            cycles += 1
          }
          val result = Option.when(pins.ack.peekBoolean())(pins.dat_r.peekInt())
          if (result.isDefined) step()
          pins.stb.poke(false)
          step()
          assert(errors == (if (result.isEmpty) 1 else 0))
          result
        }
        for (i <- 0 until 64) assert(access(write = true, i, i ^ 0x5a, 200).isDefined)
        val answers = for (i <- 0 until 64) yield {
          val answer = access(write = false, i, 0, 1 + i % 5)
          assert(access(write = false, 63 - i, 0, 200).contains(BigInt((63 - i) ^ 0x5a)))
          answer.isDefined
        }
        assert(answers.contains(true) && answers.contains(false))
      }
  }

  private def axi(body: (InterfaceUnderTest[AxiLiteInterface], AxiLitePins) => Unit) = {
    val p = EscParams(dataBusWidth = 32)
    test(new InterfaceUnderTest(new AxiLiteInterface(p), p.lanes)).withAnnotations(backend) { dut =>
      val pins = dut.pins.asInstanceOf[AxiLitePins]
      for (valid <- Seq(pins.awvalid, pins.wvalid, pins.arvalid, pins.bready, pins.rready))
        valid.poke(false)
      body(dut, pins)
    }
  }

  "B-114: AXI4-Lite" should "carry out reads and writes that come at once in turns" in axi { (dut, pins) =>
    val random            = new scala.util.Random(1)
    val count             = 64
    var (aw, w, b)        = (0, 0, 0) // taken so far
    var (ar, r)           = (0, 0)
    var order             = Vector.empty[Char]
    def flip()            = random.nextBoolean()
    var (awOn, wOn, arOn) = (false, false, false)
    while (b < count || r < count) {
      // A valid that stands is not taken back.
      awOn = awOn || (aw < count && flip())
      wOn = wOn || (w < count && flip())
      arOn = arOn || (ar < count && flip())
      pins.awvalid.poke(awOn)
      pins.wvalid.poke(wOn)
      pins.arvalid.poke(arOn)
      pins.awaddr.poke(4 * (aw % 32))
      pins.wdata.poke(word(w, 32))
      pins.wstrb.poke(0xf)
      pins.araddr.poke(0x80 + 4 * (ar % 32)) // what nobody writes
      pins.bready.poke(flip())
      pins.rready.poke(flip())
      def both(valid: Bool, ready: Bool) = valid.peekBoolean() && ready.peekBoolean()
      val taken = Seq(
        both(pins.awvalid, pins.awready),
        both(pins.wvalid, pins.wready),
        both(pins.arvalid, pins.arready),
        both(pins.bvalid, pins.bready),
        both(pins.rvalid, pins.rready)
      )
      assert(taken(0) == taken(1))
      if (taken(4)) pins.rresp.expect(0)
      if (taken(3)) pins.bresp.expect(0)
      dut.clock.step()
      if (taken(0)) { aw += 1; awOn = false; order :+= 'w' }
      if (taken(1)) { w += 1; wOn = false }
      if (taken(2)) { ar += 1; arOn = false; order :+= 'r' }
      if (taken(3)) b += 1
      if (taken(4)) r += 1
      assert(b <= aw && r <= ar)
    }
    dut.accesses.expect(2 * count)
    // Neither waits for more than one of the other kind, as both want to go on most of the time.
    assert(!order.mkString.contains("wwwwww") && !order.mkString.contains("rrrrrr"), order.mkString)
  }

  it should "write the bytes that are strobed, and keep an answer until it is taken" in axi { (dut, pins) =>
    def write(address: Int, data: BigInt, strobes: Int): Unit = {
      pins.awaddr.poke(address)
      pins.wdata.poke(data)
      pins.wstrb.poke(strobes)
      pins.awvalid.poke(true)
      dut.clock.step(3)
      pins.awready.expect(false) // not without its data
      pins.wvalid.poke(true)
      while (!pins.wready.peekBoolean()) dut.clock.step()
      dut.clock.step()
      pins.awvalid.poke(false)
      pins.wvalid.poke(false)
      for (_ <- 0 until 10) {
        pins.bvalid.expect(true)
        dut.clock.step()
      }
      pins.bready.poke(true)
      dut.clock.step()
      pins.bready.poke(false)
      pins.bvalid.expect(false)
    }
    def read(address: Int): BigInt = {
      pins.araddr.poke(address)
      pins.arvalid.poke(true)
      while (!pins.arready.peekBoolean()) dut.clock.step()
      dut.clock.step()
      pins.araddr.poke(address ^ 0x40) // the next one waits for the answer to be taken
      for (_ <- 0 until 30) {
        pins.rvalid.expect(true)
        pins.arready.expect(false)
        dut.clock.step()
      }
      val data = pins.rdata.peekInt()
      pins.arvalid.poke(false)
      pins.rready.poke(true)
      dut.clock.step()
      pins.rready.poke(false)
      pins.rvalid.expect(false)
      data
    }
    for (strobes <- 0 to 0xf) {
      write(0x10, BigInt("01020304", 16), 0xf)
      write(0x10, BigInt("a1a2a3a4", 16), strobes)
      val expected =
        (0 to 3).map(i => BigInt((if ((strobes >> i & 1) == 1) 0xa4 - i else 4 - i)) << (8 * i)).sum
      assert(read(0x10) == expected)
    }
  }

  "B-116: AXI4-Lite" should "count what is withdrawn, and answer what comes behind" in axi { (dut, pins) =>
    var codes = Vector.empty[BigInt]
    def step(cycles: Int = 1): Unit = for (_ <- 0 until cycles) {
      if (dut.error.valid.peekBoolean()) codes :+= dut.error.bits.peekInt()
      dut.clock.step()
    }
    pins.bready.poke(true)
    pins.rready.poke(true)
    pins.wstrb.poke(0xf)
    // Addresses and data without the other one are never taken.
    for ((valid, code) <- Seq(pins.awvalid -> 1, pins.wvalid -> 2)) {
      codes = Vector.empty
      valid.poke(true)
      step(5)
      valid.poke(false)
      step(5)
      assert(codes == Seq(BigInt(code)))
    }
    dut.accesses.expect(0)
    for (i <- 0 until 40) {
      codes = Vector.empty
      pins.araddr.poke(4 * i)
      pins.arvalid.poke(true)
      val taken = pins.arready.peekBoolean()
      step()
      pins.arvalid.poke(false)
      step(2)
      assert(codes == (if (taken) Nil else Seq(BigInt(4))))
      // A write behind it is that write.
      pins.awaddr.poke(4 * i)
      pins.wdata.poke(i)
      pins.awvalid.poke(true)
      pins.wvalid.poke(true)
      while (!pins.awready.peekBoolean()) step()
      step()
      pins.awvalid.poke(false)
      pins.wvalid.poke(false)
      pins.bvalid.expect(true)
      step()
      pins.araddr.poke(4 * i)
      pins.arvalid.poke(true)
      while (!pins.arready.peekBoolean()) step()
      step()
      pins.arvalid.poke(false)
      pins.rvalid.expect(true)
      pins.rdata.expect(i)
      step()
    }
  }
}
