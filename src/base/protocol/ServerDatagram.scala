package flyframe.protocol

import java.nio.ByteOrder.BIG_ENDIAN

/** The numbers in datagrams between a master and the server (REP-01, SRV-01, SRV-12). */
object ServerDatagram extends Codes("", "Numbers in datagrams between a master and the server") {
  val Magic           = code(0x4641, "magic", "every datagram begins with it")
  val Version         = code(1, "version", "it follows the magic number")
  val KindReport      = code(1, "kind_report", "a master tells what has happened")
  val KindAcknowledge = code(2, "kind_acknowledge", "the server has stored events")
  val KindCommand     = code(3, "kind_command", "the server orders something")

  /** Most events of one report. */
  val Most = code(64, "most_events", "of one report")

  /** Bytes of the key of a command's code. */
  val KeyBytes = code(32, "key_bytes", "of the secret that master and server share")

  /** What a command orders. */
  val AlarmClear    = code(1, "alarm_clear", "a command: buzzers and lamps off")
  val DetectorReset = code(2, "detector_reset", "a command: the supply of detectors off for a while")

  /** A command with this node ID is for all slaves. */
  val AllNodes = code(0xffff, "all_nodes", "a command with this node ID is for all slaves")
}

/** What became of a command: in an event of kind `Command`, as its state. */
object CommandResult extends Codes("result", "What became of a command") {
  val Done           = code(0, "done", "everybody who was meant has taken it")
  val UnknownCommand = code(1, "unknown_command", "the master's host does not know it")
  val NoAnswer       = code(2, "no_answer", "the line has not answered")
  val NoSuchNode     = code(3, "no_such_node", "no slave has this node ID")
}

/** Results of a host's self-test; all others say what failed, in a code of the host program. */
object SelfTest extends Codes("self_test", "Results of a host's self-test; all others say what failed") {
  val NotRun = code(0, "not_run", "the host has not started yet")
  val Good   = code(1, "good", "the host has found nothing wrong")
}

/** What every datagram between a master and the server begins with. */
sealed abstract class HeadedLayout(name: String, meaning: String, number: String)
    extends Layout(name, meaning, BIG_ENDIAN) {
  val Magic   = field("magic", 2, "PROTOCOL_MAGIC")
  val Version = field("version", 1, "PROTOCOL_VERSION")
  val Kind    = field("kind", 1, "one of PROTOCOL_KIND_...")
  val Master  = field("master", 2, "master ID")
  val Boot    = field("boot", 2, "boot number of the master")
  val Number  = field("number", 4, number)
}

/** The server tells which events it has (SRV-01). */
object AcknowledgementLayout
    extends HeadedLayout(
      "acknowledgement",
      "The server tells which events it has",
      "it has all events before this one"
    )

/** A master tells what has happened (REP-01): this, then its events, each as [[EventLayout]]. */
object ReportLayout
    extends HeadedLayout("report", "A report before its events", "number of its first event") {
  val Count    = field("count", 1, "events that follow")
  val SelfTest = field("self_test", 1, "result of the master's host")
  val Present  = field("present", 1, "slaves that answer")
  val Known    = field("known", 1, "slaves listed")
  val Time     = field("time", 4, "time of the master in us")
  val Lost     = field("lost", 4, "frames sent in vain")
}

/** An order of the server (SRV-12). The code is the first half of HMAC-SHA-256 over all bytes before it. */
object CommandLayout
    extends HeadedLayout("command", "An order of the server", "rises with every command of a boot") {
  val Order = field("order", 1, "PROTOCOL_ALARM_CLEAR or PROTOCOL_DETECTOR_RESET")
  val Zero  = field("zero", 1, "0")
  val Node  = field("node", 2, "ID of a slave, or PROTOCOL_ALL_NODES")
  val Code  = field("code", 16, "first half of HMAC-SHA-256 over all bytes before it")
}
