package flyframe.host

import scala.collection.mutable.ArrayBuffer
import chiseltest._
import flyframe.params.EscParams

/** What the host has at its pins in a core cycle.
  *
  * @param sel
  *   the slave is selected, whatever the level of the pin
  * @param samples
  *   MISO is looked at before anything changes
  * @param ends
  *   it is looked at behind this cycle
  */
case class SpiCycle(
    sel: Boolean,
    clk: Boolean,
    mosi: Boolean,
    samples: Boolean = false,
    ends: Boolean = false
)

/** The wires of SPI as a host drives them, core cycle by core cycle, in the mode that `p` asks for. */
class SpiWires(p: EscParams, pins: SpiPins) {
  val random              = new scala.util.Random(p.spiMode)
  private val restLevel   = p.spiMode >= 2
  private val secondEdge  = p.spiMode % 2 == 1
  private val samplesLate = p.spiLateSample == 1

  private val received = ArrayBuffer.empty[Boolean] // bits that MISO had

  val rest: SpiCycle = SpiCycle(sel = false, restLevel, mosi = false)
  private var ended  = false
  private var driven = Option.empty[SpiCycle]
  drive(rest)

  /** Another core cycle begins. */
  def drive(cycle: SpiCycle): Unit = {
    if (cycle.samples || ended) received += pins.miso.peekBoolean()
    ended = cycle.ends
    if (!driven.exists(_.sel == cycle.sel)) pins.sel.poke(cycle.sel == (p.spiSelHigh == 1))
    if (!driven.exists(_.clk == cycle.clk)) pins.clk.poke(cycle.clk)
    if (!driven.exists(_.mosi == cycle.mosi)) pins.mosi.poke(cycle.mosi)
    driven = Some(cycle)
  }

  /** One bit, with a clock of `cycles` core cycles. */
  def bit(mosi: Boolean, cycles: Int): Seq[SpiCycle] = {
    val half   = cycles / 2
    val second = if (secondEdge) restLevel else !restLevel
    Seq.tabulate(cycles) { i =>
      val clk = if (i < half) !second else second
      SpiCycle(sel = true, clk, mosi, !samplesLate && i == half, samplesLate && i == cycles - 1)
    }
  }

  /** One access: sends bytes, of the last one `bits`, and waits as long behind each as `pause` says. */
  def access(sent: Seq[Int], cycles: Int, bits: Int = 8, pause: Int => Int = _ => 0): Seq[SpiCycle] = {
    val idle = rest.copy(sel = true)
    val bytes = sent.zipWithIndex.flatMap { case (byte, i) =>
      val last = if (i == sent.size - 1) 8 - bits else 0
      (7 to last by -1).flatMap(b => bit((byte >> b & 1) == 1, cycles)) ++ Seq.fill(pause(i))(idle)
    }
    // Half a clock at least in front of the first edge, and behind the last.
    Seq.fill(2 + random.nextInt(6))(idle) ++ bytes ++ Seq.fill(cycles / 2)(idle) ++ Seq.fill(
      5 + random.nextInt(8)
    )(
      rest
    )
  }

  /** What was received so far does not count. */
  def forget(): Unit = {
    received.clear()
    ended = false
  }

  /** What was received, in bytes. */
  def bytes: Seq[Int] =
    received.toSeq.grouped(8).map(_.foldLeft(0)((soFar, bit) => soFar << 1 | (if (bit) 1 else 0))).toSeq
}

object SpiWires {

  /** Address and command. */
  def head(address: Int, command: Int, long: Boolean): Seq[Int] = {
    def low(c: Int) = (address & 0x1f) << 3 | c
    if (long) Seq(address >> 5 & 0xff, low(6), address >> 8 & 0xe0 | command << 2)
    else Seq(address >> 5 & 0xff, low(command))
  }
}
