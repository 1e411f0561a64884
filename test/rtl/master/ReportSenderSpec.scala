package flyframe.master

import scala.util.Random
import chisel3._
import chiseltest._
import flyframe.SharedSimulation
import flyframe.protocol.{Order, ServerDatagram}
import org.scalatest.flatspec.AnyFlatSpec

/** Reports as they leave the plant side, with all that goes on around them; [[PlantDriver]] checks each of
  * them: headers, lengths, checksums, FCS, tag, states, events, counter, time.
  */
class ReportSenderSpec extends AnyFlatSpec with SharedSimulation {
  private def is(b: Bool)         = b.peekBoolean()
  private def any(random: Random) = Seq.fill(16)(random.nextInt(256))

  /** The server of a driver, with what it has stored. */
  private class Server(d: PlantDriver, random: Random) {
    var life                  = random.nextLong()
    var turn                  = 0L
    var log: Vector[Seq[Int]] = Vector.empty
    private var lives         = Set(0L)

    /** Stores what a report brings; the answer to it. */
    def take(report: Report, ticket: Long = 0, order: Int = Order.None): Seq[Int] = {
      assert(report.server == life || lives(report.server))
      if (report.server == life) {
        assert(report.first <= log.size, "events are missing")
        log ++= report.events.drop(log.size - report.first.toInt).map(_.take(16))
      }
      turn += 1
      PlantServer.answer(
        life,
        turn,
        report.counter,
        if (report.server == life) log.size else report.first,
        ticket,
        order
      )
    }
    def startAnew(): Unit = {
      lives += life
      life = random.nextLong()
      turn = 0
    }
    def answers(): Unit = for (r <- d.seen()) d.datagram(take(r))
  }

  for ((cycles, mhz) <- Seq(2 -> 50, 4 -> 100, 5 -> 125))
    together(s"$mhz MHz", new PlantSideBench(cycles))(
      "REP-01, REP-02, REP-07, MST-10: each report is right, and each event is told, whatever goes on" -> {
        dut =>
          val random = new Random(mhz)
          val d      = new PlantDriver(dut)
          val server = new Server(d, random)
          var asked  = 0
          var put    = 0
          var seen   = 0
          def round(calm: Boolean): Unit = {
            random.nextInt(if (calm) 1 else 7) match {
              case 1 =>
                val n = Seq(1, 1, 2, 5, 12)(random.nextInt(5))
                if (put - server.log.size < 100) for (_ <- 1 to n) {
                  d.offer(random.nextInt(2), any(random))
                  put += 1
                }
              case 2 => d.knows(Seq(0, 1, 5, 64, 128, random.nextInt(129))(random.nextInt(6)))
              case 3 => dut.status.poke(random.nextInt(1 << 19))
              case 4 => dut.others.poke(BigInt(56, random))
              case 5 if !d.sends =>
                d.askArp()
                asked += 1
              case 6 if random.nextInt(10) == 0 => server.startAnew()
              case _                            =>
            }
            d.looks = random.nextBoolean()
            if (!d.looks) dut.mailbox.looks.poke(false)
            d.steps(random.nextInt(3000))
            for (r <- d.seen()) {
              seen += 1
              if (calm || random.nextInt(4) > 0) d.datagram(server.take(r))
              if (!calm && random.nextInt(4) == 0) d.datagram(Seq.fill(64)(random.nextInt(256)))
            }
          }
          for (_ <- 1 to 400) round(calm = false)
          for (_ <- 1 to 80) round(calm = true)
          assert(server.log.size == put && server.log == d.events)
          assert(d.arps >= asked / 2 && d.arps <= asked && asked > 20 && seen > 80)
          assert(dut.firstEvent.peekInt() == put && dut.nextEvent.peekInt() == put)
      },
      "REP-01: the largest report fits a datagram and leaves whole; the next one is behind it" -> { dut =>
        val random = new Random(mhz + 1)
        val d      = new PlantDriver(dut)
        d.knows(128)
        for (_ <- 1 to 40) d.offer(0, any(random))
        d.ms(40)
        val reports = d.seen()
        assert(reports.size >= 3 && reports.last.slaves.size == 128)
        assert(
          reports.last.events.size == ServerDatagram.Most && reports.last.events.map(_.take(16)) == d.events
            .take(32)
        )
      }
    )

