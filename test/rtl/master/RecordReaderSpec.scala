package flyframe.master

import chisel3._
import chisel3.util._
import chiseltest._
import flyframe.SharedSimulation
import flyframe.protocol.DetectorState
import org.scalatest.flatspec.AnyFlatSpec

/** The reader with its slot. */
class RecordBench(maxSlaves: Int) extends Module {
  private val reader = Module(new RecordReader(maxSlaves, 1))
  private val slot   = Module(new EventSlot)
  val start          = IO(Input(Bool()))
  val heeds          = IO(Input(Bool()))
  val words          = IO(Input(Vec(8, UInt(16.W))))
  val busy           = IO(Output(Bool()))
  val told           = IO(Input(Bool()))
  val toldAt         = IO(Input(UInt(8.W)))
  val clears         = IO(Input(Bool()))
  val newAlarm       = IO(Output(Bool()))
  val room           = IO(Input(Bool()))
  val nextEvent      = IO(Input(UInt(16.W)))
  val event          = IO(Decoupled(UInt(16.W)))
  val compose        = IO(Input(Bool()))
  val restart        = IO(Input(Bool()))
  val offers         = IO(Output(Bool()))
  val taken          = IO(Input(Bool()))
  val index          = IO(Output(UInt(8.W)))
  val ackPlace       = IO(Input(UInt(2.W)))
  val ackWord        = IO(Output(UInt(16.W)))
  reader.atSecond := false.B
  reader.base     := 0.U
  reader.clears   := clears
  reader.start    := start
  reader.begin    := heeds
  // The cycle of `start` has the word with the index.
  reader.answer    := Mux(start, words(AnswerWord.Index), RegNext(words(reader.place)))
  busy             := reader.busy
  reader.told      := told
  reader.toldAt    := Cat(toldAt(7), toldAt(log2Ceil(maxSlaves) - 1, 0))
  newAlarm         := reader.newAlarm
  reader.room      := room
  reader.nextEvent := nextEvent
  reader.compose   := compose
  reader.restart   := restart
  offers           := reader.offers
  reader.taken     := taken
  index            := reader.index
  reader.ackPlace  := ackPlace
  ackWord          := reader.ackWord
  reader.free      := slot.free
  reader.begins    := slot.begins
  slot.write       := reader.fills
  slot.place       := reader.step
  slot.kind        := 1.U
  slot.position    := reader.owner
  slot.answer      := reader.answer
  slot.data        := 0.U
  slot.own         := 0.U
  slot.offer       := reader.offer
  slot.cancel      := reader.cancel
  event <> slot.event
}

/** Records of slaves: which are taken, and which are acknowledged. */
class RecordReaderSpec extends AnyFlatSpec with SharedSimulation {
  private case class Record(
      position: Int,
      sequence: Int,
      state: Int,
      node: Int = 5,
      epoch: Int = 7,
      time: Long = 0x123456789abcL
  )

  private class Reader(dut: RecordBench) {
    for (b <- Seq(dut.start, dut.heeds, dut.told, dut.clears, dut.compose, dut.restart, dut.taken))
      b.poke(false)
    dut.room.poke(true)
    dut.nextEvent.poke(0x77)
    dut.event.ready.poke(true)
    var words                   = Vector.empty[Int]
    var alarms                  = 0
    private def is(b: Bool)     = b.peekBoolean()
    private def number(u: UInt) = u.peekInt().toInt
    private def cycle(): Unit = {
      if (is(dut.event.valid) && is(dut.event.ready)) words :+= number(dut.event.bits)
      if (is(dut.newAlarm)) alarms += 1
      dut.clock.step()
    }
    private def pulse(b: Bool): Unit = {
      b.poke(true)
      cycle()
      b.poke(false)
    }

    /** An answer with these records; how many cycles each one takes at most. */
    def answer(records: Record*): Int = {
      pulse(dut.heeds)
      records.map { r =>
        val all = Seq(r.node, (r.position + 1) << 8, r.sequence, r.state | r.epoch << 8) ++
          (0 to 3).map(i => (r.time >> 16 * i & 0xffff).toInt)
        for ((w, i) <- all.zipWithIndex) dut.words(i).poke(w)
        pulse(dut.start)
        var took = 1
        while (is(dut.busy)) {
          cycle()
          took += 1
          assert(took < 1000)
        }
        took
      }.max
    }
    def rest(n: Int): Unit = for (_ <- 1 to n) cycle()

    /** Events since this was asked last: position and sequence. */
    def seen(): Seq[(Int, Int)] = {
      rest(40)
      val all = words.grouped(8).toSeq
      words = Vector.empty
      all.map(e => (e(0) & 0xff, e(2)))
    }

    /** What is acknowledged: index, sequence, guard, tag. */
    def acks(): Seq[(Int, Int, Int, Int)] = {
      pulse(dut.restart)
      dut.compose.poke(true)
      rest(3)
      var all = Vector.empty[(Int, Int, Int, Int)]
      while (is(dut.offers)) {
        val Seq(a, b, c) = (0 to 2).map { i =>
          dut.ackPlace.poke(i)
          cycle()
          number(dut.ackWord)
        }
        all :+= ((number(dut.index), a, b, c))
        pulse(dut.taken)
        rest(2)
      }
      dut.compose.poke(false)
      all
    }

    /** Nobody answers at this position any more. */
    def forget(position: Int): Unit = for (index <- Seq(position, 0x80 | position)) {
      dut.toldAt.poke(index)
      pulse(dut.clears)
    }

