package flyframe.syncmanager

import chiseltest._
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.SharedSimulation

/** Rule B-51: to which SyncManager an address belongs. */
class AreaScanSpec extends AnyFlatSpec with SharedSimulation {
  private case class Area(index: Int, start: Int, length: Int, extent: Int, takesPart: Boolean = true)
  private case class Found(index: Int, first: Boolean, last: Boolean)

  private def expected(areas: Seq[Area], address: Int): Option[Found] = areas
    .find(a => a.takesPart && address >= a.start && address < a.start + a.extent)
    .map(a => Found(a.index, address == a.start, address == a.start + a.extent - 1))

  private def scan(dut: AreaScan, areas: Seq[Area], address: Int): Option[Found] = {
    dut.address.poke(address)
    for ((a, i) <- areas.zipWithIndex) {
      dut.entry.index.poke(a.index)
      dut.entry.start.poke(a.start)
      dut.entry.extent.poke(a.extent)
      dut.entry.takesPart.poke(a.takesPart)
      dut.entry.begins.poke(i == 0)
      dut.clock.step()
    }
    dut.entry.begins.poke(false)
    dut.entry.takesPart.poke(false)
    dut.clock.step() // the second of the two cycles; the first was that of the last entry
    val r = dut.result
    Option.when(r.hit.peekBoolean())(
      Found(
        r.index.peekInt().toInt,
        r.first.peekBoolean(),
        r.last.peekBoolean()
      )
    )
  }
  private def check(dut: AreaScan, areas: Seq[Area], addresses: Seq[Int]): Unit =
    for (address <- addresses; if address >= 0 && address <= 0xffff)
      assert(scan(dut, areas, address) == expected(areas, address), f"address 0x$address%04x in $areas")
  private def around(a: Area) =
    Seq(a.start - 1, a.start, a.start + 1, a.start + a.extent - 2, a.start + a.extent - 1, a.start + a.extent)

  together("scan", new AreaScan(3))(
    "B-51: the ends of an area" -> { dut: AreaScan =>
      for (
        length <- Seq(1, 2, 3, 0x100, 0xffff); start <- Seq(0, 1, 0x0fff, 0x1000, 0x8000, 0xfffe, 0xffff)
      ) {
        val a = Area(5, start, length, length)
        check(dut, Seq(a), around(a))
      }
    },
    "B-51: three buffers of a locked one, beyond the end of the address space too" -> { dut: AreaScan =>
      for (length <- Seq(1, 2, 0x1000, 0x5555, 0xffff); start <- Seq(0x1000, 0xff00)) {
        val a = Area(1, start, length, 3 * length)
        check(dut, Seq(a), around(a) ++ Seq(0, 0xfff, 0xffff))
      }
    },
    "B-51: length 0 and one that takes no part hold no address" -> { dut: AreaScan =>
      val areas = Seq(Area(0, 0x1000, 0, 0), Area(1, 0x1000, 16, 16, takesPart = false))
      check(dut, areas, 0xffe to 0x1011)
      assert(scan(dut, areas, 0x1000).isEmpty)
    },
    "B-51: addresses do not wrap" -> { dut: AreaScan =>
      val areas = Seq(Area(0, 0xfff0, 0x20, 0x20))
      assert(scan(dut, areas, 0x0000).isEmpty && scan(dut, areas, 0x000f).isEmpty)
      assert(scan(dut, areas, 0xffff).isDefined)
    },
    "B-51: the lowest number wins, wherever the others begin" -> { dut: AreaScan =>
      val areas = (0 until 8).map(i => Area(i, 0x1000 + 4 * (7 - i), 8, 8))
      check(dut, areas, 0xff0 to 0x1030)
    },
    "B-51: random areas, one scan after the other" -> { dut: AreaScan =>
      val random = new scala.util.Random(1)
      for (_ <- 0 until 300) {
        val areas = (0 until 8).map { i =>
          val length = random.nextInt(0x40)
          Area(
            i,
            0x1000 + random.nextInt(0x80),
            length,
            length * (if (random.nextInt(4) == 0) 3 else 1),
            random.nextInt(3) > 0
          )
        }
        check(dut, areas, Seq.fill(3)(0xff0 + random.nextInt(0x140)) ++ around(areas(random.nextInt(8))))
      }
    }
  )
}
