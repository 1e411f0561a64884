package flyframe.relay

import chisel3._
import chiseltest._
import flyframe.{Simulation, Tier}
import flyframe.can.CanFrame
import flyframe.params.CanParams
import flyframe.registers.{CanRegisters, RingRegisters}
import org.scalatest.flatspec.AnyFlatSpec
import scala.collection.mutable
import scala.util.Random

class OwnFramesSpec extends AnyFlatSpec {
  private val tier =
    Tier("Own frames in RTL against the model", "bits", test = 24000, soak = 600000)
  private val Own = 23
  private val Run = 8000 // shortest bits
  private val Ids = 12   // in half of the runs identifiers are few, so that they meet

  /** What comes in at a port: frames of others, and own ones that come home, some with wrong numbers. */
  private class Source(random: Random, bit: Int, isCalm: Boolean) {
    private val levels = mutable.Queue.empty[Boolean]
    private val homes  = mutable.Queue.empty[LinkHeader]
    private var left   = 0
    private var level  = true
    var calm           = 1

    /** A copy comes home behind those that do so already. */
    def comes(header: LinkHeader): Unit = homes += header.copy(hops = random.nextInt(255))

    private def header(): Option[LinkHeader] = random.nextInt(40) match {
      case 0 | 3 if !isCalm =>
        Some(LinkHeader(random.nextInt(3), random.nextInt(2), Own, random.nextInt(1 << 14), 9))
      case 1 | 2               => homes.headOption // and once more
      case _ if homes.nonEmpty => Some(homes.dequeue())
      case _ if random.nextInt(calm) == 0 =>
        Some(LinkHeader(random.nextInt(4), random.nextInt(2), 40, random.nextInt(1 << 14), 200))
      case _ => None
    }

    def next(): Boolean = {
      if (left == 0) {
        if (levels.isEmpty) header() match {
          case Some(h) =>
            val good = LinkFrame.levels(h, LinkBody.of(h, OwnFramesSpec.frame(random, Ids))).toSeq
            levels ++= (if (random.nextInt(30) == 0) good.take(random.nextInt(good.size)) else good)
            levels ++= Seq.fill(7 + random.nextInt(3))(true)
          case None => levels ++= Seq.fill(20)(true)
        }
        level = levels.dequeue()
        left = bit
      }
      left -= 1
      level
    }
  }

  "FR-55 to FR-58, FR-61, FR-62, RB-11 to RB-16, RB-22, RB-24: what a node does with own frames" should
    "be what the model does, in each cycle" in {
      val seen = mutable.Map.empty[String, Long].withDefaultValue(0L)
      // The schedule of 50 MHz and that of 100.
      for ((mhz, weight) <- Seq(50 -> 2, 100 -> 1)) {
        val p    = CanParams(coreClockMhz = mhz)
        val size = tier.share(weight, 3)
        tier.run(s"$mhz MHz", size, Some(mhz.toLong)) {
          RawTester.test(new OwnNode(p), Simulation.annotations(this, s"own frames $mhz")) { dut =>
            for (run <- 0L until size by Run)
              new Node(dut, p, new Random(mhz + run), seen, isCalm = run % (2 * Run) > 0).run(run)
          }
        }
      }
      println(seen.toSeq.sorted.mkString("Own frames: ", ", ", "."))
      for (what <- Seq("sent", "confirmed", "failed", "repeated", "conflicts", "lives", "aborts"))
        assert(seen(what) > 0, s"there were $what")
      assert(seen("most") == OwnFramesModel.Window, "all sequences were on their way")
    }

  "RB-13: a start in any cycle of the bits in which own frames begin" should
    "do what it does in the model between two bits" in {
      val seen = mutable.Map.empty[String, Long].withDefaultValue(0L)
      for (mhz <- Seq(50, 100))
        RawTester.test(
          new OwnNode(CanParams(coreClockMhz = mhz)),
          Simulation.annotations(this, s"starts $mhz")
        ) { dut =>
          for (run <- 1 to 3)
            new Node(
              dut,
              CanParams(coreClockMhz = mhz),
              new Random(mhz + run),
              seen,
              isCalm = false,
              startsOften = true
            ).run(run.toLong)
        }
      info(s"${seen("starts")} starts")
      for (cycle <- 0 to 24) assert(seen(s"start $cycle") > 0, s"one in cycle $cycle behind the end of a bit")
    }

