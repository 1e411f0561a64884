package flyframe.host

import org.scalatest.Assertions
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.{ControllerUnderTest, RtlBench, SharedSimulation, TestSets, Tier}
import flyframe.params.EscParams
import flyframe.rules.Steps

/** A controller whose host has SPI: accesses beside frames, at a quarter of the core clock. */
class SpiControllerSpec extends AnyFlatSpec with SharedSimulation {
  private val few  = TestSets.hosts.find(_.hostInterface == 4).get
  private val many = few.copy(preset = "spi-8", syncManagers = 8, spiMode = 0)
  private val clocked =
    few.copy(preset = "spi-clocks", clocks = 2, syncSignals = 2, latchSignals = 2, generalInputs = 0)
  private val wide   = few.copy(preset = "spi-32", dataBusWidth = 32)
  private val logged = few.copy(preset = "spi-log", fmmus = 8)
  private val most   = few.copy(preset = "spi-16", syncManagers = 16, spiMode = 1, spiLateSample = 1)

  private class Host(dut: ControllerUnderTest, p: EscParams) extends Assertions {
    private val wires   = new SpiWires(p, dut.hostPins.get.asInstanceOf[SpiPins])
    private var waiting = Iterator.empty[SpiCycle]
    val bench           = new RtlBench(dut, p)
    val bus             = new Steps(bench)
    val random          = wires.random

    /** Begins an access; it goes on while time passes. */
    def begin(sent: Seq[Int], cycles: Int = 4, bits: Int = 8, pause: Int => Int = _ => 0): Unit = {
      wires.forget()
      waiting = (wires.access(sent, cycles, bits, pause) ++ Seq.fill(60)(wires.rest)).iterator
      bench.eachCycle = Some(_ => waiting.nextOption().foreach(wires.drive))
    }

