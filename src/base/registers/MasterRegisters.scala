package flyframe.registers

import flyframe.params.EscParams
import NetworkAddresses._
import RegisterTable._

/** The registers at the host port of an alarm master (HOST-01 to HOST-14); used by
  * [[flyframe.master.MasterHost]]. Addresses and ports of the network stand there as on the wire, first byte
  * first; everything else is little endian.
  *
  * `mirrored`: units need the whole value at once; those that take it byte by byte read `ram`.
  */
object MasterRegisters {

  /** What units read byte by byte, besides addresses. */
  val MasterId = 0x28
  val SelfTest = 0x3d

  /** The host's datagram, what came back of it, and the host's event: they stand in RAM only. */
  val Request   = 0x50
  val Result    = 0x60
  val HostEvent = 0x70

  /** Reading it ends the event of a datagram that is back. */
  val Answered = 0x62

  /** Reading it moves on to the next byte. */
  val MailboxData = 0x88

  /** Reading its byte 0 or 4 keeps the three bytes behind. */
  val MasterTime = 0x98

  /** For the tags of datagrams. */
  val MasterKey  = 0xa0
  val MasterLife = 0xb0

  /** A window on the table of slaves. */
  val SlaveIndex   = 0xb8
  val ExpectedNode = 0xba
  val SlaveState   = 0xc0

  private val errors = counter("master_errors")

