package flyframe.fibre

import flyframe.params.FibreParams
import flyframe.registers.RingRegisters._

/** The golden model of both ports and the bus mode of a node, behind their registers (FB-18). */
class RingPortsModel(p: FibreParams = FibreParams()) extends FibreUnderTest {
  private val port1 = new OpticalPortModel(p)
  private val port2 = new OpticalPortModel(p)
  private val ports = Seq(port1, port2)
  private val ring  = new BusModeModel

  private val msClock      = new Divider(p.coreClockMhz * p.usPerMs)
  private val quarterClock = new Divider(256)
  private val eightClock   = new Divider(8 * p.coreClockMhz)
  private val slowClock    = new Divider(16 / p.samplesPerCycle)

  private var cycles  = 0L
  private var address = 0
  private var control = 0
  private var upMs    = UpMsReset
  private var events  = 0
  private var mask    = 0

  // As they were in the cycle before.
  private var up1     = false
  private var up2     = false
  private var mode    = 1
  private var isGuard = false

  def cycle: Long                  = cycles
  def light(port: Int): Boolean    = (if (port == 0) port1 else port2).light
  def bus(drive: Boolean): Boolean = ring.bus(drive)
  def interrupt: Boolean           = (events & mask) != 0

  def setBit(quanta: Int, prescaler: Int): Unit = ring.setBit(quanta, prescaler)

  def step(drive: Boolean, light1: Int, light2: Int, optical: Int): Unit = {
    cycles += 1
    val ms       = msClock.ends()
    val quarter  = ms && quarterClock.ends()
    val eight    = eightClock.ends()
    val slow     = slowClock.ends()
    val off      = (control >> PortsOff & 1) == 1
    val send1    = ring.send1(drive)
    val send2    = ring.send2(drive)
    val optical1 = (optical & 1) != 0 && !ring.isStuck(0) // stuck is no signal (FB-18)
    val optical2 = (optical & 2) != 0 && !ring.isStuck(1)
    if (port1.up != up1 || port2.up != up2) events |= 1 << PortEvent
    if (ring.mode != mode || ring.isGuard != isGuard) events |= 1 << ModeEvent
    up1 = port1.up
    up2 = port2.up
    mode = ring.mode
    isGuard = ring.isGuard
    ring.step(drive, port1, port2, (control >> Home & 1) == 1, address, ms)
    port1.step(light1, optical1, send1, off, upMs, eight, ms, quarter, slow)
    port2.step(light2, optical2, send2, off, upMs, eight, ms, quarter, slow)
  }

  def write(at: Int, byte: Int): Unit = at match {
    case Address => address = byte & 0x7f
    case Control =>
      control = byte & (1 << Home | 3 << Forced | 1 << PortsOff)
      ring.force(control >> Forced & 3)
    case UpMs   => upMs = byte
    case Events => events &= ~byte
    case Mask   => mask = byte & (1 << PortEvent | 1 << ModeEvent)
    case _      =>
  }

  def read(at: Int): Int = at match {
    case Address  => address
    case Control  => control
    case State    => ring.mode | bits(2, ring.isGuard, ring.isAlone) | bits(5, ring.isCut)
    case Ports    => portBits(0) | portBits(1) << 4
    case UpMs     => upMs
    case Losses1  => ports(0).losses
    case Losses2  => ports(1).losses
    case Noise1   => ports(0).noises
    case Noise2   => ports(1).noises
    case Closings => ring.closings
    case Latches  => ring.latches
    case Events   => events
    case Mask     => mask
    case _        => 0
  }

  private def portBits(n: Int) =
    bits(0, ports(n).signal, ports(n).hearsSearch, ports(n).up, ring.isStuck(n))

  private def bits(from: Int, set: Boolean*): Int =
    set.zipWithIndex.collect { case (true, i) => 1 << from + i }.sum
}

/** Tells of each so many-th step. */
private class Divider(count: Int) {
  private var left = count

  /** A step ends, and with it so many. */
  def ends(): Boolean = {
    left -= 1
    if (left == 0) left = count
    left == count
  }
}
