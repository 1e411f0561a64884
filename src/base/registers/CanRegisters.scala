package flyframe.registers

import flyframe.params.CanParams
import RegisterTable._

/** The registers of a CAN port, with its slots and filters (CAN-01 to CAN-46). The names of all fields of a
  * port begin with its own.
  */
object CanRegisters {

  /** The ports of a node: on the fibre, and on the twisted pair. */
  val Ports: Seq[String] = Seq("can_f", "can_t")

  /** Where the registers, the slots and the filters of each port begin. */
  val PortStarts: Seq[Int]   = Seq(0x0100, 0x0200)
  val SlotStarts: Seq[Int]   = Seq(0x0400, 0x0500)
  val FilterStarts: Seq[Int] = Seq(0x0600, 0x0700)

  // From the start of a port.
  val Control       = 0x00
  val Command       = 0x01
  val Status        = 0x02
  val Timing        = 0x04
  val ErrorCounters = 0x08
  val LastError     = 0x0c
  val Counters      = 0x10
  val RxLevel       = 0x18
  val RxRelease     = 0x1a
  val BridgeDropped = 0x1c
  val Requests      = 0x20
  val Aborts        = 0x22
  val Sent          = 0x24
  val Failed        = 0x26
  val RxFrame       = 0x30

  /** Bytes of a frame, and of an entry of the filters. */
  val FrameBytes  = 16
  val FilterBytes = 8

  /** The last byte of an entry: its write puts the whole entry in force (CB-11). */
  val FilterCommit = 7

  /** Names of the counters, without that of the port, in the order of their bytes. */
  val CounterNames: Seq[String] = Seq(
    "bit_errors",
    "stuff_errors",
    "form_errors",
    "crc_errors",
    "ack_errors",
    "lost_arbitrations",
    "overruns",
    "bus_offs"
  )

  private val counterTexts =
    Seq(
      "Bit errors",
      "Stuff errors",
      "Form errors",
      "CRC errors",
      "Missing acknowledgements",
      "Lost arbitrations",
      "Frames dropped as the FIFO was full",
      "Times that the port went bus-off"
    )

  /** All of port `port`, 0 or 1. */
  def apply(port: Int, p: CanParams): Seq[Register] =
    ofPort(Ports(port), PortStarts(port)) ++
      (if (p.bridge) Seq(dropped(Ports(port), PortStarts(port))) else Nil) ++
      (0 until p.slots).map(n => slot(Ports(port), SlotStarts(port) + FrameBytes * n, n, p.slots)) ++
      (0 until p.filters).map(n => filter(Ports(port), FilterStarts(port) + FilterBytes * n, n, p.filters))

