package flyframe.alarm

import java.nio.file.Paths
import scala.util.Random
import chisel3._
import chisel3.util._
import chiseltest._
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.SharedSimulation
import flyframe.frame.FrameParser
import flyframe.mii.NibbleStream
import flyframe.model.{AppendModel, Datagram, Encapsulation, EtherCatFrame, Fcs, Transmitter}
import flyframe.protocol.Command.Nop
import flyframe.replay.Recording

/** The appender behind a parser, as behind the processing unit; a slot every second cycle. */
class AppenderBench(bytes: Int, maxSubTelegrams: Int) extends Module {
  val step     = IO(Input(Bool()))
  val in       = IO(Input(new NibbleStream))
  val out      = IO(Output(new NibbleStream))
  val pending  = IO(Input(Bool()))
  val datagram = IO(Input(Vec(2 * bytes, UInt(4.W))))
  val busy     = IO(Output(Bool()))
  val begins   = IO(Output(Bool()))
  val takes    = IO(Output(Bool()))

  private val parser   = Module(new FrameParser)
  private val appender = Module(new DatagramAppender(bytes, maxSubTelegrams))
  parser.step       := step
  parser.in         := in
  parser.abandon    := false.B
  appender.step     := step
  appender.in       := RegEnable(in, NibbleStream.idle, step)
  appender.position := RegEnable(parser.position, step)
  appender.pending  := pending
  appender.data     := datagram(appender.nibble)
  takes             := appender.takes
  begins            := appender.begins
  assert(RegNext(appender.nextByte === appender.nibble >> 1 || step, true.B), "only a step moves on")
  assert(
    RegNext(appender.nextByte, 0.U) === appender.nibble >> 1 || !appender.busy || !appender.reads,
    "what was said to come next comes next"
  )
  out  := appender.out
  busy := appender.busy
}

class DatagramAppenderSpec extends AnyFlatSpec with SharedSimulation {
  private val Preamble = Vector.fill(15)(5) :+ 0xd

  /** A frame that came out: the slot of its first nibble, its nibbles, the slot of its last one. */
  private case class Sent(slot: Int, payload: Vector[Int], bad: Boolean, end: Int)

  private class Driver(dut: AppenderBench, added: Seq[Int]) {
    private var slot        = 0
    private var payload     = Vector.empty[Int]
    private var start       = -1
    var sent                = Vector.empty[Sent]
    private def is(b: Bool) = b.peekBoolean()
    added.flatMap(b => Seq(b & 0xf, b >> 4)).zipWithIndex.foreach { case (n, i) => dut.datagram(i).poke(n) }
    dut.pending.poke(false)

    private def take(): Unit = {
      val o = dut.out
      if (is(o.valid)) {
        if (start < 0) start = slot
        val data = o.data.peekInt().toInt
        assert(!is(o.end))
        if (is(o.payload)) payload :+= data
      } else if (is(o.end)) {
        assert(start >= 0 && is(o.payload), "an end is behind a frame")
        assert(is(o.crcGood) == fcsGood(payload), "the FCS is what the stream says")
        assert(is(o.odd) == (payload.size % 2 == 1))
        sent :+= Sent(start, payload, is(o.bad), slot - 1)
        payload = Vector.empty
        start = -1
      } else assert(start < 0, "no hole in a frame")
    }
    private def fcsGood(nibbles: Vector[Int]) = Fcs.good(bytesOf(nibbles))

    def cycle(
        valid: Boolean,
        behindSfd: Boolean,
        data: Int,
        end: Boolean = false,
        bad: Boolean = false,
        odd: Boolean = false,
        crcGood: Boolean = false
    ): Unit = {
      dut.in.valid.poke(valid)
      dut.in.payload.poke(behindSfd)
      dut.in.data.poke(data)
      dut.in.end.poke(end)
      dut.in.bad.poke(bad)
      dut.in.odd.poke(odd)
      dut.in.crcGood.poke(crcGood)
      dut.step.poke(true)
      dut.clock.step()
      dut.step.poke(false)
      take()
      dut.clock.step()
      slot += 1
    }
    def idle(slots: Int): Unit = (1 to slots).foreach(_ => cycle(false, false, 0))
    def frame(nibbles: Vector[Int], bad: Boolean): Int = {
      val begin = slot
      for (n <- Preamble) cycle(true, false, n)
      for (n <- nibbles) cycle(true, true, n)
      cycle(false, true, 0, end = true, bad, odd = nibbles.size % 2 == 1, fcsGood(nibbles))
      begin
    }
    def pending(on: Boolean): Unit = dut.pending.poke(on)
  }

