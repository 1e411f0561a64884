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
  require(
    Seq(50, 100).contains(coreClockMhz),
    s"coreClockMhz is $coreClockMhz but must be 50 or 100 MHz in a ring node."
  )
  require(
    sampleMhz * 1000 >= 4 * toneDominantKhz,
    s"toneDominantKhz is $toneDominantKhz but must be at most ${sampleMhz * 250} kHz."
  )
  require(
    toneDominantKhz >= 4 * toneSearchKhz && toneDominantKhz <= 8 * toneSearchKhz,
    s"toneSearchKhz is $toneSearchKhz but must be 1/8 to 1/4 of toneDominantKhz."
  )
  require(
    toneSearchKhz >= 4 * toneRecessiveKhz,
    s"toneRecessiveKhz is $toneRecessiveKhz but must be at most 1/4 of toneSearchKhz."
  )
  require(
    Seq(0, 1).contains(demodulator),
    s"demodulator is $demodulator but must be 0 (fast) or 1 (counting)."
  )
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

  /** Samples in `tenths` tenths of a dominant period, rounded down. */
  def dominantTenths(tenths: Int): Int = sampleMhz * 100 * tenths / toneDominantKhz
}
