package flyframe.can

import chisel3._
import chiseltest._
import flyframe.Simulation
import flyframe.memory.HostPort

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
