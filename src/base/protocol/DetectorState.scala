package flyframe.protocol

import java.nio.ByteOrder.LITTLE_ENDIAN

/** What a detector line is in: the codes of `detector_state` and of alarm records. */
object DetectorState extends Codes("state", "What a detector line is in") {
  val Off    = code(0, "off", "there is no supply")
  val Normal = code(1, "normal", "no smoke")
  val Alarm  = code(2, "alarm", "smoke")
  val Open   = code(3, "open", "the line is broken")
  val Short  = code(4, "short", "the line has a short circuit")

  /** Bits of a code. */
  val Width = 3
}

/** An alarm record (ALARM-03), at its register and in the datagram that reports it. */
object RecordLayout extends Layout("record", "An alarm record", LITTLE_ENDIAN) {
  val Sequence = field("sequence", 2, "number of the event, from 1 on")
  val State    = field("state", 1, "one of enum protocol_state")
  val Epoch    = field("epoch", 1, "of the host: another one after each start")
  val Time     = field("time", 4, "time of the slave in us")
}

/** The datagram that a slave appends to a passing frame (AP-05): a NOP, which every other controller passes
  * untouched, around the alarm record.
  */
object AppendedLayout extends DatagramFields("appended", "The datagram that a slave appends") {
  val Record  = field("record", RecordLayout.bytes, "the alarm record")
  val Counter = field("counter", DatagramLayout.CounterBytes, "working counter")

  /** Its working counter: that of a datagram which one slave has executed. */
  val Counted = 1
}
