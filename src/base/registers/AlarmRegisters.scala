package flyframe.registers

import Access._
import Source._

/** The registers of a smoke-alarm slave, where the register table has room for a maker's own (ALARM-01). */
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

  /** Value of a command: the events that are not confirmed are reported again. */
  val Repeat = 4

  private def field(name: String, high: Int, low: Int, source: Source, meaning: String, reset: BigInt = 0) =
    Field(name, high, low, source, reset, meaning)

  val all: Seq[Register] = Seq(
    Register(
      "alarm_record",
      "Alarm record",
      Record,
      8,
      Read,
      Read,
      "ALARM-03",
      Seq(
        field(
          "alarm_sequence",
          15,
          0,
          Status,
          "Number of the oldest event that the master has not acknowledged; 0: there is none"
        ),
        field(
          "alarm_state",
          23,
          16,
          Status,
          "State of the detector: 1 normal, 2 alarm, 3 line open, 4 line short"
        ),
        field("alarm_record_epoch", 31, 24, Status, "As 0x0EA5"),
        field("alarm_time", 63, 32, Status, "Slave time of the event in us")
      )
    ),
    Register(
      "alarm_status",
      "Alarm status",
      0x0e88,
      2,
      Read,
      Read,
      "ALARM-05",
      Seq(
        field("alarm_events", 4, 0, Status, "Events not confirmed"),
        field("detector_state", 10, 8, Status, "State of the detector now: as in the record, 0 off"),
        field("detector_supply", 12, 12, Status, "1: supply on"),
        field("alarm_latched", 13, 13, Status, "1: buzzer and lamp on")
      )
    ),
    Register(
      "alarm_acknowledge",
      "Alarm acknowledge",
      Acknowledge,
      2,
      ReadWrite,
      Read,
      "ALARM-04",
      Seq(field("alarm_acknowledge", 15, 0, Stored(), "The master has seen the event with this number"))
    ),
    Register(
      "alarm_command",
      "Alarm command",
      Command,
      1,
      ReadWrite,
      ReadWrite,
      "ALARM-06, DET-04",
      Seq(
        field("alarm_clear", 0, 0, Stored(hardwareSet = true), "1: buzzer and lamp off; returns to 0"),
        field(
          "detector_restart",
          1,
          1,
          Stored(hardwareSet = true),
          "1: supply off and on again; returns to 0"
        ),
        field(
          "alarm_repeat",
          2,
          2,
          Stored(hardwareSet = true),
          "1: events not confirmed are reported again; returns to 0"
        )
      )
    ),
    Register(
      "alarm_messages",
      "Messages received",
      0x0e8d,
      1,
      Read,
      ReadAcknowledge,
      "ALARM-07",
      Seq(
        field("broadcast_received", 0, 0, Status, "1: 0x0E90 written since the host read this"),
        field("message_received", 1, 1, Status, "1: 0x0E98 written since the host read this")
      )
    ),
    Register(
      "alarm_confirm",
      "Alarm confirm",
      Confirm,
      2,
      ReadWrite,
      Read,
      "ALARM-04",
      Seq(field("alarm_confirm", 15, 0, Stored(), "The server has the events up to this number"))
    ),
    Register(
      "alarm_broadcast",
      "Broadcast message",
      0x0e90,
      8,
      ReadWrite,
      Read,
      "ALARM-07",
      Seq(field("alarm_broadcast", 63, 0, Ram, "From the master to the hosts of all slaves"))
    ),
    Register(
      "alarm_message",
      "Message",
      0x0e98,
      8,
      ReadWrite,
      Read,
      "ALARM-07",
      Seq(field("alarm_message", 63, 0, Ram, "From the master to the host of this slave"))
    ),
    Register(
      "detector_debounce",
      "Detector debounce",
      0x0ea0,
      2,
      Read,
      ReadWrite,
      "DET-03",
      Seq(field("detector_debounce", 15, 0, Stored(), "How long a state must last, in 10 us", 1000))
    ),
    Register(
      "detector_off_time",
      "Detector off time",
      0x0ea2,
      2,
      Read,
      ReadWrite,
      "DET-04",
      Seq(field("detector_off_time", 15, 0, Stored(), "How long the supply stays off, in ms", 2000))
    ),
    Register(
      "self_test",
      "Self-test",
      SelfTest,
      1,
      Read,
      ReadWrite,
      "ALARM-08",
      Seq(field("self_test", 7, 0, Stored(), "Result of the host: 0 not run, 1 good, else what failed"))
    ),
    Register(
      "alarm_epoch",
      "Alarm epoch",
      0x0ea5,
      1,
      Read,
      ReadWrite,
      "ALARM-08",
      Seq(field("alarm_epoch", 7, 0, Stored(), "Changed by the host at each start: events count anew"))
    ),
    Register(
      "alarm_enable",
      "Alarm enable",
      0x0ea6,
      1,
      Read,
      ReadWrite,
      "ALARM-08",
      Seq(
        field("detector_enable", 0, 0, Stored(), "1: detector supplied and watched"),
        field("alarm_report", 1, 1, Stored(), "1: events are appended to passing frames")
      )
    )
  )
}
