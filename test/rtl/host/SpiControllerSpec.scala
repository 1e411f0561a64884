package flyframe.host

import org.scalatest.Assertions
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.{ControllerUnderTest, RtlBench, SharedSimulation, TestSets}
import flyframe.params.EscParams
import flyframe.rules.Steps

/** A controller whose host has SPI: accesses beside frames, at a quarter of the core clock. */
class SpiControllerSpec extends AnyFlatSpec with SharedSimulation {
  private val few  = TestSets.hosts.find(_.hostInterface == 4).get
  private val many = few.copy(preset = "spi-8", syncManagers = 8, spiMode = 0)
  private val clocked =
    few.copy(preset = "spi-clocks", clocks = 2, syncSignals = 2, latchSignals = 2, generalInputs = 0)
  private val most = few.copy(preset = "spi-16", syncManagers = 16, spiMode = 1, spiLateSample = 1)

  private class Host(dut: ControllerUnderTest, p: EscParams) extends Assertions {
    private val wires   = new SpiWires(p, dut.hostPins.get.asInstanceOf[SpiPins])
    private var waiting = Iterator.empty[SpiCycle]
    val bench           = new RtlBench(dut, p)
    val bus             = new Steps(bench)
    val random          = wires.random
    bench.eachCycle = _ => waiting.nextOption().foreach(wires.drive)

    /** Begins an access; it goes on while time passes. */
    def begin(sent: Seq[Int], cycles: Int = 4, bits: Int = 8): Unit = {
      wires.forget()
      waiting = (wires.access(sent, cycles, bits) ++ Seq.fill(60)(wires.rest)).iterator
    }
    def finish(): Seq[Int] = {
      while (waiting.hasNext) bench.idle(1)
      wires.bytes
    }
    def transfer(sent: Seq[Int], bits: Int = 8): Seq[Int] = {
      begin(sent, bits = bits)
      finish()
    }
    def reads(address: Int, count: Int): Seq[Int] =
      SpiWires.head(address, 3, long = true) ++ Seq(0xff) ++ Seq.fill(count - 1)(0) :+ 0xff
    def writes(address: Int, data: Seq[Int]): Seq[Int] = SpiWires.head(address, 4, long = true) ++ data
    def read(address: Int, count: Int): Seq[Int]       = transfer(reads(address, count)).drop(4)
    def write(address: Int, data: Int*): Unit          = transfer(writes(address, data))

    /** Errors and the code of the last one, as the bus sees them. */
    def errors: (Int, Int) = {
      val bytes = bus.get(0x030d, 3).get
      (bytes.head, bytes(1) | bytes(2) << 8)
    }
  }
  private def check(name: String, p: EscParams = few)(run: Host => Unit) =
    name -> { dut: ControllerUnderTest => run(new Host(dut, p)) }

  together("spi", new ControllerUnderTest(few, rawHost = true))(
    check("ERR-11, B-116: errors are counted and told, and cleared together by the bus") { h =>
      assert(h.errors == ((0, 0)))
      h.transfer(SpiWires.head(0x1000, 4, long = true), bits = 3)
      assert(h.errors == ((1, 0xc0 | 3)))
      h.transfer(SpiWires.head(0x0010, 2, long = false) ++ Seq(0, 0))
      assert(h.errors == ((2, 0x40 | 0x18 & 0x10)) || h.errors == ((2, 0x58)))
      assert(h.read(0x030d, 1) == Seq(2) && h.errors._1 == 2, "the host reads it, too")
      h.write(0x030d, 0)
      assert(h.errors._1 == 2, "and does not write it")
      assert(h.bus.put(0x030d, 0))
      assert(h.errors == ((0, 0)))
      for (_ <- 0 until 260) h.transfer(Seq(0), bits = 1)
      assert(h.errors == ((0xff, 1)))
      assert(h.bus.put(0x030d, 0x55))
      assert(h.errors == ((0, 0)))
    },
    check("B-115: the AL event request is that of 0x0220") { h =>
      def seen: Seq[Int] = h.transfer(SpiWires.head(0, 0, long = true))
      h.bus.syncManager(0, 0x1000, 4, 0x26)
      h.read(0x0806, 1) // activation
      assert(seen == Seq(0, 0, 0))
      assert(h.bus.put(0x0120, 2))
      assert(seen == Seq(1, 0, 0) && h.read(0x0220, 3) == Seq(1, 0, 0))
      assert(h.bus.put(0x1000, 1, 2, 3, 4))
      assert(seen == Seq(1, 1, 0) && h.read(0x0220, 3) == Seq(1, 1, 0))
      h.read(0x0120, 1)
      assert(seen == Seq(0, 1, 0))
      assert(h.read(0x1000, 4) == Seq(1, 2, 3, 4))
      assert(seen == Seq(0, 0, 0))
      assert(h.errors == ((0, 0)))
    }
  )

  // A quarter of the core clock, or less with many SyncManagers.
  for ((p, cycles) <- Seq(clocked -> 10, few -> 4, many -> 5, most -> 6))
    together(p.preset, new ControllerUnderTest(p, rawHost = true))(
      check(s"B-115: accesses with 1/$cycles of the core clock do not wait, whatever the bus does", p) { h =>
        val random  = h.random
        val content = Array.fill(0x40)(0)
        val last    = p.syncManagers - 1 // is found last
        h.bus.syncManager(0, 0x1000, 16, 0x64)
        h.bus.syncManager(last, 0x1080, 16, 0x20)
        h.write(0x1200, content.toSeq: _*)
        var (sent, got) = (0, 0)
        for (_ <- 0 until 1200) {
          val at    = random.nextInt(0x30)
          val count = 1 + random.nextInt(16)
          val kind  = random.nextInt(if (p.hasClocks) 7 else 6)
          kind match {
            case 0 => h.begin(h.reads(0x1000, 16), cycles)
            case 1 =>
              got = (got + 1) & 0xff
              h.begin(h.writes(0x1080, Seq.fill(16)(got)), cycles)
            case 2 => h.begin(h.reads(0x1200 + at, count), cycles)
            case 3 =>
              val data = Seq.fill(count)(random.nextInt(0x100))
              data.zipWithIndex.foreach { case (byte, i) => content(at + i) = byte }
              h.begin(h.writes(0x1200 + at, data), cycles)
            case 4 => h.begin(h.reads(0x0800, 16), cycles)
            case 6 => h.begin(h.reads(0x0900 + 8 * random.nextInt(22), 8), cycles)
            case 5 => h.begin(h.writes(0x0204, Seq.fill(4)(random.nextInt(0x100))), cycles)
          }
          h.bench.idle(random.nextInt(40))
          random.nextInt(4) match {
            case 0 =>
              sent = (sent + 1) & 0xff
              assert(h.bus.put(0x1000, Seq.fill(16)(sent): _*))
            case 1 =>
              val bytes = h.bus.get(0x1080, 16)
              assert(bytes.forall(b => b.distinct.size == 1), "one buffer")
            case 2 => h.bus.put(0x0400, Seq.fill(0x28)(7): _*)
            case 3 => h.bus.get(0x0000, 32)
          }
          val bytes = h.finish()
          if (kind == 0) {
            assert(bytes.drop(4).distinct.size == 1, bytes)
          }
          if (kind == 2) assert(bytes.drop(4) == content.slice(at, at + count).toSeq)
          if (kind == 4) assert(bytes.drop(4).take(5) == Seq(0x00, 0x10, 16, 0, 0x64))
          assert(h.errors == ((0, 0)), s"kind $kind, $count bytes")
        }
      }
    )
}
