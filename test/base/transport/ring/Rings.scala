package flyframe.transport.ring

import flyframe.can.CanFrame
import flyframe.fibre.Fibre
import flyframe.fibre.model.CanRing
import flyframe.registers.CanRegisters
import flyframe.relay._
import flyframe.transport.BusFrame
import scala.util.Random

/** Golden models in bus mode, 400 kbit/s, with a guard at home. */
class BusModeRing(val count: Int) extends RingPort {
  val ring = new CanRing(count, Some(0), Seq.fill(count)(20L), 5, firstAddress = 1)

  for ((host, n) <- ring.hosts.zipWithIndex; ((value, mask), i) <- RingPort.filters(n + 1).zipWithIndex)
    host.setFilter(i, value, mask)

  def now: Long            = ring.bench.now / 1000000
  def runUs(us: Int): Unit = ring.bench.runUs(us)
  def request(node: Int, slot: Int, frame: BusFrame): Unit =
    ring.hosts(node).requestAt(slot -> RingPort.toCan(frame))
  def pending(node: Int): Int            = ring.hosts(node).pending
  def received(node: Int): Seq[BusFrame] = ring.hosts(node).received().map(RingPort.toBus)
  def abort(node: Int): Unit             = ring.hosts(node).abort(0xffff)

  /** On each fibre one bit in so many arrives as the other level, from now on. */
  def disturb(oneIn: Int, random: Random): Unit =
    for (fibre <- ring.bench.there ++ ring.bench.back) fibre.disturbed = new WrongBits(oneIn, random)

  /** What arrives on a fibre: the tone of the other level in some bits. */
  private class WrongBits(oneIn: Int, random: Random) extends Fibre.Disturbance {
    private val bit      = (ring.bit * 1e6).toLong
    private val tones    = Seq(ring.bench.p.toneRecessiveKhz, ring.bench.p.toneDominantKhz)
    private val halves   = tones.map(khz => 1000000000L / khz / 2) // ps between edges
    private var before   = false
    private var edge     = 0L
    private var distance = halves.head
    private var from     = ring.bench.now + gap()
    private var half     = halves.head

    /** Bits apart as of a bit that goes wrong with the same chance wherever it is. */
    private def gap() = (-math.log(1 - random.nextDouble()) * oneIn * bit).toLong

    def apply(time: Long, light: Boolean): Boolean = {
      if (light != before) {
        distance = time - edge
        edge = time
        before = light
      }
      if (time < from) {
        half = halves.maxBy(h => (h - distance).abs)
        light
      } else {
        if (time >= from + bit) from = time + gap()
        (time - from) / half % 2 == 0
      }
    }
  }
}

/** Golden models in relay mode, frame by frame. */
class RelayModeRing(setting: RelayRingSetting, confirmUs: Int = 10000) extends RingPort {
  val ring = new RelayEngine(setting)

  def count: Int = setting.count
  for (n <- 0 until count) {
    RingHost.start(ring, n, n + 1, confirmUs)
    ring.access(n) { h =>
      for (((value, mask), i) <- RingPort.filters(n + 1).zipWithIndex)
        h.write(CanRegisters.FilterStarts(0) + i * CanRegisters.FilterBytes, Seq(value, mask).flatMap(little))
    }
  }

  /** Ports with short times. */
  val faults = new RingFaults(ring, upUs = 1000, heldUs = 3000)
  faults.start()
  ring.runUs(3.0 * confirmUs) // all have told their lives

  private def little(word: Int) = (0 to 3).map(i => word >>> 8 * i & 0xff)

  def now: Long            = ring.now / 1000000
  def runUs(us: Int): Unit = ring.runUs(us)
  def request(node: Int, slot: Int, frame: BusFrame): Unit =
    ring.access(node)(RingHost.request(_, slot, RingPort.toCan(frame)))
  def pending(node: Int): Int = {
    var map = 0
    ring.access(node)(h => map = RingHost.map(h, CanRegisters.Requests))
    map
  }
  def abort(node: Int): Unit =
    ring.access(node)(_.write(CanRegisters.PortStarts(0) + CanRegisters.Aborts, Seq(0xff, 0xff)))
  def received(node: Int): Seq[BusFrame] = {
    var frames = Seq.empty[BusFrame]
    ring.access(node) { h =>
      val port = CanRegisters.PortStarts(0)
      while (h.read(port + CanRegisters.RxLevel, 1).head > 0) {
        frames :+= RingPort.toBus(CanFrame.of(h.read(port + CanRegisters.RxFrame, CanRegisters.FrameBytes)))
        h.write(port + CanRegisters.RxRelease, Seq(1))
      }
    }
    frames
  }
}
