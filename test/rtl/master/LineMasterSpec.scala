package flyframe.master

import chisel3._
import chiseltest._
import flyframe.SharedSimulation
import flyframe.master.TimedLine.{fresh, started}
import flyframe.model._
import flyframe.params.Presets
import flyframe.protocol.{EventKind, SlaveStatus}
import flyframe.protocol.Command.{Aprd, Apwr, Brd, Bwr}
import flyframe.protocol.DetectorState.{Alarm, Normal, Open}
import flyframe.registers.AlarmRegisters
import org.scalatest.flatspec.AnyFlatSpec

/** The line master with modelled slaves on a plain line. */
class LineMasterSpec extends AnyFlatSpec with SharedSimulation {
  private def ordinary                          = new EscModel(Presets.named("cyclone4-min").get.params)
  private def slaves(count: Int): Seq[EscModel] = Seq.tabulate(count)(i => started(i + 1))
  private def bench(dut: LineMaster, count: Int): LineBench = {
    val b = new LineBench(dut, new TimedLine(slaves(count)))
    b.settle()
    b
  }
  private def set(b: LineBench, slave: Int, state: Int): Unit = {
    b.line.slaves(slave).alarm.get.setLine(state)
    b.line.slaves(slave).advanceUs(10)
  }
  private def restart(dut: LineMaster): Unit = {
    dut.reset.poke(true.B)
    dut.clock.step()
    dut.reset.poke(false.B)
  }
  private val quiet = (false, false)
  private val loud  = (true, true)
  private val still = (true, false) // silenced

