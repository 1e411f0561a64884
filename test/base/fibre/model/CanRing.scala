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
  */
class CanRing(count: Int, home: Option[Int], delays: Seq[Long], prescaler: Int, coreClockMhz: Int = 50) {
  private val p      = FibreParams(coreClockMhz = coreClockMhz, usPerMs = 1)
  private val period = 1000000L / coreClockMhz
  private val cans   = Seq.fill(count)(new CanPortModel(CanParams(coreClockMhz = coreClockMhz)))
  val rate: Rate     = Rate("25 tq", prescaler, BitSetting(tseg1 = 21, tseg2 = 3, sjw = 3))

  /** Bit time in us. */
  val bit: Double = rate.bitCycles.toDouble / coreClockMhz

  val ring: RingBench =
    new RingBench(
      p,
      IndexedSeq.fill(count)(new RingPortsModel(p)),
      delays.map(_ * 1000),
      Seq.fill(count)(period)
    )

  /** The host of each node. */
  val hosts: Seq[LowerTester] = cans.map(new LowerTester(_, rate))

  for ((can, n) <- cans.zipWithIndex) {
    ring.drives(n) = () => can.driven
    ring.hears(n) = level => can.step(level)
    ring.nodes(n).write(flyframe.registers.RingRegisters.Address, n + 2)
    ring.nodes(n).setBit(rate.bitCycles / prescaler, prescaler)
    ring.control(n, home = home.contains(n))
  }
  ring.runUs(25)
  hosts.foreach(_.start())
  ring.runUs(15 * bit)

  /** Runs until all requests are done, for `bits` at most. */
  def finish(bits: Int): Unit = {
    val end = ring.now + (bits * bit * 1e6).toLong
    while (hosts.exists(_.pending != 0) && ring.now < end) ring.runUs(5 * bit)
    ring.runUs(12 * bit)
  }

  /** Errors of every kind that the nodes have counted, lost arbitrations left out. */
  def errors: Seq[Int] = hosts.map(_.counters.take(5).sum)
}

object CanRing {

  /** Two optical modules, in ns. */
  val Modules = 40L

  /** Fibres of a ring of `metres` of which the guard's gap, behind the last node, has none. */
  def spread(count: Int, metres: Double): Seq[Long] =
    Seq.fill(count - 1)((metres * Reach.NsPerMetre / (count - 1)).toLong + Modules) :+ Modules
}
