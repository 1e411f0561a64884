package flyframe.protocol

import java.nio.ByteOrder.LITTLE_ENDIAN

/** What a detector line is in: in alarm records. */
object DetectorState extends Codes("state", "What a detector line is in") {
  val Off    = code(0, "off", "there is no supply")
  val Normal = code(1, "normal", "no smoke")
  val Alarm  = code(2, "alarm", "smoke")
  val Open   = code(3, "open", "the line is broken")
  val Short  = code(4, "short", "the line has a short circuit")

  /** Bits of a code. */
  val Width = 3

  /** In a record: it is of a detector that is being tested. */
  val Test = code(0x80, "test", "bit 7 of a record's state: the detector is being tested")
}

/** What a detector is to do (DET-06). */
object DetectorMode extends Codes("mode", "What a detector is to do") {
  val Watch   = code(0, "watch", "alarms count")
  val Disable = code(1, "disable", "nothing counts")
  val Test    = code(2, "test", "alarms are reported as tests")

  /** Bits of a code. */
  val Width = 2
}

/** An alarm record (ALARM-03), in the datagram that reports it. */
object RecordLayout extends Layout("record", "An alarm record", LITTLE_ENDIAN) {
  val Sequence = field("sequence", 2, "number of the event, from 1 on")
  val State    = field("state", 1, "one of enum protocol_state, and its test bit")
  val Epoch    = field("epoch", 1, "of the host when it happened: another one after each start")
  val Time     = field("time", 8, "time of the slave in us")
}

/** The datagram that a slave appends to a passing frame (AP-05): a NOP, which every other controller passes
  * untouched, around the alarm record. Its index is the position of the slave: 1 is the first one that the
  * frame has passed.
  */
object AppendedLayout extends DatagramFields("appended", "The datagram that a slave appends") {
  val Record  = field("record", RecordLayout.bytes, "the alarm record")
  val Counter = field("counter", DatagramLayout.CounterBytes, "working counter")

  /** Its working counter: that of a datagram which one slave has executed. */
  val Counted = 1
}

/** How the master acknowledges a record to its slave (ALARM-04): a write to `alarm_acknowledge`. */
object RecordAckLayout extends Layout("record_ack", "The master has a record", LITTLE_ENDIAN) {
  val Sequence = field("sequence", 2, "number of the record")
  val Guard    = field("guard", 2, "bits 15 to 0 of its time: no other record has both")
  val Tag      = field("tag", 2, "number that the event got at the master, low half")
}

/** What the master writes to all slaves in every cycle (ALARM-04): to `alarm_confirm`. */
object ConfirmLayout extends Layout("confirm", "What the server has", LITTLE_ENDIAN) {
  val Number = field("number", 2, "the server has all events with tags before this one")
  val Life   = field("life", 2, "of the master: another one after each start")
}

/** Bits of a slave's status word (ALARM-10). Each is 1 when there is something to know, so that one broadcast
  * read gives what there is on a whole line.
  */
object SlaveStatus extends Codes("slave", "Bits of the status word of a slave") {
  val Alarm         = code(0x0001, "alarm", "smoke is at the detector")
  val Latched       = code(0x0002, "latched", "there was smoke since the last reset: the lamp is on")
  val Sounding      = code(0x0004, "sounding", "an alarm is not silenced yet: the sounder is on")
  val Open          = code(0x0008, "open", "the line of the detector is broken")
  val Short         = code(0x0010, "short", "the line of the detector has a short circuit")
  val Unwatched     = code(0x0020, "unwatched", "the detector is not supplied")
  val HostDead      = code(0x0040, "host_dead", "the host has not said for too long that it lives")
  val Disabled      = code(0x0080, "disabled", "the detector is disabled")
  val Testing       = code(0x0100, "testing", "the detector is being tested")
  val TestAlarm     = code(0x0200, "test_alarm", "smoke is at the detector, which is being tested")
  val Waiting       = code(0x0400, "waiting", "records wait for the master")
  val Dropped       = code(0x0800, "dropped", "records were dropped since none has been kept")
  val Unwell        = code(0x1000, "unwell", "the result of the host's self-test is not good")
  val Configuration = code(0x2000, "configuration", "the FPGA's configuration is damaged")

  /** These two are of the master, about a slave. */
  val Wrong  = code(0x4000, "wrong", "told by the master: another slave is expected here")
  val Absent = code(0x8000, "absent", "told by the master: nobody answers here")

  /** What is a fault. */
  val Faults = code(
    Open | Short | Unwatched | HostDead | Dropped | Unwell | Configuration | Wrong,
    "faults",
    "what of them is a fault"
  )
}

/** The state of a slave, at `slave_status` (ALARM-10). */
object SlaveStateLayout extends Layout("slave_state", "The state of a slave", LITTLE_ENDIAN) {
  val Status   = field("status", 2, "bits of enum protocol_slave")
  val Node     = field("node", 2, "its node ID")
  val SelfTest = field("self_test", 1, "result of its host")
  val Epoch    = field("epoch", 1, "of its host: another one after each start")
  val Dropped  = field("dropped", 1, "records dropped since its start, 255: as many or more")
  val Links    = field("links", 1, "bit y: link at port y")
}
