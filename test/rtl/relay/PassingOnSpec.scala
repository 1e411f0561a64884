package flyframe.relay

import chisel3._
import chiseltest._
import flyframe.{Simulation, Tier}
import flyframe.can.{CanFrame, StuffingModel}
import flyframe.params.CanParams
import flyframe.registers.RingRegisters
import org.scalatest.flatspec.AnyFlatSpec
import scala.annotation.tailrec
import scala.collection.mutable
import scala.util.Random

class PassingOnSpec extends AnyFlatSpec {
  private val tier =
    Tier("Passing on in RTL against the model", "core cycles", test = 900000, soak = 50000000)
  private val Seed = 4L

  /** What comes in at a port: frames one behind the other, of which some are disturbed, and of 30 so many die
    * right behind their header.
    */
  private class Source(random: Random, bit: Int, dying: Int) {
    private val levels = mutable.Queue.empty[(Boolean, Double)] // and for how many bits
    private var level  = true
    private var left   = 0.0
    // All phases are seen if it is far off.
    private val ppm  = if (dying > 1) 500 else random.nextInt(1001) - 500
    private var calm = 1

    def next(): Boolean = {
      if (left < 1) {
        if (levels.isEmpty) levels ++= Source.frame(random, calm, dying)
        if (random.nextInt(800 * bit) == 0) calm = 1 + random.nextInt(300)
        val (next, bits) = levels.dequeue()
        level = next
        left += bit * bits * (1 + ppm / 1e6)
      }
      left -= 1
      level
    }
  }

  private object Source {
    def frame(random: Random, calm: Int, dying: Int): Seq[(Boolean, Double)] = {
      def steady(levels: Seq[Boolean]) = levels.map(_ -> 1.0)
      val extended                     = random.nextBoolean()
      val remote                       = random.nextInt(6) == 0
      val dlc                          = random.nextInt(10)
      val id                           = random.nextInt(if (random.nextBoolean()) 4 else 1 << 11)
      val data                         = Seq.fill(if (remote) 0 else dlc min 8)(random.nextInt(256))
      val hops                         = if (random.nextInt(20) == 0) 0 else random.nextInt(256)
      val header =
        LinkHeader(random.nextInt(4), random.nextInt(2), random.nextInt(128), random.nextInt(1 << 14), hops)
      val good =
        LinkFrame.levels(header, LinkBody.of(header, CanFrame(id, extended, remote, dlc, data))).toSeq
      val sent = random.nextInt(30) match {
        case 0                  => steady(good.updated(random.nextInt(good.size), random.nextBoolean()))
        case 1                  => steady(good.take(random.nextInt(good.size)) ++ Seq.fill(7)(false))
        case 2                  => steady(Seq.fill(random.nextInt(60))(random.nextBoolean()))
        case n if n < 3 + dying => shortest(random)
        case _                  => steady(good)
      }
      sent ++ steady(Seq.fill(7 + random.nextInt(calm))(true))
    }

    /** The shortest life of a frame: its header ends in five recessive bits, and is right; a pulse makes the
      * next sample come early, which is one more of them. Both can be told in one bit of the node.
      */
    @tailrec private def shortest(random: Random): Seq[(Boolean, Double)] = {
      val header =
        LinkHeader(LinkKind.Data, 1, 1 + random.nextInt(9), random.nextInt(1 << 14), 1 + random.nextInt(255))
      val frame    = CanFrame(1, extended = false, remote = false, 0, Nil)
      val stuffing = new StuffingModel
      var bits     = 0
      stuffing.begin()
      val levels = LinkFrame.levels(header, LinkBody.of(header, frame)).takeWhile { level =>
        val isInside = bits <= LinkHeader.Bits
        if (!stuffing.awaits) bits += 1
        stuffing.take(level)
        isInside
      }
      if (levels.takeRight(5).forall(identity))
        levels.init.toSeq.map(_ -> 1.0) ++ Seq(true -> 0.75, false -> 0.1)
      else shortest(random)
    }
  }

  for ((mhz, share) <- Seq(50 -> 1, 100 -> 2))
    s"FR-44 to FR-49, RB-07 to RB-10, RB-15, RB-19 to RB-21: what a node of $mhz MHz passes on" should
      "be what the model passes on, in each cycle" in {
        val size = tier.share(share, 3)
        tier.run(s"$mhz MHz", size, Some(Seed))(passesOn(CanParams(coreClockMhz = mhz), size))
      }