  // format: off
  private def ofPort(c: String, start: Int): Seq[Register] = Seq(
    register(start + Control,       1, s"${c}_control",        no, rw, "CAN-40, CAN-42", "CAN control",
      field(s"${c}_run",             0,  0, stored, 0, "1: takes part; 0: stopped"),
      field(s"${c}_listen_only",     1,  1, stored, 0, "1: never drives dominant"),
      field(s"${c}_loop_back",       2,  2, stored, 0, "1: hears itself only; the pin stays recessive"),
      field(s"${c}_one_shot",        3,  3, stored, 0, "1: one attempt for each frame"),
      field(s"${c}_recover_itself",  4,  4, stored, 0, "1: recovers from bus-off by itself"),
      field(s"${c}_three_samples",   5,  5, stored, 0, "1: majority of three samples"),
      field(s"${c}_bridge",          6,  6, stored, 0, "1: bridge to the other port")),
    register(start + Command,       1, s"${c}_command",        no, rw, "CAN-34, CAN-40", "Command; reads 0",
      field(s"${c}_recover",         0,  0, status, 0, "Write 1: recovers from bus-off"),
      field(s"${c}_clear_counters",  1,  1, status, 0, "Write 1: counters and last error are cleared"),
      field(s"${c}_abort_all",       2,  2, status, 0, "Write 1: aborts all slots")),
    register(start + Status,        1, s"${c}_status",         no, r,  "CAN-33",         "CAN status",
      field(s"${c}_state",           1,  0, status, 0, "0 stopped, 1 active, 2 passive, 3 bus-off"),
      field(s"${c}_warning",         2,  2, status, 0, "1: TEC or REC is 96 or more"),
      field(s"${c}_integrating",     3,  3, status, 0, "1: waits for 11 recessive bits"),
      field(s"${c}_sending",         4,  4, status, 0, "1: transmitter of the frame on the bus"),
      field(s"${c}_receiving",       5,  5, status, 0, "1: receiver of the frame on the bus"),
      field(s"${c}_impossible",      6,  6, status, 0, "1: the bit timing is impossible")),
    register(start + Timing,        4, s"${c}_timing",         no, rwIf(s"${c}_stopped"), "CAN-01",
        "Bit timing; writable while control bit 0 is 0",
      field(s"${c}_prescaler",      10,  0, stored, 0, "Core cycles per time quantum - 1"),
      field(s"${c}_tseg1",          21, 16, stored, 0, "TSEG1 in time quanta - 1"),
      field(s"${c}_tseg2",          27, 24, stored, 0, "TSEG2 in time quanta - 1"),
      field(s"${c}_sjw",            31, 28, stored, 0, "SJW in time quanta - 1")),
    register(start + ErrorCounters, 4, s"${c}_error_counters", no, r,  "CAN-30, CAN-31", "Error counters",
      field(s"${c}_tec",             8,  0, status, 0, "TEC, 0 to 256"),
      field(s"${c}_rec",            23, 16, status, 0, "REC, 0 to 255")),
    register(start + LastError,     4, s"${c}_last_error",     no, r,  "CAN-46",
        "Last bus error and lost arbitration",
      field(s"${c}_error_type",      2,  0, status, 0, "0 none, 1 bit, 2 stuff, 3 form, 4 CRC, 5 ACK"),
      field(s"${c}_error_sender",    3,  3, status, 0, "1: as sender"),
      field(s"${c}_error_field",    12,  8, status, 0, "Field (CB-10)"),
      field(s"${c}_error_bit",      20, 16, status, 0, "Bit of the field, from 0"),
      field(s"${c}_lost_bit",       29, 24, status, 0, "Bit of the last lost arbitration, from 1; 0: none"))
  ) ++ CounterNames.zip(counterTexts).zipWithIndex.map { case ((name, text), i) =>
    register(start + Counters + i,  1, s"${c}_$name",          no, r,  "CAN-46",         text,
      field(s"${c}_$name",           7,  0, status, 0, s"$text, up to 255"))
  } ++ Seq(
    register(start + RxLevel,       2, s"${c}_rx_level",       no, r,  "CAN-44",         "Frames in the FIFO",
      field(s"${c}_rx_level",        7,  0, status, 0, "Frames in the FIFO")),
    register(start + RxRelease,     1, s"${c}_rx_release",     no, rw, "CAN-44",         "Release; reads 0",
      field(s"${c}_rx_release",      0,  0, status, 0, "Write of any value: drops the oldest frame")),
    register(start + Requests,      2, s"${c}_request",        no, rw, "CAN-41",         "Requests",
      field(s"${c}_pending",        15,  0, status, 0, "Bit n: slot n waits; write 1: send it")),
    register(start + Aborts,        2, s"${c}_abort",          no, rw, "CAN-40",         "Aborts; reads 0",
      field(s"${c}_abort",          15,  0, status, 0, "Write 1: aborts the slot")),
    register(start + Sent,          2, s"${c}_sent",           no, rw, "CAN-40",         "Slots sent",
      field(s"${c}_sent",           15,  0, status, 0, "Bit n: slot n has been sent; write 1 clears")),
    register(start + Failed,        2, s"${c}_failed",         no, rw, "CAN-40",         "Slots not sent",
      field(s"${c}_failed",         15,  0, status, 0,
          "Bit n: slot n was aborted or failed with its one attempt; write 1 clears")),
    register(start + RxFrame,      16, s"${c}_rx_frame",       no, r,  "CAN-44",
        "The oldest frame received; 0 if there is none",
      field(s"${c}_rx_identifier",  28,  0, status, 0, "Identifier; of 11 bits in 10 to 0"),
      field(s"${c}_rx_remote",      30, 30, status, 0, "1: remote frame"),
      field(s"${c}_rx_extended",    31, 31, status, 0, "1: identifier of 29 bits"),
      field(s"${c}_rx_dlc",         35, 32, status, 0, "DLC as received"),
      field(s"${c}_rx_filter",      44, 40, status, 0, "Filter that matched"),
      field(s"${c}_rx_time",        63, 48, status, 0, "Low half of the time of its SOF, us"),
      field(s"${c}_rx_data",       127, 64, status, 0, "Data; bytes that the frame has not are 0"))
  )

  private def dropped(c: String, start: Int): Register =
    register(start + BridgeDropped, 1, s"${c}_bridge_dropped", no, r,  "BR-02",
        "Frames of the other port that were dropped",
      field(s"${c}_bridge_dropped",  7,  0, status, 0, "Frames of the other port without a slot, up to 255"))

  private def slot(c: String, start: Int, n: Int, slots: Int) = {
    val s = s"${c}_slot$n"
    register(start, FrameBytes, s, no, rwIf(s"${s}_free"), "CAN-41",
        s"Frame of slot $n; writable while not pending",
      field(s"${s}_identifier",     28,  0, keptWritten, 0, "Identifier; of 11 bits in 10 to 0"),
      field(s"${s}_remote",         30, 30, keptWritten, 0, "1: remote frame"),
      field(s"${s}_extended",       31, 31, keptWritten, 0, "1: identifier of 29 bits"),
      field(s"${s}_dlc",            35, 32, keptWritten, 0, "DLC"),
      field(s"${s}_time",           63, 48, kept,        0, "Low half of the time of its last SOF, us"),
      field(s"${s}_data",          127, 64, keptWritten, 0, "Data")
    ).copy(block = Some(Block(n, slots, FrameBytes)))
  }

  private def filter(c: String, start: Int, n: Int, filters: Int) = {
    val f = s"${c}_filter$n"
    register(start, FilterBytes, f, no, rw, "CAN-43", s"Filter $n; in force when its last byte is written",
      field(s"${f}_identifier",     28,  0, keptWritten, 0, "Identifier"),
      field(s"${f}_in_use",         29, 29, keptWritten, 0, "1: in use"),
      field(s"${f}_remote",         30, 30, keptWritten, 0, "1: remote frames"),
      field(s"${f}_extended",       31, 31, keptWritten, 0, "1: identifiers of 29 bits"),
      field(s"${f}_mask",           60, 32, keptWritten, 0, "1: this bit of the identifier must be equal"),
      field(s"${f}_mask_remote",    62, 62, keptWritten, 0, "1: the kind must be equal"),
      field(s"${f}_mask_extended",  63, 63, keptWritten, 0, "1: the format must be equal")
    ).copy(block = Some(Block(n, filters, FilterBytes)))
  }
  // format: on
}