  together("a line", new LineMaster(8, 16, 1))(
    "LM-01: each cycle has one frame, with what it is to have, in this order" -> { dut =>
      val b = bench(dut, 6)
      b.frames = Vector.empty
      b.begins = Vector.empty
      b.cycles(9)
      assert(b.frames.size == 9 && b.begins.sliding(2).forall { case Seq(x, y) =>
        (y - x - 1000).abs < 200 // they are not all of the same length
      })
      for ((_, frame) <- b.frames) {
        assert(frame.head.command == Brd && frame.head.adp == 0 && frame.head.ado == AlarmRegisters.State)
        assert(frame.head.data.size == 2)
        assert(frame.last.command == Bwr && frame.last.ado == AlarmRegisters.Confirm)
        val reads = frame.tail.init
        assert(reads.nonEmpty && reads.forall(d => d.command == Aprd && d.ado == AlarmRegisters.State))
        assert(reads.forall(d => d.data.size == 8 && d.adp == (-d.index & 0xffff)))
      }
      assert(b.frames.map(_._2.head.index).sliding(2).forall { case Seq(x, y) => y == (x + 1 & 0xf) })
      val reads = b.frames.flatMap(_._2).filter(_.command == Aprd).map(_.index)
      assert(reads.groupBy(identity).values.map(_.size).toSet == Set(4, 5), "all in turns")
    },
    "LM-11: the table says what slaves say, for the host and for reports" -> { dut =>
      val b = bench(dut, 6)
      assert(b.present == 6 && b.known == 6 && !b.dead && !b.wrong)
      for (i <- 0 until 6) {
        assert(b.table(i) == (b.line.slaves(i).alarm.get.statusWord, i + 1, 1, TimedLine.Epoch, 0))
        assert(b.reported(i) == (b.status(i), i + 1))
      }
      set(b, 4, Open)
      b.line.slaves(2).hostWrite(0x0ea4, 7)
      b.settle()
      assert((b.status(4) & SlaveStatus.Open) != 0 && b.table(2)._3 == 7 && b.slaveFault)
      assert((b.status(2) & SlaveStatus.Unwell) != 0)
    },
    "LM-05, LM-08: an alarm sounds with the first frame, and is reported once" -> { dut =>
      val b = bench(dut, 6)
      assert(b.loud == quiet)
      b.seen()
      set(b, 4, Alarm)
      assert(b.until(2)(b.loud == loud) < 2000 && b.alarm)
      b.settle()
      val Seq(e) = b.records()
      assert((e.position, e.node, e.state, e.epoch) == ((4, 5, Alarm, TimedLine.Epoch)))
      assert(b.line.waiting == 0 && b.line.kept == 0)
      assert((b.status(4) & SlaveStatus.Sounding) != 0)
      b.silence()
      assert(b.loud == still)
      b.settle()
      assert(b.loud == still && !b.line.slaves(4).alarm.get.buzzer)
      set(b, 4, Normal)
      b.settle()
      assert(b.loud == still && !b.alarm, "it is over, but nobody has reset it")
      b.reset()
      b.settle()
      assert(b.loud == quiet && !b.line.slaves(4).alarm.get.lamp)
    },
    "LM-05: each further alarm sounds again" -> { dut =>
      val b = bench(dut, 6)
      for (i <- Seq(2, 0, 5, 3)) {
        set(b, i, Alarm)
        b.until(2)(b.loud == loud)
        b.settle()
        b.silence()
        assert(b.loud == still)
        b.settle()
        assert(b.loud == still)
      }
      // While the first one is not silenced at its slave.
      set(b, 1, Alarm)
      b.settle()
      b.silence()
      set(b, 4, Alarm)
      b.until(3)(b.loud == loud)
      b.settle()
      assert(b.loud == loud && b.line.slaves(4).alarm.get.buzzer && !b.line.slaves(1).alarm.get.buzzer)
    },
    "LM-07: an alarm after a silence or a reset was asked for is touched by neither" -> { dut =>
      for (delay <- 0 to 2400 by 301) {
        val b = bench(dut, 6)
        set(b, 1, Alarm)
        b.settle()
        if (delay % 2 == 0) b.silence() else b.reset()
        for (_ <- 1 to delay) b.slot()
        set(b, 3, Alarm)
        b.until(3)(b.loud == loud)
        b.settle()
        b.settle()
        assert(b.loud == loud && b.line.slaves(3).alarm.get.buzzer, s"after $delay slots")
        restart(dut)
      }
    },
    "LM-02, LM-07: buttons that are held keep no frame from leaving, and no alarm of others" -> { dut =>
      val b = bench(dut, 4)
      for (button <- Seq(dut.silence, dut.resetAlarm)) {
        button.poke(true)
        b.begins = Vector.empty
        b.cycles(20)
        assert(b.begins.size >= 19)
        set(b, 2, Alarm)
        b.settle()
        assert(b.fire || button == dut.resetAlarm)
        button.poke(false)
        set(b, 2, Normal)
        b.settle()
        b.reset()
        b.settle()
      }
      set(b, 2, Alarm)
      b.until(2)(b.loud == loud)
    },
    "LM-07: smoke that is still there after a reset is a new alarm" -> { dut =>
      val b = bench(dut, 3)
      b.seen()
      set(b, 1, Alarm)
      b.settle()
      assert(b.records().size == 1)
      b.reset()
      b.until(20)(b.loud == quiet)
      b.until(60)(b.loud == loud)
      b.settle()
      assert(b.records().map(e => (e.position, e.state)) == Seq((1, Alarm)))
    },
    "LM-06: what cannot be asked any more stays: fire and sound, and in the table what was said last" -> {
      dut =>
        val b = bench(dut, 6)
        set(b, 4, Alarm)
        b.settle()
        b.line.setCable(3, intact = false)
        b.settle()
        assert(b.loud == loud && b.present == 3 && b.known == 6)
        assert((3 to 5).forall(b.isAbsent) && !b.isAbsent(2))
        assert((b.status(4) & SlaveStatus.Alarm) != 0 && b.node(4) == 5)
        b.line.setCable(0, intact = false)
        b.settle()
        assert(b.loud == loud && b.dead && b.present == 0 && (0 to 5).forall(b.isAbsent))
        b.silence()
        b.settle()
        assert(b.loud == still)
        // A slave that is lost for good does not keep people from a reset.
        b.line.setCable(0, intact = true)
        b.settle()
        b.reset()
        b.settle()
        assert(b.loud == quiet && b.isAbsent(4) && (b.status(4) & SlaveStatus.Alarm) != 0)
        // Its alarm is still there when it comes back.
        b.line.setCable(3, intact = true)
        b.until(3)(b.loud == loud)
        b.settle()
        assert(b.loud == loud && !b.isAbsent(4))
    },
    "LM-03: lost and bad frames delay nothing but the cycle, and double nothing" -> { dut =>
      val random = new scala.util.Random(1)
      val b      = bench(dut, 4)
      b.seen()
      b.disturb = (_, f) =>
        random.nextInt(4) match {
          case 0 => None
          case 1 => Some(f.copy(payload = f.payload.updated(50, f.payload(50) ^ 4)))
          case _ => Some(f)
        }
      var changes = 0
      for (round <- 1 to 30) {
        set(b, round % 4, 2 + round / 4 % 3)
        changes += 1
        b.cycles(3)
      }
      b.disturb = (_, f) => Some(f)
      b.cycles(80)
      val records = b.records()
      for ((node, mine) <- records.groupBy(_.node))
        assert(mine.map(_.sequence).toSet.size == mine.size, s"node $node")
      assert(records.size == changes + 4 - 4 && b.line.kept == 0 && b.lost > 10)
      assert(b.loud == loud)
    },
    "LM-03: a dead line is dead after three cycles more, and alive with the first answer" -> { dut =>
      val b = bench(dut, 4)
      b.disturb = (_, _) => None
      b.cycles(3)
      assert(!b.dead && b.present == 4)
      b.disturb = (_, f) => Some(f)
      b.cycles(2)
      assert(!b.dead && (0 to 3).forall(!b.isAbsent(_)))
      b.line.setCable(0, intact = false)
      b.until(12)(b.dead)
      b.settle()
      assert((0 to 3).forall(b.isAbsent))
      b.line.setCable(0, intact = true)
      b.until(2)(!b.dead)
      b.settle()
      assert((0 to 3).forall(!b.isAbsent(_)) && b.loud == quiet)
    },
    "LM-09: without room nothing is taken, but everything sounds, once; with room nothing is missing" -> {
      dut =>
        val b = bench(dut, 4)
        b.seen()
        dut.roomForRecords.poke(false)
        dut.roomForStates.poke(false)
        set(b, 2, Alarm)
        b.until(2)(b.loud == loud)
        b.settle()
        b.silence()
        b.settle()
        assert(b.loud == still && b.seen().isEmpty && b.line.waiting == 1)
        set(b, 0, Alarm)
        b.until(2)(b.loud == loud)
        b.cycles(1)
        b.silence()
        b.settle()
        assert(b.loud == still && b.line.waiting == 2)
        dut.roomForRecords.poke(true)
        b.settle()
        assert(b.records().map(_.position).sorted == Seq(0, 2) && b.loud == still && b.line.waiting == 0)
        dut.roomForStates.poke(true)
        b.settle()
        assert(b.seen().filter(_.kind == EventKind.Slave).map(_.position).sorted == Seq(0, 2), "run together")
    },
    "LM-02: a reporter that takes nothing for ever keeps no frame and no alarm" -> { dut =>
      for (words <- 0 to 9) {
        val b = bench(dut, 4)
        set(b, 1, Open)
        b.until(4)(b.line.slaves(1).alarm.get.waiting == 0 || b.events.nonEmpty || true)
        for (_ <- 1 to words * 7) b.slot()
        b.takes = false
        b.begins = Vector.empty
        b.cycles(20)
        assert(b.begins.size >= 19)
        set(b, 3, Alarm)
        b.until(2)(b.loud == loud)
        b.settle()
        b.silence()
        b.settle()
        assert(b.loud == still)
        b.takes = true
        b.settle()
        assert(b.records().count(e => e.position == 3 && e.state == Alarm) == 1 && b.line.kept == 0)
        restart(dut)
      }
    },
    "LM-10: what the server does not have stays at the slaves, and a new life reports it again" -> { dut =>
      val b = bench(dut, 3)
      b.seen()
      b.serverHears = false
      for (state <- Seq(Alarm, Normal, Open)) {
        set(b, 1, state)
        b.settle()
      }
      assert(b.records().map(e => (e.position, e.state)) == Seq((1, Alarm), (1, Normal), (1, Open)))
      assert(b.line.waiting == 0 && b.line.slaves(1).alarm.get.kept == 3)
      b.serverHears = true
      b.settle()
      assert(b.line.kept == 0)
    },
    "LM-08: after a new life records that were taken are acknowledged again, and not taken twice" -> { dut =>
      val b = bench(dut, 3)
      b.serverHears = false
      set(b, 1, Alarm)
      b.settle()
      b.silence()
      b.settle()
      b.seen()
      dut.life.poke(0x4321)
      b.settle()
      assert(b.records().isEmpty && b.line.waiting == 0 && b.loud == still)
      b.serverHears = true
      b.settle()
      assert(b.line.kept == 0)
    },
    "LM-08: a slave that restarts with the same numbers and epoch is heard again" -> { dut =>
      val b = bench(dut, 3)
      b.seen()
      set(b, 2, Alarm)
      b.settle()
      assert(b.records().map(_.sequence) == Seq(2))
      b.silence()
      b.line.kill(2)
      b.settle()
      assert(b.isAbsent(2) && b.loud == still)
      b.line.replace(2, started(3))
      b.cycles(5)
      set(b, 2, Alarm)
      b.until(2)(b.loud == loud)
      b.settle()
      assert(b.records().map(e => (e.sequence, e.state)) == Seq((1, Normal), (2, Alarm)))
      assert(b.line.kept == 0)
    },
    "LM-11: swapped slaves, and one that is bypassed, are wrong; the list says who is missing" -> { dut =>
      val b = bench(dut, 5)
      b.expect(1, 2, 3, 4, 5, 6)
      b.settle()
      assert(b.known == 6 && (0 to 4).forall(!b.isWrong(_)) && b.isWrong(5) && b.isAbsent(5) && b.wrong)
      b.expect(1, 2, 3, 4, 5, 0)
      b.settle()
      assert((0 to 5).forall(!b.isWrong(_)) && !b.wrong)
      // Without the second one.
      val four = new LineBench(dut, new TimedLine(Seq(1, 3, 4, 5).map(started(_))))
      four.expect(1, 2, 3, 4, 5, 0)
      four.settle()
      assert((0 to 4).map(four.isWrong) == Seq(false, true, true, true, true) && four.wrong)
      assert((0 to 4).map(four.node) == Seq(1, 3, 4, 5, 5) && four.isAbsent(4))
      val swapped = new LineBench(dut, new TimedLine(Seq(1, 3, 2, 4, 5).map(started(_))))
      swapped.expect(1, 2, 3, 4, 5, 0)
      swapped.settle()
      assert((0 to 4).map(swapped.isWrong) == Seq(false, true, true, false, false))
    },
    "LM-11: ordinary slaves are neither absent nor wrong, and records behind them have their positions" -> {
      dut =>
        val b = new LineBench(dut, new TimedLine(Seq(started(1), ordinary, ordinary, started(4))))
        b.expect(1, 0, 0, 4)
        b.settle()
        assert(b.present == 4 && (0 to 3).forall(i => !b.isAbsent(i) && !b.isWrong(i)) && !b.wrong)
        b.seen()
        set(b, 3, Alarm)
        b.settle()
        assert(b.records().map(e => (e.position, e.node)) == Seq((3, 4)) && b.loud == loud)
        b.expect(1, 7, 0, 4)
        b.settle()
        assert(b.isWrong(1) && b.isAbsent(1) && !b.isWrong(2))
    },
    "LM-12: changes of a slave's state and of the master's are told, and run together without room" -> {
      dut =>
        val b = bench(dut, 3)
        b.seen()
        dut.framesLost.poke(0x5678)
        dut.status.poke(0x5a5a5)
        b.settle()
        assert(b.seen() == Seq(SeenEvent(EventKind.Line, 3, 3, 0xa5a5, 0, 5, 0x5678L)))
        b.line.slaves(1).hostWrite(0x0ea5, 0x55)
        b.settle()
        val Seq(e) = b.seen()
        assert(e == SeenEvent(EventKind.Slave, 1, 2, b.status(1), 1, 0x55, 3))
        dut.roomForStates.poke(false)
        for (test <- Seq(2, 3, 4)) {
          b.line.slaves(2).hostWrite(0x0ea4, test)
          b.settle()
        }
        assert(b.seen().isEmpty)
        dut.roomForStates.poke(true)
        b.settle()
        assert(b.seen().map(e => (e.position, e.state)) == Seq((2, 4)))
    },
    "LM-13: the host's datagrams are sent, with an answer for each" -> { dut =>
      val b = bench(dut, 3)
      assert(b.host(Bwr, 0x0e90L << 16, 1 to 8).map(_._1).contains(3))
      assert(b.line.slaves.forall(s => s.interrupt && s.hostRead(0x0e97) == 8))
      assert(b.host(Apwr, 0xffffL | 0x0e98L << 16, Seq(9, 8, 7)).map(_._1).contains(1))
      assert(b.line.slaves.map(_.hostRead(0x0e98)) == Seq(0, 9, 0))
      assert(
        b.host(Aprd, 0xfffeL | 0x0012L << 16, Seq(0, 0))
          .map(r => (r._1, r._2 & 0xffff))
          .contains((1, BigInt(3)))
      )
      b.disturb = (_, _) => None
      assert(b.host(Bwr, 0x0e90L << 16, Seq(1)).isEmpty)
    },
    "LM-02, LM-13: a host that always has something to send keeps nothing else from going" -> { dut =>
      val b = bench(dut, 6)
      b.seen()
      b.asks(Bwr, 0x0e90L << 16, 1 to 8)
      for (i <- 0 to 5) set(b, i, Alarm)
      b.cycles(2)
      assert(b.loud == loud)
      b.settle()
      assert(b.records().size == 6 && b.line.kept == 0)
      b.silence()
      b.settle()
      assert(b.loud == still && b.line.slaves.forall(!_.alarm.get.buzzer))
      assert(b.frames.takeRight(10).forall(_._2.exists(_.ado == 0x0e90)))
    },
    "LM-08: of more records than a frame can acknowledge all are taken once" -> { dut =>
      val b = bench(dut, 8)
      b.seen()
      for (round <- 1 to 3; i <- 0 to 7) set(b, i, if (round % 2 == 1) Alarm else Open)
      b.settle()
      b.settle()
      val records = b.records()
      assert(records.size == 24 && records.map(e => (e.position, e.sequence)).distinct.size == 24)
      assert(b.line.kept == 0 && b.frames.map(_._2.size).max <= 16)
      val acks = b.frames.flatMap(_._2).filter(_.ado == AlarmRegisters.Acknowledge)
      assert(acks.groupBy(a => (a.index, a.data)).values.forall(_.size == 1), "each acknowledged once")
    }
  )

