package flyframe.fmmu

import chisel3._
import chisel3.util._
import chiseltest._
import org.scalatest.Assertions
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.SharedSimulation
import flyframe.memory.{RegisterWrite, TableWrite}
import flyframe.params.EscParams

/** Which FMMU maps a logical byte, and where to: FMMU-01 to FMMU-05, FMMU-09, B-45, B-46, B-47. */
class FmmusSpec extends AnyFlatSpec with SharedSimulation {

  /** The FMMUs behind register writes. */
  private class FmmusUnderTest(p: EscParams) extends Module {
    private val fmmus = Module(new Fmmus(p))
    val write         = IO(Input(Valid(new RegisterWrite(p.lanes, p.hasBitWrites))))
    val search        = IO(Input(new FmmuSearch(hasOffset = false)))
    val slot          = IO(Input(UInt(2.W)))
    val read          = IO(Output(chiselTypeOf(fmmus.read)))
    val writes        = IO(Output(chiselTypeOf(fmmus.write)))
    fmmus.table     := TableWrite(write)
    fmmus.search    := search
    fmmus.readSlot  := slot
    fmmus.writeSlot := slot
    read            := fmmus.read
    writes          := fmmus.write
  }

  /** First and last bit of the logical area, first bit of the local one: without effect in whole bytes. */
  private case class Bits(start: Int, stop: Int, physical: Int)

  private case class Entry(
      logical: Long,
      length: Int,
      physical: Int,
      typ: Int,
      active: Boolean = true,
      bits: Bits = Bits(7, 5, 3)
  ) {
    def bytes: Seq[Int] = (0 until 4).map(i => (logical >> 8 * i & 0xff).toInt) ++
      Seq(
        length & 0xff,
        length >> 8,
        bits.start,
        bits.stop,
        physical & 0xff,
        physical >> 8,
        bits.physical,
        typ,
        if (active) 1 else 0
      )
    def maps(byte: Long, direction: Int): Option[Int] =
      Option.when(active && (typ >> direction & 1) == 1 && byte >= logical && byte < logical + length)(
        physical + (byte - logical).toInt
      )

    /** Where the bits of a logical byte lead, as address and bit: those of the area follow each other in
      * both.
      */
    def mapsBits(byte: Long, direction: Int): Map[Int, (Int, Int)] =
      if (maps(byte, direction).isEmpty) Map.empty
      else
        (0 until 8).flatMap { bit =>
          val order = 8 * (byte - logical).toInt + bit - bits.start
          val last  = 8 * (length - 1) + bits.stop - bits.start
          val place = 8 * physical + bits.physical + order
          Option.when(order >= 0 && order <= last)(bit -> (place / 8, place % 8))
        }.toMap
  }
  private val none = Entry(0, 0, 0, 0, active = false)

  private class Bench(dut: FmmusUnderTest, p: EscParams) extends Assertions {
    private val entries = Array.fill(p.fmmus)(none)
    private var slot    = 0
    dut.search.index.poke(7)
    dut.search.direct.poke(false)
    dut.search.before.poke(false)
    dut.search.past.poke(false)
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
      slot = (slot + 1) % 4
      dut.search.slot.poke(slot)
      dut.slot.poke(slot)
      dut.search.behind.poke(byte + 1)
      for (i <- 0 until 8) { dut.search.index.poke(i); dut.clock.step() }
      dut.clock.step(3) // four cycles after the last entry, and one for the answer
      Seq(dut.read, dut.writes).map(m => Option.when(m.hit.peekBoolean())(m.address.peekInt().toInt))
    }
    def check(byte: Long): Unit = if (byte >= 0 && byte <= 0xffffffffL) {
      val expected = Seq(0, 1).map(d => entries.toSeq.flatMap(_.maps(byte, d)).headOption)
      assert(search(byte) == expected, f"byte 0x$byte%x of ${entries.toSeq}")
    }

