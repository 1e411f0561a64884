package flyframe.protocol

/** What a detector line is in: the codes of `detector_state` and of alarm records. */
object DetectorState {
  val Off    = 0 // no supply
  val Normal = 1
  val Alarm  = 2
  val Open   = 3 // the line is broken
  val Short  = 4 // short circuit on the line

  /** Bits of a code. */
  val Width = 3
}