  private val room = 4
  together(s"maxSlaves $room", new LineMaster(room, 10, 1))(
    Seq(room, room + 1, 2 * room + 1).map { count =>
      s"LM-11: of $count slaves no more are in the table than there is room for, and all sound" -> {
        (dut: LineMaster) =>
          val b = bench(dut, count)
          assert(b.present == count && b.known == room && b.wrong == (count > room))
          b.seen()
          set(b, count - 1, Alarm)
          b.until(2)(b.fire && b.sounding)
          b.settle()
          assert(b.records().map(_.position) == (if (count > room) Nil else Seq(count - 1)))
          b.silence()
          b.settle()
          assert(!b.sounding && b.fire && !b.line.slaves(count - 1).alarm.get.buzzer)
          b.reset()
          b.settle()
          assert(!b.fire && !b.line.slaves(count - 1).alarm.get.lamp)
      }
    } :+ "LM-07: to more slaves than the table has places for, silence and reset go to all" -> {
      (dut: LineMaster) =>
        val b = bench(dut, 2 * room)
        // Orders as they leave: command, position.
        def orders = b.frames.flatMap(_._2).collect {
          case d if d.ado == AlarmRegisters.Command => d.command
        }
        for (i <- Seq(0, room, 2 * room - 1)) set(b, i, Alarm)
        b.until(2)(b.loud == loud)
        b.settle()
        b.frames = Vector.empty
        b.silence()
        b.settle()
        assert(orders.nonEmpty && orders.forall(_ == Bwr), orders)
        assert(b.loud == still && b.line.slaves.forall(!_.alarm.get.buzzer))
        set(b, room + 1, Alarm)
        b.until(2)(b.loud == loud)
        b.settle()
        assert(b.loud == loud, "a new alarm sounds, wherever it is")
        b.frames = Vector.empty
        for (i <- 0 until 2 * room) set(b, i, Normal)
        b.reset()
        b.settle()
        assert(orders.nonEmpty && orders.forall(_ == Bwr), orders)
        assert(b.loud == quiet && b.line.slaves.forall(!_.alarm.get.lamp))
    }: _*
  )

  together("with more core cycles of a slot", new LineMaster(8, 12, 1))(
    Seq(2, 4, 5).map { clocks =>
      s"LM-01, LM-05, LM-08: with $clocks cycles of a slot" -> { (dut: LineMaster) =>
        val b = new LineBench(dut, new TimedLine(slaves(6)), clocks = clocks)
        b.settle()
        b.seen()
        for (i <- Seq(5, 0, 2)) {
          set(b, i, Alarm)
          b.until(2)(b.loud == loud)
          b.settle()
          assert(b.records().map(e => (e.position, e.sequence)) == Seq((i, 2)))
          b.silence()
          b.settle()
          assert(b.loud == still && !b.line.slaves(i).alarm.get.buzzer && b.line.kept == 0)
        }
        b.reset()
        b.settle()
        assert(b.loud == quiet && b.lost == 0)
        assert(
          (0 to 5).forall(i =>
            b.table(i) == ((b.line.slaves(i).alarm.get.statusWord, i + 1, 1, TimedLine.Epoch, 0))
          )
        )
      }
    }: _*
  )
}
