package flyframe.protocol

/** What the server is to know of (LM-08) goes to it as six words of 16 bits, one after the other: kind and
  * position; node ID; sequence; state and epoch; time, its high half first. In the first and the fourth the
  * former of both is the high byte. The kind tells what the others mean.
  */
object MasterEvent {
  val Kind     = 0
  val Node     = 1
  val Sequence = 2
  val State    = 3
  val TimeHigh = 4
  val TimeLow  = 5
  val Words    = 6
}

/** Kinds of events: written down here for RTL, model and server. */
object EventKind {

  /** An alarm record of a slave. */
  val Detector = 1

  /** The line has been looked through; position: number of slaves listed, node: of those that answer. */
  val Scanned = 2

  /** A slave is there; state: result of its self-test, sequence: its DL status. */
  val Present = 3

  /** A slave that was there does not answer any more; it answers again. */
  val Lost  = 4
  val Found = 5

  /** A slave has the same node ID as that at position `sequence`. */
  val Duplicate = 6

  /** A slave's node ID is not that of the one before it (`sequence`) plus one. */
  val Gap = 7

  /** What became of a command of the server, from the master's host; position: the command, sequence: low
    * bits of its counter, state: result.
    */
  val Command = 8
}