  private def nibbles(bytes: Seq[Int]): Vector[Int] = bytes.flatMap(b => Seq(b & 0xf, b >> 4)).toVector
  private def bytesOf(nibbles: Seq[Int]): Seq[Int] =
    nibbles.grouped(2).collect { case Seq(low, high) => low | high << 4 }.toSeq
  private def closed(bytes: Seq[Int]): Vector[Int] = nibbles(bytes ++ Fcs.of(bytes))
  private def empty(area: Int = 44): Vector[Int] =
    closed(EtherCatFrame(Nil).take(14) ++ Seq(0x00, 0x10) ++ Seq.fill(area)(0))

  /** A frame of any kind, and whether it is bad. */
  private def any(random: Random): (Vector[Int], Boolean) = {
    def datagram() = Datagram(
      random.nextInt(15),
      random.nextInt(0x10000),
      random.nextInt(0x10000),
      Seq.fill(random.nextInt(4) match {
        case 0 => 0; case 1 => random.nextInt(200); case _ => random.nextInt(20)
      })(random.nextInt(256))
    )
    val form      = if (random.nextInt(5) > 0) Encapsulation.Basic else Encapsulation.all(random.nextInt(4))
    val datagrams = Seq.fill(random.nextInt(6))(datagram())
    val whole = EtherCatFrame(datagrams, form, if (random.nextInt(20) == 0) random.nextInt(16) else 1) ++
      (if (random.nextInt(4) == 0) Seq.fill(random.nextInt(60))(random.nextInt(256)) else Nil)
    val spoiled =
      if (random.nextInt(8) == 0) whole.updated(random.nextInt(24) min (whole.size - 1), random.nextInt(256))
      else whole
    val right = closed(spoiled)
    random.nextInt(10) match {
      case 0 => (right.take(1 + random.nextInt(right.size)), true)
      case 1 => (right, true)
      case 2 => (right :+ random.nextInt(16), random.nextBoolean())
      case _ => (right, false)
    }
  }

