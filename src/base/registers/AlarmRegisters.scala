package flyframe.registers

import flyframe.protocol.{ConfirmLayout, RecordAckLayout}
import RegisterTable._

/** The registers of a smoke-alarm slave, where the register table has room for a maker's own (ALARM-01 to
  * ALARM-12, DET-01 to DET-07); used by [[flyframe.alarm.SmokeAlarm]].
  */
object AlarmRegisters {

  /** Of the master: it has a record; what the server has; an order. */
  val Acknowledge = 0x0eb8
  val Confirm     = 0x0ec8
  val Command     = 0x0e8c

  /** Which messages have come, and the messages, eight bytes each. */
  val Messages     = 0x0e8d
  val Broadcast    = 0x0e90
  val Message      = 0x0e98
  val MessageBytes = 8

  /** How the detector is watched, and what the host says of its slave. */
  val Debounce = 0x0ea0
  val OffTime  = 0x0ea2
  val SelfTest = 0x0ea4
  val Epoch    = 0x0ea5
  val Enable   = 0x0ea6

  /** The state of the slave as it goes to the master, see [[flyframe.protocol.SlaveStateLayout]]. Datagrams
    * that report a record have this address, too.
    */
  val State = 0x0ea8

  /** Disable and test; heartbeat of the host. */
  val Mode      = 0x0eb0
  val HostAlive = 0x0eb4

  // format: off
  val all: Seq[Register] = Seq(
    register(Acknowledge, RecordAckLayout.bytes, "alarm_acknowledge", rw, r, "ALARM-04", "Alarm acknowledge",
      field("acknowledge_sequence", 15,  0, status, 0,    "The master has the record with this number,"),
      field("acknowledge_guard",    31, 16, status, 0,    "with these bits 15 to 0 of its time;"),
      field("acknowledge_tag",      47, 32, status, 0,    "at the master it has this number; all read 0")),
    register(Confirm,     ConfirmLayout.bytes,   "alarm_confirm",     rw, r, "ALARM-04", "Alarm confirm",
      field("confirm_number",       15,  0, status, 0,    "The server has all events before this one"),
      field("confirm_life",         31, 16, status, 0,    "of this life of the master; both read 0")),
    register(Command,     1,            "alarm_command",     rw, rw,  "ALARM-06, DET-04", "Alarm command",
      field("alarm_silence",       0,  0, loadable, 0,    "1: sounder off; returns to 0"),
      field("detector_restart",    1,  1, loadable, 0,
          "1: the alarm ends, supply off and on again; returns to 0")),
    register(Messages,    1,            "alarm_messages",    r,  ack, "ALARM-07",         "Messages received",
      field("broadcast_received",  0,  0, status,   0,    "1: 0x0E90 written since the host read this"),
      field("message_received",    1,  1, status,   0,    "1: 0x0E98 written since the host read this")),
    register(Broadcast,   MessageBytes, "alarm_broadcast",   rw, r,   "ALARM-07",         "Broadcast message",
      field("alarm_broadcast",    63,  0, ram,      0,    "From the master to the hosts of all slaves")),
    register(Message,     MessageBytes, "alarm_message",     rw, r,   "ALARM-07",         "Message",
      field("alarm_message",      63,  0, ram,      0,    "From the master to the host of this slave")),
    register(Debounce,    2,            "detector_debounce", r,  rw,  "DET-03",           "Detector debounce",
      field("detector_debounce",  15,  0, stored,   1000, "How long a state must last, in 10 us")),
    register(OffTime,     2,            "detector_off_time", r,  rw,  "DET-04",           "Detector off time",
      field("detector_off_time",  15,  0, stored,   2000, "How long the supply stays off, in ms")),
    register(SelfTest,    1,            "self_test",         r,  rw,  "ALARM-08",         "Self-test",
      field("self_test",           7,  0, stored,   0,
          "Result of the host: 0 not run, 1 good, else what failed")),
    register(Epoch,       1,            "alarm_epoch",       r,  rw,  "ALARM-08",         "Alarm epoch",
      field("alarm_epoch",         7,  0, stored,   0,    "Changed by the host at each start")),
    register(Enable,      1,            "alarm_enable",      r,  rw,  "ALARM-09",         "Alarm enable",
      field("detector_enable",     0,  0, stored,   1,    "1: detector supplied and watched")),
    register(State,       8,            "slave_state",       r,  r,   "ALARM-10",
        "State of the slave",
      field("slave_status",       15,  0, status,   0,    "Bits of enum protocol_slave"),
      field("slave_node",         31, 16, status,   0,    "Station alias"),
      field("slave_self_test",    39, 32, status,   0,    "As 0x0EA4"),
      field("slave_epoch",        47, 40, status,   0,    "As 0x0EA5"),
      field("slave_dropped",      55, 48, status,   0,    "Records dropped, 255: as many or more"),
      field("slave_links",        63, 56, status,   0,    "Bit y: link at port y")),
    register(Mode,        4,            "detector_mode",     rw, rw,  "DET-06",           "Detector mode",
      field("detector_mode",       1,  0, loadable, 0,    "0 watch, 1 disable, 2 test; returns to 0"),
      field("detector_seconds",   31, 16, loadable, 0,    "Seconds it has left")),
    register(HostAlive,   2,            "host_alive",        r,  rw,  "ALARM-11",
        "Heartbeat of the host",
      field("host_alive",         15,  0, loadable, 0,
          "The host will write this again within so many ms; counts down to 0"))
  )
  // format: on
}
