package flyframe.model

import flyframe.protocol.DetectorState._
import flyframe.protocol.{AppendedLayout, Command, RecordLayout}
import flyframe.registers.{AlarmRegisters, Register}

/** The events of a smoke detector and the datagram that reports the oldest of them (ALARM-01 to ALARM-08,
  * DET-01 to DET-05).
  */
class AlarmModel(registers: ModelRegisters) extends ModelUnit {
  import AlarmModel._

  private case class Event(sequence: Int, state: Int, time: Long)

  private var line     = Normal
  private var offLeft  = 0L                  // us the supply stays off
  private var lasted   = 0L                  // us the line has been as it is
  private var state    = Off
  private var reported = Off
  private var sequence = 1
  private var queue    = Vector.empty[Event] // not confirmed
  private var told     = 0                   // of them acknowledged
  private var latched  = false
  private var time     = 0L
  private var restarts = false               // the supply has been taken away since time last passed
  private var received = Set.empty[String]

  /** The next event gets this number: for tests where numbers wrap. */
  def countFrom(number: Int): Unit = sequence = number

  private def supplied = registers.value("detector_enable") == 1 && offLeft == 0

  /** The line is in this state from now on, whether there is supply or not. */
  def setLine(now: Int): Unit = if (now != line) {
    line = now
    lasted = 0
  }

  /** Lets time pass. */
  def advance(us: Long): Unit = {
    time = (time + us) & 0xffffffffL
    restarts = false
    val off = offLeft min us
    offLeft -= off
    if (!supplied) {
      state = Off
      lasted = 0
    } else {
      lasted += us - off
      if (lasted >= 10L * registers.value("detector_debounce") && state != line) {
        state = line
        if (state == Alarm) latched = true
      }
    }
    watch()
  }

  /** Time until nothing moves any more, in us; without debounce. */
  def settlingUs: Int =
    if (registers.value("detector_debounce") != 0) 0
    else if (restarts) offLeft.toInt + 1100 // the supply comes back with a tick of 1 ms
    else if (state != (if (supplied) line else Off)) 8
    else 0

  /** A byte of the time of an event, which the model does not know to the microsecond. */
  def isTime(address: Int): Boolean = head.nonEmpty && Time.contains(address)

  private def watch(): Unit = if (state != reported && state != Off && queue.size < Depth) {
    reported = state
    queue :+= Event(sequence, state, time)
    sequence = if (sequence == 0xffff) 1 else sequence + 1
  }

  private def epoch = registers.value("alarm_epoch")

  private def head = queue.drop(told).headOption

  /** The alarm record, if an event waits. */
  private def record: Option[Seq[Int]] = head.map { e =>
    RecordLayout
      .encode(
        RecordLayout.Sequence -> e.sequence.toLong,
        RecordLayout.State    -> e.state.toLong,
        RecordLayout.Epoch    -> epoch.toLong,
        RecordLayout.Time     -> e.time
      )
      .map(_ & 0xff)
      .toSeq
  }

  /** What is appended to a passing frame. */
  def datagram: Option[Seq[Int]] = record.filter(_ => registers.value("alarm_report") == 1).map { data =>
    Datagram(Command.Nop, registers.value("station_alias"), AlarmRegisters.Record, data)
      .copy(index = head.get.sequence & 0xff, workingCounter = AppendedLayout.Counted)
      .bytes(more = false)
  }

  override def status(field: String): Option[Int] = {
    field match {
      case "alarm_sequence"                          => Some(head.fold(0)(_.sequence))
      case "alarm_state"                             => Some(head.fold(0)(_.state))
      case "alarm_record_epoch"                      => Some(if (head.isEmpty) 0 else epoch)
      case "alarm_time"                              => Some(head.fold(0)(_.time.toInt))
      case "alarm_events"                            => Some(queue.size)
      case "detector_state"                          => Some(state)
      case "detector_supply"                         => Some(if (supplied) 1 else 0)
      case "alarm_latched"                           => Some(if (latched) 1 else 0)
      case "broadcast_received" | "message_received" => Some(if (received(field)) 1 else 0)
      case _                                         => None
    }
  }

  override def written(register: Register, address: Int, byte: Int, byHost: Boolean): Unit = {
    register.name match {
      case "alarm_acknowledge" if address == register.address + 1 =>
        if (head.exists(_.sequence == registers.value("alarm_acknowledge"))) told += 1
      case "alarm_confirm" if address == register.address + 1 =>
        val gone = queue.take(told).indexWhere(_.sequence == registers.value("alarm_confirm")) + 1
        queue = queue.drop(gone)
        told -= gone
      case "alarm_command" =>
        if ((byte & 1) != 0) latched = false
        if ((byte & 2) != 0) {
          offLeft = 1000L * registers.value("detector_off_time")
          state = Off
          lasted = 0
          restarts = true
        }
        if ((byte & 4) != 0) told = 0
        registers.set("alarm_clear", 0)
        registers.set("alarm_repeat", 0)
        registers.set("detector_restart", 0)
      case "alarm_broadcast" if address == register.range.last => received += "broadcast_received"
      case "alarm_message" if address == register.range.last   => received += "message_received"
      case _                                                   =>
    }
    watch()
  }

  override def readByHost(register: Register): Unit =
    if (register.name == "alarm_messages") received = Set.empty

  /** A message waits for the host. */
  def interrupt: Boolean = received.nonEmpty
}

object AlarmModel {
  private val Depth = 16
  private val Time =
    AlarmRegisters.Record + RecordLayout.Time.offset until AlarmRegisters.Record + RecordLayout.Time.end

  /** What the line is in when the comparators of its current give these bits (DET-02). */
  def lineOf(current: Int): Int =
    if ((current & 4) != 0) Short
    else if ((current & 2) != 0) Alarm
    else if ((current & 1) != 0) Normal
    else Open
}