  "CAN-40, FR-55: slots that are given up at any moment" should
    "be over once, and never be on their way without being pending" in
    RawTester.test(new OwnNode(CanParams()), Simulation.annotations(this, "given up")) { dut =>
      dut.clock.setTimeout(0)
      val random                   = new Random(5)
      var (requested, over, begun) = (0, 0, 0)
      dut.bitCycles.poke(25)
      dut.setting.on.poke(true)
      dut.setting.address.poke(Own)
      dut.setting.life.poke(1)
      dut.setting.confirm.poke(2)
      dut.setting.retries.poke(1)
      dut.setting.oneShot.poke(false)
      for (q <- 0 to 1) {
        dut.home(q).valid.poke(false)
        dut.heard(q).poke(true)
        dut.up(q).poke(true)
      }
      for (s <- Seq(dut.restart, dut.write.valid, dut.append.valid)) s.poke(false)
      dut.unit.poke(true) // often, so that much is over soon
      dut.aborts.poke(0)
      dut.reset.poke(true.B)
      dut.clock.step(2)
      dut.reset.poke(false.B)
      var asked = Option.empty[Int]
      var held  = BigInt(0) // requested and not over
      for (cycle <- 0 until 300000) {
        val isEnd   = cycle > 290000
        val pending = dut.maps(0).peekInt()
        val done    = dut.maps(1).peekInt() | dut.maps(2).peekInt()
        val way     = dut.begun.peekInt()
        assert((way &~ pending) == 0, s"cycle $cycle: on its way and not pending")
        assert((dut.maps(1).peekInt() & dut.maps(2).peekInt()) == 0, s"cycle $cycle: sent and failed")
        assert((held &~ (pending | done)) == 0, s"cycle $cycle: neither pending nor over")
        over += (held & done &~ pending).bitCount
        begun += way.bitCount.sign
        held = held &~ done | pending
        if (asked.isEmpty && !isEnd && random.nextInt(60) == 0)
          asked = Some(random.nextInt(16)).filterNot(held.testBit)
        for (slot <- asked) dut.append.bits.poke(slot)
        dut.append.valid.poke(asked.nonEmpty)
        dut.aborts.poke(
          if (isEnd) 0xffff
          else if (random.nextInt(30) > 0) 0
          else if (random.nextInt(4) > 0) 1 << random.nextInt(16)
          else random.nextInt(1 << 16)
        )
        if (dut.appended.peekBoolean()) {
          requested += 1
          asked = None
        }
        dut.clock.step()
      }
      assert(dut.maps(0).peekInt() == 0 && dut.begun.peekInt() == 0 && over == requested)
      assert(
        requested > 2000 && begun > 10000,
        s"$requested requests, $begun cycles with frames on their way"
      )
    }

