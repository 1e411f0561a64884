package flyframe.can

/** The setting of a bit's quanta (CAN-01); the prescaler is not part of it.
  *
  * @param tseg1
  *   quanta between sync segment and sample point, 1 to 64
  * @param tseg2
  *   quanta behind it, 1 to 16
  * @param sjw
  *   greatest change by a resynchronisation, 1 to 16 quanta
  */
final case class BitSetting(tseg1: Int, tseg2: Int, sjw: Int, threeSamples: Boolean = false) {

  /** Quanta of a bit. */
  def length: Int = 1 + tseg1 + tseg2

  def isPossible: Boolean = length >= 8 && sjw <= tseg2 && !(threeSamples && tseg1 < 2)
}

/** What happens to the bits that a [[BitTimingModel]] tells apart. */
trait BitStream {

  /** A bit begins: what is driven from now on is that of this bit. */
  def begins(): Unit

  /** The present bit is sampled. */
  def samples(bit: Boolean): Unit

  /** Edges synchronise hard in the present bit (CAN-03). */
  def isHard: Boolean

  /** There was a hard synchronisation. */
  def hardSynchronises(): Unit

  /** The level that the controller drives. */
  def level: Boolean
}

/** Finds bits in quanta (CAN-02 to CAN-06, CB-02). */
class BitTimingModel(setting: BitSetting, bits: BitStream) {
  import setting._
  private var k            = 0    // number of the present quantum in its bit
  private var before       = true // level of the quantum before
  private var twoBefore    = true
  private var lastSample   = true
  private var synchronised = false

  /** A quantum ends in which `heard` was heard. */
  def quantum(heard: Boolean): Unit = {
    if (before && !heard && lastSample && !synchronised) edge()
    if (k == tseg1) {
      lastSample =
        if (threeSamples) Seq(heard, before, twoBefore).count(identity) >= 2
        else heard
      synchronised = false
      bits.samples(lastSample)
    }
    if (k == length - 1) next() else k += 1
    twoBefore = before
    before = heard
  }

  private def next(): Unit = {
    k = 0
    bits.begins()
  }

  private def edge(): Unit = {
    val isBehind = k > tseg1
    if (bits.isHard) {
      synchronised = true
      bits.hardSynchronises()
      if (isBehind) next() else k = 0
    } else if (isBehind) {
      synchronised = true
      if (length - k <= sjw) next() else k += sjw
    } else if (bits.level || k == 0) {
      synchronised = true
      k -= k min sjw
    }
  }
}
