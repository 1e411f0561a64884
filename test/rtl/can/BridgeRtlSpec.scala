package flyframe.can

import chisel3._
import chiseltest._
import flyframe.Simulation
import flyframe.memory.HostPort
import flyframe.params.CanParams
import org.scalatest.flatspec.AnyFlatSpec

/** Both ports of a node with their bridges, and on the bus of each another port. */
class BridgeBench extends Module {
  import BridgeUnderTest._
  val hosts = IO(Vec(4, new HostPort(4)))

  private val ports = Seq(params, params, params.copy(bridge = false), params.copy(bridge = false)).map(p =>
    Module(new CanPort(p, 0))
  )
  private val bridges = Seq.fill(2)(Module(new Bridge(params)))
  private val time    = RegInit(0.U(16.W))
  time := time + 1.U
  for ((p, host) <- ports.zip(hosts)) {
    p.host <> host
    p.time := time
  }
  for ((a, b)      <- Seq(F -> OnF, T -> OnT); p <- Seq(a, b)) ports(p).rx := ports(a).tx && ports(b).tx
  for ((bridge, n) <- bridges.zipWithIndex) {
    bridge.from <> ports(n).bridgeFrom.get
    bridge.into <> ports(1 - n).bridgeInto.get
  }
}

/** [[BridgeRules]] on the RTL. */
class BridgeRtlSpec extends BridgeRules with ChiselScalatestTester {
  protected def withBridge(body: BridgeUnderTest => Unit): Unit =
    test(new BridgeBench).withAnnotations(Simulation.annotations(this, "bridge")) { dut =>
      dut.clock.setTimeout(0)
      for (h <- dut.hosts) h.req.poke(false)
      body(new BridgeUnderTest {
        private var cycles = 0L
        def cycle: Long    = cycles
        def run(n: Int): Unit = {
          dut.clock.step(n)
          cycles += n
        }
        private def access(port: Int, address: Int, be: Int, word: Option[Long]): Long = {
          val host = dut.hosts(port)
          host.addr.poke(address)
          host.be.poke(be)
          host.write.poke(word.isDefined)
          host.wdata.poke(word.getOrElse(0L))
          host.req.poke(true)
          var tries = 0
          while (!host.ack.peekBoolean()) {
            run(1)
            tries += 1
            assert(tries < 500, f"no acknowledgement of 0x$address%04x")
          }
          val data = host.rdata.peekInt().toLong
          run(1)
          host.req.poke(false)
          run(1)
          data
        }
        def write(port: Int, address: Int, bytes: Seq[Int]): Unit = if (bytes.nonEmpty) {
          val at           = address % 4
          val (now, later) = bytes.splitAt(4 - at)
          val word         = now.zipWithIndex.map { case (b, i) => b.toLong << 8 * (at + i) }.sum
          access(port, address - at, now.indices.map(i => 1 << at + i).sum, Some(word))
          write(port, address + now.size, later)
        }
        def read(port: Int, address: Int, count: Int): Seq[Int] = {
          val words = (address / 4 to (address + count - 1) / 4).map(w => access(port, 4 * w, 15, None))
          words
            .flatMap(w => (0 until 4).map(i => (w >> 8 * i & 0xff).toInt))
            .slice(address % 4, address % 4 + count)
        }
      })
    }
}

/** The search of [[Bridge]] for the frame that is last, with slots that change meanwhile. */
class BridgeSearchSpec extends AnyFlatSpec with ChiselScalatestTester {
  private val p     = BridgeUnderTest.params
  private val slots = CanParams.BridgeSlots.size

  /** The key of slot 3 is the last one, then that of slot 6. */
  private val keys = Seq(40, 50, 60, 90, 10, 20, 80, 30)

  /** The slot that is taken back, the one that is used, and how many frames are counted as dropped. */
  private type Result = (Option[Int], Int, Int)

