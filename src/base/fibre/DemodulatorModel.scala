package flyframe.fibre

import flyframe.params.FibreParams

/** Makes levels of light, sample by sample. */
trait DemodulatorModel {

  /** The level heard, true for recessive. */
  def level: Boolean

  /** One sample of the input. */
  def sample(light: Boolean): Unit
}

object DemodulatorModel {
  def apply(p: FibreParams): DemodulatorModel =
    if (p.demodulator == 0) new FastDemodulatorModel(p) else new CountingDemodulatorModel(p)
}

/** Decides by distances between rising edges (FR-04). */
class FastDemodulatorModel(p: FibreParams) extends DemodulatorModel {
  private val short    = p.dominantTenths(15)
  private val quiet    = p.dominantTenths(25)
  private var before   = false
  private var distance = quiet // samples since the last rising edge
  private var wasShort = false // the distance before
  private var heard    = true

  def level: Boolean = heard

  def sample(light: Boolean): Unit = {
    distance = quiet min distance + 1
    if (light && !before) {
      val isShort = distance <= short
      if (isShort && wasShort) heard = false
      wasShort = isShort
      distance = 0
    } else if (distance == quiet) heard = true
    before = light
  }
}

/** Decides by counting rising edges for a microsecond, every two (FR-08). */
class CountingDemodulatorModel(p: FibreParams) extends DemodulatorModel {
  private val base     = p.sampleMhz                      // samples of a base period
  private val enough   = p.toneDominantKhz * 4 / 5 / 1000 // four fifths of what a dominant tone has
  private var position = 0
  private var count    = 0
  private var before   = false
  private var heard    = true

  def level: Boolean = heard

  def sample(light: Boolean): Unit = {
    val enable = position >= base
    val start  = position % base < base / 2
    if (!enable) { if (light && !before) count += 1 }
    else if (start) heard = count < enough
    else count = 0
    before = light
    position = (position + 1) % (2 * base)
  }
}
