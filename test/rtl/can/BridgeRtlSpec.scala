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

  /** What becomes of slot 3 in a cycle of the search. */
  private def check(gone: Boolean): Unit =
    test(new Bridge(p)).withAnnotations(Simulation.annotations(this, "search")) { dut =>
      dut.clock.setTimeout(0)

      /** The slot that is taken back, and the one that is asked for, if slot 3 begins in this cycle. */
      def search(begins: Int): (Option[Int], Int) = {
        var evicted = Option.empty[Int]
        var asked   = Option.empty[Int]
        var job     = Option.empty[(Int, Int)] // the word that is being read, and since when
        var pending = (1 << slots) - 1
        for (cycle <- 0 until 200) {
          val isOver = cycle >= begins && gone
          if (isOver && evicted.isEmpty) pending &= ~(1 << 3)
          dut.from.taken.valid.poke(cycle == 0)
          dut.into.held.poke(if (cycle >= begins && !gone) 1 << 3 else 0)
          dut.into.pending.poke(pending)
          val isDone = job.exists(_._2 == cycle - 2)
          dut.into.done.poke(isDone)
          dut.into.key.poke(if (isDone) keys(job.get._1 / 4 % slots) else 0)
          if (isDone) job = None
          else if (job.isEmpty && dut.into.job.valid.peekBoolean())
            job = Some(dut.into.job.bits.source.peekInt().toInt -> cycle)
          val evicts = dut.into.evict.peekInt().toInt
          if (evicts != 0) {
            evicted = Some(Integer.numberOfTrailingZeros(evicts))
            pending &= ~evicts
          }
          if (dut.into.append.valid.peekBoolean() && asked.isEmpty)
            asked = Some(dut.into.append.bits.peekInt().toInt - CanParams.BridgeSlots.start)
          dut.into.appended.poke(asked.nonEmpty)
          dut.clock.step()
        }
        evicted -> asked.get
      }
      dut.from.ready.poke(true)
      dut.from.taken.bits.poke(0)
      dut.from.data.poke(0) // the first frame of all
      val results = (0 until 60).map(search)
      assert(results.last == (Some(3) -> 3), "of slots that rest the last one")
      val others  = results.filter(_ != (Some(3) -> 3))
      assert(others.nonEmpty && others.forall(_ == (if (gone) None -> 3 else Some(6) -> 6)), s"$results")
    }

  "BR-02: a slot that begins while its frame is looked at" should "stay, and not be taken for the next one" in
    check(gone = false)

  "BR-02: a slot that is sent while the last one is sought" should "be used" in check(gone = true)
}