  /** RTL and model, from a reset on. */
  private class Node(
      dut: OwnNode,
      p: CanParams,
      random: Random,
      seen: mutable.Map[String, Long],
      isCalm: Boolean,
      startsOften: Boolean = false // in bits in which an own data frame begins
  ) {
    private val least   = LinkTiming.least(p.coreClockMhz)
    private val unit    = 10 * p.coreClockMhz
    private val bit     = if (isCalm || random.nextBoolean()) least else random.between(least, least + 35)
    private val model   = new RelayModel(p)
    private val up      = Array(random.nextBoolean(), true)
    private val sources = Seq.fill(2)(new Source(random, bit, isCalm || startsOften))
    private val came    = Array.fill(2)(Option.empty[LinkHeader]) // home, in the model
    private val delays  = Array(-1, -1)                           // cycles until the RTL knows it
    private val port    = CanRegisters.PortStarts(0)
    private var life    = random.nextInt(128)
    private var asked   = Option.empty[(Int, CanFrame)]
    private val writes  = mutable.Queue.empty[(Int, Long)]
    private var startAt = Option.empty[Int] // the cycle of this or the next bit in which it starts anew

    private def map(which: Int) = {
      val bytes = model.read(port + which, 2)
      bytes.head | bytes(1) << 8
    }

    private def start(): Unit = {
      val confirm =
        if (isCalm) 10 else if (startsOften) 4 else 8 + random.nextInt(if (random.nextBoolean()) 10 else 150)
      val retries = random.nextInt(4)
      val oneShot = !isCalm && random.nextInt(4) == 0
      val address = if (!isCalm && !startsOften && random.nextInt(10) == 0) 0 else Own
      model.write(RingRegisters.LinkBit, Seq(bit, 0))
      model.write(RingRegisters.Address, Seq(address))
      model.write(RingRegisters.Confirm, Seq(confirm, 0, retries))
      model.write(RingRegisters.Life, Seq(life))
      model.write(port, Seq(if (oneShot) 8 else 0))
      model.write(RingRegisters.Control, Seq(1 << RingRegisters.Relay))
      model.node.comesHome = (h, p) => came(p) = Some(h)
      model.node.begins = (_, h, _) => {
        random.nextInt(10) match {
          case n if n < losses => // lost
          case 8               => sources(h.direction).comes(h)
          case _               => sources(1 - h.direction).comes(h)
        }
        if (h.kind == LinkKind.Start) seen("lives") += 1
        else if (startsOften && startAt.isEmpty && random.nextBoolean()) {
          startAt = Some((seen("starts") * 7 % least).toInt) // each cycle in turn
          seen("starts") += 1
        }
      }
      dut.bitCycles.poke(bit)
      dut.setting.on.poke(true)
      dut.setting.address.poke(address)
      dut.setting.life.poke(life)
      dut.setting.confirm.poke(confirm)
      dut.setting.retries.poke(retries)
      dut.setting.oneShot.poke(oneShot)
      for (q <- 0 to 1) {
        dut.home(q).valid.poke(false)
        dut.up(q).poke(false)
        dut.heard(q).poke(true)
      }
      for (s <- Seq(dut.restart, dut.unit, dut.write.valid, dut.append.valid)) s.poke(false)
      dut.aborts.poke(0)
      dut.reset.poke(true.B)
      dut.clock.step(2)
      dut.reset.poke(false.B)
    }

    /** Between what is decided in a bit, and its end. */
    private def host(cycle: Int): Unit = {
      val shown = (0 to 2).map(dut.maps(_).peekInt().toInt)
      val own   = Seq(CanRegisters.Requests, CanRegisters.Sent, CanRegisters.Failed).map(map)
      assert(shown == own, s"cycle $cycle of run with bits of $bit: pending, sent, failed")
      assert(dut.conflict.peekBoolean() == model.node.isConflict, s"cycle $cycle: conflict")
      if (!isCalm && random.nextInt(1000) == 0) {
        val which = if (random.nextInt(20) == 0) 0xffff else 1 << random.nextInt(16)
        model.write(port + CanRegisters.Aborts, Seq(which & 0xff, which >> 8))
        dut.aborts.poke(which)
        seen("aborts") += 1
      }
      if (random.nextInt(1000) == 0) setLife()
      if (model.node.isConflict && random.nextInt(100) == 0 || !isCalm && random.nextInt(8000) == 0) {
        if (model.node.isConflict) seen("conflicts") += 1
        startAt = Some(random.nextInt(bit))
      }
    }

    /** The node starts anew, with another life from the end of that bit on. */
    private def starts(cycle: Int): Unit = {
      if (startAt.contains(cycle % bit)) {
        seen(s"start ${cycle % bit}") += 1
        model.write(RingRegisters.Control, Seq(1 << RingRegisters.Relay | 1 << RingRegisters.ClearConflict))
        dut.restart.poke(true)
        startAt = None
        isStarted = true
      }
      if (isStarted && cycle % bit == bit - 1) {
        setLife()
        isStarted = false
      }
    }
    private def setLife(): Unit = {
      life = life + 1 & 127
      model.write(RingRegisters.Life, Seq(life))
      dut.setting.life.poke(life)
    }
    private var isStarted = false

    /** A slot is filled in both, word by word, and requested. */
    private def request(): Unit = {
      if (asked.isEmpty && random.nextInt(calmHost) == 0) {
        val slot = random.nextInt(16)
        if ((map(CanRegisters.Requests) >> slot & 1) == 0) {
          val frame = OwnFramesSpec.frame(random, ids)
          asked = Some(slot -> frame)
          val bytes = frame.bytes()
          model.write(CanRegisters.SlotStarts(0) + 16 * slot, bytes)
          writes ++= bytes.grouped(4).zipWithIndex.map { case (b, i) =>
            (4 * slot + i) -> b.zipWithIndex.map { case (x, n) => x.toLong << 8 * n }.sum
          }
        }
      }
      dut.write.valid.poke(writes.nonEmpty)
      if (writes.nonEmpty) {
        val (at, word) = writes.dequeue()
        dut.write.bits.poke(at)
        dut.word.poke(word)
      } else
        for ((slot, _) <- asked) {
          dut.append.valid.poke(true)
          dut.append.bits.poke(slot)
        }
    }
    private var calmHost = 40
    private var losses   = 1
    private val ids      = if (!isCalm && random.nextBoolean()) Ids else 2000

    def run(number: Long): Unit = {
      start()
      for (cycle <- 0 until Run * least) {
        // Sequences are used up while nothing comes home and nothing is repeated.
        if (isCalm && cycle % bit == bit - 2 && (cycle / bit == 1000 || cycle / bit == 6500)) {
          losses = if (cycle / bit == 1000) 10 else 0
          model.write(RingRegisters.Confirm, Seq(0, 4))
          dut.setting.confirm.poke(4 << 8)
        }
        if (random.nextInt(80000) == 0) {
          if (!isCalm) losses = if (random.nextInt(4) == 0) 10 else random.nextInt(3)
          calmHost = if (isCalm || random.nextInt(3) > 0) 40 else 5000
          for (s <- sources) s.calm = 1 + random.nextInt(if (random.nextBoolean()) 4 else 400)
        }
        for (q <- 0 to 1) {
          if (random.nextInt(if (up(q)) (if (isCalm) 300000 else 30000) else 3000) == 0) up(q) = !up(q)
          dut.up(q).poke(up(q))
        }
        val heard = sources.map(_.next())
        for (q <- 0 to 1) {
          dut.heard(q).poke(heard(q))
          assert(
            dut.level(q).peekBoolean() == model.level(q),
            s"cycle $cycle of run $number with bits of $bit, port $q"
          )
          if (dut.decides(q).peekBoolean() && wasUp(q) && model.node.isUp(q)) {
            val offer =
              if (dut.offer(q).valid.peekBoolean()) Some(dut.offer(q).bits.peekInt().toLong) else None
            assert(
              offer == model.node.offered(q),
              s"cycle $cycle of run $number with bits of $bit: offer at port $q"
            )
          }
          dut.home(q).valid.poke(delays(q) == 0)
          for (h <- came(q) if delays(q) == 0) {
            dut.home(q).bits.kind.poke(h.kind)
            dut.home(q).bits.leftBy.poke(h.direction)
            dut.home(q).bits.sequence.poke(h.sequence)
            came(q) = None
          }
          if (delays(q) >= 0) delays(q) -= 1
          if (dut.received(q).peekBoolean() && came(q).nonEmpty) delays(q) = random.nextInt(10)
        }
        dut.unit.poke(cycle % unit == 0 && cycle > 0)
        dut.aborts.poke(0)
        dut.restart.poke(false)
        if (cycle % bit == bit - 2) host(cycle)
        starts(cycle)
        request()
        if (dut.appended.peekBoolean()) {
          val slot = asked.get._1
          model.write(port + CanRegisters.Requests, Seq(1 << slot & 0xff, 1 << slot >> 8))
          asked = None
        }
        val counts = Seq("sent" -> dut.counts.sent, "confirmed" -> dut.counts.confirmed) ++
          Seq("failed" -> dut.counts.failed, "repeated" -> dut.counts.repeated)
        for ((name, pulse) <- counts if pulse.peekBoolean()) {
          seen(name) += 1
          here(name) += 1
        }
        // A port that comes up with the bit decides from the next one on.
        if (cycle % bit == 0) for (q <- 0 to 1) wasUp(q) = model.node.isUp(q)
        if (cycle % bit == 0) seen("most") = seen("most") max model.node.own.size
        model.step((heard(0), heard(1)), (up(0), up(1)))
        dut.clock.step()
        if (asked.isEmpty) dut.append.valid.poke(false)
      }
      val model8 = Seq("repeated" -> RelayCounter.Repeated, "failed" -> RelayCounter.Failed) ++
        Seq("sent" -> RelayCounter.OwnSent, "confirmed" -> RelayCounter.Confirmed)
      for ((name, which) <- model8)
        assert(
          ((if (which < RelayCounter.Passed) here(name) min 255 else here(name)) -
            model.node.counters(which)).abs <= 4,
          s"$name in run $number"
        )
    }
    private val wasUp = Array(false, false) // in the model, when it decided what begins
    private val here  = mutable.Map.empty[String, Long].withDefaultValue(0L)
  }
}

object OwnFramesSpec {
  private def frame(random: Random, ids: Int): CanFrame = {
    val extended = random.nextBoolean()
    val remote   = random.nextInt(4) == 0
    val dlc      = random.nextInt(10)
    val id       = if (extended) random.nextInt(ids) << 16 else random.nextInt(ids min 64) << 5
    CanFrame(id, extended, remote, dlc, Seq.fill(if (remote) 0 else dlc min 8)(random.nextInt(256)))
  }
}
