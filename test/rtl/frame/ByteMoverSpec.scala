package flyframe.frame

import chiseltest._
import org.scalatest.Assertions
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.SharedSimulation
import flyframe.fmmu.Mapped
import flyframe.model.FmmuModel

/** The bits of bytes that pass against the golden model's FMMU: which are read from where, and which local
  * bytes are written (FMMU-02, FMMU-04, FMMU-09, FMMU-10, B-47).
  */
class ByteMoverSpec extends AnyFlatSpec with SharedSimulation {
  private val random = new scala.util.Random(1)

  /** A local byte that is written: address, whether it may be, data and bits. */
  private case class Written(address: Int, may: Boolean, data: Int, mask: Int)

  private class Bench(dut: ByteMover) extends Assertions {
    private def step(): Unit = dut.clock.step()

    /** What the search finds for the byte at `logical`. */
    private def map(to: Mapped, f: FmmuModel, logical: Long, before: Boolean): Int = {
      val upward = if (f.physicalBit > f.startBit) 1 else 0
      val early  = logical == f.logicalStart - 1 && upward == 1
      to.hit.poke(f.covers(logical) || early)
      to.before.poke(before)
      for (bits <- to.bits) {
        bits.early.poke(early)
        bits.first.poke(logical == f.logicalStart)
        bits.last.poke(f.isLast(logical))
        bits.startBit.poke(f.startBit)
        bits.stopBit.poke(f.stopBit)
        bits.turn.poke((f.physicalBit - f.startBit) & 7)
      }
      (f.physicalStart + (logical - f.logicalStart).toInt + upward) & 0xffff
    }

    /** A datagram with `data` from the logical address `first` on, through one FMMU. */
    def datagram(f: FmmuModel, first: Long, data: Seq[Int]): Unit = {
      val hint    = s"$f, from $first, $data"
      val local   = Map.empty[Int, Int].withDefault(address => (address * 0x35 + 0x5a) & 0xff)
      val allowed = Set.from((0 to 0x40).map(f.physicalStart - 0x10 + _).filter(_ => random.nextInt(4) > 0))
      var written = Seq.empty[Written]
      def note(): Unit = if (dut.written.valid.peekBoolean()) {
        val w = dut.written.bits
        written :+= Written(
          w.address.peekInt().toInt,
          w.may.peekBoolean(),
          w.data.peekInt().toInt,
          w.mask.peekInt().toInt
        )
      }

      // A byte time: the byte before is written, this one is read. The byte before the datagram is one, too.
      for (i <- -1 to data.size) {
        dut.schedule.ends.poke(false)
        if (i >= 0) {
          val address = map(dut.writeTo, f, first + i - 1, before = i == 0)
          dut.address.poke(address)
          dut.may.poke(allowed(address))
          dut.isLast.poke(i == data.size)
          dut.passed.poke(if (i == 0) random.nextInt(256) else data(i - 1))
          dut.first.poke(true)
          note()
          step()
          dut.first.poke(false)
          dut.second.poke(true)
          note()
          step()
          dut.second.poke(false)
        }
        val from = map(dut.readFrom, f, first + i, before = i == -1)
        dut.readByte.poke(local(from))
        dut.isRead.poke(allowed(from))
        val parts =
          (if (i >= 0 && f.covers(first + i)) f.map(first + i) else Nil).filter(m => allowed(m.address))
        for (high <- Seq(false, true)) {
          dut.high.poke(high)
          dut.schedule.ends.poke(high)
          def half(byte: Int) = if (high) byte >> 4 else byte & 15
          if (i >= 0 && i < data.size) {
            val mask = dut.readMask.peekInt().toInt
            assert(mask == half(parts.map(_.mask).fold(0)(_ | _)), s"mask of byte $i, $high, $hint")
            val read = half(parts.map(m => m.toLogical(local(m.address))).fold(0)(_ | _))
            assert((dut.readNibble.peekInt().toInt & mask) == read, s"byte $i, $high, $hint")
          }
          step()
        }
      }

      // Each local byte once, with the bits of all bytes of the datagram.
      val bits = for {
        (byte, i) <- data.zipWithIndex if f.covers(first + i)
        m         <- f.map(first + i)
      } yield (m.address, m.toLocal(byte), m.toLocal(0xff))
      val expected = bits.groupBy(_._1).toSeq.sortBy(_._1).map { case (address, some) =>
        Written(address, allowed(address), some.map(_._2).reduce(_ | _), some.map(_._3).reduce(_ | _))
      }
      assert(written == expected, hint)
    }

    /** FMMUs with any bits; datagrams that begin and end before, in and behind them. */
    def run(count: Int, any: (Int, Int) => (Int, Int, Int)): Unit = for (_ <- 0 until count) {
      val length          = 1 + random.nextInt(5)
      val (low, high, to) = any(random.nextInt(8), random.nextInt(8))
      val f = FmmuModel(
        active = true,
        forReads = true,
        forWrites = true,
        logicalStart = 0x100,
        length = length,
        startBit = low,
        stopBit = high,
        physicalStart = 0x1000,
        physicalBit = to
      )
      datagram(
        f,
        0x100 - 3 + random.nextInt(length + 4),
        Seq.fill(1 + random.nextInt(8))(random.nextInt(256))
      )
    }
  }

  together("bits", new BitMover(isProtected = false))(
    "FMMU-09, FMMU-10, B-47: bits of any FMMU, read and written" -> { dut: BitMover =>
      new Bench(dut).run(600, (low, high) => (low, high, random.nextInt(8)))
    },
    "FMMU-02, FMMU-04: whole bytes through bits" -> { dut: BitMover =>
      new Bench(dut).run(100, (_, _) => (0, 7, 0))
    },
    "FMMU-09: bits that stay at their places" -> { dut: BitMover =>
      new Bench(dut).run(100, (low, high) => (low, high, low))
    }
  )

  // For whole bytes what is not mapped has no address, and may not be accessed.
  together("whole bytes", new WholeByteMover(isProtected = false))(
    "FMMU-02, FMMU-04: each byte is a local one" -> { dut: WholeByteMover =>
      for (_ <- 0 until 200) {
        val (byte, passed, address) = (random.nextInt(256), random.nextInt(256), random.nextInt(0x20000))
        val (isRead, may)           = (random.nextBoolean(), random.nextBoolean())
        dut.readByte.poke(byte)
        dut.isRead.poke(isRead)
        for (high <- Seq(false, true)) {
          dut.high.poke(high)
          assert(dut.readMask.peekInt() == (if (isRead) 15 else 0))
          assert(dut.readNibble.peekInt() == (if (high) byte >> 4 else byte & 15))
        }
        dut.passed.poke(passed)
        dut.address.poke(address)
        dut.may.poke(may)
        dut.first.poke(true)
        assert(!dut.written.valid.peekBoolean())
        dut.clock.step()
        dut.first.poke(false)
        dut.second.poke(true)
        assert(dut.written.valid.peekBoolean())
        assert(dut.written.bits.address.peekInt() == address)
        assert(dut.written.bits.may.peekBoolean() == may)
        assert(
          dut.written.bits.data.peekInt() == passed && dut.written.bits.mask.peekInt() == 0xff
        )
        dut.clock.step()
        dut.second.poke(false)
      }
    }
  )
}