  for (max <- Seq(1, 4, 15, 128)) {
    val record =
      Datagram(Nop, 0x1234, 0x0e80, Seq(1, 2, 3, 4, 5, 6, 7, 8)).copy(workingCounter = 1, index = 0x5a)
    val added = record.bytes(more = false)
    together(s"maxSubTelegrams $max", new AppenderBench(added.size, max))(
      "AP-01: with nothing pending it is a wire" -> { dut =>
        val random = new Random(1)
        val driver = new Driver(dut, added)
        for (_ <- 1 to 40) {
          val (frame, bad) = any(random)
          val begin        = driver.frame(frame, bad)
          driver.idle(1)
          val got = driver.sent.last
          assert(got.slot == begin && got.payload == frame && got.bad == bad)
          driver.idle(random.nextInt(30))
        }
      },
      "AP-02, AP-05: an empty frame takes the datagram in place of padding and keeps its length" -> { dut =>
        val driver = new Driver(dut, added)
        driver.pending(true)
        val begin = driver.frame(empty(), bad = false)
        driver.idle(30)
        val got = driver.sent.head
        assert(got.slot == begin + DatagramAppender.Delay)
        assert(!got.bad)
        val bytes = EtherCatFrame(Nil).take(14) ++ EtherCatFrame.little(added.size | 0x1000) ++
          added.updated(1, 0) // no datagram has counted slaves
        assert(got.payload == closed(bytes.padTo(60, 0)))
      },
      "AP-03 to AP-08: random frames leave as the model says" -> { dut =>
        val random = new Random(max)
        val driver = new Driver(dut, added)
        for (number <- 1 to 400) {
          val pending      = random.nextInt(4) > 0
          val (frame, bad) = any(random)
          driver.pending(pending)
          driver.frame(frame, bad)
          driver.pending(random.nextBoolean())
          driver.idle(110)
          val AppendModel.Result(expected, expectedBad, _) =
            if (pending) AppendModel.append(frame, bad, added, max) else AppendModel.Result(frame, bad)
          val got = driver.sent.last
          assert(driver.sent.size == number)
          assert(got.payload == expected && got.bad == expectedBad, s"frame $number, $frame")
        }
      },
      "AP-09: frames at the minimum gap stay whole, in order, and apart" -> { dut =>
        val random = new Random(100 + max)
        val driver = new Driver(dut, added)
        var frames = Vector.empty[(Vector[Int], Boolean)]
        driver.pending(true)
        for (_ <- 1 to 300) {
          val next = any(random)
          frames :+= next
          driver.frame(next._1, next._2)
          driver.idle(23 + (if (random.nextInt(5) == 0) random.nextInt(60) else -random.nextInt(3)))
        }
        driver.idle(400)
        assert(driver.sent.size == frames.size)
        var appended = 0
        for ((got, (frame, bad)) <- driver.sent.zip(frames)) {
          val changed = AppendModel.append(frame, bad, added, max)
          if (got.payload == changed.payload && got.bad == changed.bad) appended += 1
          else assert(got.payload == frame && got.bad == bad)
        }
        assert(appended > 30)
        for (Seq(a, b) <- driver.sent.sliding(2)) {
          // What the transmitter adds takes of the gap.
          val mark =
            if (a.bad) Transmitter.bad(0, hasSfd = true, a.payload).payload.size - a.payload.size else 0
          assert(b.slot - a.end - 1 - mark >= (if (mark > 1) 18 else 20))
        }
      },
      "AP-02, AP-03: frames grow up to the longest of Ethernet, and stay good" -> { dut =>
        val random = new Random(200 + max)
        val driver = new Driver(dut, added)
        driver.pending(true)
        for (length <- Seq(0, 12) ++ (1470 to 1498 by 4) ++ Seq(1477, 1479)) {
          // As many datagrams as there may be at most; the rest of the area is in the last one.
          val count = if (length == 0) 0 else 1 + random.nextInt((max - 1) max 1 min length / 12)
          val list = Seq.tabulate(count)(i =>
            Datagram(Nop, 0, i, Seq.fill(if (i < count - 1) 0 else length - 12 * count)(random.nextInt(256)))
          )
          val vlan  = random.nextBoolean()
          val bytes = EtherCatFrame(list, if (vlan) Encapsulation.Vlan else Encapsulation.Basic)
          driver.frame(closed(bytes), bad = false)
          driver.idle(110)
          val got   = driver.sent.last
          val grown = got.payload.size / 2
          assert(!got.bad && Fcs.good(bytesOf(got.payload)))
          assert(grown <= 1518 + (if (vlan) 4 else 0), s"area of $length bytes")
          val appends = length + added.size <= 1498 && length < 12 * max
          assert(
            got.payload == (if (appends) AppendModel.append(closed(bytes), false, added, max).payload
                            else closed(bytes))
          )
        }
      },
      "AP-03 to AP-05: tshark finds a datagram with working counter 1 and nothing wrong" -> { dut =>
        val random = new Random(300 + max)
        val driver = new Driver(dut, added)
        driver.pending(true)
        val counts = 0 to 15
        val lists =
          counts.map(n => Seq.tabulate(n)(i => Datagram(i % 15, 0, 0x0f80 + i, Seq.fill(i % 2)(i)))) :+
            Seq(Datagram(Nop, 0, 0, Seq.fill(1498 - 20 - 12)(random.nextInt(256)))) // full with the new one
        val expected =
          for (
            (list, form) <- lists
              .zip(Iterator.continually(Seq(Encapsulation.Basic, Encapsulation.Vlan)).flatten)
          ) yield {
            driver.frame(closed(EtherCatFrame(list, form)), bad = false)
            driver.idle(110)
            val area = list.map(_.data.size + 12).sum
            if (area < 12 * max) list :+ record else list
          }
        val file = Paths.get(s"build/replay/appended-$max.pcap")
        Recording.write(file, driver.sent.map(s => bytesOf(s.payload).dropRight(4)))
        assert(Recording.tshark(file, "-Y", Recording.Wrong) == Nil)
        val names  = Seq("ecatf.length", "ecat.cmd", "ecat.subframe.length", "ecat.subframe.more", "ecat.cnt")
        val last   = Seq("ecat.adp", "ecat.ado")
        val fields = (names ++ last).flatMap(Seq("-e", _))
        val lines  = Recording.tshark(file, Seq("-T", "fields", "-E", "separator=;") ++ fields: _*)
        assert(lines.size == lists.size)
        for ((line, list) <- lines.zip(expected)) {
          val values = line
            .split(";", -1)
            .toSeq
            .map(_.split(",").toSeq.filter(_.nonEmpty).map(v => Integer.decode(v).toInt))
          val Seq(length, commands, lengths, more, counters) = values.take(5)
          assert(length == Seq(list.map(_.data.size + 12).sum))
          if (list.nonEmpty) {
            assert(commands == list.map(_.command) && lengths == list.map(_.data.size), line)
            assert(more == Seq.fill(list.size - 1)(1) :+ 0, line)
            assert(counters == list.map(_.workingCounter), line)
            if (list.last == record) assert(values.drop(5).map(_.last) == Seq(0x1234, 0x0e80), line)
          }
        }
        assert(expected.count(_.lastOption.contains(record)) >= (if (max == 1) 1 else max min 16))
      }
    )
  }
}