    /** The same of several, at a quarter of the core clock, after `delay` cycles. */
    def beginAll(delay: Int, accesses: Seq[Int]*): Unit = {
      wires.forget()
      val cycles = accesses.flatMap(wires.access(_, 4, 8))
      waiting = (Seq.fill(delay)(wires.rest) ++ cycles ++ Seq.fill(60)(wires.rest)).iterator
      bench.eachCycle = Some(_ => waiting.nextOption().foreach(wires.drive))
    }
    def finish(): Seq[Int] = {
      while (waiting.hasNext) bench.idle(1)
      bench.eachCycle = None
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

  together("spi-log", new ControllerUnderTest(logged, rawHost = true))(
    check(
      "B-115: what is written beside the longest register writes of frames lands whole, and there",
      logged
    ) { h =>
      val content = Array.fill(0x40)(0)
      h.write(0x1200, content.toSeq: _*)
      for (i <- 0 until 60) {
        val at         = h.random.nextInt(0x10)
        val (one, two) = (Seq.fill(16)(h.random.nextInt(0x100)), Seq.fill(16)(h.random.nextInt(0x100)))
        val second     = if (i % 2 == 0) h.writes(0x1220 + at, two) else h.reads(0x1220 + at, 16)
        one.zipWithIndex.foreach { case (byte, j) => content(at + j) = byte }
        if (i % 2 == 0) two.zipWithIndex.foreach { case (byte, j) => content(0x20 + at + j) = byte }
        // They are on their way when the frame has ended, and its writes take effect one by one.
        h.beginAll(700 + h.random.nextInt(700), h.writes(0x1200 + at, one), second)
        assert(h.bus.put(0x0600, Seq.fill(128)(0): _*))
        h.finish()
        assert(h.read(0x1200, 0x40) == content.toSeq, s"round $i")
        assert(h.errors == ((0, 0)))
      }
    }
  )

  together("spi-clocks", new ControllerUnderTest(clocked, rawHost = true))(
    check("B-115: times of the clocks are there 300 core cycles behind the command", clocked) { h =>
      def number(bytes: Seq[Int]): BigInt = bytes.foldRight(BigInt(0))((byte, above) => above << 8 | byte)
      def bytes(value: BigInt): Seq[Int]  = (0 until 8).map(i => (value >> (8 * i) & 0xff).toInt)
      // Pulses of SYNC0 every 10 us, so that the engine has to do.
      assert(h.bus.put(0x09a0, bytes(10000).take(4): _*))
      assert(h.bus.put(0x0990, bytes(number(h.bus.get(0x0910, 8).get) + 100000): _*) && h.bus.put(0x0981, 3))
      h.bench.idle(4000)
      assert(number(h.bus.get(0x0990, 8).get) > 0, "the next pulse")
      val times = Seq(0x0990, 0x0998, 0x09b0, 0x09b8, 0x09c0, 0x09c8).map(_ -> 8)
      val all   = Seq(0x0900 -> 16, 0x0910 -> 8, 0x0918 -> 16, 0x0928 -> 4, 0x092c -> 4, 0x0932 -> 2) ++ times
      var last  = number(h.bus.get(0x0910, 8).get)
      for (i <- 0 until 200) {
        val (at, count) = if (i % 2 == 0) 0x0910 -> 8 else all(h.random.nextInt(all.size))
        val sent        = SpiWires.head(at, 2, long = true) ++ Seq.fill(count - 1)(0) :+ 0xff
        h.begin(sent, pause = byte => if (byte == 2) 300 else 0)
        h.bench.idle(h.random.nextInt(110))
        if (h.random.nextBoolean()) h.bus.get(0x0910, 8) else h.bus.put(0x0910, 0, 0, 0, 0)
        val received = h.finish().drop(3)
        assert(h.errors == ((0, 0)), f"at 0x$at%04x, round $i: $received")
        if (at == 0x0910) {
          val time = number(received)
          assert(time > last && time - last < 100000, s"$received, the time before was $last")
          last = time
        }
      }
    }
  )

  // A quarter of the core clock, or less with many SyncManagers. In `make test` those with least time.
  for ((p, cycles) <- Seq(few -> 4, most -> 6) ++ (if (Tier.isSoak) Seq(wide -> 4, many -> 5) else Nil))
    together(p.preset, new ControllerUnderTest(p, rawHost = true))(
      check(s"B-115: accesses with 1/$cycles of the core clock do not wait, whatever the bus does", p) { h =>
        val random  = h.random
        val content = Array.fill(0x40)(0)
        val last    = p.syncManagers - 1 // is found last
        h.bus.syncManager(0, 0x1000, 16, 0x64)
        h.bus.syncManager(last, 0x1080, 16, 0x20)
        h.write(0x1200, content.toSeq: _*)
        var (sent, got) = (0, 0)
        var written     = false // there was a whole buffer of the host
        for (_ <- 0 until 1200) {
          val (sentBefore, gotBefore) = (sent, got)
          val at                      = random.nextInt(0x30)
          val count                   = 1 + random.nextInt(16)
          val kind                    = random.nextInt(6)
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
            case 5 => h.begin(h.writes(0x0204, Seq.fill(4)(random.nextInt(0x100))), cycles)
          }
          h.bench.idle(random.nextInt(40))
          random.nextInt(4) match {
            case 0 =>
              sent = (sent + 1) & 0xff
              assert(h.bus.put(0x1000, Seq.fill(16)(sent): _*))
            case 1 =>
              val bytes                = h.bus.get(0x1080, 16)
              def isWhole(b: Seq[Int]) = b.distinct.size == 1 && Seq(gotBefore, got).contains(b.head)
              assert(bytes.fold(!written)(isWhole), s"$bytes, written was $got, before that $gotBefore")
            case 2 => h.bus.put(0x0400, Seq.fill(0x28)(7): _*)
            case 3 => h.bus.get(0x0000, 32)
          }
          val bytes = h.finish()
          if (kind == 0) {
            assert(bytes.drop(4).distinct.size == 1, bytes)
            assert(
              Seq(sentBefore, sent).contains(bytes.last),
              s"$bytes, sent was $sent, before that $sentBefore"
            )
          }
          if (kind == 1) written = true
          if (kind == 2) assert(bytes.drop(4) == content.slice(at, at + count).toSeq)
          if (kind == 4) assert(bytes.drop(4).take(5) == Seq(0x00, 0x10, 16, 0, 0x64))
          assert(h.errors == ((0, 0)), s"kind $kind, $count bytes")
        }
      }
    )
}
