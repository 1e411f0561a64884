package flyframe.master

import scala.util.Random
import chisel3._
import chisel3.util._
import chiseltest._
import flyframe.ethernet.{EthernetReceiver, EthernetSender}
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.SharedSimulation
import flyframe.mii.NibbleStream
import flyframe.model.{Datagram, EtherCatFrame, Fcs}
import flyframe.protocol.Command.Nop
import flyframe.registers.AlarmRegisters

/** Composer and sender as in a master. */
class ComposerBench extends Module {
  private val composer = Module(new FrameComposer)
  private val sender   = Module(new EthernetSender)
  val step             = IO(Input(Bool()))
  val out              = IO(Output(new NibbleStream))
  val clear            = IO(Input(Bool()))
  val byte             = IO(Flipped(Valid(UInt(8.W))))
  val send             = IO(Input(Bool()))
  val busy             = IO(Output(Bool()))
  composer.source := "h665544332210".U
  composer.clear  := clear
  composer.byte   := byte
  composer.send   := send
  composer.look   := 0.U
  busy            := composer.busy
  sender.bytes <> composer.bytes
  sender.step := step
  out         := sender.out
}

/** Receiver and matcher as in a master, with the composer that knows what was sent. */
class MatcherBench extends Module {
  private val receiver = Module(new EthernetReceiver)
  private val matcher  = Module(new AnswerMatcher)
  private val composer = Module(new FrameComposer)
  val step             = IO(Input(Bool()))
  val in               = IO(Input(new NibbleStream))
  val clear            = IO(Input(Bool()))
  val byte             = IO(Flipped(Valid(UInt(8.W))))
  val word             = IO(Output(Valid(new AnswerWord)))
  val whole            = IO(Output(Bool()))
  val done             = IO(Output(Valid(Bool())))
  receiver.step        := step
  receiver.in          := in
  matcher.byte         := receiver.byte
  matcher.first        := receiver.first
  matcher.end          := receiver.end
  matcher.length       := composer.length
  matcher.sent         := composer.sent
  composer.look        := matcher.look
  composer.clear       := clear
  composer.byte        := byte
  composer.send        := false.B
  composer.source      := 0.U
  composer.bytes.ready := false.B
  word                 := matcher.word
  whole                := matcher.whole
  done                 := matcher.done
}

class MasterFrameSpec extends AnyFlatSpec with SharedSimulation {
  private def is(b: Bool) = b.peekBoolean()
  private def any(random: Random, most: Int) = Datagram(
    random.nextInt(15),
    random.nextInt(),
    Seq.fill(random.nextInt(most))(random.nextInt(256)),
    index = random.nextInt(256)
  ).copy(address = random.nextInt() & 0xffffffffL)

  private def area(datagrams: Seq[Datagram]): Seq[Int] =
    datagrams.zipWithIndex.flatMap { case (d, i) => d.bytes(more = i < datagrams.size - 1) }

  private class Composing(dut: ComposerBench) {
    dut.clear.poke(false)
    dut.send.poke(false)
    dut.byte.valid.poke(false)
    dut.step.poke(false)
    def pulse(signal: Bool): Unit = {
      signal.poke(true)
      dut.clock.step()
      signal.poke(false)
    }
    def put(byte: Int): Unit = {
      dut.byte.bits.poke(byte)
      pulse(dut.byte.valid)
    }

    /** The payload of the frame, sent with a slot every `cycles`. */
    def send(cycles: Int): Vector[Int] = {
      var payload = Vector.empty[Int]
      var ended   = false
      pulse(dut.send)
      while (!ended) {
        dut.step.poke(true)
        dut.clock.step()
        dut.step.poke(false)
        if (is(dut.out.valid) && is(dut.out.payload)) payload :+= dut.out.data.peekInt().toInt
        ended = is(dut.out.end)
        if (ended) assert(!is(dut.out.bad))
        if (cycles > 1) dut.clock.step(cycles - 1)
      }
      assert(!is(dut.busy))
      payload
    }
  }
  private def wire(datagrams: Seq[Datagram]) = {
    val own   = Seq.fill(6)(0xff) ++ Seq(0x10, 0x22, 0x33, 0x44, 0x55, 0x66)
    val bytes = own ++ EtherCatFrame(datagrams).drop(12)
    (bytes ++ Fcs.of(bytes)).flatMap(b => Seq(b & 0xf, b >> 4))
  }

