package flyframe.master

import scala.util.Random
import chisel3._
import chisel3.util._
import chiseltest._
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.SharedSimulation
import flyframe.mii.NibbleStream
import flyframe.model.{Datagram, EtherCatFrame, Fcs}
import flyframe.protocol.Command.Nop

/** Composer and sender as in a master. */
class ComposerBench(maxSubTelegrams: Int) extends Module {
  private val composer = Module(new FrameComposer(maxSubTelegrams))
  private val sender   = Module(new EthernetSender)
  val step             = IO(Input(Bool()))
  val out              = IO(Output(new NibbleStream))
  val clear            = IO(Input(Bool()))
  val datagram         = IO(Flipped(Decoupled(new DatagramToSend)))
  val data             = IO(Flipped(Decoupled(UInt(8.W))))
  val full             = IO(Output(Bool()))
  val send             = IO(Input(Bool()))
  val busy             = IO(Output(Bool()))
  composer.source := "h665544332210".U
  composer.clear  := clear
  composer.datagram <> datagram
  composer.data <> data
  full          := composer.full
  composer.send := send
  busy          := composer.busy
  sender.bytes <> composer.bytes
  sender.step := step
  out         := sender.out
}

/** Receiver and matcher as in a master. */
class MatcherBench(maxSubTelegrams: Int) extends Module {
  private val receiver = Module(new EthernetReceiver)
  private val matcher  = Module(new AnswerMatcher(maxSubTelegrams))
  val step             = IO(Input(Bool()))
  val in               = IO(Input(new NibbleStream))
  val clear            = IO(Input(Bool()))
  val expect           = IO(Flipped(Valid(new DatagramToSend)))
  val data             = IO(Output(Valid(UInt(8.W))))
  val offset           = IO(Output(UInt(11.W)))
  val number           = IO(Output(UInt(7.W)))
  val word             = IO(Output(Valid(new AnswerWord)))
  val done             = IO(Output(Valid(Bool())))
  receiver.step  := step
  receiver.in    := in
  matcher.byte   := receiver.byte
  matcher.first  := receiver.first
  matcher.end    := receiver.end
  matcher.clear  := clear
  matcher.expect := expect
  data           := matcher.data
  offset         := matcher.offset
  number         := matcher.number
  word           := matcher.word
  done           := matcher.done
}

class MasterFrameSpec extends AnyFlatSpec with SharedSimulation {
  private def is(b: Bool) = b.peek().litToBoolean
  private def any(random: Random, most: Int) = Datagram(
    random.nextInt(15),
    random.nextInt(),
    Seq.fill(random.nextInt(most))(random.nextInt(256)),
    index = random.nextInt(256)
  ).copy(address = random.nextInt() & 0xffffffffL)

