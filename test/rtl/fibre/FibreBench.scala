package flyframe.fibre

import scala.collection.mutable
import chisel3._
import chisel3.util._
import chiseltest._
import flyframe.StandingSimulation
import flyframe.params.FibreParams
import flyframe.registers.RingRegisters

/** A node with what else it needs of a controller: the us counter, the time quanta of port F, and counters.
  */
class NodeUnderTest(p: FibreParams) extends Module {
  val ports = IO(new Bundle {
    val rx      = Input(Vec(2, Bool()))
    val tx      = Output(Vec(2, Bool()))
    val optical = Input(Vec(2, Bool()))
    val drive   = Input(Bool())
    val bus     = Output(Bool())
  })
  val host       = IO(new flyframe.memory.HostPort(4))
  val interrupts = IO(Output(Bool()))
  val quanta     = IO(Input(UInt(7.W)))
  val prescaler  = IO(Input(UInt(12.W)))

  private val dut      = Module(new RingPorts(p))
  private val fraction = RegInit(0.U(log2Ceil(p.coreClockMhz).W))
  private val us       = fraction === (p.coreClockMhz - 1).U
  private val time     = RegInit(0.U(RingPorts.timeBits(p).W))
  fraction := Mux(us, 0.U, fraction + 1.U)
  time     := time + us

  private val cycle   = RegInit(0.U(12.W))
  private val quantum = cycle +& 1.U >= prescaler
  cycle := Mux(quantum, 0.U, cycle + 1.U)

  dut.rx       := ports.rx
  ports.tx     := dut.tx
  dut.optical  := ports.optical
  dut.drive    := ports.drive
  ports.bus    := dut.bus
  dut.us       := us
  dut.timer    := time
  dut.possible := quanta =/= 0.U
  dut.quantum  := quantum && dut.possible
  dut.quanta   := quanta
  interrupts   := dut.irq
  dut.host <> host

  // A node has its counters in the memory of port F.
  private val counters = RingRegisters.BusCounters.zip(dut.counts).map { case (register, event) =>
    val count = RegInit(0.U(8.W))
    when(event && !count.andR) { count := count + 1.U }
    Mux(host.addr(15, 2) === (register / 4).U, count.pad(32) << 8 * (register % 4), 0.U)(31, 0)
  }
  host.rdata := counters.foldLeft(dut.host.rdata)(_ | _)
}

/** Nodes that share all inputs; each has a clock of its own, which passes a cycle when it is enabled: it
  * falls and rises with that of the simulation, which is high between its steps.
  */
class NodesUnderTest(p: FibreParams, count: Int) extends Module {

  /** Of this cycle: which nodes pass it, what the controller drives, the optical signals, and the samples of
    * light at port 2 and port 1, the first one in the lowest bit.
    */
  val enable  = IO(Input(UInt(count.W)))
  val drive   = IO(Input(Bool()))
  val optical = IO(Input(UInt(2.W)))
  val light   = IO(Input(Vec(2, UInt(p.samplesPerCycle.W))))

  /** By node: light sent at both ports, level of the bus, interrupt. */
  val out = IO(Output(Vec(count, UInt(4.W))))

  /** An access to the node that is chosen, see [[flyframe.memory.HostPort]]; `rdata` needs no request. */
  val host = IO(new flyframe.memory.HostPort(4))
  val node = IO(Input(UInt(log2Ceil(count).W)))

  val quanta    = IO(Input(Vec(count, UInt(7.W))))
  val prescaler = IO(Input(Vec(count, UInt(12.W))))

  // The first sample lies at the pin until the node's clock falls, and the last one until it rises.
  private val second = Wire(Bool())
  private val first  = withClock((!clock.asBool).asClock)(RegNext(!second))
  second := RegNext(first)
  private val isLast = if (p.samplesPerCycle == 1) true.B else first =/= second

  private val nodes = for (n <- 0 until count) yield {
    val node = withClock((clock.asBool || !enable(n)).asClock)(Module(new NodeUnderTest(p)))
    for (i <- 0 to 1) {
      node.ports.rx(i)      := Mux(isLast, light(i)(p.samplesPerCycle - 1), light(i)(0))
      node.ports.optical(i) := optical(i)
    }
    node.ports.drive := drive
    node.quanta      := quanta(n)
    node.prescaler   := prescaler(n)
    node.host <> host
    node.host.req := host.req && this.node === n.U
    out(n)        := Cat(node.interrupts, node.ports.bus, node.ports.tx(1), node.ports.tx(0))
    node
  }
  host.ack   := VecInit(nodes.map(_.host.ack))(node)
  host.rdata := VecInit(nodes.map(_.host.rdata))(node)
}

