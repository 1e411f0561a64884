package flyframe.fibre

import chisel3._
import chisel3.util.log2Ceil
import flyframe.memory.HostPort
import flyframe.params.FibreParams
import flyframe.registers.RingRegisters

/** Relay mode between the ports, from its side; port 1 is number 0. */
class RingLinks extends Bundle {
  val on = Output(Bool())

  /** Levels that it sends; links that are dominant for too long, which is no signal (FR-63). */
  val send  = Output(Vec(2, Bool()))
  val stuck = Output(Vec(2, Bool()))

  /** Ports that are up, and what they hear. */
  val up    = Input(Vec(2, Bool()))
  val level = Input(Vec(2, Bool()))

  /** The node's address. */
  val address = Input(UInt(7.W))
}

/** Both optical ports and the bus mode of a ring node, behind their registers. It only connects.
  *
  * Port 1 is number 0, and port 2 number 1.
  *
  * @param addressBits
  *   implemented bits of the node's address, 4 to 7
  * @param hasRelay
  *   there is relay mode, too
  */
class RingPorts(p: FibreParams, addressBits: Int = 7, hasRelay: Boolean = false) extends Module {

  /** Pins: light received and sent, and whether an optical module has signal (tied high if it does not tell).
    */
  val rx      = IO(Input(Vec(2, Bool())))
  val tx      = IO(Output(Vec(2, Bool())))
  val optical = IO(Input(Vec(2, Bool())))

  /** What the own controller sends and hears, 1 is recessive. */
  val drive = IO(Input(Bool()))
  val bus   = IO(Output(Bool()))

  /** A microsecond ends with this cycle; and how many had ended before it since reset. */
  val us    = IO(Input(Bool()))
  val timer = IO(Input(UInt(RingPorts.timeBits(p).W)))

  /** T of port F, see [[BitClock]]. */
  val quantum = IO(Input(Bool()))
  val quanta  = IO(Input(UInt(7.W)))

  /** The bit timing of port F is possible: else there is no T. */
  val possible = IO(Input(Bool()))

  val host = IO(new HostPort(4))
  val irq  = IO(Output(Bool()))

  /** What is counted, as in [[flyframe.registers.RingRegisters.BusCounters]], each a pulse. */
  val counts = IO(Output(Vec(RingRegisters.BusCounters.size, Bool())))

  val relay: Option[RingLinks] = Option.when(hasRelay)(IO(Flipped(new RingLinks)).suggestName("relay"))
  private def inRelay(n: Int)(of: RingLinks => Vec[Bool]) = relay.fold(false.B)(r => r.on && of(r)(n))
  private val isBus                                       = !relay.fold(false.B)(_.on)

  private val ports = Seq.fill(2)(Module(new OpticalPort(p)))
  private val ring  = Module(new BusMode)
  private val bits  = Module(new BitClock)
  private val front = Module(new RingHost(addressBits))

  private def ends(usBits: Int) = us && (if (usBits == 0) true.B else timer(usBits - 1, 0).andR)
  private val samples           = RegInit(0.U(log2Ceil(16 / p.samplesPerCycle).W)) // reset: as in the model
  samples := samples + 1.U
  private val portClock = Wire(new PortClock)
  portClock.window  := ends(6)
  portClock.eight   := ends(3)
  portClock.ms      := ends(log2Ceil(p.usPerMs))
  portClock.quarter := ends(RingPorts.quarterBits(p))
  portClock.slow    := samples.andR
  portClock.odd     := timer(0)

  for ((port, n) <- ports.zipWithIndex) {
    port.rx       := rx(n)
    tx(n)         := port.tx
    port.optical  := optical(n) && !front.ring.stuck(n) // stuck is no signal (FR-63, FB-18)
    port.time     := portClock
    port.off      := front.control.off
    port.upMs     := front.control.upMs
    port.send     := Mux(isBus, ring.send(n), inRelay(n)(_.send))
    ring.up(n)    := port.report.up
    ring.level(n) := port.report.level || !isBus        // then nobody is guard, and no latch is found
    for (r <- relay) {
      r.up(n)    := port.report.up
      r.level(n) := port.report.level
    }
    front.ports(n) := port.report
  }

  bits.quantum := quantum
  bits.quanta  := quanta

  ring.drive  := drive
  bus         := ring.bus
  ring.home   := front.control.home
  ring.forced := Mux(isBus, front.control.forced, 0.U)
  ring.rests  := !isBus || !RegNext(possible, false.B) // reset: there is none
  ring.ms     := portClock.ms
  for (r <- relay) r.address := front.control.address
  ring.address := front.control.address
  ring.ticks   := bits.ticks

  front.ring := ring.report
  for (n <- 0 to 1) front.ring.stuck(n) := ring.report.stuck(n) || inRelay(n)(_.stuck)
  front.host <> host
  irq := front.irq
  counts := VecInit(
    ports.map(_.report.loses) ++ ports.map(_.report.noise) :+ ring.report.closes :+ ring.report.latch
  )
}

object RingPorts {

  /** A quarter of a second is 256 of what counts as milliseconds, in us a power of two (FB-04). */
  private def quarterBits(p: FibreParams): Int = log2Ceil(p.usPerMs) + 8

  /** Of the us counter, as many as the longest time needs. */
  def timeBits(p: FibreParams): Int = quarterBits(p) max 6
}
