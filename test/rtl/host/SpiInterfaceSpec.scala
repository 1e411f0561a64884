package flyframe.host

import chisel3._
import chisel3.util._
import chiseltest._
import org.scalatest.Assertions
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.SharedSimulation
import flyframe.params.EscParams

/** The interface in front of a memory that takes its time, with what is at the port. */
class SpiUnderTest(p: EscParams, latency: Int) extends Module {
  private val interface = Module(new SpiInterface(p))
  private val memory    = Module(new PortMemory(p.lanes, latency))
  memory.port <> interface.port
  val pins = IO(new SpiPins)
  pins <> interface.spi
  val side = IO(new HostSide)
  side <> interface.side
  val access = IO(Output(Valid(new Bundle {
    val write   = Bool()
    val address = UInt(16.W)
  })))
  access.valid        := memory.port.ack
  access.bits.write   := memory.port.write
  access.bits.address := memory.port.addr
}

/** The host at the other end of the wires, and what it must find by B-115.
  *
  * @param wires
  *   makes accesses of bytes, and bytes of MISO
  */
class SpiMaster(dut: SpiUnderTest, p: EscParams) extends Assertions {
  val wires  = new SpiWires(p, dut.pins)
  val random = wires.random
  var log    = Vector.empty[(Boolean, Int)] // accesses at the port: write, address
  var errors = Vector.empty[Int]

  /** Bytes that are there, as far as they were written. */
  val content = scala.collection.mutable.Map.empty[Int, Int]

  def step(cycles: Int): Unit = for (_ <- 0 until cycles) {
    if (dut.access.valid.peekBoolean())
      log :+= ((dut.access.bits.write.peekBoolean(), dut.access.bits.address.peekInt().toInt))
    if (dut.side.error.valid.peekBoolean()) errors :+= dut.side.error.bits.peekInt().toInt
    dut.clock.step()
  }
  dut.side.events.poke(0)
  step(10)

  private def play(cycles: Seq[SpiCycle]): Unit = for (cycle <- cycles) {
    wires.drive(cycle)
    step(1)
  }

  /** One access: see [[SpiWires.access]]. */
  def transfer(sent: Seq[Int], cycles: Int = 4, bits: Int = 8, pause: Int => Int = _ => 0): Seq[Int] = {
    wires.forget()
    play(wires.access(sent, cycles, bits, pause))
    wires.bytes
  }
  def select(on: Boolean): Unit = wires.drive(wires.rest.copy(sel = on))

  /** Bits while `select` is as it is. */
  def bits(mosi: Seq[Boolean], selected: Boolean): Unit =
    play(mosi.flatMap(wires.bit(_, 4)).map(_.copy(sel = selected)))
  def byte(value: Int): Unit = bits((7 to 0 by -1).map(b => (value >> b & 1) == 1), selected = true)

  /** Reads bytes, as a host should. */
  def read(address: Int, count: Int, cycles: Int = 4, long: Boolean, pause: Boolean): Seq[Int] = {
    val asks = SpiWires.head(address, if (pause) 3 else 2, long) ++ (if (pause) Seq(0xff) else Nil)
    val data = Seq.fill(count - 1)(random.nextInt(0x80)) :+ 0xff
    transfer(asks ++ data, cycles, pause = i => if (i == asks.size - 1 && !pause) 40 else 0).drop(asks.size)
  }
  def write(address: Int, data: Seq[Int], cycles: Int = 4, long: Boolean): Unit = {
    transfer(SpiWires.head(address, 4, long) ++ data, cycles)
    for ((byte, i) <- data.zipWithIndex) content(address + i & 0xff) = byte
  }

  /** What an access does at the port, and how its errors are told (0x030E), if nothing comes too early. */
  def expected(sent: Seq[Int], bits: Int): (Seq[(Boolean, Int)], Option[Int]) = {
    val odd   = bits % 8
    val whole = if (odd == 0) sent else sent.init
    val long  = whole.size > 1 && (whole(1) & 7) == 6
    val size  = if (long) 3 else 2
    val last  = if (whole.size < 2) 0 else if (long && whole.size > 2) whole(2) >> 2 & 7 else whole(1) & 7
    val none  = (Nil, Option.when(odd != 0)(last >> 1 << 6 | odd))
    if (whole.size < size) none
    else {
      val upper      = if (long) whole(2) >> 5 << 13 else 0
      val address    = upper | whole(0) << 5 | whole(1) >> 3
      def at(i: Int) = address + i & 0xffff
      last match {
        case 2 | 3 =>
          val data       = sent.drop(size + (if (last == 3) 1 else 0)) // their first bits have come
          val terminated = data.indexWhere(_ >= 0x80)
          val fetched    = if (terminated < 0) data.size + 1 else terminated + 1
          val endless    = if (terminated < 0) 0x10 else 0
          val beyond     = if (terminated >= 0 && terminated < data.size - 1) 0x20 else 0
          val code       = odd | endless | beyond
          (Seq.tabulate(fetched)(i => (false, at(i))), Option.when(code != 0)(last >> 1 << 6 | code))
        case 4 => (Seq.tabulate(whole.size - size)(i => (true, at(i))), none._2)
        case _ => none
      }
    }
  }