  together("frames", new ComposerBench)(
    "MST-02: bytes become a frame, which can be sent again; then a new one begins" -> { dut =>
      val random   = new Random(1)
      val composer = new Composing(dut)
      for (round <- 1 to 20) {
        composer.pulse(dut.clear)
        val datagrams = Seq.fill(1 + random.nextInt(5))(any(random, 90))
        area(datagrams).foreach(composer.put)
        for (_ <- 1 to 1 + round % 2) assert(composer.send(1 + round % 4) == wire(datagrams))
      }
    },
    "MST-02: the longest frame of a master" -> { dut =>
      val composer = new Composing(dut)
      composer.pulse(dut.clear)
      val longest = Seq(any(new Random(1), 1).copy(data = Seq.tabulate(499)(_ & 0xff)))
      area(longest).foreach(composer.put)
      assert(composer.send(2) == wire(longest))
    }
  )

  /** A datagram as the matcher tells of it; of its data as much as it keeps. */
  private case class Seen(index: Int, command: Int, adp: Int, counter: Option[Int], data: Seq[Int])
  private def seenOf(d: Datagram) =
    Seen(d.index, d.command, (d.address & 0xffff).toInt, Some(d.workingCounter), d.data.take(8))
  private def recordOf(d: Datagram) = seenOf(d).copy(counter = None, data = d.data)

  private class Matching(dut: MatcherBench) {
    def expect(sent: Seq[Datagram]): Unit = {
      dut.step.poke(false)
      dut.byte.valid.poke(false)
      dut.clear.poke(true)
      dut.clock.step()
      dut.clear.poke(false)
      for (b <- area(sent)) {
        dut.byte.bits.poke(b)
        dut.byte.valid.poke(true)
        dut.clock.step()
      }
      dut.byte.valid.poke(false)
    }

    /** What it says of a frame: the datagrams, and whether they count. */
    def receive(bytes: Seq[Int], bad: Boolean = false): (Seq[Seen], Boolean) = {
      val payload = (bytes ++ Seq(1, 2, 3, 4)).flatMap(b => Seq(b & 0xf, b >> 4))
      var seen    = Vector.empty[Seen]
      var words   = Vector.fill(AnswerWord.Count)(0)
      var size    = 0
      var counter = Option.empty[Int]
      var done    = Option.empty[Boolean]
      def look(): Unit = {
        if (is(dut.word.valid)) {
          val place = dut.word.bits.place.peekInt().toInt
          val word  = dut.word.bits.data.peekInt().toInt
          val ends  = is(dut.whole) && place == AnswerWord.Counter
          if (ends) counter = Some(word)
          else {
            // A word of data comes twice, if there are two bytes of it.
            if (place >= AnswerWord.Data) {
              val at = 2 * (place - AnswerWord.Data)
              size = if (size == at) at + 1 else at + 2
            }
            words = words.updated(place, word)
          }
        }
        if (is(dut.whole)) {
          val most = if (counter.isDefined) 8 else 12
          val kept = (0 until (size min most)).map(i => words(AnswerWord.Data + i / 2) >> 8 * (i % 2) & 0xff)
          seen :+= Seen(words(1) >> 8, words(1) & 0xff, words(0), counter, kept)
          counter = None
        }
        if (is(dut.word.valid) && dut.word.bits.place.peekInt() == AnswerWord.Index) size = 0
        if (is(dut.done.valid)) done = Some(is(dut.done.bits))
      }
      for ((nibble, i) <- (Seq.fill(15)(5) ++ Seq(13) ++ payload ++ Seq.fill(4)(0)).zipWithIndex) {
        dut.in.valid.poke(i < 16 + payload.size)
        dut.in.payload.poke(i >= 16)
        dut.in.data.poke(nibble)
        dut.in.end.poke(i == 16 + payload.size)
        dut.in.bad.poke(bad)
        dut.step.poke(true)
        look()
        dut.clock.step()
        dut.step.poke(false)
        look()
        dut.clock.step()
      }
      (seen, done.get)
    }
  }
  private def back(datagrams: Seq[Datagram]) = EtherCatFrame(datagrams).updated(6, 0x12)

