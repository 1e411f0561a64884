package flyframe.master

import chisel3._
import chiseltest._
import flyframe.SharedSimulation
import flyframe.master.TimedLine.started
import flyframe.protocol.Command.{Aprd, Apwr, Bwr}
import flyframe.protocol.DetectorState.{Alarm, Normal, Open}
import org.scalatest.flatspec.AnyFlatSpec

/** The line master with a ring of modelled slaves. */
class RingSpec extends AnyFlatSpec with SharedSimulation {
  private val Slaves = 6
  private def bench(dut: LineMaster, clocks: Int = 1): LineBench = {
    val slaves = Seq.tabulate(Slaves)(i => started(i + 1))
    val b = new LineBench(dut, new TimedLine(slaves, ring = true), ports = 2, cycle = 1500, clocks = clocks)
    b.settle()
    b
  }
  private def set(b: LineBench, slave: Int, state: Int): Unit = {
    b.line.slaves(slave).alarm.get.setLine(state)
    b.line.slaves(slave).advanceUs(10)
  }
  private val quiet               = (false, false)
  private val loud                = (true, true)
  private val still               = (true, false)
  private def nodes(b: LineBench) = (0 until Slaves).map(b.node)

  /** Every slave is where it is, and an alarm of each is heard and reported with its position. */
  private def works(b: LineBench, reached: Int => Boolean = _ => true): Unit = {
    assert(nodes(b) == (1 to Slaves))
    b.settle()
    b.seen()
    for (i <- 0 until Slaves if reached(i)) {
      set(b, i, Alarm)
      b.until(4)(b.loud == loud)
      b.settle()
      assert(b.records().map(e => (e.position, e.node)) == Seq((i, i + 1)))
      b.silence()
      b.settle()
      assert(b.loud == still && b.line.slaves.forall(!_.alarm.get.buzzer))
      set(b, i, Normal)
      b.settle()
      b.seen()
    }
    b.reset()
    b.settle()
    b.settle()
    assert(b.loud == quiet && (0 until Slaves).forall(i => !reached(i) || !b.line.slaves(i).alarm.get.lamp))
  }

