package flyframe.model

/** The loop that brings a clock to the time of another one (DC-17 to DC-20, B-85): from one sample to the
  * next it adjusts the speed, and lets the time fall back or catch up by a few ns.
  */
class TimeLoop {
  private var mean     = 0L // of the difference, 1/65536 ns
  private var integral = 0L // speed counter difference, 1/65536
  private var speed    = 0L // the same averaged, in 2^-32
  private var rest     = 0L // still to correct, 1/256 ns

  private var sampled = false // since the mean was reset

  /** Cycles, less 2, between those in which the clock loses 1 ns, and wins 1 ns. */
  var lose: Int = 0x1000
  var win: Int  = 0x1000

  /** Writes of the registers.
    *
    * @param start
    *   speed counter start
    * @param speedDepth
    *   filter depth of the speed, 0 to 15
    * @param direct
    *   speed counter difference that is set directly, or 0 (DC-25)
    */
  def reset(start: Int, speedDepth: Int = 0, direct: Int = 0): Unit = {
    resetMean()
    resetSpeed()
    integral = 0
    rest = 0
    if (direct == 0) drive(start) else set(start, speedDepth, direct)
  }
  def resetMean(): Unit = {
    mean = 0
    sampled = false
  }
  def resetSpeed(): Unit = speed = 0

  /** The speed counter difference is set directly. */
  def set(start: Int, speedDepth: Int, direct: Int): Unit = {
    integral = direct.toLong << 16
    settle(start, speedDepth)
  }

  /** The clock was `difference` ns later than the reference; how many ns it now falls back by, if it is not
    * set directly.
    *
    * @param timeDepth
    *   filter depth of the difference, 0 to 15
    */
  def sample(
      difference: Int,
      start: Int,
      timeDepth: Int,
      speedDepth: Int,
      direct: Int = 0
  ): Option[Int] = {
    mean += (difference - (mean >> 16)) << (16 - timeDepth)
    sampled = true
    if (direct != 0) {
      set(start, speedDepth, direct)
      None
    } else {
      val isFar  = difference < -16384 || difference >= 16384
      val isNear = difference >= -128 && difference < 128
      rest += (if (isFar) difference.sign * 4096 * 256 else (if (isNear) 16 else 64) * difference)
      val now = rest >> 8
      rest -= now << 8
      if (!isFar) integral += (if (isNear) 2048L else 4096L) * difference
      settle(start, speedDepth)
      Some(now.toInt)
    }
  }

  private def settle(start: Int, speedDepth: Int): Unit = {
    val limit = (start - 0x7f).max(0).toLong << 16
    integral = integral.max(-limit).min(limit)
    speed += (integral - (speed >> 16)) << (16 - speedDepth)
    drive(start)
  }

  private def drive(start: Int): Unit = {
    val difference = (integral >> 16).toInt
    lose = (start - difference) & 0x7fff
    win = (start + difference) & 0x7fff
  }

  /** What the clock wins per cycle at the time, ns. */
  def winsPerCycle: Double = 1.0 / (win + 2) - 1.0 / (lose + 2)

  /** What the registers show: the mean difference (0x092C) with its sign, which is 0 after a reset, and the
    * speed counter difference (0x0932).
    */
  def shownDifference: Long = {
    val whole = mean >> 16
    if (whole < 0) -whole else if (sampled) whole | 0x80000000L else 0
  }
  def shownSpeed: Int = (speed >> 32).toInt & 0xffff
}