  private def record(random: Random): Datagram =
    Datagram(Nop, random.nextInt(), AlarmRegisters.State, Seq.fill(12)(random.nextInt(256)))
      .copy(index = 1 + random.nextInt(128), workingCounter = 1)

  together("answers", new MatcherBench)(
    "MST-04: what comes back as sent counts, with its data and working counter" -> { dut =>
      val random   = new Random(1)
      val matching = new Matching(dut)
      for (_ <- 1 to 20) {
        val sent = Seq.fill(1 + random.nextInt(5))(any(random, 60))
        val came = sent.map(d =>
          d.copy(
            data = d.data.map(_ ^ 0x55),
            workingCounter = random.nextInt(0x10000),
            address = random.nextInt(0x1000),
            circulating = random.nextBoolean()
          )
        )
        matching.expect(sent)
        val (seen, good) = matching.receive(back(came))
        assert(good && seen == came.map(seenOf))
      }
    },
    "MST-05: records of slaves behind them are told apart; what else is there is left out" -> { dut =>
      val random   = new Random(2)
      val matching = new Matching(dut)
      for (count <- 1 to 3; more <- 1 to 3) {
        val sent    = Seq.fill(count)(any(random, 20))
        val records = Seq.fill(more)(record(random))
        val others = Seq(
          record(random).copy(command = 1),
          record(random).copy(address = 0x0ea9L << 16),
          record(random).copy(address = 0x1ea8L << 16),
          record(random).copy(data = Seq.fill(13)(1)),
          record(random).copy(data = Seq.fill(268)(1)),
          record(random).copy(data = Nil)
        )
        matching.expect(sent)
        val added        = records.flatMap(r => Seq(others(random.nextInt(others.size)), r))
        val (seen, good) = matching.receive(back(sent ++ added))
        assert(good && seen == sent.map(seenOf) ++ records.map(recordOf))
      }
    },
    "MST-06: another command, index or length, missing ones, bad frames and others do not count" -> { dut =>
      val random   = new Random(3)
      val matching = new Matching(dut)
      val sent     = Seq.fill(3)(any(random, 20))
      matching.expect(sent)
      def counts(bytes: Seq[Int], bad: Boolean = false) = matching.receive(bytes, bad)._2
      assert(counts(back(sent)))
      for (n <- 0 until 3) {
        val d = sent(n)
        assert(!counts(back(sent.updated(n, d.copy(command = d.command ^ 1)))))
        assert(!counts(back(sent.updated(n, d.copy(index = d.index ^ 0x80)))))
        assert(!counts(back(sent.updated(n, d.copy(data = d.data :+ 0)))))
      }
      assert(!counts(back(sent.take(2))) && !counts(back(Nil)))
      assert(!counts(back(sent), bad = true))
      assert(!counts(EtherCatFrame(sent)), "it has passed no slave")
      assert(!counts(back(sent).updated(13, 0xa5)) && !counts(back(sent).updated(12, 0x08)))
      assert(!counts(back(sent).updated(15, 0x40 | back(sent)(15) & 0xf)), "header type")
      assert(!counts(back(sent).take(40)), "cut off")
      val long = Seq(any(random, 1).copy(data = Seq.fill(90)(7)))
      matching.expect(long)
      for (n <- 1 to 4) assert(!counts(back(long).dropRight(n)), s"$n bytes of it would be FCS")
      assert(counts(back(long)))
      matching.expect(sent)
      assert(counts(back(sent)))
    }
  )
}