  // format: off
  def apply(p: EscParams): Seq[Register] = Seq(
    register(0x00,               1, "master_type",         no, r,   "HOST-01", "Controller family",
      field("master_type",          7,  0, constant, p.escType,     "Controller family")),
    register(0x01,               1, "master_revision",     no, r,   "HOST-01", "Family revision",
      field("master_revision",      7,  0, constant, p.escRevision, "Family revision")),
    register(0x02,               2, "master_build",        no, r,   "HOST-01", "Build number",
      field("master_build",        15,  0, constant, p.escBuild,    "Build number")),
    register(0x04,               1, "max_slaves",          no, r,   "HOST-01", "Slaves it can list",
      field("max_slaves",           7,  0, constant, p.maxSlaves,   "Slaves it can list")),
    register(First + ServerMac,  6, "server_mac",          no, rw,  "HOST-02",
        "MAC address of the server or of the router to it",
      field("server_mac",          47,  0, ram,      0,
          "MAC address of the server or of the router to it")),
    register(First + MasterMac,  6, "master_mac",          no, rw,  "HOST-02", "MAC address of the master",
      field("master_mac",          47,  0, ram,      0,             "MAC address of the master")),
    register(First + MasterIp,   4, "master_ip",           no, rw,  "HOST-02", "IP address of the master",
      field("master_ip",           31,  0, ram,      0,             "IP address of the master")),
    register(First + ServerIp,   4, "server_ip",           no, rw,  "HOST-02", "IP address of the server",
      field("server_ip",           31,  0, ram,      0,             "IP address of the server")),
    register(First + MasterPort, 2, "master_port",         no, rw,  "HOST-02", "UDP port of the master",
      field("master_port",         15,  0, ram,      0,             "UDP port of the master")),
    register(First + ServerPort, 2, "server_port",         no, rw,  "HOST-02", "UDP port of the server",
      field("server_port",         15,  0, ram,      0,             "UDP port of the server")),
    register(MasterId,           2, "master_id",           no, rw,  "HOST-02", "Master ID",
      field("master_id",           15,  0, mirrored, 0,             "Master ID")),
    register(0x2a,               2, "line_life",           no, rw,  "HOST-02",
        "Life of the master for the slaves, another one after each start",
      field("line_life",           15,  0, mirrored, 0,
          "Life of the master for the slaves, another one after each start")),
    register(0x2c,               1, "server_timeout",      no, rw,  "HOST-03",
        "Seconds without an answer after which the server is silent",
      field("server_timeout",       7,  0, mirrored, 30,
          "Seconds without an answer after which the server is silent")),
    register(0x30,               4, "bus_cycle",           no, rw,  "HOST-03",
        "Length of a bus cycle in slots of 40 ns",
      field("bus_cycle",           19,  0, mirrored, 25000,
          "Length of a bus cycle in slots of 40 ns")),
    register(0x34,               2, "answer_timeout",      no, rw,  "HOST-03",
        "Time to wait for a frame in slots of 40 ns",
      field("answer_timeout",      15,  0, mirrored, 2500,
          "Time to wait for a frame in slots of 40 ns")),
    register(0x36,               1, "retries",             no, rw,  "HOST-03",
        "How often a frame is sent again",
      field("retries",              3,  0, mirrored, 2,             "How often a frame is sent again")),
    register(0x38,               2, "report_repeat",       no, rw,  "HOST-03",
        "Time after which a report is repeated in ms",
      field("report_repeat",       11,  0, mirrored, 200,
          "Time after which a report is repeated in ms")),
    register(0x3a,               2, "report_heartbeat",    no, rw,  "HOST-03",
        "Time between reports without events in ms",
      field("report_heartbeat",    11,  0, mirrored, 1000,
          "Time between reports without events in ms")),
    register(0x3c,               1, "master_control",      no, rw,  "HOST-03", "Master control",
      field("line_run",             0,  0, stored,   1,             "1: the line runs"),
      field("report_run",           1,  1, stored,   0,             "1: the server gets reports"),
      field("line_listed",          2,  2, stored,   0,             "1: the expected slaves are set"),
      field("lamp_test",            3,  3, stored,   0,             "1: all signals on"),
      field("silence",              4,  4, loadable, 0,             "1: sounders off; returns to 0"),
      field("reset_alarm",          5,  5, loadable, 0,
          "1: alarms end, detectors begin anew; returns to 0")),
    register(SelfTest,           1, "master_self_test",    no, rw,  "HOST-02",
        "Self-test of the host: 0 not run, 1 good, else what failed; in every report",
      field("master_self_test",     7,  0, mirrored, 0,
          "Self-test of the host: 0 not run, 1 good, else what failed; in every report")),
    register(0x40,               1, "slaves_present",      no, r,   "HOST-04", "Slaves that answer",
      field("slaves_present",       7,  0, status,   0,             "Slaves that answer")),
    register(0x41,               1, "slaves_known",        no, r,   "HOST-04", "Slaves listed",
      field("slaves_known",         7,  0, status,   0,             "Slaves listed")),
    register(0x42,               1, "master_status",       no, r,   "HOST-04", "Master status",
      field("line_link",            0,  0, status,   0,             "1: link to the first slave"),
      field("plant_link",           1,  1, status,   0,             "1: link to the plant network"),
      field("mailbox_waiting",      2,  2, status,   0,             "1: an order of the server waits"),
      field("request_done",         3,  3, status,   0,             "1: a datagram of the host is back"),
      field("request_busy",         4,  4, status,   0,             "1: it is waiting or under way"),
      field("ring_closed",          5,  5, status,   0,             "1: frames come round the ring"),
      field("host_event_busy",      6,  6, status,   0,
          "1: an event of the host waits for its place")),
    register(0x44,               2, "frames_lost",         no, r,   "HOST-04", "Frames sent in vain",
      field("frames_lost",         15,  0, status,   0,             "Frames sent in vain, modulo 65,536")),
    register(0x48,               4, "master_state",        no, r,   "HOST-11", "Status of the master",
      field("master_state",        18,  0, status,   0,             "Bits of enum protocol_master")),
    register(Request,            1, "request_command",     no, rw,  "HOST-05",
        "Command of the host's datagram",
      field("request_command",      7,  0, ram,      0,             "Command of the host's datagram")),
    register(Request + 1,        1, "request_length",      no, rw,  "HOST-05", "Its data bytes, at most 8",
      field("request_length",       3,  0, ram,      0,             "Its data bytes, at most 8")),
    register(Request + 4,        4, "request_address",     no, rw,  "HOST-05",
        "Its address, ADP in the low word",
      field("request_address",     31,  0, ram,      0,             "Its address, ADP in the low word")),
    register(Request + 8,        8, "request_data",        no, rw,  "HOST-05", "Its data",
      field("request_data",        63,  0, ram,      0,             "Its data")),
    register(Result,             1, "request_control",     no, rw,  "HOST-05", "Request control",
      field("request_go",           0,  0, loadable, 0,             "1: send it; returns to 0")),
    register(Answered,           1, "request_answered",    no, ack, "HOST-05", "Request answered",
      field("request_answered",     0,  0, status,   0,
          "1: it came back; else the line did not answer")),
    register(Result + 4,         2, "request_counter",     no, r,   "HOST-05", "Its working counter",
      field("request_counter",     15,  0, ram,      0,             "Its working counter")),
    register(Result + 8,         8, "request_result",      no, r,   "HOST-05", "Its data when it was back",
      field("request_result",      63,  0, ram,      0,             "Its data when it was back")),
    register(HostEvent,          8, "host_event",          no, rw,  "HOST-06", "Host event",
      field("host_event_position",  7,  0, ram,      0,             "Position of an event of the host"),
      field("host_event_state",    15,  8, ram,      0,             "Its state"),
      field("host_event_node",     31, 16, ram,      0,             "Its node ID"),
      field("host_event_sequence", 47, 32, ram,      0,             "Its number")),
    register(HostEvent + 8,      1, "host_event_control",  no, rw,  "HOST-06", "Host event control",
      field("host_event_go",        0,  0, loadable, 0,             "1: report it; returns to 0")),
    register(0x80,               2, "mailbox_length",      no, r,   "SRV-02",
        "Bytes of the order that waits, 0: none",
      field("mailbox_length",       8,  0, status,   0,
          "Bytes of the order that waits, 0: none")),
    register(0x82,               1, "mailbox_offset",      no, rw,  "SRV-02",  "Mailbox offset",
      field("mailbox_offset",       7,  0, loadable, 0,             "Number of the byte at 0x0088")),
    register(0x84,               1, "mailbox_control",     no, rw,  "SRV-02",  "Mailbox control",
      field("mailbox_done",         0,  0, loadable, 0,
          "1: the order has been taken; returns to 0")),
    register(MailboxData,        1, "mailbox_data",        no, ack, "SRV-02",  "Mailbox data",
      field("mailbox_data",         7,  0, status,   0,
          "A byte of it; reading it alone moves the offset on")),
    register(0x90,               1, "refused_datagrams",   no, clr, "HOST-07",
        "Frames to the master that were no message for it",
      field("refused_datagrams",    7,  0, errors,   0,
          "Frames to the master that were no message for it")),
    register(0x91,               1, "dropped_messages",    no, clr, "HOST-07",
        "Orders dropped because another one waited",
      field("dropped_messages",     7,  0, errors,   0,
          "Orders dropped because another one waited")),
    register(0x92,               1, "invalid_frame_port0", no, clr, "HOST-07", "Bad frames from the line",
      field("invalid_frame_port0",  7,  0, errors,   0,             "Bad frames from the line")),
    register(0x93,               1, "invalid_frame_port1", no, clr, "HOST-07",
        "Bad frames from the plant network",
      field("invalid_frame_port1",  7,  0, errors,   0,             "Bad frames from the plant network")),
    register(0x94,               2, "host_alive",          no, rw,  "HOST-12", "Heartbeat of the host",
      field("host_alive",          15,  0, loadable, 0,
          "The host will write this again within so many ms; counts down to 0")),
    register(0x96,               1, "host_faults",         no, rw,  "HOST-12", "Faults that the host sees",
      field("mains_failed",         0,  0, stored,   0,             "1: the mains have failed"),
      field("battery_low",          1,  1, stored,   0,             "1: the battery is low"),
      field("earth_fault",          2,  2, stored,   0,             "1: an earth fault"),
      field("storage_failed",       3,  3, stored,   0,             "1: the host's memory does not work")),
    register(MasterTime,         8, "master_time",         no, r,   "HOST-04", "Time of the master in us",
      field("master_time",         63,  0, status,   0,
          "Time of the master in us; reading byte 0 or 4 keeps it for reads of the bytes behind")),
    register(MasterKey,         16, "master_key",          no, rw,  "HOST-13", "Key of the tags",
      field("master_key",         127,  0, ram,      0,             "Key of the tags; reads 0")),
    register(MasterLife,         8, "master_life",         no, rw,  "HOST-13", "Life of the master",
      field("master_life",         63,  0, ram,      0,
          "Random, another one after each start; as on the wire, first byte first")),
    register(SlaveIndex,         1, "slave_index",         no, rw,  "HOST-14", "Position looked at",
      field("slave_index",          7,  0, stored,   0,             "Position looked at")),
    register(ExpectedNode,       2, "expected_node",       no, rw,  "HOST-14", "Node ID expected there",
      field("expected_node",       15,  0, stored,   0,
          "Node ID expected there, 0: none; its second byte is to be written last, behind the position")),
    register(SlaveState,         8, "slave_state",         no, r,   "HOST-14", "State of the slave there",
      field("slave_status",        15,  0, ram,      0,             "Bits of enum protocol_slave"),
      field("slave_node",          31, 16, ram,      0,             "Its node ID, or the last one known"),
      field("slave_self_test",     39, 32, ram,      0,             "Result of its host"),
      field("slave_epoch",         47, 40, ram,      0,             "Epoch of its host"),
      field("slave_dropped",       55, 48, ram,      0,             "Records dropped"),
      field("slave_links",         63, 56, ram,      0,             "Bit y: link at port y")),
    register(0xc8,               1, "ring_cut",            no, r,   "HOST-14", "Place of the cut",
      field("ring_cut",             7,  0, status,   0,             "First slave behind the cut of the ring"))
  )
  // format: on
}
