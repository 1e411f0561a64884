package flyframe.master

import chisel3._
import chiseltest._
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.SharedSimulation
import flyframe.model._
import flyframe.params.Presets
import flyframe.protocol.Command.{Aprd, Brd, Bwr}
import flyframe.registers.AlarmRegisters

/** The exchange of a master with a line of modelled slaves. */
class LineExchangeSpec extends AnyFlatSpec with SharedSimulation {
  private val slave       = Presets.named("alarm-slave").get.params
  private def is(b: Bool) = b.peekBoolean()
  private case class Answer(counter: Int, data: Seq[Int], index: Int, command: Int, adp: Int)

  /** @param disturb
    *   what becomes of the frame with this number on its way back; None: it is lost
    */
  private class Master(
      dut: LineExchange,
      line: LineModel,
      disturb: (Int, SentFrame) => Option[SentFrame] = (_, f) => Some(f)
  ) {
    var frames = 0
    var lost   = 0
    def waits(slots: Int, retries: Int): Unit = {
      dut.timeout.poke(slots)
      dut.retries.poke(retries)
    }
    private var sending = Vector.empty[Int]
    private var back    = Vector.empty[Option[(Int, Boolean, Boolean)]] // nibble, payload, end
    private var good    = false
    dut.source.poke(BigInt("665544332210", 16))
    dut.timeout.poke(900)
    dut.retries.poke(2)
    dut.clear.poke(false)
    dut.go.poke(false)
    dut.atSecond.poke(false)
    dut.keeps.valid.poke(false)
    dut.keptSecond.poke(false)
    dut.keptPlace.poke(0)
    dut.byte.valid.poke(false)
    private val in  = dut.in.head
    private val out = dut.out.head
    in.odd.poke(false)
    in.crcGood.poke(true)

    private def slot(): Unit = {
      val now = back.headOption.flatten
      back = back.drop(1)
      in.valid.poke(now.exists(!_._3))
      in.data.poke(now.fold(0)(_._1))
      in.payload.poke(now.exists(_._2))
      in.end.poke(now.exists(_._3))
      in.bad.poke(now.exists(_._3) && !good)
      dut.step.poke(true)
      cycle()
      dut.step.poke(false)
      cycle()
      if (is(out.valid) && is(out.payload)) sending :+= out.data.peekInt().toInt
      if (is(out.end)) {
        for (sent <- line.send(WireFrame.ofNibbles(sending)); frame <- disturb(frames, sent)) {
          good = frame.good
          val start = Vector.fill(15)(5) :+ 13
          back = Vector.fill(40)(None) ++ start.map(n => Some((n, false, false))) ++
            frame.payload.map(n => Some((n, true, false))) :+ Some((0, true, true))
        }
        frames += 1
        sending = Vector.empty
      }
    }
    private var result = Option.empty[Boolean]
    private def cycle(): Unit = {
      if (is(dut.done.valid)) result = Some(is(dut.done.bits))
      if (is(dut.lost)) lost += 1
      dut.clock.step()
    }

    def exchange(datagrams: Datagram*): Option[Seq[Answer]] = {
      dut.clear.poke(true)
      dut.clock.step()
      dut.clear.poke(false)
      for (b <- datagrams.zipWithIndex.flatMap { case (d, i) => d.bytes(more = i < datagrams.size - 1) }) {
        dut.byte.bits.poke(b)
        dut.byte.valid.poke(true)
        dut.clock.step()
      }
      dut.byte.valid.poke(false)
      result = None
      dut.go.poke(true)
      dut.clock.step()
      dut.go.poke(false)
      while (result.isEmpty) slot()
      Option.when(result.get)((0 until dut.count.peekInt().toInt).map { i =>
        dut.read.poke(i)
        def word(place: Int): Int = {
          dut.place.poke(place)
          dut.clock.step()
          dut.answer.peekInt().toInt
        }
        val index = word(AnswerWord.Index)
        Answer(
          word(AnswerWord.Counter),
          (0 until 8).map(k => word(AnswerWord.Data + k / 2) >> 8 * (k % 2) & 0xff),
          index >> 8,
          index & 0xff,
          word(AnswerWord.Adp)
        )
      })
    }
  }
  private def line(count: Int) = new LineModel(Seq.fill(count)(new EscModel(slave)))

