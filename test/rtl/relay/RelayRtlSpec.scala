package flyframe.relay

import chisel3._
import chiseltest._
import flyframe.{StandingSimulation, Tier}
import flyframe.params.CanParams
import flyframe.registers.RingRegisters

/** Relay mode in RTL, with a host at its port. */
class RtlRelayNode(dut: RelayPortUnderTest) extends RelayUnderTest {
  private var cycles = 0L
  private val hears  = Array(true, true)
  private val areUp  = Array(true, true)
  private val levels = Array(true, true)
  private var answer = Option.empty[Long]
  private var asks   = false

  dut.clock.setTimeout(0)
  dut.host.req.poke(false)
  for (n <- 0 to 1) poke(n, heard = true, isUp = false, always = true)
  dut.reset.poke(true.B)
  dut.clock.step(2)
  dut.reset.poke(false.B)

  private def poke(n: Int, heard: Boolean, isUp: Boolean, always: Boolean = false): Unit = {
    if (always || heard != hears(n)) dut.heard(n).poke(heard)
    if (always || isUp != areUp(n)) dut.up(n).poke(isUp)
    hears(n) = heard
    areUp(n) = isUp
  }

  def cycle: Long                 = cycles
  def level(port: Int): Boolean   = levels(port)
  def isStuck(port: Int): Boolean = dut.stuck(port).peekBoolean()

  def step(heard: (Boolean, Boolean), up: (Boolean, Boolean)): Unit = {
    poke(0, heard._1, up._1)
    poke(1, heard._2, up._2)
    if (asks && dut.host.ack.peekBoolean()) {
      answer = Some(dut.host.rdata.peekInt().toLong)
      asks = false
    }
    dut.clock.step()
    cycles += 1
    if (answer.nonEmpty) dut.host.req.poke(false)
    for (n <- 0 to 1) levels(n) = dut.level(n).peekBoolean()
  }

  private def access(address: Int, be: Int, write: Option[Long]): Long = {
    dut.host.addr.poke(address)
    dut.host.be.poke(be)
    dut.host.write.poke(write.isDefined)
    dut.host.wdata.poke(write.getOrElse(0L))
    dut.host.req.poke(true)
    answer = None
    asks = true
    for (_ <- 0 until 20000 if asks) passes()
    passes()
    answer.getOrElse(sys.error(f"no answer to an access to 0x$address%04x"))
  }

  def write(address: Int, bytes: Seq[Int]): Unit = if (bytes.nonEmpty) {
    val at           = address % 4
    val (now, later) = bytes.splitAt(4 - at)
    val word         = now.zipWithIndex.map { case (b, i) => b.toLong << 8 * (at + i) }.sum
    access(address - at, now.indices.map(i => 1 << at + i).sum, Some(word))
    write(address + now.size, later)
  }

  def read(address: Int, count: Int): Seq[Int] = {
    val first = address & ~3
    val all = (first until address + count by 4).flatMap { a =>
      val word = access(a, 15, None)
      (0 until 4).map(i => (word >> 8 * i & 0xff).toInt)
    }
    all.slice(address - first, address - first + count)
  }
}

object RelaySimulation {

  /** With port T and a FIFO that is soon full. */
  val Bridged: CanParams = CanParams(rxFrames = 16, bridge = true)

  private def simulation(p: CanParams) =
    new StandingSimulation(new RelayPortUnderTest(p), this, s"relay mode ${p.coreClockMhz} ${p.bridge}")
  private val simulations =
    Seq(CanParams(), CanParams(coreClockMhz = 100), Bridged).map(p => p -> simulation(p)).toMap

  /** Runs `body` with a node fresh out of reset: of 50 MHz, of 100 MHz, or [[Bridged]]. */
  def apply(body: RelayUnderTest => Unit, p: CanParams = CanParams()): Unit =
    simulations(p)(dut => body(new RtlRelayNode(dut)))
}

/** The suites that run on any node, on the RTL. */
trait OnRtl { self: RelayCases =>
  protected def withNode(body: RelayUnderTest => Unit): Unit =
    RelaySimulation(body(_))
}

class LinkRtlSpec extends RelayCases with LinkRules with OnRtl {
  "RB-28: an own frame of the second half" should "leave behind 127 that pass at the latest, at 100 MHz" in {
    val p = CanParams(coreClockMhz = 100)
    for (output <- 0 to 1)
      RelaySimulation(
        { node =>
          val b = new RelayBench(node, bit = 50)
          b.write(RingRegisters.LinkBit, 50, 0)
          b.start(address = 7)
          assert(passedBefore(b, own = 3 << 27, waiting = 1 << 28, output).contains(127), output)
        },
        p
      )
  }
}

class ConfirmRtlSpec extends RelayCases with ConfirmRules with OnRtl
class ReceiveRtlSpec extends RelayCases with ReceiveRules with OnRtl
class StartRtlSpec   extends RelayCases with StartRules with OnRtl

class MutationRtlSpec extends RelayCases with MutationRules with OnRtl {
  protected def mutations =
    Tier("Broken and forged frames of relay mode, RTL", "frames", test = 80, soak = 10000)
}
