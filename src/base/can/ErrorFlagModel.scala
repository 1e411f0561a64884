package flyframe.can

/** What an own flag counts, beside the error that it is sent for (CAN-21, CAN-30 to CAN-32). */
class ErrorFlagModel(confinement: ConfinementModel) {
  private var run      = 0     // equal bits of a passive flag
  private var last     = true
  private var waits    = false // an ACK error has not counted yet
  private var dominant = 0     // bits behind the flag

  /** @param isAckWhilePassive
    *   it is sent for an ACK error that counts with a dominant bit only
    */
  def begin(isAckWhilePassive: Boolean = false): Unit = {
    run = 0
    dominant = 0
    waits = isAckWhilePassive
  }

  /** A bit of a passive flag.
    *
    * @param counts
    *   counters change with it
    * @return
    *   it is the last one: six equal ones have been heard
    */
  def passiveEnds(heard: Boolean, asTransmitter: Boolean, counts: Boolean): Boolean = {
    if (waits && !heard) {
      waits = false
      if (counts) confinement.raise(asTransmitter, 8)
    }
    run = if (run > 0 && heard == last) run + 1 else 1
    last = heard
    run == 6
  }

  /** Another dominant bit behind the flag. */
  def dominantBehind(isError: Boolean, asTransmitter: Boolean, counts: Boolean): Unit = {
    dominant += 1
    if (counts && dominant == 1 && isError && !asTransmitter) confinement.raise(asTransmitter, 8)
    if (counts && dominant % 8 == 0) confinement.raise(asTransmitter, 8)
  }
}

/** Counts recessive bits in a row, and how often there were eleven (CAN-10, CAN-34). */
class RecessiveCount {
  private var bits = 0

  /** How often there were eleven. */
  var elevens: Int = 0

  /** Also a hard synchronisation does this to the bits (CB-03). */
  def restart(): Unit = bits = 0

  def clear(): Unit = {
    bits = 0
    elevens = 0
  }

  /** A bit was sampled; it is the eleventh in a row. */
  def reaches11(heard: Boolean): Boolean = {
    bits = if (heard) bits + 1 else 0
    val done = bits == 11
    if (done) {
      bits = 0
      elevens += 1
    }
    done
  }
}