  together("with modelled slaves", new LineExchange(1))(
    "MST-07: counting slaves and reading their registers" -> { dut =>
      val slaves = line(5)
      slaves.slaves.zipWithIndex.foreach { case (s, i) => s.hostWrite(0x12, 0x20 + i) }
      val master = new Master(dut, slaves)
      assert(master.exchange(Datagram(Brd, 0, 0, Seq(0))).get.map(a => (a.counter, a.adp)) == Seq((5, 5)))
      val answers =
        master.exchange((0 until 5).map(i => Datagram(Aprd, -i, 0x12, Seq(0, 0)).copy(index = i)): _*).get
      assert(answers.map(_.counter) == Seq.fill(5)(1) && answers.map(_.data.head) == (0x20 to 0x24))
      assert(answers.map(_.index) == (0 until 5) && answers.forall(_.command == Aprd))
      assert(master.lost == 0 && master.frames == 2)
    },
    "MST-08: an answer that has begun in time is waited for, whenever the time-out passes in it" -> { dut =>
      for (retries <- Seq(0, 2); timeout <- 125 to 270) {
        val master = new Master(dut, line(1))
        master.waits(timeout, retries)
        val counters = master.exchange(Datagram(Brd, 0, 0, Seq(0))).map(_.map(_.counter))
        assert(
          counters.contains(Seq(1)) && master.lost == 0 && master.frames == 1,
          s"time-out after $timeout slots, $retries retries"
        )
      }
    },
    "MST-07, AP-05: a frame collects what slaves have to say, and the host's answer is kept" -> { dut =>
      val slaves = line(5)
      for (i <- Seq(1, 3)) {
        val s = slaves.slaves(i)
        s.hostWrite(0x12, 0x30 + i)
        s.hostWrite(0x0ea0, 0)
        s.hostWrite(0x0ea1, 0)
        s.alarm.get.setLine(2)
        s.advanceUs(20)
      }
      val master = new Master(dut, slaves)
      // A master that confirms expects records.
      master.exchange(Datagram(Bwr, 0, AlarmRegisters.Confirm, Seq.fill(4)(0)))
      dut.keeps.valid.poke(true)
      dut.keeps.bits.poke(1)
      val answers =
        master.exchange(Datagram(Brd, 0, 0, Seq(0)), Datagram(Aprd, -3, 0x12, Seq(0, 0))).get
      dut.keeps.valid.poke(false)
      val records = answers.drop(2)
      assert(
        records.map(a => (a.adp, a.index)) == Seq((0x31, 2), (0x33, 4)) && records.forall(_.command == 0)
      )
      assert(records.map(_.data.take(3)) == Seq.fill(2)(Seq(1, 0, 2)))
      master.exchange(Datagram(Brd, 0, 0, Seq(0)))
      def kept(place: Int) = {
        dut.keptPlace.poke(place)
        dut.clock.step()
        dut.kept.peekInt().toInt
      }
      assert(kept(AnswerWord.Counter) == 1 && kept(AnswerWord.Data) == 0x33)
    },
    "MST-08: a lost or spoiled frame is sent again, as often as asked" -> { dut =>
      val spoil = (f: SentFrame) => f.copy(payload = f.payload.updated(40, f.payload(40) ^ 1))
      for (kind <- 0 to 1; failing <- 0 to 3) {
        val master = new Master(
          dut,
          line(2),
          (n, f) => if (n >= failing) Some(f) else if (kind == 0) None else Some(spoil(f))
        )
        val answer = master.exchange(Datagram(Brd, 0, 0, Seq(0)))
        assert(answer.map(_.map(_.counter)) == Option.when(failing <= 2)(Seq(2)))
        assert(master.lost == (failing min 3) && master.frames == (failing + 1 min 3))
      }
    },
    "MST-08: an answer that comes after its time does no harm" -> { dut =>
      val master = new Master(dut, line(1))
      dut.timeout.poke(60)
      assert(master.exchange(Datagram(Brd, 0, 0, Seq(0))).isEmpty)
      dut.timeout.poke(900)
      for (i <- 1 to 3)
        assert(master.exchange(Datagram(Brd, 0, 0, Seq(0)).copy(index = i)).get.map(_.counter) == Seq(1))
    }
  )
}
