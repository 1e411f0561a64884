package flyframe.protocol

import java.nio.ByteOrder.{BIG_ENDIAN, LITTLE_ENDIAN}

/** Kinds of events. The kind tells what the other fields of an event mean. */
object EventKind extends Codes("event", "Kinds of events") {
  val Detector = code(1, "detector", "an alarm record of a slave")
  val Slave = code(
    2,
    "slave",
    "the state of a slave is another one; sequence: its status word, state: its self-test, " +
      "slave time: records dropped (bits 15 to 8) and links (bits 7 to 0)"
  )
  val Line = code(
    3,
    "line",
    "the state of the master is another one; position: slaves that answer, node: first slave behind the " +
      "cut, sequence and epoch: its status, low half and bits 23 to 16, slave time: frames sent in vain"
  )
  val Command = code(
    4,
    "command",
    "an order is over; position: the order, node: that of the order, sequence: its ticket's low half, " +
      "state: the result"
  )
}

/** An event as reports hold it, behind [[ReportLayout]] and the states of slaves. */
object EventLayout extends Layout("event", "An event of a report", BIG_ENDIAN) {
  val Kind       = field("kind", 1, "one of enum protocol_event: it tells what the other fields mean")
  val Position   = field("position", 1, "of the slave on the line, from 0 on")
  val Node       = field("node", 2, "node ID of the slave")
  val Sequence   = field("sequence", 2, "number of its alarm record")
  val State      = field("state", 1, "of its detector")
  val Epoch      = field("epoch", 1, "of its alarm record")
  val SlaveTime  = field("slave_time", 8, "time of the slave in us")
  val MasterTime = field("master_time", 8, "time of the master in us, when it took the event")
}

/** What the server is to know of (LM-08, LM-12) goes to the memory of events as words of 16 bits, those of an
  * event without the time of the master, which is added there. Here are the numbers of these words.
  */
object MasterEvent {
  val Kind     = EventLayout.Kind.word      // and position
  val Node     = EventLayout.Node.word
  val Sequence = EventLayout.Sequence.word
  val State    = EventLayout.State.word     // and epoch
  val Time     = EventLayout.SlaveTime.word // the first of four, highest first
  val Words    = EventLayout.MasterTime.word
}

/** An event of the master's host at its registers (HOST-06): it becomes one of kind `Command`. */
object HostEventLayout extends Layout("host_event", "An event of the host at its registers", LITTLE_ENDIAN) {
  val Position = field("position", 1, "of the event: the order")
  val State    = field("state", 1, "of the event: one of enum protocol_result")
  val Node     = field("node", 2, "of the event: that of the order")
  val Sequence = field("sequence", 2, "of the event: low half of the order's ticket")
}
