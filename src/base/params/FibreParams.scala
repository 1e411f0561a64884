package flyframe.params

/** What modems, ports and bus mode of a ring node are built with.
  *
  * @param coreClockMhz
  *   50 or 100
  * @param toneDominantKhz
  *   tone of a dominant level
  * @param toneSearchKhz
  *   tone of a port that hears nothing
  * @param toneRecessiveKhz
  *   tone of a recessive level
  * @param demodulator
  *   0 fast, 1 counting, as published
  * @param usPerMs
  *   microseconds of what ports count as a millisecond, a power of two (FB-04); tests make it shorter
  */
final case class FibreParams(
    coreClockMhz: Int = 100,
    toneDominantKhz: Int = 25000,
    toneSearchKhz: Int = 5000,
    toneRecessiveKhz: Int = 1000,
    demodulator: Int = 0,
    usPerMs: Int = 1024
) {
  for (
    problem <-
      FibreParams.problems(coreClockMhz, toneDominantKhz, toneSearchKhz, toneRecessiveKhz, demodulator)
  ) require(requirement = false, problem)
  require(
    usPerMs > 0 && Integer.bitCount(usPerMs) == 1 && usPerMs <= 1024,
    s"usPerMs is $usPerMs but must be a power of two up to 1,024."
  )

  /** Samples of an optical input in each core cycle: on one clock edge or on both. */
  def samplesPerCycle: Int = 100 / coreClockMhz

  /** Samples in a microsecond. */
  def sampleMhz: Int = coreClockMhz * samplesPerCycle

  /** Core cycles of half a period of a tone, rounded down. */
  def halfPeriod(khz: Int): Int = coreClockMhz * 1000 / (2 * khz)

  /** Samples in a time of `ns` nanoseconds, rounded down. */
  def samplesIn(ns: Int): Int = ns * sampleMhz / 1000

  /** Samples between rising edges of the tone of search, a tenth of its period more or less (FR-11). */
  def searchSamples: Range = {
    val tenth = sampleMhz * 100.0 / toneSearchKhz
    (9 * tenth).ceil.toInt to (11 * tenth).toInt
  }

  /** Samples in `tenths` tenths of a dominant period, rounded down. */
  def dominantTenths(tenths: Int): Int = sampleMhz * 100 * tenths / toneDominantKhz
}

object FibreParams {

  /** Why there can be no such modems, as [[EscParams.problems]]. */
  private[params] def problems(
      coreClockMhz: Int,
      dominant: Int,
      search: Int,
      recessive: Int,
      demodulator: Int
  ): Seq[String] = Seq(
    Option.unless(Seq(50, 100).contains(coreClockMhz))(
      s"coreClockMhz is $coreClockMhz but must be 50 or 100 MHz in a ring node."
    ),
    Option.unless(dominant <= 25000)(s"toneDominantKhz is $dominant but must be at most 25000 kHz."),
    Option.unless(dominant >= 4 * search && dominant <= 8 * search)(
      s"toneSearchKhz is $search but must be 1/8 to 1/4 of toneDominantKhz."
    ),
    Option.unless(search >= 4 * recessive)(
      s"toneRecessiveKhz is $recessive but must be at most 1/4 of toneSearchKhz."
    ),
    // The detector tells a silence from more than 16 samples.
    Option.unless(search <= 5200)(s"toneSearchKhz is $search but must be at most 5200 kHz."),
    // Else there is no signal (FR-10).
    Option.unless(recessive >= 400)(
      s"toneRecessiveKhz is $recessive but must be 400 kHz or more."
    ),
    Option.unless(Seq(0, 1).contains(demodulator))(
      s"demodulator is $demodulator but must be 0 (fast) or 1 (counting)."
    )
  ).flatten
}
