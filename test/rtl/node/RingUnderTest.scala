package flyframe.node

import chisel3._
import chisel3.util._
import chiseltest._
import flyframe.can._
import flyframe.RingNode
import flyframe.fibre._
import flyframe.memory.HostPort
import flyframe.params.EscParams
import flyframe.registers.RingRegisters

/** Nodes in RTL in a ring of fibres with delays, all in one clock domain.
  *
  * @param most
  *   nodes; fewer may be in the ring
  */
class RingUnderTest(p: EscParams, most: Int) extends Module {
  import RingUnderTest._

  /** How many are in the ring. */
  val count = IO(Input(UInt(log2Ceil(most + 1).W)))

  /** Of the fibres behind each node: core cycles from pin to pin, 1 or more, and whether they are cut, the
    * one that leads there and the one back.
    */
  val delay = IO(Input(Vec(most, UInt(log2Ceil(Longest).W))))
  val isCut = IO(Input(Vec(most, Vec(2, Bool()))))

  /** An access to the node that is chosen. */
  val host = IO(new HostPort(4))
  val node = IO(Input(UInt(log2Ceil(most).W)))

  private val nodes = Seq.fill(most)(
    withReset(reset.asAsyncReset)(Module(new RingNode(p.copy(dataBusWidth = 32), p.fibre.copy(usPerMs = 1))))
  )
  private val hosts = nodes.map(_.hostPins.asInstanceOf[HostPort])
  private val next  = RegInit(0.U(log2Ceil(Longest).W)) // reset: any place will do
  next := next + 1.U

  /** The light that leaves a fibre into which this light goes. */
  private def through(link: Int, way: Int, light: Bool): Bool = {
    val cells = Mem(Longest, Bool())
    cells.write(next, light)
    cells.read(next - delay(link)) && !isCut(link)(way)
  }
  private val isLast = nodes.indices.map(n => count === (n + 1).U)
  private val there  = for ((n, i) <- nodes.zipWithIndex) yield through(i, 0, n.optical_2.tx)
  private val back =
    for (i <- nodes.indices)
      yield through(i, 1, Mux(isLast(i), nodes.head.optical_1.tx, nodes((i + 1) % most).optical_1.tx))
  for ((n, i) <- nodes.zipWithIndex) {
    n.optical_1.signal := true.B
    n.optical_2.signal := true.B
    n.optical_1.rx     := (if (i == 0) Mux1H(isLast, there) else there(i - 1))
    n.optical_2.rx     := back(i)
    hosts(i) <> host
    hosts(i).req := host.req && node === i.U
  }
  host.ack   := VecInit(hosts.map(_.ack))(node)
  host.rdata := VecInit(hosts.map(_.rdata))(node)
}

object RingUnderTest {

  /** Core cycles that a fibre may delay. */
  val Longest = 1024
}

/** A ring of RTL nodes, fresh out of reset, with a host at each.
  *
  * @param delays
  *   of the fibres behind each node, with two modules, in ns
  */
class RtlRing(dut: RingUnderTest, delays: Seq[Long], mhz: Int) {

  /** Core cycles since the reset. */
  var now: Long = 0

  def pass(cycles: Int): Unit = if (cycles > 0) {
    dut.clock.step(cycles)
    now += cycles
  }

  dut.clock.setTimeout(0)
  dut.count.poke(delays.size)
  for ((input, n) <- dut.delay.zipWithIndex) input.poke(delays.lift(n).getOrElse(10L) * mhz / 1000)
  for (link       <- dut.isCut; fibre <- link) fibre.poke(false)
  dut.host.req.poke(false)
  dut.reset.poke(true.B)
  pass(4)
  dut.reset.poke(false.B)
  pass(PortMemory.Words + 4) // it is cleared

  /** Both fibres of a link, or one: 0 leads to the next node, 1 back. */
  def cut(link: Int, isCut: Boolean, fibres: Seq[Int] = Seq(0, 1)): Unit =
    for (f <- fibres) dut.isCut(link)(f).poke(isCut)

  /** Accesses pass a few core cycles. */
  private def access(n: Int, address: Int, be: Int, write: Option[Long]): Long = {
    dut.node.poke(n)
    dut.host.addr.poke(address)
    dut.host.be.poke(be)
    dut.host.write.poke(write.isDefined)
    dut.host.wdata.poke(write.getOrElse(0L))
    dut.host.req.poke(true)
    var waited = 0
    while (!dut.host.ack.peekBoolean()) {
      pass(1)
      waited += 1
      assert(waited < CanUnderTest.AccessCycles, f"access to 0x$address%04x")
    }
    val answer = dut.host.rdata.peekInt().toLong
    pass(1)
    dut.host.req.poke(false)
    pass(1)
    answer
  }

  def write(n: Int, address: Int, bytes: Seq[Int]): Unit = if (bytes.nonEmpty) {
    val (now, later) = bytes.splitAt(4 - address % 4)
    val lanes        = now.zipWithIndex.map { case (b, i) => (b.toLong, address % 4 + i) }
    access(n, address & ~3, lanes.map(1 << _._2).sum, Some(lanes.map { case (b, i) => b << 8 * i }.sum))
    write(n, address + now.size, later)
  }

  def read(n: Int, address: Int, count: Int): Seq[Int] = {
    val from  = address & ~3
    val words = (from until address + count by 4).map(access(n, _, 15, None))
    words
      .flatMap(w => (0 to 3).map(i => (w >> 8 * i & 0xff).toInt))
      .slice(address - from, address - from + count)
  }
}

/** A ring of RTL nodes in bus mode that is up; node `home` is guard if there is one.
  *
  * @param delays
  *   of the fibres behind each node, with two modules, in ns
  * @param kbps
  *   bit rate, by the bit timing of FR-38
  */
class RtlCanRing(dut: RingUnderTest, home: Option[Int], delays: Seq[Long], kbps: Int, first: Int, mhz: Int)
    extends CanOnRing {
  private val rate  = Rate("25 tq", mhz * 1000 / 25 / kbps, BitSetting(tseg1 = 21, tseg2 = 3, sjw = 3))
  private val nodes = new RtlRing(dut, delays, mhz)

  private class Node(n: Int) extends CanUnderTest {
    def cycle: Long                = nodes.now
    def driven                     = throw new UnsupportedOperationException("the ring steps all")
    def step(heard: Boolean): Unit = driven
    def write(address: Int, bytes: Seq[Int]): Unit = nodes.write(n, address, bytes)
    def read(address: Int, count: Int): Seq[Int]   = nodes.read(n, address, count)
  }
  val hosts: IndexedSeq[LowerTester] = delays.indices.map(n => new LowerTester(new Node(n), rate))

  for ((h, n) <- hosts.zipWithIndex) {
    h.device.write(RingRegisters.Address, Seq(first + n))
    if (home.contains(n)) h.device.write(RingRegisters.Control, Seq(1 << RingRegisters.Home))
    h.setTiming(rate.prescaler, rate.setting)
  }
  nodes.pass(25 * mhz)
  hosts.foreach(_.start())
  run(15)

  def run(bits: Double): Unit              = nodes.pass((bits * rate.bitCycles).toInt max 1)
  def cut(link: Int, isCut: Boolean): Unit = nodes.cut(link, isCut)
  def ring(node: Int, address: Int): Int   = nodes.read(node, address, 1).head
}
