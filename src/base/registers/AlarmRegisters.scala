package flyframe.registers

import RegisterTable._

/** The registers of a smoke-alarm slave, where the register table has room for a maker's own (ALARM-01 to
  * ALARM-08, DET-03, DET-04); used by [[flyframe.alarm.AlarmUnit]].
  */
object AlarmRegisters {

  /** The oldest event: the object of the datagrams that report it. */
  val Record = 0x0e80

  /** Where the master acknowledges it, and says what the server has; commands; what the host says of its
    * slave, with the epoch behind it.
    */
  val Acknowledge = 0x0e8a
  val Confirm     = 0x0e8e
  val Command     = 0x0e8c
  val SelfTest    = 0x0ea4

  /** Which messages have come, and the messages, eight bytes each. */
  val Messages     = 0x0e8d
  val Broadcast    = 0x0e90
  val Message      = 0x0e98
  val MessageBytes = 8

  /** How the detector is watched. */
  val Debounce = 0x0ea0
  val OffTime  = 0x0ea2
  val Status   = 0x0e88
  val Epoch    = 0x0ea5
  val Enable   = 0x0ea6

  /** Value of a command: the events that are not confirmed are reported again. */
  val Repeat = 4

  // format: off
  val all: Seq[Register] = Seq(
    register(Record,      8,            "alarm_record",      r,  r,   "ALARM-03",         "Alarm record",
      field("alarm_sequence",     15,  0, status,   0,
          "Number of the oldest event that the master has not acknowledged; 0: there is none"),
      field("alarm_state",        23, 16, status,   0,
          "State of the detector: 1 normal, 2 alarm, 3 line open, 4 line short"),
      field("alarm_record_epoch", 31, 24, status,   0,    "As 0x0EA5"),
      field("alarm_time",         63, 32, status,   0,    "Slave time of the event in us")),
    register(Status,      2,            "alarm_status",      r,  r,   "ALARM-05",         "Alarm status",
      field("alarm_events",        4,  0, status,   0,    "Events not confirmed"),
      field("detector_state",     10,  8, status,   0,
          "State of the detector now: as in the record, 0 off"),
      field("detector_supply",    12, 12, status,   0,    "1: supply on"),
      field("alarm_latched",      13, 13, status,   0,    "1: buzzer and lamp on")),
    register(Acknowledge, 2,            "alarm_acknowledge", rw, r,   "ALARM-04",         "Alarm acknowledge",
      field("alarm_acknowledge",  15,  0, stored,   0,    "The master has seen the event with this number")),
    register(Command,     1,            "alarm_command",     rw, rw,  "ALARM-06, DET-04", "Alarm command",
      field("alarm_clear",         0,  0, loadable, 0,    "1: buzzer and lamp off; returns to 0"),
      field("detector_restart",    1,  1, loadable, 0,    "1: supply off and on again; returns to 0"),
      field("alarm_repeat",        2,  2, loadable, 0,
          "1: events not confirmed are reported again; returns to 0")),
    register(Messages,    1,            "alarm_messages",    r,  ack, "ALARM-07",         "Messages received",
      field("broadcast_received",  0,  0, status,   0,    "1: 0x0E90 written since the host read this"),
      field("message_received",    1,  1, status,   0,    "1: 0x0E98 written since the host read this")),
    register(Confirm,     2,            "alarm_confirm",     rw, r,   "ALARM-04",         "Alarm confirm",
      field("alarm_confirm",      15,  0, stored,   0,    "The server has the events up to this number")),
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
      field("alarm_epoch",         7,  0, stored,   0,
          "Changed by the host at each start: events count anew")),
    register(Enable,      1,            "alarm_enable",      r,  rw,  "ALARM-08",         "Alarm enable",
      field("detector_enable",     0,  0, stored,   0,    "1: detector supplied and watched"),
      field("alarm_report",        1,  1, stored,   0,    "1: events are appended to passing frames"))
  )
  // format: on
}
