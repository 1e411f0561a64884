package flyframe.master

import scala.util.Random
import chisel3._
import chiseltest._
import flyframe.SharedSimulation
import org.scalatest.flatspec.AnyFlatSpec

class EventMemorySpec extends AnyFlatSpec with SharedSimulation {
  private def is(b: Bool) = b.peekBoolean()

  private class Driver(dut: EventMemory, random: Random) {
    private var time = BigInt(63, random)

    /** Events with their times, and the number of the first one. */
    var kept  = Vector.empty[(Seq[Int], BigInt)]
    var first = 0
    for (e <- dut.event) e.valid.poke(false)
    dut.remove.valid.poke(false)

    /** A cycle; the time moves on, but not while it is read. */
    def step(): Unit = {
      if (!is(dut.stamps)) time += random.nextInt(3) * BigInt(32, random)
      dut.now.poke((time >> (16 * (3 - dut.timeAddress.peekInt().toInt)) & 0xffff).U)
      dut.clock.step()
    }

    /** Offers an event, which may be taken with pauses between its words. */
    def put(source: Int): Unit = {
      val words = Seq.fill(8)(random.nextInt(0x10000))
      for (word <- words) {
        for (_ <- 1 to random.nextInt(3)) step()
        dut.event(source).valid.poke(true)
        dut.event(source).bits.poke(word)
        while (!is(dut.event(source).ready)) step()
        step()
        dut.event(source).valid.poke(false)
      }
      while (!is(dut.stored)) step()
      kept :+= words -> time
      step()
    }
    def remove(count: Int): Unit = {
      dut.remove.valid.poke(true)
      dut.remove.bits.poke(count)
      step()
      dut.remove.valid.poke(false)
      kept = kept.drop(count)
      first += count
    }
    def check(): Unit = {
      assert(dut.first.peekInt() == first && dut.count.peekInt() == kept.size)
      assert(dut.next.peekInt() == ((first + kept.size) & 0xffff))
      assert(is(dut.roomForRecords) == kept.size < 120 && is(dut.roomForStates) == kept.size < 64)
      for (((words, stamp), i) <- kept.take(32).zipWithIndex; byte <- 0 until 24) {
        dut.readEvent.poke(i)
        dut.readByte.poke(byte)
        step()
        val wanted =
          if (byte < 16) words(byte / 2) >> (8 * (1 - byte % 2)) & 0xff
          else (stamp >> (8 * (23 - byte)) & 0xff).toInt
        assert(dut.readData.peekInt() == wanted, s"byte $byte of event ${first + i}")
      }
    }
  }

  together("memory", new EventMemory)(
    "REP-02: events and their times are kept as they came, until the server has them" -> { dut =>
      val random = new Random(1)
      val d      = new Driver(dut, random)
      d.check()
      for (_ <- 1 to 60) {
        for (_ <- 1 to random.nextInt(20) if d.kept.size < 128) d.put(random.nextInt(2))
        d.check()
        if (random.nextInt(4) > 0) d.remove(random.nextInt(d.kept.size + 1))
        d.check()
      }
      assert(d.first > 256)
    },
    "REP-06: 128 events are kept; more of them wait, and lose nothing" -> { dut =>
      val random = new Random(2)
      val d      = new Driver(dut, random)
      for (_ <- 1 to 128) d.put(0)
      dut.event(1).valid.poke(true)
      for (_ <- 1 to 50) {
        assert(!is(dut.event(1).ready) && !is(dut.stored))
        d.step()
      }
      dut.event(1).valid.poke(false)
      d.check()
      d.remove(1)
      d.put(1)
      d.check()
    },
    "REP-06: it is full from 64 events on, until there are fewer than 32" -> { dut =>
      val d = new Driver(dut, new Random(3))
      for (i <- 1 to 70) {
        d.put(0)
        d.step()
        assert(is(dut.full) == i >= 64)
      }
      for (i <- 69 to 0 by -1) {
        d.remove(1)
        d.step()
        assert(is(dut.full) == i >= 32)
      }
      for (i <- 1 to 70) {
        d.put(0)
        d.step()
        assert(is(dut.full) == i >= 64)
      }
    },
    "REP-02: events of both sources come whole, those of the first source first" -> { dut =>
      val d = new Driver(dut, new Random(4))
      for (e <- dut.event) e.valid.poke(true)
      dut.event(0).bits.poke(0x1111)
      dut.event(1).bits.poke(0x2222)
      for (n <- 0 until 2) {
        while (!is(dut.stored)) d.step()
        if (n == 0) dut.event(0).valid.poke(false)
        d.step()
      }
      dut.event(1).valid.poke(false)
      for (n <- 0 to 1; byte <- 0 until 16) {
        dut.readEvent.poke(n)
        dut.readByte.poke(byte)
        d.step()
        assert(dut.readData.peekInt() == (if (n == 0) 0x11 else 0x22))
      }
    }
  )
}