  private def passesOn(p: CanParams, size: Long): Unit = {
    val schedule = Schedule(p)
    val least    = LinkTiming.least(p.coreClockMhz)
    val cycles   = 4000 * least // of a run
    val design   = Simulation.annotations(this, s"passing on ${p.coreClockMhz}")
    RawTester.test(new PassingOn(schedule), design) { dut =>
      val random = new Random(Seed)
      val most   = Array(0L, 0L)
      for (first <- 0L until size by cycles) {
        val bit    = if (first == 0 || random.nextBoolean()) least else random.between(least, 2 * least)
        val model  = new RelayModel(p)
        val source = Seq.fill(2)(new Source(random, bit, dying = if (first == 0) 17 else 1))
        val up     = Array(true, true)
        // Ports that change often do so in the bit in which a header is complete at the other one, too.
        val calm = if (first / cycles % 3 == 1) 40 else 1600
        val seen = mutable.Map.empty[Int, Long].withDefaultValue(0L)
        model.write(RingRegisters.LinkBit, Seq(bit, 0))
        model.write(RingRegisters.Address, Seq(Own))
        model.write(RingRegisters.Confirm, Seq(20, 0, 0)) // and no repeats
        model.write(RingRegisters.Control, Seq(1 << RingRegisters.Relay))
        dut.bitCycles.poke(bit)
        dut.on.poke(true)
        dut.address.poke(Own)
        val bytes = Array.fill(2)(IndexedSeq.fill(32)(0)) // of the own frame that leaves
        model.node.begins = (port, header, body) => bytes(port) = bytesOf(header, body)
        for (p <- 0 to 1) {
          dut.offer(p).poke(false)
          dut.fetched(p).valid.poke(false)
          dut.up(p).poke(false)
          dut.heard(p).poke(true)
        }
        dut.read.valid.poke(false)
        dut.reset.poke(true.B)
        dut.clock.step(2)
        dut.reset.poke(false.B)
        val c = dut.counts
        val counters = Seq(
          RelayCounter.BadHeader     -> c.badHeader(0),
          RelayCounter.BadHeader + 1 -> c.badHeader(1),
          RelayCounter.BadFrame      -> c.badFrame(0),
          RelayCounter.BadFrame + 1  -> c.badFrame(1),
          RelayCounter.Stray         -> c.stray,
          RelayCounter.Aborted       -> c.aborted,
          RelayCounter.Wrapped       -> c.wrapped,
          RelayCounter.Passed        -> c.passed(0),
          RelayCounter.Passed + 1    -> c.passed(1)
        )
        for (cycle <- 0 until cycles) {
          for (p <- 0 to 1) {
            if (random.nextInt((if (up(p)) calm else calm / 5) * bit) == 0) up(p) = !up(p)
            dut.up(p).poke(up(p))
          }
          val heard = source.map(_.next())
          for (p <- 0 to 1) {
            dut.heard(p).poke(heard(p))
            val level = model.level(p)
            assert(dut.level(p).peekBoolean() == level, s"cycle $cycle with bits of $bit, port $p")
          }
          own(dut, bytes)
          if (random.nextInt(8 * bit) == 0) {
            val slot  = random.nextInt(16)
            val id    = random.nextInt(if (random.nextInt(3) == 0) 1 << 11 else 1 << 3)
            val frame = CanFrame(id, false, false, 8, Seq.fill(8)(random.nextInt(256)))
            RingHost.request(model.host, slot, frame)
          }
          for ((which, pulse) <- counters) if (pulse.peekBoolean()) seen(which) += 1
          model.step((heard(0), heard(1)), (up(0), up(1)))
          if (cycle % bit == bit - 1) for (p <- 0 to 1) {
            dut.offer(p).poke(model.node.offered(p).nonEmpty)
          }
          for (p <- 0 to 1)
            if ((cycle + 1) % bit == schedule.decisions(p) - 1)
              dut.order.poke(model.node.offered(p).getOrElse(0L))
          dut.clock.step()
        }
        for ((which, _) <- counters)
          assert(
            ((seen(which) min (if (which >= RelayCounter.Passed) Long.MaxValue else 255L)) -
              model.node.counters(which)).abs <= 1,
            s"counter $which"
          )
        for (p <- 0 to 1) most(p) = most(p) max model.node.transits(p).most
      }
      assert(most.max >= LinkFrame.Many, "a transit buffer was half full")
    }
  }

  /** Bytes of own frames that are asked for come in the next cycle. */
  private def own(dut: PassingOn, bytes: Array[IndexedSeq[Int]]): Unit = for (p <- 0 to 1) {
    val isAsked = dut.fetch(p).valid.peekBoolean()
    dut.fetched(p).valid.poke(isAsked)
    if (isAsked) dut.fetched(p).bits.poke(bytes(p)(dut.fetch(p).bits.peekInt().toInt))
  }

  private def bytesOf(header: LinkHeader, body: LinkBody) = {
    val bits = header.bits.take(32) ++ (0 until body.total).map(body(_))
    bits.grouped(8).map(_.foldLeft(0)((b, bit) => b << 1 | (if (bit) 1 else 0))).toIndexedSeq.padTo(32, 0)
  }

  private val Own = 23
}
