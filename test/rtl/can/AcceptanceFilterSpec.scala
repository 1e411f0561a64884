package flyframe.can

import chiseltest._
import flyframe.params.CanParams
import org.scalatest.flatspec.AnyFlatSpec
import scala.util.Random

class AcceptanceFilterSpec extends AnyFlatSpec with ChiselScalatestTester {
  private val p = CanParams(filters = 8)

  "CAN-43: the filters" should "find the lowest match, also if they must wait, or if an entry changes" in
    test(new AcceptanceFilter(p)) { dut =>
      val random  = new Random(1)
      val inUse   = CanFiltersModel.InUse
      val entries = Array.fill(2 * p.filters)(0L) // value, mask
      var matched = 0
      for (s <- Seq(dut.start, dut.hold, dut.ready)) s.poke(false)

      // Few bits differ, so that some match; a mask names the bits that count.
      def value() = 0x40000123L ^ (random.nextInt(16) << 8) | (if (random.nextInt(4) > 0) inUse else 0)
      def mask()  = 0xdfffffffL & ~Seq(0L, 0x300L, 0x100L, 0x40000000L)(random.nextInt(4))
      for (i <- entries.indices) entries(i) = if (i % 2 == 0) value() else mask()

      for (_ <- 1 to 400) {
        val identifier = 0x40000123L ^ (random.nextInt(16) << 8)
        dut.identifier.poke(identifier)
        dut.start.poke(true)
        dut.clock.step()
        dut.start.poke(false)
        var cycles = 0
        while (!dut.done.peekBoolean()) {
          val isReady = random.nextInt(3) > 0
          // The host changes an entry: nothing is read meanwhile.
          val holds = random.nextInt(20) == 0
          dut.hold.poke(holds)
          dut.ready.poke(isReady)
          val read = dut.read.valid.peekBoolean()
          assert(!holds || !read, "it reads while an entry changes")
          val at = dut.read.bits.peekInt().toInt
          dut.clock.step()
          dut.data.poke(if (read && isReady) entries(at) else random.nextLong(1L << 32))
          cycles += 1
          assert(cycles < 400, "it finds no end")
        }
        dut.hold.poke(false)
        val wanted = (0 until p.filters).find { n =>
          val (v, m) = (entries(2 * n), entries(2 * n + 1))
          (v & inUse) != 0 && ((v ^ identifier) & m) == 0
        }
        dut.matches.expect(wanted.nonEmpty)
        wanted.foreach(dut.entry.expect(_))
        matched += wanted.size
        entries(random.nextInt(entries.length) & ~1) = value()
      }
      assert(matched > 50 && matched < 390)
    }
}