  /** What has been found is forgotten, when all has happened. */
  def forget(): Unit = {
    step(40)
    log = Vector.empty
    errors = Vector.empty
  }
  def found: (Vector[(Boolean, Int)], Vector[Int]) = {
    step(40)
    (log, errors)
  }

  /** An access of any kind does what it should, and no more. */
  def check(sent: Seq[Int], bits: Int = 8, cycles: Int = 4): Unit = {
    forget()
    val asks = if (sent.size > 1 && (sent(1) & 7) == 6) 2 else 1
    transfer(sent, cycles, bits, i => if (i == asks) 40 else 0)
    val (accesses, error) = expected(sent, bits)
    assert(found == ((accesses.toVector, error.toVector)), s"$sent, $bits bits of the last byte")
    for (((write, address), byte) <- accesses.zip(sent.drop(if (asks == 2) 3 else 2)) if write)
      content(address & 0xff) = byte
  }

  /** All that was written can be read. */
  def verify(): Unit = {
    forget()
    for ((address, byte) <- content.toSeq.sorted)
      assert(read(address, 1, long = random.nextBoolean(), pause = random.nextBoolean()) == Seq(byte))
    assert(found._2.isEmpty)
  }
}

class SpiInterfaceSpec extends AnyFlatSpec with SharedSimulation {
  private val latency = 20

