package flyframe.protocol

import java.nio.ByteOrder.BIG_ENDIAN

/** The numbers in datagrams between a master and the server (REP-01, SRV-01). */
object ServerDatagram extends Codes("", "Numbers in datagrams between a master and the server") {
  val Magic      = code(0x4641, "magic", "every datagram begins with it")
  val Version    = code(2, "version", "it follows the magic number")
  val KindReport = code(1, "kind_report", "a master tells how its line is and what has happened")
  val KindAnswer = code(2, "kind_answer", "the server answers a report, and may order something")
  val KindRing   = code(4, "kind_ring", "a gateway reports what its ring has for the server")
  val KindSend   = code(5, "kind_send", "the server has a message for a node of a ring")

  /** Most events of one report. */
  val Most = code(32, "most_events", "of one report")

  /** Bytes of the key of tags, of a life, of a tag. */
  val KeyBytes  = code(16, "key_bytes", "of the secret that master and server share")
  val LifeBytes = code(8, "life_bytes", "of the random number of a life")
  val TagBytes  = code(16, "tag_bytes", "of the tag of a datagram")

  /** Bytes of what makes each tag another one; in the header this number comes with the layout. */
  def NonceBytes: Int = NonceLayout.bytes

  /** Whose datagram it is: in the nonce. */
  val OfMaster = code(0x4d, "of_master", "in the nonce: a report")
  val OfServer = code(0x53, "of_server", "in the nonce: an answer")

  /** A command with this node ID is for all slaves. */
  val AllNodes = code(0xffff, "all_nodes", "an order with this node ID is for all slaves")
}

/** What the server may order. */
object Order extends Codes("order", "What the server may order") {
  val None    = code(0, "none", "nothing")
  val Silence = code(1, "silence", "sounders off, until the next alarm")
  val Reset   = code(2, "reset", "alarms end, detectors begin anew")
  val Disable = code(3, "disable", "a detector is disabled for a time")
  val Test    = code(4, "test", "a detector is tested for a time")
  val Watch   = code(5, "watch", "a detector is neither disabled nor tested any more")

  /** Changes nothing but the log. */
  val Acknowledge = code(6, "acknowledge", "somebody has seen the alarm: only recorded")
}

/** What became of a command: in an event of kind `Command`, as its state. */
object CommandResult extends Codes("result", "What became of a command") {
  val Done           = code(0, "done", "everybody who was meant has taken it")
  val UnknownCommand = code(1, "unknown_command", "the master's host does not know it")
  val NoAnswer       = code(2, "no_answer", "the line has not answered")
  val NoSuchNode     = code(3, "no_such_node", "no slave has this node ID")
  val Refused        = code(4, "refused", "the host's memory does not work, or a number is out of bounds")
}

/** Results of a host's self-test; all others say what failed. */
object SelfTest extends Codes("self_test", "Results of a host's self-test; all others say what failed") {
  val NotRun = code(0, "not_run", "the host has not started yet")
  val Good   = code(1, "good", "the host has found nothing wrong")
}

/** Bits of the master's status, in reports and at its host. */
object MasterStatus extends Codes("master", "Bits of the status of a master") {
  val Fire          = code(0x00001, "fire", "there was smoke at a slave since the last reset")
  val Sounding      = code(0x00002, "sounding", "an alarm is not silenced yet")
  val Alarm         = code(0x00004, "alarm", "smoke is at a detector now")
  val LineDead      = code(0x00008, "line_dead", "no slave answers")
  val RingOpen      = code(0x00010, "ring_open", "the ring is cut")
  val WrongLine     = code(0x00020, "wrong_line", "slaves are missing, or others than expected are there")
  val SlaveFault    = code(0x00040, "slave_fault", "a slave has a fault")
  val Disabled      = code(0x00080, "disabled", "a detector is disabled")
  val Testing       = code(0x00100, "testing", "a detector is being tested")
  val ServerSilent  = code(0x00200, "server_silent", "no right answer of the server has come for too long")
  val HostDead      = code(0x00400, "host_dead", "the host has not said for too long that it lives")
  val Configuration = code(0x00800, "configuration", "the FPGA's configuration is damaged")
  val Mains         = code(0x01000, "mains", "the mains have failed")
  val Battery       = code(0x02000, "battery", "the battery is low")
  val Earth         = code(0x04000, "earth", "an earth fault")
  val Storage       = code(0x08000, "storage", "the host's memory does not work: no commands")
  val Unlisted      = code(0x10000, "unlisted", "the expected slaves are not set: none can be missed")
  val Full          = code(0x20000, "full", "events wait for the server that has not taken the earlier ones")
  val PlantDead     = code(0x40000, "plant_dead", "no link to the plant network")

