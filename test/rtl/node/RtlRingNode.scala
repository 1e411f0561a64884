package flyframe.node

import chiseltest._
import flyframe.RingNode
import flyframe.fibre.{FibreUnderTest, RingBench}

/** A whole node in RTL among others on a ring, with a host at its plain port. What it drives is its own
  * controller's, so that `drive` is not looked at, and `bus` tells nothing.
  */
class RtlRingNode(dut: RingNode, lanes: Int) extends FibreUnderTest {
  private val optical = Seq(dut.optical_1, dut.optical_2)
  private val host    = dut.hostPins.asInstanceOf[flyframe.memory.HostPort]
  private val lights  = Array(false, false) // that it sends
  private val hears   = Array(true, true)   // what was poked last
  private val signals = Array(false, false)
  private var cycles  = 0L
  private var asks    = false
  private var answer  = 0L

  /** The ring that it is part of; accesses pass time there. */
  var bench: RingBench = _

  host.req.poke(false)
  for (n <- 0 to 1) poke(n, light = false, signal = true)

  private def poke(n: Int, light: Boolean, signal: Boolean): Unit = {
    if (light != hears(n)) optical(n).rx.poke(light)
    if (signal != signals(n)) optical(n).signal.poke(signal)
    hears(n) = light
    signals(n) = signal
  }

  def cycle: Long                               = cycles
  def light(port: Int): Boolean                 = lights(port)
  def bus(drive: Boolean): Boolean              = true
  def interrupt: Boolean                        = dut.irq.peekBoolean()
  def setBit(quanta: Int, prescaler: Int): Unit = ()

  def step(drive: Boolean, light1: Int, light2: Int, signal: Int): Unit = {
    poke(0, (light1 & 1) == 1, (signal & 1) == 1)
    poke(1, (light2 & 1) == 1, (signal & 2) == 2)
    dut.clock.step()
    cycles += 1
    if (asks && host.ack.peekBoolean()) {
      asks = false
      answer = host.rdata.peekInt().toLong
      host.req.poke(false)
    }
    for (n <- 0 to 1) lights(n) = optical(n).tx.peekBoolean()
  }

  private def access(address: Int, be: Int, write: Option[Long]): Unit = {
    host.addr.poke(address)
    host.be.poke(be)
    host.write.poke(write.isDefined)
    host.wdata.poke(write.getOrElse(0L))
    host.req.poke(true)
    asks = true
    // Behind a reset it waits until the memories are clear.
    bench.await(40, f"access to 0x$address%04x")(!asks)
    bench.run(20000)
  }

  /** The host reads the word of 32 bits at `address`. */
  def word(address: Int): Long = (0 until 4 by lanes).map { i =>
    access((address & ~3) + i, (1 << lanes) - 1, None)
    answer << 8 * i
  }.sum

  /** The host writes bytes from `address` on, as many at once as its words have. */
  def write(address: Int, bytes: Seq[Int]): Unit = if (bytes.nonEmpty) {
    val at           = address % lanes
    val (now, later) = bytes.splitAt(lanes - at)
    val word         = now.zipWithIndex.map { case (b, i) => b.toLong << 8 * (at + i) }.sum
    access(address - at, now.indices.map(i => 1 << at + i).sum, Some(word))
    write(address + now.size, later)
  }

  def write(address: Int, byte: Int): Unit = write(address, Seq(byte))
  def read(address: Int): Int              = (word(address) >> 8 * (address % 4) & 0xff).toInt
}