/** Runs nodes of a simulation. */
class RtlNodes(dut: NodesUnderTest, count: Int) {
  private val enabled = new Poked(dut.enable)
  private val drive   = new Poked(dut.drive)
  private val optical = new Poked(dut.optical)
  private val light   = dut.light.map(new Poked(_))
  private val node    = new Poked(dut.node)
  private val address = new Poked(dut.host.addr)
  private val request = new Poked(dut.host.req)
  private val out     = new Array[Int](count)

  /** An input of the simulation, poked when it changes. */
  private class Poked(input: Bits) {
    private var is = -1
    def set(value: Int): Boolean = {
      val changes = value != is
      if (changes) {
        is = value
        input match {
          case bool: Bool => bool.poke(value == 1)
          case bits: UInt => bits.poke(value)
          case _          => throw new IllegalArgumentException
        }
      }
      changes
    }
  }

  dut.clock.setTimeout(0)
  dut.host.be.poke(0)
  dut.host.write.poke(true)
  for (n <- 0 until count) setBit(n, 8, 1)
  enabled.set((1 << count) - 1)
  drive.set(1)
  optical.set(0)
  light.foreach(_.set(0))
  request.set(0)
  dut.reset.poke(true.B)
  dut.clock.step(4)
  dut.reset.poke(false.B)
  (0 until count).foreach(look)

  private def look(n: Int): Unit = out(n) = dut.out(n).peekInt().toInt

  private def setBit(n: Int, quanta: Int, prescaler: Int): Unit = {
    dut.quanta(n).poke(quanta)
    dut.prescaler(n).poke(prescaler)
  }

  val nodes: IndexedSeq[FibreUnderTest] = for (n <- 0 until count) yield new RtlNode(n)

  private class RtlNode(n: Int) extends FibreUnderTest {
    private var passed    = 0L
    private var driven    = 1 // with what `out` was looked at
    private val writes    = mutable.Queue.empty[(Int, Int)]
    private var isWriting = false

    def cycle: Long               = passed
    def light(port: Int): Boolean = (out(n) >> port & 1) == 1
    def interrupt: Boolean        = (out(n) >> 3 & 1) == 1

    def bus(drives: Boolean): Boolean = {
      val level = if (drives) 1 else 0
      if (driven != level) {
        drive.set(level)
        driven = level
        look(n)
      }
      (out(n) >> 2 & 1) == 1
    }

    def step(drives: Boolean, light1: Int, light2: Int, opticals: Int): Unit = {
      driven = if (drives) 1 else 0
      enabled.set(1 << n)
      drive.set(driven)
      optical.set(opticals)
      RtlNodes.this.light(0).set(light1)
      RtlNodes.this.light(1).set(light2)
      if (writes.nonEmpty) write()
      dut.clock.step()
      request.set(0)
      look(n)
      passed += 1
    }

    /** A write takes two cycles, the acknowledgement is in the second one. */
    private def write(): Unit = {
      val (at, byte) = writes.head
      node.set(n)
      address.set(at)
      dut.host.be.poke(1 << at % 4)
      dut.host.wdata.poke(byte.toLong << 8 * (at % 4))
      request.set(1)
      if (isWriting) writes.dequeue()
      isWriting = !isWriting
    }

    def setBit(quanta: Int, prescaler: Int): Unit = RtlNodes.this.setBit(n, quanta, prescaler)

    def write(at: Int, byte: Int): Unit = writes.enqueue((at, byte))

    def read(at: Int): Int = {
      node.set(n)
      address.set(at)
      (dut.host.rdata.peekInt() >> 8 * (at % 4)).toInt & 0xff
    }
  }
}

/** One simulation of nodes with the same parameters, for all suites that need it. */
class FibreSimulation(p: FibreParams, count: Int) {
  private val simulation = new StandingSimulation(
    new NodesUnderTest(p, count),
    this,
    s"${p.coreClockMhz} MHz, demodulator ${p.demodulator}, $count nodes"
  )

  /** Runs `body` with nodes fresh out of reset. */
  def apply(body: IndexedSeq[FibreUnderTest] => Unit): Unit =
    simulation(dut => body(new RtlNodes(dut, count).nodes))
}

object FibreSimulation {
  private val all = mutable.Map.empty[(FibreParams, Boolean), FibreSimulation]

  /** Rings of up to three nodes, and of more. */
  private val Small = 3
  private val Large = 6

  /** Runs `body` with `count` nodes fresh out of reset. */
  def apply(p: FibreParams, count: Int)(body: IndexedSeq[FibreUnderTest] => Unit): Unit = {
    val isSmall = count <= Small
    val simulation = all.synchronized(
      all.getOrElseUpdate((p, isSmall), new FibreSimulation(p, if (isSmall) Small else Large))
    )
    simulation(nodes => body(nodes.take(count)))
  }
}