  /** Bits of the status. */
  val Width = 19

  /** What is a fault. */
  val Faults = code(
    LineDead | RingOpen | WrongLine | SlaveFault | ServerSilent | HostDead | Configuration | Mains | Battery |
      Earth | Storage | Unlisted | Full | PlantDead,
    "faults",
    "what of them is a fault"
  )
}

/** What every datagram between a master and the server begins with. The tag covers it, and all that follows
  * up to the rest.
  */
sealed abstract class HeadedLayout(name: String, meaning: String) extends Layout(name, meaning, BIG_ENDIAN) {
  val Magic   = field("magic", 2, "PROTOCOL_MAGIC")
  val Version = field("version", 1, "PROTOCOL_VERSION")
  val Kind    = field("kind", 1, "one of PROTOCOL_KIND_...")
  val Master  = field("master", 2, "ID of the master or gateway")
  val Zero    = field("zero", 2, "0")
  val Life    = field("life", 8, "of the master: random, another one after each start")
  val Server  = field("server", 8, "life of the server; in a report as far as the master knows, or 0")
}

/** A master tells how its line is (REP-01): this, then of each slave [[ReportedSlaveLayout]], then its
  * events, each as [[EventLayout]], then [[ReportEndLayout]].
  */
object ReportLayout extends HeadedLayout("report", "A report before the states of slaves") {
  val Counter  = field("counter", 4, "of the reports of this life, from 1 on: in the nonce")
  val Number   = field("number", 4, "of its first event")
  val Time     = field("time", 8, "time of the master in us")
  val Status   = field("status", 4, "bits of enum protocol_master")
  val Lost     = field("lost", 4, "frames sent in vain, modulo 65,536")
  val Count    = field("count", 1, "events that follow")
  val Slaves   = field("slaves", 1, "slaves whose state follows")
  val Present  = field("present", 1, "slaves that answer, also those that are not listed")
  val SelfTest = field("self_test", 1, "result of the master's host")
  val Cut      = field("cut", 1, "first slave behind the cut of a ring")
  val Refused  = field("refused", 1, "datagrams refused, 255: as many or more")
  val Spare    = field("spare", 2, "0")
}

/** State of a slave in a report, by position. */
object ReportedSlaveLayout extends Layout("reported_slave", "State of a slave in a report", BIG_ENDIAN) {
  val Status = field("status", 2, "bits of enum protocol_slave")
  val Node   = field("node", 2, "its node ID, or the last one known")
}

/** What a report ends with. The tag needs time: meanwhile the rest is sent. */
object ReportEndLayout extends Layout("report_end", "What a report ends with", BIG_ENDIAN) {
  val Rest    = field("rest", 16, "0")
  val Tag     = field("tag", 16, "Ascon-AEAD128 tag of all before the rest, as associated data")
  val Balance = field("balance", 2, "makes the sum of UDP right whose checksum was sent before")
}

/** The server answers a report (SRV-01). */
object AnswerLayout extends HeadedLayout("answer", "The server answers a report") {
  val Turn    = field("turn", 4, "of the answers of this life of the server, from 1 on: in the nonce")
  val Echo    = field("echo", 4, "counter of the report; answers to earlier ones do not count any more")
  val Number  = field("number", 4, "of the next event wanted: all before are stored")
  val Ticket  = field("ticket", 4, "of the order: another one for each in a life of the master")
  val Order   = field("order", 1, "one of enum protocol_order")
  val Trouble = field("trouble", 1, "1: the server cannot write its log, else 0")
  val Node    = field("node", 2, "ID of a slave, or PROTOCOL_ALL_NODES")
  val Seconds = field("seconds", 2, "how long a detector is disabled or tested")
  val Spare   = field("spare", 2, "0")
  val Tag     = field("tag", 16, "Ascon-AEAD128 tag of all before it, as associated data")
}

/** What a part of a ring's report is (GW-04). */
object RingPart extends Codes("ring_part", "What a part of a report of a ring is") {
  val Message = code(1, "message", "a piece of a message to the server")
  val Node    = code(2, "node", "a node is there, or is lost")
  val Ring    = code(3, "ring", "the ring is broken, or whole")
  val Result  = code(4, "result", "how a message of the server has ended")
}