  together("a ring", new LineMaster(8, 16, 2))(
    "LM-04: closed, one frame goes round in each cycle" -> { dut =>
      val b = bench(dut)
      assert(b.ringClosed && !b.ringOpen && b.present == Slaves && b.known == Slaves && !b.dead)
      b.frames = Vector.empty
      b.cycles(5)
      assert(b.frames.size == 5 && b.frames.forall(_._1 == 0))
      works(b)
    },
    "LM-04: cut anywhere all slaves are heard, at their positions; mended, it is closed again" -> { dut =>
      val b = bench(dut)
      for (cut <- 0 to Slaves) {
        b.line.setCable(cut, intact = false)
        b.cycles(6)
        b.settle()
        assert(b.ringOpen && !b.ringClosed && b.cut == cut && b.present == Slaves && !b.wrong, s"cut $cut")
        assert((0 until Slaves).forall(!b.isAbsent(_)))
        works(b)
        b.line.setCable(cut, intact = true)
        b.until(4)(b.ringClosed)
        b.settle()
        assert(!b.ringOpen && b.present == Slaves && (0 until Slaves).forall(!b.isAbsent(_)))
        assert(b.known == Slaves && b.loud == quiet)
      }
    },
    "LM-04: at most the frame in flight is lost: an alarm in the cycle of a cut sounds in the next one" -> {
      dut =>
        val b = bench(dut)
        for ((cut, delay) <- Seq((3, 0), (1, 400), (5, 800), (2, 1200))) {
          for (_ <- 1 to delay) b.slot()
          set(b, 4, Alarm)
          b.line.setCable(cut, intact = false)
          b.until(3)(b.loud == loud)
          b.settle()
          assert(b.records().count(_.state == Alarm) == 1)
          b.line.setCable(cut, intact = true)
          set(b, 4, Normal)
          b.settle()
          b.reset()
          b.settle()
          b.settle()
          assert(b.loud == quiet)
          b.seen()
        }
    },
    "LM-04, LM-06: cut twice, the slaves between are absent, and what they said stays" -> { dut =>
      val b = bench(dut)
      set(b, 3, Alarm)
      b.settle()
      b.line.setCable(2, intact = false)
      b.line.setCable(5, intact = false)
      b.settle()
      b.settle()
      assert(
        b.present == 3 && b.cut == 2 && (0 until Slaves).map(b.isAbsent) == Seq(false, false, true, true,
          true, false)
      )
      assert(nodes(b) == (1 to Slaves) && b.loud == loud)
      b.silence()
      b.settle()
      assert(b.loud == still)
      set(b, 5, Alarm)
      b.until(4)(b.loud == loud)
      b.settle()
      assert(b.records().last.position == 5)
      b.silence()
      for (i <- Seq(3, 5)) set(b, i, Normal)
      b.line.setCable(2, intact = true)
      b.settle()
      assert(b.present == 6 && b.ringOpen && (0 until Slaves).forall(!b.isAbsent(_)))
      b.line.setCable(5, intact = true)
      b.settle()
      b.silence()
      b.settle()
      b.reset()
      b.settle()
      b.settle()
      assert(b.ringClosed && b.loud == quiet)
      works(b)
    },
    "LM-04: a slave that dies is absent, those behind it keep their positions" -> { dut =>
      val b = bench(dut)
      b.expect(1 to Slaves: _*)
      b.settle()
      assert(!b.wrong)
      b.line.kill(2)
      b.settle()
      b.settle()
      assert(b.present == 5 && b.isAbsent(2) && b.isWrong(2) && b.wrong && nodes(b) == (1 to Slaves))
      assert(Seq(0, 1, 3, 4, 5).forall(i => !b.isAbsent(i) && !b.isWrong(i)))
      b.line.replace(2, started(3))
      b.settle()
      b.settle()
      assert(b.ringClosed && !b.wrong)
      b.line.replace(2, started(9))
      b.settle()
      assert(b.wrong && b.isWrong(2) && !b.isAbsent(2))
    },
    "LM-04: a ring that is cut from the start: the list gives the positions" -> { dut =>
      val slaves = Seq.tabulate(Slaves)(i => started(i + 1))
      val line   = new TimedLine(slaves, ring = true)
      line.setCable(2, intact = false)
      line.kill(3)
      val b = new LineBench(dut, line, ports = 2, cycle = 1500)
      b.expect(1 to Slaves: _*)
      b.settle()
      b.settle()
      assert(b.present == 4 && Seq(0, 1, 4, 5).map(b.node) == Seq(1, 2, 5, 6))
      assert((0 until Slaves).map(b.isAbsent) == Seq(false, false, true, true, false, false))
    },
    "LM-04: nobody at either end is dead; the first one that answers is alive" -> { dut =>
      val b = bench(dut)
      b.line.setCable(0, intact = false)
      b.line.setCable(Slaves, intact = false)
      b.until(16)(b.dead)
      b.settle()
      assert((0 until Slaves).forall(b.isAbsent) && b.present == 0)
      b.line.setCable(Slaves, intact = true)
      b.until(6)(!b.dead)
      b.settle()
      b.settle()
      assert(b.present == Slaves && b.cut == 0 && nodes(b) == (1 to Slaves))
      works(b)
    },
    "LM-03, LM-04: lost and bad frames on a cut ring double and lose nothing" -> { dut =>
      val random = new scala.util.Random(1)
      val b      = bench(dut)
      b.line.setCable(3, intact = false)
      b.settle()
      b.seen()
      b.disturb = (_, f) =>
        random.nextInt(4) match {
          case 0 => None
          case 1 => Some(f.copy(payload = f.payload.updated(60, f.payload(60) ^ 4)))
          case _ => Some(f)
        }
      for (round <- 1 to 24) {
        set(b, round % Slaves, if (round / Slaves % 2 == 0) Open else Alarm)
        b.cycles(3)
      }
      b.disturb = (_, f) => Some(f)
      b.settle()
      b.cycles(60)
      val records = b.records()
      for (i <- 0 until Slaves) {
        val mine = records.filter(_.node == i + 1)
        assert(
          mine.forall(_.position == i) && mine.map(_.sequence).sorted == (2 to mine.size + 1),
          s"slave $i"
        )
      }
      assert(records.size == 24 && b.line.kept == 0 && b.loud == loud)
    },
    "LM-04: noise at one port does not drown the other one" -> { dut =>
      val b = bench(dut)
      b.line.setCable(Slaves, intact = false)
      b.settle()
      assert(b.present == Slaves && b.ringOpen)
      // Frames without end at the second port, all bad.
      b.noise = Some(1)
      b.cycles(4)
      set(b, 2, Alarm)
      b.until(6)(b.loud == loud)
      assert(b.present == Slaves)
    },
    "LM-04, LM-07: where a cut makes an order void the master sounds as long as a slave does" -> { dut =>
      val b                     = bench(dut)
      def buzzers               = b.line.slaves.exists(_.alarm.get.buzzer)
      def lamps                 = b.line.slaves.exists(_.alarm.get.lamp)
      def agrees(where: String) = assert((b.fire || !lamps) && (b.sounding || !buzzers), where)
      for (
        (cut, delay) <- (0 to Slaves).zip(Iterator.iterate(0)(d => (d + 430) % 1500));
        mends        <- Seq(false, true)
      ) {
        // The order comes in the cycle of a cut, or of its mending.
        def changes(after: Int): Unit = {
          for (_ <- 1 to after) b.slot()
          b.line.setCable(cut, intact = mends)
        }
        val where = s"cut $cut, mended $mends"
        if (mends) b.line.setCable(cut, intact = false)
        b.settle()
        for (i <- Seq(1, 4)) set(b, i, Alarm)
        b.until(4)(b.loud == loud)
        b.settle()
        b.silence()
        changes(delay)
        b.settle()
        agrees(where)
        b.silence()
        b.settle()
        assert(b.loud == still && !buzzers, where)
        for (i <- Seq(1, 4)) set(b, i, Normal)
        b.line.setCable(cut, intact = !mends)
        b.settle()
        agrees(where)
        b.reset()
        changes(delay)
        b.settle()
        b.settle()
        agrees(where)
        b.reset()
        b.settle()
        b.settle()
        assert(b.loud == quiet && !lamps, where)
        b.line.setCable(cut, intact = true)
        b.settle()
        assert(b.ringClosed && b.loud == quiet)
      }
    },
    "LM-13: the host's datagram reaches both parts of a ring that is cut, also in the cycle of the cut" -> {
      dut =>
        val b = bench(dut)
        b.line.setCable(2, intact = false)
        b.settle()
        assert(b.host(Bwr, 0x0e90L << 16, 1 to 8).map(_._1).contains(Slaves))
        for (i <- 0 until Slaves) {
          assert(b.host(Apwr, (-i & 0xffff).toLong | 0x0e98L << 16, Seq(i + 1)).map(_._1).contains(1))
          assert(b.line.slaves.map(_.hostRead(0x0e98)) == (1 to Slaves).map(k => if (k <= i + 1) k else 0))
          assert(
            b.host(Aprd, (-i & 0xffff).toLong | 0x12L << 16, Seq(0, 0))
              .map(r => (r._1, r._2.toInt & 0xffff))
              .contains((1, i + 1))
          )
        }
        b.line.setCable(2, intact = true)
        b.settle()
        for (delay <- 0 to 1400 by 350) {
          var frame = b.frames.size
          b.disturb = (n, f) => {
            if (n == frame) b.line.setCable(4, intact = false)
            if (n == frame) None else Some(f)
          }
          frame = b.frames.size
          assert(
            b.host(Bwr, 0x0e90L << 16, Seq(delay & 0xff, 1, 2, 3, 4, 5, 6, 7)).map(_._1).contains(Slaves)
          )
          assert(b.line.slaves.forall(_.hostRead(0x0e90) == (delay & 0xff)))
          b.disturb = (_, f) => Some(f)
          b.line.setCable(4, intact = true)
          b.settle()
        }
    }
  )
}
