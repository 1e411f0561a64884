package flyframe.fibre

import chisel3._
import chisel3.util.log2Ceil
import flyframe.memory.HostPort
import flyframe.params.FibreParams

/** Both optical ports and the bus mode of a ring node, behind their registers. It only connects.
  *
  * Port 1 is number 0, and port 2 number 1.
  *
  * @param addressBits
  *   implemented bits of the node's address, 4 to 7
  */
class RingPorts(p: FibreParams, addressBits: Int = 7) extends Module {

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

  val host = IO(new HostPort(4))
  val irq  = IO(Output(Bool()))

  private val ports = Seq.fill(2)(Module(new OpticalPort(p)))
  private val ring  = Module(new BusMode)
  private val bits  = Module(new BitClock)
  private val front = Module(new RingHost(addressBits))

  private def ends(usBits: Int) = us && (if (usBits == 0) true.B else timer(usBits - 1, 0).andR)
  private val samples           = RegInit(0.U(log2Ceil(16 / p.samplesPerCycle).W)) // reset: as in the model
  samples := samples + 1.U
  private val portClock = Wire(new PortClock)
  portClock.window  := ends(6)
  portClock.ms      := ends(log2Ceil(p.usPerMs))
  portClock.quarter := ends(RingPorts.quarterBits(p))
  portClock.slow    := samples.andR
  portClock.odd     := timer(0)

  for ((port, n) <- ports.zipWithIndex) {
    port.rx        := rx(n)
    tx(n)          := port.tx
    port.optical   := optical(n)
    port.time      := portClock
    port.off       := front.control.off
    port.upMs      := front.control.upMs
    port.send      := ring.send(n)
    ring.up(n)     := port.report.up
    ring.level(n)  := port.report.level
    front.ports(n) := port.report
  }

  bits.quantum := quantum
  bits.quanta  := quanta

  ring.drive   := drive
  bus          := ring.bus
  ring.home    := front.control.home
  ring.forced  := front.control.forced
  ring.address := front.control.address
  ring.ticks   := bits.ticks

  front.ring := ring.report
  front.host <> host
  irq := front.irq
}

object RingPorts {

  /** A quarter of a second is 256 of what counts as milliseconds, in us a power of two (FB-04). */
  private def quarterBits(p: FibreParams): Int = log2Ceil(p.usPerMs) + 8

  /** Of the us counter, as many as the longest time needs. */
  def timeBits(p: FibreParams): Int = quarterBits(p) max 6
}
