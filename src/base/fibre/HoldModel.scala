package flyframe.fibre

/** Tells when a condition has held for more than some eighths of T in one go (FB-08). */
class HoldModel(eighths: Int) {
  private var count = 0

  /** It has held that long. */
  def isOver: Boolean = count > eighths

  /** A cycle ends in which the condition was `holds`; with `eighth` an eighth of T ends, too. */
  def step(holds: Boolean, eighth: Boolean): Unit =
    if (!holds) count = 0
    else if (eighth && !isOver) count += 1
}

/** A level that counts as recessive when it has been dominant for too long (FR-37).
  *
  * @param longest
  *   bit times that it may be dominant
  */
class StuckModel(longest: Int) {
  private val dominant  = new HoldModel(8 * longest)
  private val recessive = new HoldModel(8 * 11)
  private var stuck     = false

  def isStuck: Boolean = stuck

  /** A cycle ends in which the level was `level`, true for recessive. */
  def step(level: Boolean, eighth: Boolean): Unit = {
    dominant.step(!level, eighth)
    recessive.step(level, eighth)
    stuck = dominant.isOver || stuck && !recessive.isOver
  }
}
