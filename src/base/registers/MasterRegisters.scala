package flyframe.registers

import flyframe.params.EscParams
import Access._
import Source._
import NetworkAddresses._

/** The registers at the host port of an alarm master (HOST-01 to HOST-07). Addresses and ports of the network
  * stand there as on the wire, first byte first; everything else is little endian.
  */
object MasterRegisters {

  /** The host's datagram, what came back of it, and the host's event: they stand in RAM only. */
  val Request   = 0x50
  val Result    = 0x60
  val HostEvent = 0x70

  /** Reading it ends the event of a datagram that is back. */
  val Answered = 0x62

  /** Reading it moves on to the next byte. */
  val MailboxData = 0x88

  /** For units that need the whole value at once; those that take it byte by byte read [[Source.Ram]]. */
  private val Mirrored = Stored(mirrored = true)

  private def field(
      name: String,
      width: Int,
      source: Source,
      meaning: String,
      reset: BigInt = 0,
      low: Int = 0
  ) =
    Field(name, low + width - 1, low, source, reset, meaning)
  private def register(
      address: Int,
      bytes: Int,
      title: String,
      rule: String,
      access: Access,
      fields: Field*
  ) = Register(title.toLowerCase.replace(' ', '_'), title, address, bytes, None, access, rule, fields)

  /** A register of one field, with its name. */
  private def single(address: Int, bytes: Int, title: String, rule: String, access: Access, only: Field) =
    Register(only.name, title, address, bytes, None, access, rule, Seq(only))
  private def constant(address: Int, bytes: Int, name: String, title: String, value: Int) =
    single(address, bytes, title, "HOST-01", Read, field(name, 8 * bytes, Constant, title, value))
  private def setting(
      address: Int,
      bytes: Int,
      name: String,
      title: String,
      rule: String,
      reset: BigInt = 0,
      width: Int = 0,
      source: Source = Mirrored,
      access: Access = ReadWrite
  ) = single(
    address,
    bytes,
    title,
    rule,
    access,
    field(name, if (width == 0) 8 * bytes else width, source, title, reset)
  )
  private def status(
      address: Int,
      bytes: Int,
      name: String,
      title: String,
      rule: String,
      width: Int = 0
  ) = single(
    address,
    bytes,
    title,
    rule,
    Read,
    field(name, if (width == 0) 8 * bytes else width, Status, title)
  )

  /** An address of the network. */
  private def address(index: Int, bytes: Int, name: String, title: String) =
    single(
      NetworkAddresses.First + index,
      bytes,
      title,
      "HOST-02",
      ReadWrite,
      field(name, 8 * bytes, Ram, title)
    )
  private def counter(address: Int, name: String, title: String) =
    single(address, 1, title, "HOST-07", ReadClear, field(name, 8, Counter("master_errors"), title))

  /** An action that the host starts by writing 1; the bit returns to 0. */
  private def action(name: String, meaning: String, low: Int = 0) =
    field(name, 1, Stored(hardwareSet = true), s"1: $meaning; returns to 0", low = low)

