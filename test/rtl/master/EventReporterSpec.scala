package flyframe.master

import java.nio.ByteBuffer
import scala.util.Random
import chisel3._
import chisel3.util._
import chiseltest._
import flyframe.SharedSimulation
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.protocol.ServerDatagram

/** Reporter and UDP sender as in a master. */
class ReporterBench(depth: Int) extends Module {
  private val reporter = Module(new EventReporter(depth))
  private val sender   = Module(new UdpSender)
  val event            = IO(Flipped(Decoupled(UInt(16.W))))
  val other            = IO(Flipped(Decoupled(UInt(16.W))))
  val status           = IO(Input(new ReporterStatus))
  val room             = IO(Output(Bool()))
  val millisecond      = IO(Input(Bool()))
  val acknowledge      = IO(Flipped(Valid(UInt(32.W))))
  val bytes            = IO(Decoupled(new FrameByte))
  reporter.event(0) <> event
  reporter.event(1) <> other
  reporter.status      := status
  room                 := reporter.room
  reporter.millisecond := millisecond
  reporter.repeatMs    := 10.U
  reporter.heartbeatMs := 100.U
  reporter.acknowledge := acknowledge
  sender.setting       := 0.U
  sender.start         := reporter.start
  sender.length        := reporter.length
  reporter.busy        := sender.busy
  reporter.readAddress := sender.readAddress
  sender.readData      := reporter.readData
  bytes <> sender.bytes
}

class EventReporterSpec extends AnyFlatSpec with SharedSimulation {
  private def is(b: Bool) = b.peek().litToBoolean
  private case class Event(
      kind: Int,
      position: Int,
      node: Int,
      sequence: Int,
      state: Int,
      epoch: Int,
      time: Long
  ) {
    def words: Seq[Int] =
      Seq(kind << 8 | position, node, sequence, state << 8 | epoch, (time >> 16).toInt, (time & 0xffff).toInt)
  }
  private case class Report(first: Long, present: Int, lost: Long, events: Seq[(Event, Long)])

  private class Driver(dut: ReporterBench) {
    var reports       = Vector.empty[Report]
    private var frame = Vector.empty[Byte]
    private var time  = 0
    dut.event.valid.poke(false)
    dut.other.valid.poke(false)
    dut.acknowledge.valid.poke(false)
    dut.bytes.ready.poke(true)
    dut.status.master.poke(0x1234)
    dut.status.boot.poke(0x5678)
    dut.status.present.poke(5)
    dut.status.known.poke(6)
    dut.status.lost.poke(77)

    def cycle(): Unit = {
      if (is(dut.bytes.valid)) {
        frame :+= dut.bytes.bits.data.peek().litValue.toByte
        if (is(dut.bytes.bits.last)) {
          reports :+= parse(ByteBuffer.wrap(frame.drop(42).toArray))
          frame = Vector.empty
        }
      }
      dut.status.time.poke(time)
      dut.clock.step()
      time += 1
    }
    private def parse(b: ByteBuffer): Report = {
      def u8()  = b.get & 0xff
      def u16() = b.getShort & 0xffff
      def u32() = b.getInt & 0xffffffffL
      assert((u16(), u8(), u8(), u16(), u16()) == (0x4641, 1, 1, 0x1234, 0x5678))
      val first            = u32()
      val (count, spare)   = (u8(), u8())
      val (present, known) = (u8(), u8())
      val (_, lost)        = (u32(), u32())
      assert(spare == 0 && known == 6)
      val events = Seq.fill(count)((Event(u8(), u8(), u16(), u16(), u8(), u8(), u32()), u32()))
      assert(!b.hasRemaining)
      Report(first, present, lost, events)
    }
    def put(e: Event): Unit = {
      offer(dut.event, e)
    }
    def offer(source: DecoupledIO[UInt], e: Event): Unit = {
      source.valid.poke(true)
      for (word <- e.words) {
        source.bits.poke(word)
        while (!is(source.ready)) cycle()
        cycle()
      }
      source.valid.poke(false)
      cycle()
      cycle()
    }
    def acknowledge(number: Long): Unit = {
      dut.acknowledge.bits.poke(number & 0xffffffffL)
      dut.acknowledge.valid.poke(true)
      cycle()
      dut.acknowledge.valid.poke(false)
    }
    def milliseconds(n: Int): Unit = for (_ <- 1 to n) {
      dut.millisecond.poke(true)
      cycle()
      dut.millisecond.poke(false)
      (1 to 5).foreach(_ => cycle())
    }
    def settle(): Unit = (1 to 12000).foreach(_ => cycle())
    def seen(): Seq[Report] = {
      val now = reports
      reports = Vector.empty
      now
    }
  }
  private def any(random: Random) = Event(
    random.nextInt(256),
    random.nextInt(256),
    random.nextInt(0x10000),
    random.nextInt(0x10000),
    random.nextInt(256),
    random.nextInt(256),
    random.nextInt() & 0xffffffffL
  )