  private class Composing(dut: ComposerBench) {
    dut.clear.poke(false)
    dut.send.poke(false)
    dut.datagram.valid.poke(false)
    dut.data.valid.poke(false)
    dut.step.poke(false)
    def pulse(signal: Bool): Unit = {
      signal.poke(true)
      dut.clock.step()
      signal.poke(false)
    }
    def offer(d: Datagram): Boolean = {
      val bits = dut.datagram.bits
      bits.command.poke(d.command)
      bits.index.poke(d.index)
      bits.address.poke(d.address)
      bits.length.poke(d.data.size)
      dut.datagram.valid.poke(true)
      val taken = !is(dut.full)
      for (_ <- 1 to 20 if taken && !is(dut.datagram.ready)) dut.clock.step()
      assert(taken == is(dut.datagram.ready))
      dut.clock.step()
      dut.datagram.valid.poke(false)
      if (taken) {
        for (b <- d.data) {
          dut.data.bits.poke(b)
          dut.data.valid.poke(true)
          while (!is(dut.data.ready)) dut.clock.step()
          dut.clock.step()
        }
        dut.data.valid.poke(false)
        while (is(dut.busy)) dut.clock.step()
      }
      taken
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
        if (is(dut.out.valid) && is(dut.out.payload)) payload :+= dut.out.data.peek().litValue.toInt
        ended = is(dut.out.valid) && is(dut.out.last)
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

  for (max <- Seq(1, 4, 15))
    together(s"maxSubTelegrams $max", new ComposerBench(max))(
      "MST-02: datagrams become a frame, which can be sent again; then a new one begins" -> { dut =>
        val random   = new Random(max)
        val composer = new Composing(dut)
        for (round <- 1 to 12) {
          composer.pulse(dut.clear)
          val datagrams = Seq.fill(random.nextInt(max + 1))(any(random, 90))
          for (d <- datagrams) assert(composer.offer(d))
          for (_ <- 1 to 1 + round % 2) assert(composer.send(1 + round % 4) == wire(datagrams))
        }
      },
      "MST-03: what does not fit is refused and changes nothing" -> { dut =>
        val random   = new Random(max)
        val composer = new Composing(dut)
        composer.pulse(dut.clear)
        var taken = Vector.empty[Datagram]
        for (_ <- 1 to 20) {
          val d = any(random, 700)
          if (composer.offer(d)) taken :+= d
          val area = (taken :+ d).map(_.data.size + 12).sum
          assert(taken.lastOption.contains(d) || taken.size == max || area > 1498)
        }
        assert(composer.send(2) == wire(taken))
        composer.pulse(dut.clear)
        assert(!composer.offer(any(random, 1).copy(data = Seq.fill(1487)(1))))
        assert(composer.offer(any(random, 1).copy(data = Seq.fill(1486)(1))))
      }
    )

  private case class Seen(number: Int, address: Long, counter: Int, appended: Boolean, data: Seq[Int])

  private class Matching(dut: MatcherBench) {
    def expect(sent: Seq[Datagram]): Unit = {
      dut.step.poke(false)
      dut.expect.valid.poke(false)
      dut.clear.poke(true)
      dut.clock.step()
      dut.clear.poke(false)
      for (d <- sent) {
        dut.expect.bits.command.poke(d.command)
        dut.expect.bits.index.poke(d.index)
        dut.expect.bits.length.poke(d.data.size)
        dut.expect.bits.address.poke(d.address)
        dut.expect.valid.poke(true)
        dut.clock.step()
      }
      dut.expect.valid.poke(false)
    }

    /** What it says of a frame: the datagrams, and whether they count. */
    def receive(bytes: Seq[Int], bad: Boolean = false): (Seq[Seen], Boolean) = {
      val payload = (bytes ++ Seq(1, 2, 3, 4)).flatMap(b => Seq(b & 0xf, b >> 4))
      var seen    = Vector.empty[Seen]
      var data    = Vector.empty[Int]
      var words   = Vector.fill(AnswerWord.Count)(0)
      var done    = Option.empty[Boolean]
      def look(): Unit = {
        if (is(dut.data.valid)) {
          assert(dut.offset.peek().litValue == data.size)
          data :+= dut.data.bits.peek().litValue.toInt
        }
        if (is(dut.word.valid)) {
          val place = dut.word.bits.place.peek().litValue.toInt
          words = words.updated(place, dut.word.bits.data.peek().litValue.toInt)
          if (place == AnswerWord.Counter) {
            assert((words(AnswerWord.Kind) & 0x7fff) == data.size)
            val kept = (0 until 8).map(i => words(AnswerWord.Data + i / 2) >> 8 * (i % 2) & 0xff)
            assert(data.take(8) == kept.take(data.size))
            seen :+= Seen(
              dut.number.peek().litValue.toInt,
              words(AnswerWord.Ado).toLong << 16 | words(AnswerWord.Adp),
              words(AnswerWord.Counter),
              words(AnswerWord.Kind) >> 15 == 1,
              data
            )
            data = Vector.empty
          }
        }
        if (is(dut.done.valid)) done = Some(is(dut.done.bits))
      }
      for ((nibble, i) <- (Seq.fill(15)(5) ++ Seq(13) ++ payload ++ Seq.fill(4)(0)).zipWithIndex) {
        dut.in.valid.poke(i < 16 + payload.size)
        dut.in.payload.poke(i >= 16)
        dut.in.data.poke(nibble)
        dut.in.last.poke(i == 15 + payload.size)
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

  together("answers", new MatcherBench(15))(
    "MST-04: what comes back as sent counts, with its data and working counter" -> { dut =>
      val random   = new Random(1)
      val matching = new Matching(dut)
      for (_ <- 1 to 20) {
        val sent = Seq.fill(random.nextInt(6))(any(random, 60))
        val came = sent.map(d =>
          d.copy(
            data = d.data.map(_ ^ 0x55),
            workingCounter = random.nextInt(0x10000),
            address = random.nextInt(0x1000)
          )
        )
        matching.expect(sent)
        val (seen, good) = matching.receive(back(came))
        assert(good && seen == came.zipWithIndex.map { case (d, i) =>
          Seen(i, d.address, d.workingCounter, appended = false, d.data)
        })
      }
    },
    "MST-05: datagrams of slaves behind them are told apart" -> { dut =>
      val random   = new Random(2)
      val matching = new Matching(dut)
      for (count <- 0 to 3; more <- 1 to 3) {
        val sent  = Seq.fill(count)(any(random, 20))
        val added = Seq.fill(more)(any(random, 20).copy(command = Nop, workingCounter = 1))
        matching.expect(sent)
        val (seen, good) = matching.receive(back(sent ++ added))
        assert(good && seen.map(_.appended) == Seq.fill(count)(false) ++ Seq.fill(more)(true))
        assert(seen.drop(count).map(s => (s.address, s.data)) == added.map(d => (d.address, d.data)))
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
      assert(!counts(back(sent).updated(14, back(sent)(14) ^ 1)), "length of the area")
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