/** Flags of a part of a ring's report, and of a message of the server. */
object RingFlag extends Codes("ring_flag", "Flags of messages of a ring") {
  val Urgent = code(1, "urgent", "the message is urgent")
  val Repeat = code(2, "repeat", "it may be a repeat")
}

/** How a message of the server has ended (GW-06). */
object RingResult extends Codes("ring_result", "How a message of the server has ended") {
  val Delivered    = code(0, "delivered", "its node has it")
  val Refused      = code(1, "refused", "its node has refused it, or it is impossible")
  val NotConfirmed = code(2, "not_confirmed", "its node has not said that it has it")
}

/** Bits of the status of a gateway of a ring: each of them is a fault, but the last one. */
object RingStatus extends Codes("ring_status", "Bits of the status of a gateway of a ring") {
  val Controller = code(1, "controller", "the controller does not answer, or does not hold its settings")
  val Storage    = code(2, "storage", "the memory of the host does not work")
  val Conflict   = code(4, "conflict", "another node has the address of the gateway")
  val Alone      = code(8, "alone", "no port of the gateway is up")
  val Full       = code(16, "full", "messages wait for the server that has not taken the earlier ones")
  val Busy       = code(32, "busy", "no fault: it takes urgent messages only")
}

/** A gateway reports of its ring (GW-04): this, then its parts, each a [[RingPartLayout]] and its data, then
  * [[RingReportEndLayout]].
  */
object RingReportLayout extends HeadedLayout("ring_report", "A report of a ring before its parts") {
  val Counter = field("counter", 4, "of the reports of this life, from 1 on: in the nonce")
  val Number  = field("number", 4, "of its first part: the server has all before it")
  val Taken   = field("taken", 4, "counter of the last message of the server that was taken")
  val Parts   = field("parts", 1, "parts that follow")
  val Status  = field("status", 1, "bits of enum protocol_ring_status")
  val Spare   = field("spare", 2, "0")
}

/** A part of a ring's report before its data. Of a node: 1 and its HELLO, then its distances at ports 1 and
  * 2, or 0; of the ring: the addresses at both ends of a broken one, or two zeros; of a result: counter (4)
  * and result (1) of the message.
  */
object RingPartLayout extends Layout("ring_part_head", "A part of a report of a ring", BIG_ENDIAN) {
  val Type   = field("type", 1, "one of enum protocol_ring_part")
  val Source = field("source", 1, "address of the node")
  val Pipe   = field("pipe", 1, "of a message; as all that follows, but for the length")
  val Number = field("number", 1, "of the message in its pipe")
  val Life   = field("life", 1, "of its sender; bit 7: it is to all nodes")
  val Flags  = field("flags", 1, "bits of enum protocol_ring_flag")
  val Total  = field("total", 2, "bytes of the whole message")
  val Offset = field("offset", 2, "of the data in the message")
  val Length = field("length", 2, "bytes of data that follow")
}

/** What a ring's report ends with. */
object RingReportEndLayout
    extends Layout("ring_report_end", "What a report of a ring ends with", BIG_ENDIAN) {
  val Tag = field("tag", 16, "Ascon-AEAD128 tag of all before it, as associated data")
}

/** The server has a message for a node of a ring (GW-06): this, the message, then [[RingReportEndLayout]]. */
object RingSendLayout extends HeadedLayout("ring_send", "A message of the server before its data") {
  val Turn        = field("turn", 4, "counts with those of the answers: in the nonce")
  val Counter     = field("counter", 4, "of such messages in this life of the gateway, from 1 on")
  val Destination = field("destination", 1, "address of the node, 0: all nodes")
  val Flags       = field("flags", 1, "PROTOCOL_RING_FLAG_URGENT, or 0")
  val Length      = field("length", 2, "bytes of data that follow, 1 to 1,024")
}

/** What makes each tag another one. */
object NonceLayout extends Layout("nonce", "What makes each tag another one", BIG_ENDIAN) {
  val Life    = field("life", 8, "of who sends it")
  val Origin  = field("origin", 1, "PROTOCOL_OF_MASTER or PROTOCOL_OF_SERVER")
  val Zero    = field("zero", 3, "0")
  val Counter = field("counter", 4, "of a report; turn of an answer")
}
