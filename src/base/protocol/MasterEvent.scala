package flyframe.protocol

import java.nio.ByteOrder.{BIG_ENDIAN, LITTLE_ENDIAN}

/** Kinds of events. The kind tells what the other fields of an event mean. */
object EventKind extends Codes("event", "Kinds of events") {
  val Detector = code(1, "detector", "an alarm record of a slave")
  val Scanned =
    code(2, "scanned", "the line has been listed; position: slaves listed, node: those that answer")
  val Present = code(3, "present", "a slave is there; state: its self-test, sequence: its DL status")
  val Lost    = code(4, "lost", "a slave that was there does not answer any more")
  val Found   = code(5, "found", "it answers again; state and sequence as for a slave that is there")
  val Duplicate =
    code(6, "duplicate", "a slave has the same node ID as the one at the position in sequence")
  val Gap = code(7, "gap", "a node ID is not that of the slave before it, which is in sequence, plus one")
  val Command = code(
    8,
    "command",
    "an order is over; position: the order, sequence: its number's low half, state: the result"
  )
}

/** An event as reports hold it, behind [[ReportLayout]]. */
object EventLayout extends Layout("event", "An event of a report", BIG_ENDIAN) {
  val Kind       = field("kind", 1, "one of enum protocol_event: it tells what the other fields mean")
  val Position   = field("position", 1, "of the slave on the line, from 0 on")
  val Node       = field("node", 2, "node ID of the slave")
  val Sequence   = field("sequence", 2, "number of its alarm record")
  val State      = field("state", 1, "of its detector")
  val Epoch      = field("epoch", 1, "of its alarm record")
  val SlaveTime  = field("slave_time", 4, "time of the slave in us")
  val MasterTime = field("master_time", 4, "time of the master in us, when it took the event")
}

/** What the server is to know of (LM-08) goes to the reporter as words of 16 bits, those of an event without
  * the time of the master, which the reporter adds. Here are the numbers of these words.
  */
object MasterEvent {
  val Kind     = EventLayout.Kind.word  // and position
  val Node     = EventLayout.Node.word
  val Sequence = EventLayout.Sequence.word
  val State    = EventLayout.State.word // and epoch
  val TimeHigh = EventLayout.SlaveTime.word
  val TimeLow  = TimeHigh + 1
  val Words    = EventLayout.MasterTime.word
}

/** An event of the master's host at its registers (HOST-06): it becomes one of kind `Command`. */
object HostEventLayout extends Layout("host_event", "An event of the host at its registers", LITTLE_ENDIAN) {
  val Position = field("position", 1, "of the event: the order")
  val State    = field("state", 1, "of the event: one of enum protocol_result")
  val Node     = field("node", 2, "of the event: that of the order")
  val Sequence = field("sequence", 2, "of the event: low half of the order's number")
}
