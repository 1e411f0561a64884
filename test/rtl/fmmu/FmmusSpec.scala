package flyframe.fmmu

import chiseltest._
import org.scalatest.Assertions
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.SharedSimulation
import flyframe.params.EscParams

/** Which FMMU maps a logical byte, and where to: FMMU-01 to FMMU-05, B-45, B-46. */
class FmmusSpec extends AnyFlatSpec with SharedSimulation {
  private case class Entry(logical: Long, length: Int, physical: Int, typ: Int, active: Boolean = true) {
    def bytes: Seq[Int] = (0 until 4).map(i => (logical >> 8 * i & 0xff).toInt) ++
      Seq(
        length & 0xff,
        length >> 8,
        0x07,
        0x05,
        physical & 0xff,
        physical >> 8,
        0x03,
        typ,
        if (active) 1 else 0
      )
    def maps(byte: Long, direction: Int): Option[Int] =
      Option.when(active && (typ >> direction & 1) == 1 && byte >= logical && byte < logical + length)(
        physical + (byte - logical).toInt
      )
  }
  private val none = Entry(0, 0, 0, 0, active = false)

  private class Bench(dut: Fmmus, p: EscParams) extends Assertions {
    private val entries = Array.fill(p.fmmus)(none)
    dut.index.poke(7)
    dut.write.valid.poke(false)
    for (n <- 0 until p.fmmus) set(n, none)

    private def write(address: Int, bytes: Seq[Int]): Unit = {
      val word = address / p.lanes
      val lane = address % p.lanes
      dut.write.valid.poke(true)
      dut.write.bits.address.poke(word)
      dut.write.bits.mask.poke((1 << bytes.size) - 1 << lane)
      dut.write.bits.data.poke(bytes.zipWithIndex.map { case (b, i) => BigInt(b) << 8 * (i + lane) }.sum)
      dut.clock.step()
      dut.write.valid.poke(false)
    }

    /** Byte by byte, or in words, without a gap. */
    def set(n: Int, e: Entry, wide: Boolean = false): Unit = {
      val size = if (wide) p.lanes else 1
      for ((part, i) <- e.bytes.grouped(size).zipWithIndex) write(0x600 + 16 * n + size * i, part)
      entries(n) = e
      dut.clock.step(3)
    }
    def writeElsewhere(address: Int): Unit = write(address, Seq(0xff))

    /** What the search finds, read and write. */
    def search(byte: Long): Seq[Option[Int]] = {
      dut.behind.poke(byte + 1)
      for (i <- 0 until 8) { dut.index.poke(i); dut.clock.step() }
      dut.clock.step(2) // three cycles after the one of the last entry
      Seq(dut.read, dut.writes).map(m =>
        Option.when(m.hit.peek().litToBoolean)(m.address.peek().litValue.toInt)
      )
    }
    def check(byte: Long): Unit = if (byte >= 0 && byte <= 0xffffffffL) {
      val expected = Seq(0, 1).map(d => entries.toSeq.flatMap(_.maps(byte, d)).headOption)
      assert(search(byte) == expected, f"byte 0x$byte%x of ${entries.toSeq}")
    }
    def around(e: Entry): Unit =
      Seq(-1L, 0L, 1L, e.length / 2L, e.length - 1L, e.length.toLong).foreach(i => check(e.logical + i))
  }

  for (
    p <- Seq(
      EscParams(fmmus = 8),
      EscParams(fmmus = 3, dataBusWidth = 32),
      EscParams(fmmus = 12, dataBusWidth = 16),
      EscParams(fmmus = 16),
      EscParams(fmmus = 1)
    )
  ) {
    def check(name: String)(run: Bench => Unit): (String, Fmmus => Unit) =
      name -> (dut => run(new Bench(dut, p)))
    together(s"${p.fmmus} FMMUs, ${p.lanes}-byte words", new Fmmus(p))(
      check("FMMU-01, B-45: the ends of an FMMU, in every number, byte by byte and in words") { b =>
        for (n <- 0 until p.fmmus; wide <- Seq(false, true)) {
          val e = Entry(0x10000L * (n + 1) + 0x123, 17 + n, 0x1000 + 0x111 * n, 3)
          b.set(n, e, wide)
          b.around(e)
          b.set(n, none)
        }
      },
      check("FMMU-03: reads and writes by the type bits; inactive: neither") { b =>
        for (n <- Seq(0, p.fmmus - 1).distinct; typ <- 0 to 3; active <- Seq(true, false)) {
          val e = Entry(0x200, 4, 0x1100, typ, active)
          b.set(n, e)
          b.around(e)
          b.set(n, none)
        }
      },
      check("B-45: length 0 never matches, the longest does; no address wraps") { b =>
        for (
          e <- Seq(
            Entry(0x1000, 0, 0x1000, 3),
            Entry(0, 0xffff, 0x1000, 3),
            Entry(0xffff0000L, 0xffff, 0xff00, 3),
            Entry(0xfffffff0L, 0x20, 0xfff8, 3),
            Entry(0xffffffffL, 1, 0xffff, 3)
          )
        ) {
          b.set(0, e)
          b.around(e)
          for (byte <- Seq(0L, 1L, 0xfL, 0x10L, 0x1fL, 0x7fffffffL, 0x80000000L, 0xfffffffeL, 0xffffffffL))
            b.check(byte)
        }
      },
      check("FMMU-05: the lowest number wins, for reads and writes apart") { b =>
        for (n <- 0 until p.fmmus)
          b.set(n, Entry(0x1000 + 4 * (p.fmmus - n), 8, 0x1000 + 0x100 * n, n % 3 + 1))
        for (byte <- 0xffeL to 0x1050L) b.check(byte)
      },
      check("FMMU-01: neighbouring registers leave the table alone") { b =>
        val e = Entry(0x3000, 8, 0x1000, 3)
        for (n       <- 0 until p.fmmus) b.set(n, e.copy(logical = 0x3000 + 0x100 * n))
        for (address <- Seq(0x500, 0x50c, 0x5ff, 0x60d, 0x60e, 0x60f, 0x700, 0x70c, 0x800, 0xe00))
          b.writeElsewhere(address)
        for (n <- 0 until p.fmmus; i <- -1L to 8L) b.check(0x3000 + 0x100 * n + i)
      },
      check("FMMU-01 to FMMU-05: random") { b =>
        val random = new scala.util.Random(p.fmmus)
        for (_ <- 0 until 40) {
          for (_ <- 0 to random.nextInt(3))
            b.set(
              random.nextInt(p.fmmus),
              Entry(
                random.nextInt(0x60),
                random.nextInt(0x20),
                random.nextInt(0x10000),
                random.nextInt(4),
                random.nextInt(4) > 0
              ),
              random.nextBoolean()
            )
          for (_ <- 0 until 12) b.check(random.nextInt(0x80))
        }
      }
    )
  }
}