  def apply(p: EscParams): Seq[Register] = Seq(
    constant(0x00, 1, "master_type", "Controller family", p.escType),
    constant(0x01, 1, "master_revision", "Family revision", p.escRevision),
    constant(0x02, 2, "master_build", "Build number", p.escBuild),
    constant(0x04, 1, "max_slaves", "Slaves it can list", p.maxSlaves),
    address(ServerMac, 6, "server_mac", "MAC address of the server or of the router to it"),
    address(MasterMac, 6, "master_mac", "MAC address of the master"),
    address(MasterIp, 4, "master_ip", "IP address of the master"),
    address(ServerIp, 4, "server_ip", "IP address of the server"),
    address(MasterPort, 2, "master_port", "UDP port of the master"),
    address(ServerPort, 2, "server_port", "UDP port of the server"),
    setting(0x28, 2, "master_id", "Master ID", "HOST-02"),
    setting(0x2a, 2, "boot_number", "Boot number, another one after each start", "HOST-02"),
    setting(0x30, 4, "bus_cycle", "Length of a bus cycle in slots of 40 ns", "HOST-03", 25000, width = 20),
    setting(0x34, 2, "answer_timeout", "Time to wait for a frame in slots of 40 ns", "HOST-03", 2500),
    setting(0x36, 1, "retries", "How often a frame is sent again", "HOST-03", 2, width = 4),
    setting(
      0x38,
      2,
      "report_repeat",
      "Time after which a report is repeated in ms",
      "HOST-03",
      200,
      width = 12
    ),
    setting(
      0x3a,
      2,
      "report_heartbeat",
      "Time between reports without events in ms",
      "HOST-03",
      1000,
      width = 12
    ),
    register(
      0x3c,
      1,
      "Master control",
      "HOST-03",
      ReadWrite,
      field("line_run", 1, Stored(), "1: the line runs"),
      field("report_run", 1, Stored(), "1: the server gets reports", low = 1),
      action("buzzer_off", "buzzer and lamp off", low = 2)
    ),
    setting(
      0x3d,
      1,
      "master_self_test",
      "Self-test of the host: 0 not run, 1 good, else what failed; in every report",
      "HOST-02"
    ),
    status(0x40, 1, "slaves_present", "Slaves that answer", "HOST-04"),
    status(0x41, 1, "slaves_known", "Slaves listed", "HOST-04"),
    register(
      0x42,
      1,
      "Master status",
      "HOST-04",
      Read,
      field("line_link", 1, Status, "1: link to the first slave"),
      field("plant_link", 1, Status, "1: link to the plant network", low = 1),
      field("mailbox_waiting", 1, Status, "1: a message of the server waits", low = 2),
      field("request_done", 1, Status, "1: a datagram of the host is back", low = 3),
      field("request_busy", 1, Status, "1: it is waiting or under way", low = 4),
      field("alarm_latched", 1, Status, "1: buzzer and lamp on", low = 5),
      field("host_event_busy", 1, Status, "1: an event of the host waits for its place", low = 6)
    ),
    status(0x44, 4, "frames_lost", "Frames sent in vain", "HOST-04"),
    status(0x48, 4, "master_time", "Time of the master in us", "HOST-04"),
    setting(0x50, 1, "request_command", "Command of the host's datagram", "HOST-05", source = Ram),
    setting(0x51, 1, "request_length", "Its data bytes, at most 8", "HOST-05", width = 4, source = Ram),
    setting(0x54, 4, "request_address", "Its address, ADP in the low word", "HOST-05", source = Ram),
    setting(0x58, 8, "request_data", "Its data", "HOST-05", source = Ram),
    register(0x60, 1, "Request control", "HOST-05", ReadWrite, action("request_go", "send it")),
    register(
      Answered,
      1,
      "Request answered",
      "HOST-05",
      ReadAcknowledge,
      field("request_answered", 1, Status, "1: it came back; else the line did not answer")
    ),
    setting(0x64, 2, "request_counter", "Its working counter", "HOST-05", source = Ram, access = Read),
    setting(0x68, 8, "request_result", "Its data when it was back", "HOST-05", source = Ram, access = Read),
    register(
      0x70,
      8,
      "Host event",
      "HOST-06",
      ReadWrite,
      field("host_event_position", 8, Ram, "Position of an event of the host"),
      field("host_event_state", 8, Ram, "Its state", low = 8),
      field("host_event_node", 16, Ram, "Its node ID", low = 16),
      field("host_event_sequence", 16, Ram, "Its number", low = 32)
    ),
    register(0x78, 1, "Host event control", "HOST-06", ReadWrite, action("host_event_go", "report it")),
    status(0x80, 2, "mailbox_length", "Bytes of the message that waits, 0: none", "SRV-02", width = 9),
    register(
      0x82,
      1,
      "Mailbox offset",
      "SRV-02",
      ReadWrite,
      field("mailbox_offset", 8, Stored(hardwareSet = true), "Number of the byte at 0x0088")
    ),
    register(
      0x84,
      1,
      "Mailbox control",
      "SRV-02",
      ReadWrite,
      action("mailbox_done", "the message has been taken")
    ),
    register(
      MailboxData,
      1,
      "Mailbox data",
      "SRV-02",
      ReadAcknowledge,
      field("mailbox_data", 8, Status, "A byte of the message; reading it alone moves the offset on")
    ),
    counter(0x90, "refused_datagrams", "Frames to the master that were no message for it"),
    counter(0x91, "dropped_messages", "Messages dropped because another one waited"),
    counter(0x92, "invalid_frame_port0", "Bad frames from the line"),
    counter(0x93, "invalid_frame_port1", "Bad frames from the plant network")
  )
}