  together("128 events", new ReporterBench(128))(
    "REP-01, REP-04: a heartbeat at the start and whenever nothing is to be told" -> { dut =>
      val driver = new Driver(dut)
      driver.settle()
      assert(driver.seen() == Seq(Report(0, 5, 77, Nil)))
      driver.milliseconds(90)
      assert(driver.seen().isEmpty)
      driver.milliseconds(20)
      driver.settle()
      assert(driver.seen() == Seq(Report(0, 5, 77, Nil)))
    },
    "REP-02, REP-03: an event is reported at once, and again until it is acknowledged" -> { dut =>
      val random = new Random(1)
      val driver = new Driver(dut)
      driver.settle()
      driver.seen()
      for (n <- 0 until 3) {
        val e = any(random)
        driver.put(e)
        driver.settle()
        val Seq(report) = driver.seen()
        assert(report.first == n && report.events.map(_._1) == Seq(e))
        driver.milliseconds(12)
        driver.settle()
        assert(driver.seen() == Seq(report), "again")
        driver.acknowledge(n)
        driver.milliseconds(12)
        driver.settle()
        assert(driver.seen() == Seq(report), "that was an old acknowledgement")
        driver.acknowledge(n + 2)
        driver.milliseconds(12)
        driver.settle()
        assert(driver.seen() == Seq(report), "that was about an event which does not exist yet")
        driver.acknowledge(n + 1)
        driver.milliseconds(50)
        driver.settle()
        assert(driver.seen().isEmpty)
      }
    },
    "REP-05: events stay in order, none is lost or doubled, whatever the server acknowledges" -> { dut =>
      val random   = new Random(2)
      val driver   = new Driver(dut)
      val events   = Seq.fill(300)(any(random))
      var received = Vector.empty[Event]
      def serve(): Unit = for (r <- driver.seen()) {
        assert(r.first <= received.size && r.events.size <= ServerDatagram.Most)
        if (random.nextInt(3) > 0) {
          val known = (received.size - r.first).toInt
          received ++= r.events.drop(known).map(_._1)
          if (random.nextInt(3) > 0) driver.acknowledge(received.size)
        }
      }
      for (e <- events) {
        driver.put(e)
        if (random.nextInt(3) == 0) (1 to random.nextInt(2500)).foreach(_ => driver.cycle())
        serve()
        if (random.nextInt(20) == 0) {
          driver.milliseconds(11)
          driver.settle()
          serve()
        }
        // Never beyond what it can keep: the line waits.
        var tries = 0
        while (!is(dut.room) && tries < 40) {
          driver.milliseconds(11)
          driver.settle()
          serve()
          tries += 1
        }
      }
      for (_ <- 1 to 40) {
        driver.milliseconds(11)
        driver.settle()
        serve()
      }
      assert(received == events)
    },
    "REP-02: events of both sources come whole, those of the first source first" -> { dut =>
      val random = new Random(4)
      val driver = new Driver(dut)
      driver.settle()
      driver.seen()
      val (mine, others) = (Seq.fill(3)(any(random)), any(random))
      dut.other.valid.poke(true)
      dut.other.bits.poke(others.words.head)
      mine.foreach(driver.put)
      driver.offer(dut.other, others)
      driver.settle()
      driver.milliseconds(12)
      driver.settle()
      assert(driver.seen().last.events.map(_._1) == mine :+ others)
    },
    "REP-06: when it is full, events wait" -> { dut =>
      val random = new Random(3)
      val driver = new Driver(dut)
      val events = Seq.fill(126)(any(random)) // two places are for the header
      events.foreach(driver.put)
      dut.event.valid.poke(true)
      driver.settle()
      assert(!is(dut.event.ready) && !is(dut.room))
      dut.event.valid.poke(false)
      driver.settle()
      driver.seen()
      driver.milliseconds(12)
      driver.settle()
      val Seq(report) = driver.seen()
      assert(report.events.map(_._1) == events.take(64))
      driver.acknowledge(64)
      driver.settle()
      assert(driver.seen().map(_.events.map(_._1)) == Seq(events.drop(64)), "the others at once")
      val late = any(random)
      driver.put(late)
      driver.settle()
      assert(driver.seen().last.events.map(_._1) == events.drop(64) :+ late)
    }
  )
}