  /** Slot 3 begins in some cycle of the search, or leaves by itself. In some cycles none can be taken back.
    */
  private def search(
      dut: Bridge,
      change: Int = 250,
      isGone: Boolean = false,
      rests: Int => Boolean = _ => false,
      keys: Seq[Int] = keys
  ): Result = {
    var evicted = Option.empty[(Int, Int)] // the slot, and when
    var asked   = Option.empty[Int]
    var job     = Option.empty[Int]        // since when it is done
    var words   = Seq.empty[Int]           // that are written
    var drops   = 0
    for (cycle <- 0 until 250) {
      val isHeld = cycle >= change && !isGone
      val isThere = (0 until slots).filterNot { s =>
        (s == 3 && isGone && cycle >= change) || evicted.exists(e => e._1 == s && cycle >= e._2 + 2)
      }
      dut.from.taken.valid.poke(cycle == 0)
      dut.into.held.poke(if (isHeld) 1 << 3 else 0)
      dut.into.pending.poke(isThere.map(1 << _).sum)
      // As the memory: what is asked for is read, then its word is there, then it is done.
      val source = dut.into.job.bits.source.peekInt().toInt
      val isDone = job.contains(cycle - 2)
      dut.into.done.poke(isDone)
      dut.into.key.poke(if (isDone) keys(source / 4 % slots) else 0)
      if (isDone) {
        if (dut.into.job.bits.counts.peekBoolean()) drops += 1
        else if (dut.into.job.bits.write.peekBoolean()) words :+= source
        job = None
      } else if (job.isEmpty && dut.into.job.valid.peekBoolean()) job = Some(cycle)
      for (
        s <- isThere if (dut.into.evict.peekInt().toInt >> s & 1) == 1 && !(s == 3 && isHeld) && !rests(cycle)
      )
        evicted = Some(s -> cycle)
      val asks = dut.into.append.valid.peekBoolean()
      if (asks) asked = Some(dut.into.append.bits.peekInt().toInt - CanParams.BridgeSlots.start)
      dut.into.appended.poke(asks)
      dut.clock.step()
    }
    val first = 4 * (CanParams.BridgeSlots.start + asked.get)
    assert(words == Seq(0, 1, 2, 3).map(first + _), s"slot 3 changes in cycle $change")
    // A slot that leaves by itself in the cycle before it is taken back was not dropped.
    (evicted.filterNot(e => isGone && e._2 + 2 > change).map(_._1), asked.get, drops)
  }

  private val late: Result = (Some(3), 3, 1)

  private def bridge(body: Bridge => Unit): Unit =
    test(new Bridge(p)).withAnnotations(Simulation.annotations(this, "search")) { dut =>
      dut.clock.setTimeout(0)
      dut.from.ready.poke(true)
      dut.from.taken.bits.poke(0)
      dut.from.data.poke(0) // the first frame of all
      body(dut)
    }

  private def check(isGone: Boolean, early: Result): Unit =
    bridge { dut =>
      val results      = (0 until 80).map(search(dut, _, isGone))
      val (some, rest) = results.span(_ == early)
      assert(some.size > 30 && rest.size > 30 && rest.forall(_ == late), s"$results")
    }

  "BR-02: a slot that begins while the last one is sought" should "stay, and not be taken for the next one" in
    check(isGone = false, (Some(6), 6, 1))

  "BR-02: a slot that is free while the last one is sought" should "be used, and nothing be dropped" in
    check(isGone = true, (None, 3, 0))

  "BR-02: a frame that is in front of one slot alone" should "take the place of that" in bridge { dut =>
    for (slot <- 0 until slots) {
      val result = search(dut, keys = Seq.fill(slots)(0).updated(slot, 1))
      assert(result == ((Some(slot), slot, 1)))
    }
  }

  "BR-02: slots that are held for three cycles of each bit of relay mode" should
    "be taken back in the others, at any bit rate" in bridge { dut =>
      for (bit <- 25 to 60; phase <- 0 until bit)
        assert(
          search(dut, rests = c => (c + phase) % bit < 3) == late,
          s"bits of $bit, from $phase on"
        )
    }
}
