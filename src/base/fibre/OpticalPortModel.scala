package flyframe.fibre

import flyframe.params.FibreParams

/** A port: what it hears, whether it is up, and what it sends (FR-10 to FR-14, FB-02 to FB-07, FB-16). */
class OpticalPortModel(p: FibreParams) {
  import OpticalPortModel._
  private val demodulator = DemodulatorModel(p)
  private val inspection  = new SignalModel(p)
  private val modulator   = new ModulatorModel(p)
  private val count       = p.samplesPerCycle

  // The stages of the crossing, of samples and of `optical_signal`.
  private var (once, twice)               = (0, 0)
  private var (onceOptical, twiceOptical) = (false, false)

  private var left    = 0     // milliseconds of signal without search, less one, until it comes up
  private var last    = Never // quarters of a second since the last loss
  private var second  = Never // and since the one before
  private var isThird = false // the last loss was the third one within a second

  private var isUp     = false
  private var telling  = 2    // ends of 8 us until the other end has heard that it went down
  private var searches = true // it sends search, unless it is switched off

  /** Times that it went down, and that noise began; 8 bits, which stop at 255. */
  var losses: Int = 0
  var noises: Int = 0

  def light: Boolean       = modulator.light
  def signal: Boolean      = inspection.signal && twiceOptical
  def hearsSearch: Boolean = inspection.hearsSearch && signal
  def up: Boolean          = isUp

  /** The level heard, true for recessive. */
  def level: Boolean = demodulator.level

  /** Ends a core cycle.
    *
    * @param samples
    *   of the optical input, the first one in bit 0
    * @param send
    *   the level to be sent while the port is up
    * @param eight
    *   8 us end with this cycle
    * @param ms
    *   a millisecond ends with this cycle
    * @param quarter
    *   a quarter of a second does
    * @param slow
    *   16 samples do
    */
  def step(
      samples: Int,
      optical: Boolean,
      send: Boolean,
      off: Boolean,
      upMs: Int,
      eight: Boolean,
      ms: Boolean,
      quarter: Boolean,
      slow: Boolean
  ): Unit = {
    modulator.step(
      if (off) Tone.Dark
      else if (searches) Tone.Search
      else if (!isUp) Tone.Recessive
      else Tone.of(send)
    )
    searches = !signal || tells
    upOrDown(signal && !hearsSearch && !off, off, upMs, eight, ms, quarter)
    var i = 0
    while (i < count) {
      demodulator.sample((twice >> i & 1) == 1)
      i += 1
    }
    if (inspection.step(twice, slow)) noises = 255 min noises + 1
    twice = once
    once = samples
    twiceOptical = onceOptical
    onceOptical = optical
  }

  /** Three losses within a second keep it down (FR-14). */
  private def isHeld = isThird && last < Never

  /** It sends search though there is signal (FB-16). */
  private def tells = isHeld || telling > 0

  private def upOrDown(
      isGood: Boolean,
      off: Boolean,
      upMs: Int,
      eight: Boolean,
      ms: Boolean,
      quarter: Boolean
  ): Unit = {
    val mayRise = !tells
    if (isUp && !isGood) telling = 2 else if (eight && telling > 0) telling -= 1
    if (isUp && !isGood && !off) lose()
    else if (quarter) {
      last = Never min last + 1
      second = Never min second + 1
    }
    if (isUp || !isGood || !mayRise) {
      isUp &&= isGood
      left = upMs
    } else if (ms && left > 0) left -= 1
    else if (ms) isUp = true
  }

  private def lose(): Unit = {
    losses = 255 min losses + 1
    isThird = second < Never
    second = last
    last = 0
  }
}

object OpticalPortModel {

  /** More quarters than a second has. */
  private val Never = 5
}
