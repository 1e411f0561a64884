package flyframe.memory

import chisel3._
import chisel3.util._
import chiseltest._
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.SharedSimulation

/** The tables of FMMUs and SyncManagers: bytes are written in every cycle, words read meanwhile (FMMU-01,
  * SM-10).
  */
class WideTableSpec extends AnyFlatSpec with SharedSimulation {

  /** A table behind writes of registers in words of four bytes, of which it keeps the first ones. */
  private class TableUnderTest(entries: Int, bytes: Int, copies: Int) extends Module {
    private val table = Module(new WideTable(entries, Seq.fill(bytes)(8), copies))
    val write         = IO(Input(Bool()))
    val writeIndex    = IO(Input(chiselTypeOf(table.writeIndex)))
    val writeMask     = IO(Input(UInt(bytes.W)))
    val writeData     = IO(Input(UInt((8 * bytes).W)))
    val readIndex     = IO(Input(chiselTypeOf(table.readIndex)))
    val readData      = IO(Output(chiselTypeOf(table.readData)))

    private val written = Wire(Valid(new RegisterWrite(4, false)))
    written.valid        := write
    written.bits.address := writeIndex
    written.bits.mask    := writeMask
    written.bits.data    := writeData
    written.bits.bits    := DontCare
    private val gathered = TableWrite(written)
    table.write      := gathered.valid
    table.writeIndex := gathered.word
    table.writeMask  := gathered.mask
    table.writeData  := gathered.data(8 * bytes - 1, 0)
    table.readIndex  := readIndex
    readData         := table.readData
  }

  /** A word as it has been since a cycle: history of the model. */
  private class Bench(dut: TableUnderTest, entries: Int, bytes: Int, copies: Int) {
    private val random  = new scala.util.Random(entries * 16 + bytes)
    private val now     = Array.fill(entries)(BigInt(0)) // when all writes are done
    private var cycle   = 0L
    private var isKnown = false                          // RAM is undefined until it has been written

    /** For each word the last three values with the cycle they were given. */
    private val history                         = Array.fill(entries)(Vector((-9L, BigInt(0))))
    private var asked: Seq[(Int, Int, Boolean)] = Nil // port, index, taken over by a write

    def step(write: Option[(Int, Int, BigInt)], reads: Seq[Int]): Unit = {
      // Answers to the reads of the cycle before.
      for ((port, index, taken) <- asked if !taken && isKnown) {
        val found = dut.readData(port).peekInt()
        // A write takes effect two cycles later; what is read meanwhile is the old word or the new one.
        val (settled, fresh) = history(index).partition(_._1 < cycle - 3)
        val allowed          = settled.lastOption.map(_._2).toSeq ++ fresh.map(_._2)
        assert(allowed.contains(found), s"cycle $cycle, port $port, word $index: $found, not one of $allowed")
      }
      dut.write.poke(write.isDefined)
      for ((index, mask, data) <- write) {
        dut.writeIndex.poke(index)
        dut.writeMask.poke(mask)
        dut.writeData.poke(data)
        for (i <- 0 until bytes if (mask >> i & 1) == 1) {
          val ones = BigInt(0xff) << 8 * i
          now(index) = (now(index) &~ ones) | (data & ones)
        }
        history(index) = history(index).takeRight(8) :+ (cycle -> now(index))
      }
      for ((index, port) <- reads.zipWithIndex) dut.readIndex(port).poke(index)
      val writes = write.exists(_._2 != 0) // else it has been refused
      asked = reads.zipWithIndex.map { case (index, port) => (port, index, port == 0 && writes) }
      dut.clock.step()
      cycle += 1
    }
    private def anywhere        = random.nextInt(entries)
    private def reads: Seq[Int] = Seq.fill(copies)(anywhere)
    def someWrite(index: Int = anywhere) =
      Some((index, random.nextInt(1 << bytes), BigInt(8 * bytes, random)))
    def clear(): Unit = {
      for (i <- 0 until entries) step(Some((i, (1 << bytes) - 1, BigInt(0))), Seq.fill(copies)(i))
      for (_ <- 0 until 4) step(None, reads)
      isKnown = true
    }

    def verify(): Unit = {
      for (_ <- 0 until 3) step(None, reads)
      for (i <- 0 until entries; _ <- 0 to 1) {
        step(None, Seq.fill(copies)(i))
        for (port <- 0 until copies)
          assert(dut.readData(port).peekInt() == now(i), s"word $i, port $port")
      }
    }

    /** Writes with the given probability, to any word or mostly to the same. */
    def traffic(cycles: Int, density: Double, change: Double): Unit = {
      var index = anywhere
      for (_ <- 0 until cycles) {
        if (random.nextDouble() < change) index = anywhere
        step(if (random.nextDouble() < density) someWrite(index) else None, reads)
      }
      verify()
    }
  }

  for ((entries, bytes, copies) <- Seq((8, 4, 2), (1, 4, 1), (3, 4, 1), (5, 2, 2))) {
    def check(name: String)(run: Bench => Unit): (String, TableUnderTest => Unit) = name -> { dut =>
      val b = new Bench(dut, entries, bytes, copies)
      b.clear()
      run(b)
    }
    together(s"$entries words of $bytes bytes, $copies copies", new TableUnderTest(entries, bytes, copies))(
      check("FMMU-01, SM-10: byte by byte, one write per cycle, ascending") { b =>
        for (i <- 0 until entries; byte <- 0 until bytes)
          b.step(Some((i, 1 << byte, BigInt(0x11 * (i + byte + 1)) << 8 * byte)), Seq.fill(copies)(0))
        b.verify()
      },
      check("FMMU-01, SM-10: the same byte twice, and its neighbour, without a gap") { b =>
        for (gap <- 0 to 3) {
          for (mask <- Seq(1, 1, 2, 1)) {
            b.step(b.someWrite(0).map { case (i, _, data) => (i, mask, data) }, Seq.fill(copies)(0))
            for (_ <- 0 until gap) b.step(None, Seq.fill(copies)(0))
          }
          b.verify()
        }
      },
      check("FMMU-01, SM-10: alternating words without a gap") { b =>
        for (n <- 0 until 40) b.step(b.someWrite(n % (2 min entries)), Seq.fill(copies)(0))
        b.verify()
      },
      check("FMMU-01, SM-10: random writes in every cycle, reading meanwhile") { b =>
        b.traffic(2000, 1.0, 1.0)
        b.traffic(1000, 1.0, 0.3)
      },
      check("FMMU-01, SM-10: random writes with gaps, reading meanwhile") { b =>
        b.traffic(1000, 0.5, 0.5)
        b.traffic(1000, 0.1, 0.5)
      }
    )
  }
}
