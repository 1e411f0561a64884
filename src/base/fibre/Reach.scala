package flyframe.fibre

/** How long a ring in bus mode may be (FR-38). */
object Reach {

  /** Light in fibre. */
  val NsPerMetre = 5

  /** A node with two optical modules. */
  def nodeNs(coreClockMhz: Int): Int = if (coreClockMhz == 100) 200 else 280

  /** Part of a bit, in percent, that the way to the farthest node and back may take. */
  val Percent = 72

  /** The greatest length in metres, gap included; negative if there is none.
    *
    * @param kbps
    *   bit rate in kbit/s
    * @param nodes
    *   2 or more
    */
  def metres(kbps: Int, nodes: Int, coreClockMhz: Int = 100): Int = {
    val oneWay = 1000000 / 2 * Percent / 100 / kbps - nodeNs(coreClockMhz) * (nodes - 1)
    Math.floorDiv(oneWay, NsPerMetre)
  }

  /** The greatest bit rate in bit/s of a ring of this length. */
  def bitsPerSecond(metres: Int, nodes: Int, coreClockMhz: Int = 100): Int = {
    (1000000000L * Percent / 100 / (2 * oneWay(metres, nodes, coreClockMhz))).toInt
  }

  /** The least core cycles of a quantum with which a ring of this length works.
    *
    * @param quanta
    *   of a bit
    */
  def prescaler(metres: Int, nodes: Int, coreClockMhz: Int, quanta: Int): Long = {
    val thereAndBack = 2 * oneWay(metres, nodes, coreClockMhz)
    val perCycle     = quanta * Percent * 1000
    (thereAndBack * 100 * coreClockMhz + perCycle - 1) / perCycle
  }

  /** ns to the farthest node. */
  private def oneWay(metres: Int, nodes: Int, coreClockMhz: Int): Long =
    nodeNs(coreClockMhz).toLong * (nodes - 1) + NsPerMetre.toLong * metres

  /** The bit rates and numbers of nodes of the table. */
  val Rates: Seq[Int] = Seq(1000, 500, 400, 250, 125, 100, 50, 20, 10, 5)
  val Nodes: Seq[Int] = Seq(2, 5, 10, 20, 50)

  /** An entry of the table: km, rounded down to three digits at most, `-` if there is none. */
  def entry(kbps: Int, nodes: Int, coreClockMhz: Int = 100): String = {
    val m = metres(kbps, nodes, coreClockMhz)
    if (m <= 0) "-"
    else if (m < 10000) f"${m / 1000}%d.${m % 1000 / 10}%02d"
    else f"${m / 1000}%d.${m % 1000 / 100}%d"
  }
}
