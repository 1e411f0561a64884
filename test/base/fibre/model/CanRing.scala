package flyframe.fibre.model

import flyframe.can._
import flyframe.fibre._
import flyframe.params.{CanParams, FibreParams}

/** A ring in bus mode: golden models of ports and CAN controllers, fibres with delays.
  *
  * @param home
  *   the node that is guard
  * @param delays
  *   of the fibres behind each node, with two modules, in ns
  * @param prescaler
  *   of the bit timing of FR-38, 25 quanta
  * @param firstAddress
  *   of node 0; each node has the next one
  * @param ppm
  *   by how much the clock of each node is slow
  */
class CanRing(
    count: Int,
    home: Option[Int],
    delays: Seq[Long],
    prescaler: Int,
    coreClockMhz: Int = 50,
    firstAddress: Int = 2,
    ppm: Seq[Int] = Nil
) extends CanOnRing {
  private val p      = FibreParams(coreClockMhz = coreClockMhz, usPerMs = 1)
  private val period = 1000000L / coreClockMhz
  private val cans =
    Seq.fill(count)(new CanPortModel(CanParams(coreClockMhz = coreClockMhz), isTolerant = false))
  val rate: Rate = Rate("25 tq", prescaler, BitSetting(tseg1 = 21, tseg2 = 3, sjw = 3))

  /** Bit time in us. */
  val bit: Double = rate.bitCycles.toDouble / coreClockMhz

  val bench: RingBench =
    new RingBench(
      p,
      IndexedSeq.fill(count)(new RingPortsModel(p)),
      delays.map(_ * 1000),
      Seq.tabulate(count)(n => period + period * ppm.lift(n).getOrElse(0) / 1000000)
    )

  val hosts: IndexedSeq[LowerTester] = cans.map(new LowerTester(_, rate)).toIndexedSeq

  for ((can, n) <- cans.zipWithIndex) {
    bench.drives(n) = () => can.driven
    bench.hears(n) = level => can.step(level)
    bench.nodes(n).write(flyframe.registers.RingRegisters.Address, firstAddress + n)
    bench.nodes(n).setBit(rate.bitCycles / prescaler, prescaler)
    bench.control(n, home = home.contains(n))
  }
  bench.runUs(25)
  hosts.foreach(_.start())
  run(15)

  def run(bits: Double): Unit              = bench.runUs(bits * bit)
  def cut(link: Int, isCut: Boolean): Unit = bench.cut(link, isCut)
  def ring(node: Int, address: Int): Int   = bench.nodes(node).read(address)
}

object CanRing {

  /** Two optical modules, in ns. */
  val Modules = 40L

  /** How many metres are too many: with the nodes the way is 1.5 times as long as at `metres`. Where they
    * take most of it twice, as nodes are faster than what FR-38 takes them for.
    */
  def tooLong(metres: Double, count: Int): Double = {
    val ofNodes = Reach.nodeNs(100).toDouble * (count - 1) / Reach.NsPerMetre
    metres + (metres + ofNodes) * (if (metres > ofNodes / 5) 0.5 else 1)
  }

  /** Fibres of a ring of `metres` of which the guard's gap, behind the last node, has none. */
  def spread(count: Int, metres: Double): Seq[Long] =
    Seq.fill(count - 1)((metres * Reach.NsPerMetre / (count - 1)).toLong + Modules) :+ Modules
}