  together("times", new PlantSideBench(2))(
    "REP-03, REP-04: at once, again until it is acknowledged, and as a heartbeat" -> { dut =>
      val random = new Random(5)
      val d      = new PlantDriver(dut)
      val server = new Server(d, random)
      d.ms(3)
      server.answers() // the first report, at the start, and one because the life of the server is new
      d.ms(4)
      assert(d.reports.size == 1 && d.reports.head._2.server == server.life)
      server.answers()
      d.ms(30)
      assert(d.reports.isEmpty)
      d.ms(12)
      assert(d.reports.size == 1, "the heartbeat")
      server.answers()
      d.ms(5)
      d.offer(1, any(random))
      d.ms(2)
      assert(d.reports.map(_._2.events.size) == Seq(1), "at once")
      d.ms(36)
      assert(d.reports.size == 4, "again every 12 ms")
      val first = d.seen()
      d.datagram(server.take(first.head))
      d.ms(3)
      assert(d.reports.isEmpty, "an old answer leaves nothing")
      d.ms(30)
      assert(d.reports.isEmpty)
      dut.status.poke(0x40000)
      d.ms(2)
      assert(d.seen().map(_.fields("status")) == Seq(0x40000L), "another status")
      for (_ <- 1 to 36) d.offer(0, any(random))
      d.ms(5)
      val begun = d.seen().last
      d.ms(14)
      val full = d.seen().last
      assert(begun.events.nonEmpty && full.events.size == 32)
      d.datagram(server.take(full))
      d.ms(3)
      assert(d.reports.map(_._2.events.size) == Seq(4), "what is left, at once")
    },
    "REP-03: seven reports at once at most, and one more with each millisecond" -> { dut =>
      val d = new PlantDriver(dut)
      for (i <- 1 to 120) {
        dut.status.poke(i)
        d.steps(150)
      }
      d.ms(3)
      val times = d.reports.map(_._1)
      for (first <- times.indices; last <- first until times.size) {
        val passed = (times(last) - times(first)) / PlantSideBench.MsCycles
        assert(last - first + 1 <= 7 + passed + 1, s"reports $first to $last")
      }
      assert(times.size > 12 && times(6) - times(0) < 5 * PlantSideBench.MsCycles, "the first ones at once")
    },
    "HOST-03: no report without leave; SRV-03: the server is silent when no right answer comes" -> { dut =>
      val d      = new PlantDriver(dut)
      val server = new Server(d, new Random(6))
      assert(!is(dut.silent))
      d.ms(2)
      val Seq(report) = d.seen()
      dut.run.poke(false)
      d.offer(0, Seq.fill(16)(1))
      for (_ <- 1 to 9) dut.clock.step(100 * PlantSideBench.MsCycles)
      assert(d.reports.isEmpty && !is(dut.silent))
      for (_ <- 1 to 2) dut.clock.step(100 * PlantSideBench.MsCycles)
      assert(is(dut.silent))
      val right = server.take(report)
      d.datagram(right)
      d.ms(2)
      assert(is(dut.silent) && d.refused == 1, "there is nothing to be answered")
      d.refused = 0
      dut.run.poke(true)
      d.steps(10)
      for (i <- right.indices) d.datagram(right.updated(i, right(i) ^ 0x20))
      d.ms(60)
      assert(is(dut.silent) && d.refused == right.size)
      d.datagram(right, from = d.server.copy(ip = d.server.ip + 1))
      d.ms(2)
      assert(is(dut.silent) && d.refused == right.size + 1)
      d.datagram(right)
      d.ms(2)
      assert(!is(dut.silent))
      dut.clock.step(997 * PlantSideBench.MsCycles)
      assert(!is(dut.silent))
      dut.clock.step(3 * PlantSideBench.MsCycles)
      assert(is(dut.silent))
    },
    "REP-05: a number that is older, or of an event that does not exist yet, acknowledges nothing" -> { dut =>
      val d      = new PlantDriver(dut)
      val server = new Server(d, new Random(9))
      var turn   = 0L
      def first  = dut.firstEvent.peekInt().toLong
      def answer(number: Long): Unit = {
        turn += 1
        d.datagram(PlantServer.answer(server.life, turn, d.seen().last.counter, number, 0, Order.None))
        d.ms(2)
      }
      d.ms(2)
      for (_ <- 1 to 9) d.offer(0, Seq.fill(16)(1))
      d.ms(8)
      answer(5)
      assert(first == 5)
      for (wrong <- Seq(0L, 4L, 10L, 11L, 0x7fffffffL, 0x80000000L, 0xffffffffL)) {
        dut.status.poke((wrong & 0xff) + 1) // for another report, which can be answered
        d.ms(8)
        answer(wrong)
        assert(first == 5 && d.refused == 0, s"number $wrong")
      }
      dut.status.poke(0)
      d.ms(8)
      assert(d.reports.last._2.events.size == 4, "and nothing is forgotten")
      answer(9)
      assert(first == 9)
    },
    "SRV-02: an order waits in the mailbox" -> { dut =>
      val d      = new PlantDriver(dut)
      val server = new Server(d, new Random(7))
      d.ms(2)
      val answer = server.take(d.seen().last, ticket = 0x01020304, order = Order.Silence)
      assert(!is(dut.mailbox.waiting))
      d.datagram(answer)
      d.ms(2)
      assert(is(dut.mailbox.waiting))
      val box = answer.indices.map { i =>
        dut.mailbox.readAddress.poke(i)
        dut.mailbox.looks.poke(true)
        d.step()
        dut.mailbox.looks.poke(false)
        val byte = dut.mailbox.readData.peekInt().toInt
        d.step()
        byte
      }
      assert(box == answer)
      d.datagram(server.take(d.seen().last, ticket = 0x01020305, order = Order.Reset))
      d.ms(2)
      assert(d.dropped == 1)
      dut.mailbox.take.poke(true)
      d.step()
      dut.mailbox.take.poke(false)
      d.step()
      assert(!is(dut.mailbox.waiting))
    },
    "REP-06: rooms and events that wait" -> { dut =>
      val random = new Random(8)
      val d      = new PlantDriver(dut)
      def rooms  = dut.rooms.peekInt().toInt
      assert(rooms == 3)
      for ((many, room) <- Seq(63 -> 3, 64 -> 5, 119 -> 5, 120 -> 4, 128 -> 4)) {
        while (d.events.size < many) {
          d.offer(0, any(random))
          d.steps(40)
        }
        assert(rooms == room, s"$many events")
      }
      d.offer(0, any(random))
      d.ms(2)
      assert(d.waitsToBeTaken(0) && d.events.size == 128)
      val server = new Server(d, random)
      d.seen()
      var before = 128
      for (_ <- 1 to 10) {
        d.ms(14)
        server.answers()
        d.ms(3)
        val left = (dut.nextEvent.peekInt() - dut.firstEvent.peekInt()).toInt
        assert(left <= before)
        assert(
          rooms == (if (left >= 120) 4 else if (left >= 64) 5 else if (left >= 32) 7 else 3),
          s"$left events"
        )
        before = left
      }
      assert(before == 0)
      assert(server.log == d.events && d.events.size == 129)
    }
  )
}