  for (mode <- 0 to 3; late <- 0 to 1) {
    val p = EscParams(
      hostInterface = 4,
      spiMode = mode,
      spiLateSample = late,
      spiSelHigh = late,
      dataBusWidth = Seq(8, 32, 16, 8)(mode)
    )
    def spi(name: String)(body: (SpiMaster, SpiUnderTest) => Unit): (String, SpiUnderTest => Any) =
      name -> (dut => body(new SpiMaster(dut, p), dut))

    together(s"mode $mode, late $late", new SpiUnderTest(p, latency))(
      spi("B-115: bytes are written and read, at any speed up to a quarter of the core clock") { (host, _) =>
        val random = host.random
        for (_ <- 0 until 30) {
          val cycles  = 4 + random.nextInt(8)
          val address = random.nextInt(0x100)
          val long    = random.nextBoolean()
          host.write(address, Seq.fill(1 + random.nextInt(9))(random.nextInt(0x100)), cycles, long)
          val known = host.content.keySet.toSeq.filter(a => host.content.contains(a + 1 & 0xff))
          for (a <- known.headOption.map(_ => known(random.nextInt(known.size)))) {
            val bytes = host.read(a, 2, cycles, random.nextBoolean(), random.nextBoolean())
            assert(bytes == Seq(host.content(a), host.content(a + 1 & 0xff)))
          }
        }
        host.verify()
        assert(host.found._2.isEmpty)
      },
      spi("B-115: the AL event request comes with address and command") { (host, dut) =>
        for (events <- Seq(0x000000, 0xffffff, 0x5aa596, 0x800001)) {
          dut.side.events.poke(events)
          host.step(4)
          val bytes = Seq(events & 0xff, events >> 8 & 0xff, events >> 16)
          assert(host.transfer(Seq(0, 0)) == bytes.take(2))
          assert(host.transfer(SpiWires.head(0x10, 0, long = true)) == bytes)
          assert(host.transfer(SpiWires.head(0x1234, 4, long = true) :+ 0x77).take(3) == bytes)
          assert(
            host.transfer(SpiWires.head(0x34, 3, long = false) ++ Seq(0xff, 0xff)).take(2) == bytes.take(2)
          )
        }
        assert(host.found._2.isEmpty)
      },
      spi("B-115: an access that is broken off does no more than it has said by then") { (host, _) =>
        val whole = Seq(
          SpiWires.head(0x1122, 4, long = true) ++ Seq(0x01, 0xfe),
          SpiWires.head(0x0133, 4, long = false) ++ Seq(0xfe, 0x01),
          SpiWires.head(0x2244, 2, long = true) ++ Seq(0x00, 0xff),
          SpiWires.head(0x0155, 3, long = false) ++ Seq(0xff, 0x00, 0xff)
        )
        for (sent <- whole; bytes <- 1 to sent.size; bits <- 1 to 8) host.check(sent.take(bytes), bits)
        host.verify()
      },
      spi("B-116: bytes behind the last one are counted, as is a read without one") { (host, _) =>
        host.check(SpiWires.head(0x10, 3, long = false) ++ Seq(0xff, 0x00, 0xff, 0x00))
        host.check(SpiWires.head(0x10, 2, long = false) ++ Seq(0xff, 0xff, 0xff))
        host.check(SpiWires.head(0x10, 2, long = false) ++ Seq(0x00, 0x00))
        host.check(SpiWires.head(0x10, 3, long = true))
        // The bit that is looked at is the first one.
        host.check(SpiWires.head(0x10, 2, long = false) ++ Seq(0x7f, 0x80))
        host.verify()
      },
      spi("B-116: a byte that is taken before it is there is counted") { (host, _) =>
        host.transfer(SpiWires.head(0x10, 2, long = false) ++ Seq(0xff))
        assert(host.found._2 == Seq(0x40 | 0x08))
        // One that comes just in time: later ones are right, and earlier ones counted.
        host.write(0x20, Seq(0xa5), long = false)
        val rights = (0 to 40).map { pause =>
          host.forget()
          val bytes =
            host.transfer(
              SpiWires.head(0x20, 2, long = false) ++ Seq(0xff),
              pause = i => if (i == 1) pause else 0
            )
          val errors = host.found._2
          if (errors.isEmpty) assert(bytes.last == 0xa5, s"after $pause cycles")
          else assert(errors == Seq(0x40 | 0x08))
          errors.isEmpty
        }
        assert(!rights.head && rights.last && rights == rights.sorted)
        host.verify()
      },
      spi("B-115: commands that there are not do nothing") { (host, _) =>
        for (command <- Seq(0, 1, 5, 7)) {
          host.check(SpiWires.head(0x10, command, long = false) ++ Seq(0, 0xff, 1))
          host.check(SpiWires.head(0x10, command, long = true) ++ Seq(0, 0xff, 1))
        }
        host.check(SpiWires.head(0x10, 6, long = true) ++ Seq(0, 0xff, 1))
      },
      spi("B-115: glitches of the select line, and a clock for others, do nothing") { (host, dut) =>
        host.write(0x30, Seq(0x12, 0x34), long = false)
        host.forget()
        for (cycles <- Seq(1, 1, 2, 3, 5, 9)) {
          host.select(true)
          host.step(cycles)
          host.select(false)
          host.step(6)
        }
        host.bits(Seq.fill(37)(host.random.nextBoolean()), selected = false)
        assert(host.found == ((Vector.empty, Vector.empty)))
        host.verify()
        // One in the middle of an access: what comes behind it has lost its place.
        host.forget()
        host.select(true)
        host.step(4)
        SpiWires.head(0x30, 4, long = false).foreach(host.byte)
        host.bits(Seq.fill(3)(true), selected = true)
        dut.pins.sel.poke(p.spiSelHigh == 0)
        dut.pins.miso_drive.expect(false)
        dut.pins.sel.poke(p.spiSelHigh == 1)
        host.bits(Seq.fill(5)(true), selected = true)
        host.select(false)
        assert(host.found == ((Vector.empty, Vector(0x80 | 5))))
        host.verify()
      },
      spi("B-115: whatever comes, a good access behind it is served") { (host, _) =>
        val random = host.random
        for (_ <- 0 until 150) {
          val long = random.nextBoolean()
          val sent = SpiWires.head(random.nextInt(0x10000), random.nextInt(8), long) ++
            Seq.fill(random.nextInt(5))(random.nextInt(0x100))
          host.check(sent.take(1 + random.nextInt(sent.size)), 1 + random.nextInt(8), 4 + random.nextInt(3))
        }
        host.verify()
      },
      spi("B-115: an access that a reset meets is over") { (host, dut) =>
        host.write(0x40, Seq(0x55), long = false)
        host.forget()
        host.select(true)
        host.step(4)
        SpiWires.head(0x40, 4, long = false).foreach(host.byte)
        dut.reset.poke(true.B)
        host.step(3)
        dut.reset.poke(false.B)
        host.bits(Seq.fill(16)(true), selected = true)
        host.select(false)
        assert(host.found == ((Vector.empty, Vector.empty)))
        host.verify()
      }
    )
  }
}