    /** The same bit by bit, from the byte before the first of all on. Of two areas of one direction, FMMU-08
      * wants three free bytes between them.
      */
    def checkBits(byte: Long): Unit = if (byte >= -1 && byte <= 0xffffffffL) {
      search(byte)
      for ((m, d) <- Seq(dut.read, dut.writes).zipWithIndex) {
        val hint  = f"byte 0x$byte%x, direction $d of ${entries.toSeq}"
        val hit   = m.hit.peekBoolean()
        val early = hit && m.bits.get.early.peekBoolean()
        val upper = m.address.peekInt().toInt
        val turn  = m.bits.get.turn.peekInt().toInt
        // Early: the byte before an area that begins in the upper one of two local bytes.
        val next = entries.toSeq.find(e =>
          e.active && (e.typ >> d & 1) == 1 && e.length > 0 && byte == e.logical - 1 &&
            e.bits.physical > e.bits.start
        )
        assert(early == next.isDefined && next.forall(_.physical == upper), hint)
        val from = if (m.bits.get.first.peekBoolean()) m.bits.get.startBit.peekInt().toInt else 0
        val to   = if (m.bits.get.last.peekBoolean()) m.bits.get.stopBit.peekInt().toInt else 7
        val mapped =
          if (!hit || early) Map.empty[Int, (Int, Int)]
          else
            (from to to).map { bit =>
              val below = turn != 0 && bit + turn < 8
              bit -> (if (below) upper - 1 else upper, (bit + turn) % 8)
            }.toMap
        assert(mapped == entries.toSeq.map(_.mapsBits(byte, d)).find(_.nonEmpty).getOrElse(Map.empty), hint)
      }
    }
    def aroundBits(e: Entry): Unit =
      Seq(-2L, -1L, 0L, 1L, e.length / 2L, e.length - 2L, e.length - 1L, e.length.toLong).distinct
        .foreach(i => checkBits(e.logical + i))
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
    def check(name: String)(run: Bench => Unit): (String, FmmusUnderTest => Unit) =
      name -> (dut => run(new Bench(dut, p)))
    together(s"${p.fmmus} FMMUs, ${p.lanes}-byte words", new FmmusUnderTest(p))(
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

  for (
    p <- Seq(
      EscParams(fmmus = 8, fmmuBitwise = 1),
      EscParams(fmmus = 16, fmmuBitwise = 1, dataBusWidth = 16),
      EscParams(fmmus = 3, fmmuBitwise = 1, dataBusWidth = 32, digitalOutputs = 4)
    )
  ) {
    def check(name: String)(run: Bench => Unit): (String, FmmusUnderTest => Unit) =
      name -> (dut => run(new Bench(dut, p)))
    def possible(e: Entry) = e.length > 1 || e.bits.stop >= e.bits.start
    together(s"${p.fmmus} bit-wise FMMUs, ${p.lanes}-byte words", new FmmusUnderTest(p))(
      check("FMMU-09, B-46, B-47: any first and last bit, from any bit of the local byte on") { b =>
        for (
          start <- 0 until 8; stop <- 0 until 8; physical <- 0 until 8; length <- Seq(1, 2, 5);
          n = (start + stop) % p.fmmus;
          e = Entry(0x1000, length, 0x1100, 3, bits = Bits(start, stop, physical)) if possible(e)
        ) {
          b.set(n, e, wide = physical % 2 == 0)
          b.aroundBits(e)
          b.set(n, none)
        }
      },
      check("FMMU-09: the ends of the address spaces, by type") { b =>
        for (
          logical <- Seq(0L, 0xfffffffaL); local <- Seq(1, 0xfff0, 0xfffc, 0xffff); typ <- 0 to 3;
          bits    <- Seq(Bits(0, 7, 0), Bits(3, 5, 1), Bits(2, 0, 7))
        ) {
          val e = Entry(logical, 6, local, typ, bits = bits)
          b.set(p.fmmus - 1, e)
          b.aroundBits(e)
        }
      },
      check("FMMU-09, B-45: the shortest and the longest, upward and downward") { b =>
        for (
          logical  <- Seq(0L, 0x1000L, 0xffff0001L); length <- Seq(0, 1, 0xffff); local <- Seq(0, 0x1100);
          physical <- Seq(0, 3, 7);
          e = Entry(logical, length, local, 3, bits = Bits(3, 5, physical)) if local > 0 || physical >= 3
        ) {
          b.set(0, e)
          b.aroundBits(e)
        }
      },
      check("FMMU-05, FMMU-08, FMMU-09: all of them, with three free bytes between, reads and writes apart") {
        b =>
          val random = new scala.util.Random(p.fmmus)
          for (_ <- 0 until 8) {
            for (n <- 0 until p.fmmus) {
              val length = 2 + random.nextInt(4)
              val bits   = Bits(random.nextInt(8), random.nextInt(8), random.nextInt(8))
              b.set(
                n,
                Entry(0x2000 + 8 * n, length, 0x1000 + 0x20 * n, n % 3 + 1, bits = bits),
                random.nextBoolean()
              )
            }
            for (byte <- 0x1ffcL until 0x2004L + 8 * p.fmmus) b.checkBits(byte)
          }
      }
    )
  }
}