    /** The frame with the acknowledgement has come back. */
    def told(index: Int): Unit = {
      dut.toldAt.poke(index)
      pulse(dut.told)
    }
  }
  import DetectorState.{Alarm, Normal, Open, Test}

  together("with its slot", new RecordBench(8))(
    "LM-08: a record is an event once, and acknowledged with its number until it is gone" -> { dut =>
      val r      = new Reader(dut)
      val record = Record(3, 9, Open)
      r.answer(record)
      r.rest(40)
      assert(r.words == Seq(0x0103, 5, 9, Open << 8 | 7, 0, 0x1234, 0x5678, 0x9abc))
      r.words = Vector.empty
      dut.nextEvent.poke(0x78)
      for (_ <- 1 to 3) {
        assert(r.acks() == Seq((3, 9, 0x9abc, 0x77)))
        r.answer(record)
        assert(r.seen().isEmpty && r.alarms == 0)
      }
      // It comes once more in the frame of its acknowledgement.
      r.told(3)
      r.answer(record)
      assert(r.acks().isEmpty)
      r.answer(record)
      assert(r.acks() == Seq((3, 9, 0x9abc, 0x77)), "it has not arrived after all")
    },
    "LM-08: another number, state, epoch, time or node is another record" -> { dut =>
      val r     = new Reader(dut)
      val first = Record(2, 1, Alarm)
      r.answer(first)
      assert(r.seen() == Seq((2, 1)) && r.alarms == 1)
      for (
        other <- Seq(
          first.copy(sequence = 2),
          first.copy(epoch = 8),
          first.copy(node = 6),
          first.copy(time = first.time + 1),
          first.copy(time = first.time + 0x10000),
          first
        )
      ) {
        r.answer(other)
        assert(r.seen() == Seq((2, other.sequence)), s"$other")
      }
      assert(r.alarms == 7)
    },
    "LM-08: an alarm between does not make the record before it a new one" -> { dut =>
      val r = new Reader(dut)
      r.answer(Record(2, 1, Open))
      r.answer(Record(2, 3, Alarm))
      r.answer(Record(2, 5, Alarm))
      assert(r.seen() == Seq((2, 1), (2, 3), (2, 5)))
      r.answer(Record(2, 1, Open))
      assert(r.seen().isEmpty && r.acks().map(_._2) == Seq(1) && r.alarms == 2)
    },
    "LM-08: what comes from a slave that was absent is new, even if it is the same" -> { dut =>
      val r   = new Reader(dut)
      val all = Seq(Record(2, 1, Alarm), Record(2, 2, Normal), Record(3, 1, Alarm))
      r.answer(all: _*)
      r.answer(all.dropRight(1): _*)
      r.rest(40)
      r.answer(all: _*)
      assert(r.seen().size == 3 && r.alarms == 2)
      r.forget(2)
      r.answer(all: _*)
      r.rest(40)
      r.answer(all: _*)
      assert(r.seen() == Seq((2, 1), (2, 2)) && r.alarms == 3)
      r.answer(all: _*)
      assert(r.seen().isEmpty && r.alarms == 3 && r.acks().size == 3)
    },
    "LM-05: an alarm of a test is none" -> { dut =>
      val r = new Reader(dut)
      r.answer(Record(2, 1, Alarm | Test))
      assert(r.seen() == Seq((2, 1)) && r.alarms == 0)
    },
    "LM-09: without room a record is not taken, but heard, once" -> { dut =>
      val r = new Reader(dut)
      dut.room.poke(false)
      for (_ <- 1 to 3) r.answer(Record(1, 4, Alarm))
      assert(r.seen().isEmpty && r.acks().isEmpty && r.alarms == 1)
      dut.room.poke(true)
      r.answer(Record(1, 4, Alarm))
      assert(r.seen() == Seq((1, 4)) && r.alarms == 1)
    },
    "LM-02: a reporter that does not take an event is waited for, but not for ever" -> { dut =>
      val r = new Reader(dut)
      dut.event.ready.poke(false)
      assert(r.answer(Record(1, 1, Open)) < 100 && r.acks().isEmpty)
      dut.event.ready.poke(true)
      r.rest(100)
      assert(r.words.isEmpty, "it was withdrawn")
      r.answer(Record(1, 1, Open))
      assert(r.seen() == Seq((1, 1)))
      // The reporter stops within an event: that goes on when it does, the next one waits at its slave.
      r.answer(Record(1, 2, Open))
      r.rest(3)
      dut.event.ready.poke(false)
      assert(r.answer(Record(3, 1, Open)) < 100)
      dut.event.ready.poke(true)
      assert(r.seen() == Seq((1, 2)))
      r.answer(Record(3, 1, Open))
      assert(r.seen() == Seq((3, 1)))
    },
    "LM-08: positions that the table has no place for, and 0, are left out" -> { dut =>
      val r = new Reader(dut)
      r.answer(Record(8, 1, Alarm), Record(200, 1, Alarm), Record(-1, 1, Alarm))
      assert(r.seen().isEmpty && r.alarms == 0 && r.acks().isEmpty)
      r.answer(Record(7, 1, Alarm))
      assert(r.seen() == Seq((7, 1)) && r.acks().map(_._1) == Seq(0x87))
    },
    "LM-01: a record that is known takes 10 cycles, a new one 50" -> { dut =>
      val r   = new Reader(dut)
      val all = (0 to 7).map(Record(_, 1, Normal))
      assert(r.answer(all: _*) <= 50)
      r.rest(40)
      assert(r.answer(all: _*) <= 10 && r.acks().size == 8)
    }
  )
}
