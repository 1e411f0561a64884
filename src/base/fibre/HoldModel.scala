package flyframe.fibre

/** Tells how long a condition has held in one go, in ticks (FB-08). */
class HoldModel {
  private var count = 0

  /** It has held for more than so many of them. */
  def exceeds(ticks: Int): Boolean = count > ticks

  /** It is counted anew. */
  def begin(): Unit = count = 0

  /** A cycle ends in which the condition was `holds`, and with `tick` one of the ticks. */
  def step(holds: Boolean, tick: Boolean): Unit =
    if (!holds) count = 0
    else if (tick) count += 1
}

/** A level that counts as recessive when it has been dominant for too long (FR-37).
  *
  * @param longest
  *   units that it may be dominant
  * @param unit
  *   T of such a unit (FB-08)
  */
class StuckModel(longest: Int, unit: Int) {
  private var before = true
  private var ticks  = 0 // of the level
  private var stuck  = false

  def isStuck: Boolean = stuck

  /** A cycle ends in which the level was `level`, true for recessive.
    *
    * @param clock
    *   which has ended it
    */
  def step(level: Boolean, clock: BitClockModel): Unit = {
    if (level != before) ticks = 0
    else if (clock.ends(8 * (if (level) StuckModel.RecessiveUnit else unit))) ticks += 1
    if (ticks > (if (level) 3 else longest)) stuck = !level
    before = level
  }
}

object StuckModel {

  /** T of which recessive must last 3. */
  private val RecessiveUnit = 4
}

/** The clock of a node that counts times in T (FB-08). */
class BitClockModel {
  private var quanta    = 8
  private var prescaler = 1
  private var cycle     = 0     // of the quantum
  private var left      = 0     // of an eighth, in eighths of a quantum
  private var eighths   = 0
  private var isEighth  = false // one ends with the present cycle

  /** T, see [[FibreUnderTest.setBit]]. */
  def set(quanta: Int, prescaler: Int): Unit = {
    this.quanta = quanta
    this.prescaler = prescaler
  }

  /** There is a T. */
  def isPossible: Boolean = quanta > 0

  /** So many eighths of T, 1 to 512, end with the cycle that is just over. */
  def ends(count: Int): Boolean = isEighth && eighths % count == 0

  /** Ends a core cycle. */
  def step(): Unit = {
    isEighth = false
    cycle += 1
    if (cycle >= prescaler) cycle = 0
    if (cycle == 0 && isPossible) {
      left -= 8
      if (left < 0) {
        left += quanta
        eighths = (eighths + 1) % 512
        isEighth = true
      }
    }
  }
}
