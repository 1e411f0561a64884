package flyframe.system

import flyframe.protocol._

/** The decisions of a [[MasterModel]] on which lives depend; tests put defects there. */
trait MasterDecisions {

  /** The bits of status words reach the sounder and the fire output. */
  protected[system] def soundsByState: Boolean = true

  /** Whether a record is one that was heard or taken before, since its position was last absent: a slave
    * begins with the same numbers, and even at the same time of its own, after each power-up.
    */
  protected[system] def isSame(a: Record, b: Record): Boolean =
    a.sequence == b.sequence && a.epoch == b.epoch && a.guard == b.guard && a.state == b.state

  /** A record sounds if an alarm is not silenced: one that has waited for long may be over. */
  protected[system] def recordSounds(or: Int): Boolean = (or & SlaveStatus.Sounding) != 0

  /** Fire follows from status words only. */
  protected[system] def recordFires(or: Int): Boolean = false

  /** The sounder ends when no slave that answers sounds: wrong, since others may not answer. */
  protected[system] def followsSlaves: Boolean = false

  /** An order is given up after a while, and when other slaves may have the positions. */
  protected[system] def forgetsOrders: Boolean = true

  /** Records that were heard or taken from a slave count no more when it is absent, nor do acknowledgements
    * for it.
    */
  protected[system] def forgetsRecords: Boolean = true

  /** A reset that has not ended the fire ends no later alarm. */
  protected[system] def forgetsReset: Boolean = true

  /** A slave that was absent, and comes back sounding, is heard. */
  protected[system] def hearsReturned: Boolean = true

  /** When orders are given up since one end of a ring has changed, the other end is heard again, too. */
  protected[system] def hearsTogether: Boolean = true

  /** When orders are given up, slaves that still sound are heard again. */
  protected[system] def soundsAgain: Boolean = true

  /** An order ends when the slave has taken it, not when its effect is seen. */
  protected[system] def endsOrder: Boolean = true

  protected[system] def stores(record: Record): Boolean = true
}
