package flyframe.model

import flyframe.protocol.DetectorState._
import flyframe.protocol.{
  AppendedLayout,
  Command,
  ConfirmLayout,
  DetectorMode,
  Layout,
  RecordAckLayout,
  RecordLayout,
  SelfTest,
  SlaveStatus
}
import flyframe.registers.{AlarmRegisters, Register}

/** A smoke detector, the state of its slave, the records of what has happened, and the datagram that reports
  * one of them (ALARM-01 to ALARM-12, DET-01 to DET-07).
  *
  * @param links
  *   bit y: link at port y
  */
class AlarmModel(registers: ModelRegisters, links: () => Int = () => 0) extends ModelUnit {
  import AlarmModel._

  // The detector.
  private var line     = Normal
  private var offLeft  = 0L    // us the supply stays off
  private var lasted   = 0L    // us the line has been as it is
  private var state    = Off
  private var unsteady = 0     // ticks of a line that was not normal, less those in which it was
  private var calm     = 0     // ticks of a normal line, of which each fourth counts
  private var touched  = false // the line was not normal in this tick
  private var above    = false // the line was above normal since it was steady

  // Lamp and sounder.
  private var mode     = DetectorMode.Watch
  private var rings    = false // smoke is at a detector that is watched
  private var latched  = false
  private var sounding = false

  // Records.
  private var time      = 0L
  private var reported  = Option.empty[Int]    // state of the last record, if that still is known
  private var sequence  = 1
  private var queue     = Vector.empty[Record] // oldest first
  private var dropped   = 0
  private var lacking   = false                // records were dropped since there were none
  private var orders    = Map.empty[Int, Int]  // bytes of acknowledgement and confirmation as written last
  private var clears    = false                // the master has become another one
  private var confirmed = false                // it expects records
  private var offered   = Option.empty[Record]
  private var left      = 0                    // times the record on offer has left
  private var passed    = 0                    // frames since then

  private var damaged  = false // the FPGA's configuration
  private var received = Set.empty[String]
  private var restarts = false // the supply has been taken away since time last passed
  private var moved    = false // records have changed since time last passed

  // ---- for tests ----

  /** The next record gets this number: for tests where numbers wrap. */
  def countFrom(number: Int): Unit = sequence = number

  /** The FPGA's configuration is damaged (ALARM-12). */
  def damage(): Unit = damaged = true

  /** Records that are kept: those that the master has not got, and all. */
  def waiting: Int = queue.count(!_.told)
  def kept: Int    = queue.size

  /** Records that were dropped since the start. */
  def lost: Int = dropped

  /** The record that passing frames may take. */
  def onOffer: Option[Record] = offered

  /** Numbers that records which the master has got have there. */
  def tags: Seq[Int] = queue.filter(_.told).map(_.tag)

  // ---- detector ----

  private def value(name: String) = registers.value(name)
  private def supplied            = value("detector_enable") == 1 && offLeft == 0
  private def debounce            = value("detector_debounce")
  private def modeNow: Int = value("detector_mode") match {
    case DetectorMode.Disable => DetectorMode.Disable
    case DetectorMode.Test    => DetectorMode.Test
    case _                    => DetectorMode.Watch
  }

  /** The line is in this state from now on, whether there is supply or not. */
  def setLine(now: Int): Unit = if (now != line) {
    line = now
    lasted = 0
    see()
  }

  /** What is known of a tick before it is over. */
  private def see(): Unit = if (supplied && line != Normal) {
    touched = true
    if (line != Open) above = true
  }

  /** Lets time pass. */
  def advance(us: Long): Unit = {
    restarts = false
    moved = false
    var rest = us
    while (rest > 0) {
      val step = rest min (TickUs - time % TickUs)
      rest -= step
      pass(step)
    }
    look()
  }

  private def pass(us: Long): Unit = {
    time += us
    val off = offLeft min us
    offLeft -= off
    if (supplied) {
      lasted += us - off
      see()
    }
    if (time % TickUs == 0) tick()
    if (time % 1000 == 0 && value("host_alive") > 0) registers.set("host_alive", value("host_alive") - 1)
    if (time % 1000000 == 0) second()
    decide()
    look()
  }

  private def tick(): Unit = {
    if (touched) unsteady = (unsteady + 1) min debounce max unsteady
    else {
      if (unsteady == 0) above = false
      calm = (calm + 1) % 4
      if (calm == 0 && unsteady > 0) unsteady -= 1
    }
    touched = false
    see()
  }

  private def second(): Unit = {
    val left = value("detector_seconds")
    if (left <= 1) registers.set("detector_mode", DetectorMode.Watch)
    registers.set("detector_seconds", (left - 1) max 0)
  }

  private def settled(now: Int): Unit = {
    state = now
    unsteady = 0
    above = false
  }

  /** DET-03. */
  private def decide(): Unit =
    if (!supplied) {
      settled(Off)
      lasted = 0
      touched = false
    } else if (lasted >= TickUs * debounce) settled(line)
    else if (unsteady > 0 && unsteady >= debounce) state = if (above) Alarm else Open

  /** Time until nothing moves any more, in us; without debounce. */
  def settlingUs: Int =
    if (restarts && debounce == 0) offLeft.toInt + 1100 // the supply comes back with a tick of 1 ms
    else if (moved || (debounce == 0 && state != (if (supplied) line else Off))) QueueUs
    else 0

  // ---- records ----

  /** Something has changed: what follows for lamp, sounder and records. */
  private def look(): Unit = {
    if (modeNow != mode) {
      mode = modeNow
      reported = None
    }
    val smoke = mode == DetectorMode.Watch && state == Alarm
    if (smoke) latched = true
    if (smoke && !rings) sounding = true
    rings = smoke
    if (state == Off || mode == DetectorMode.Disable) reported = None
    else if (!reported.contains(state)) {
      reported = Some(state)
      keep(new Record(sequence, state, mode == DetectorMode.Test, value("alarm_epoch"), time))
      sequence = if (sequence == 0xffff) 1 else sequence + 1
    }
    choose()
  }

  /** ALARM-05 */
  private def keep(record: Record): Unit = {
    moved = true
    val full = queue.size == Depth
    val told = if (full) queue.find(r => r.told && !r.isAlarm) else None
    if (full && told.isEmpty) {
      dropped = (dropped + 1) min 0xff
      lacking = true
    }
    val others = queue.find(!_.isAlarm).orElse(queue.find(_.told)).orElse(queue.lastOption)
    val gone   = if (full) told.orElse(others) else None
    if (!full || record.isAlarm || gone.exists(!_.isAlarm))
      queue = queue.filterNot(gone.contains(_)) :+ record
  }

  private def choose(): Unit = {
    val untold = queue.filter(!_.told)
    val best   = untold.find(_.isAlarm).orElse(untold.headOption)
    if (best != offered) {
      offered = best
      left = 0
      passed = 0
      moved = true
    }
  }

  private def ordered(address: Int, field: Layout.Field): Int =
    (0 until field.bytes).map(i => orders.getOrElse(address + field.offset + i, 0) << (8 * i)).sum

  private def acknowledge(): Unit = {
    def of(field: Layout.Field) = ordered(AlarmRegisters.Acknowledge, field)
    for (
      r <- queue.find(r =>
        r.sequence == of(RecordAckLayout.Sequence) && (r.time & 0xffff) == of(RecordAckLayout.Guard)
      )
    ) {
      r.told = true
      r.tag = of(RecordAckLayout.Tag)
      moved = true
    }
  }

  private def confirm(): Unit = {
    confirmed = true
    if (clears) {
      clears = false
      queue.foreach(_.told = false)
      moved = true
    } else {
      def stored(tag: Int) = {
        val ahead = (tag - ordered(AlarmRegisters.Confirm, ConfirmLayout.Number)) & 0xffff
        ahead >= Lead
      }
      val stay = queue.filterNot(r => r.told && stored(r.tag))
      if (stay.size != queue.size) moved = true
      queue = stay
      if (queue.isEmpty) lacking = false
    }
  }

  /** What a frame that begins now may take, without its index, which is the position. */
  def datagram: Option[Seq[Int]] =
    for (r <- offered if confirmed && (r.isAlarm || left < Often || passed == Pause))
      yield {
        val data = RecordLayout
          .encode(
            RecordLayout.Sequence -> r.sequence.toLong,
            RecordLayout.State    -> (r.state | (if (r.test) Test else 0)).toLong,
            RecordLayout.Epoch    -> r.epoch.toLong,
            RecordLayout.Time     -> r.time
          )
          .map(_ & 0xff)
          .toSeq
        Datagram(Command.Nop, value("station_alias"), AlarmRegisters.State, data)
          .copy(workingCounter = AppendedLayout.Counted)
          .bytes(more = false)
      }

  /** A frame begins to pass. */
  def frameBegins(): Unit = passed = (passed + 1) min Pause

  /** It has taken the datagram. */
  def frameTook(): Unit = {
    left = (left + 1) min Often
    passed = 0
  }

  // ---- registers ----

  /** Bits of [[flyframe.protocol.SlaveStatus]] (ALARM-10). */
  def statusWord: Int = Seq(
    SlaveStatus.Alarm         -> rings,
    SlaveStatus.Latched       -> latched,
    SlaveStatus.Sounding      -> sounding,
    SlaveStatus.Open          -> (state == Open && mode != DetectorMode.Disable),
    SlaveStatus.Short         -> (state == Short && mode != DetectorMode.Disable),
    SlaveStatus.Unwatched     -> !supplied,
    SlaveStatus.HostDead      -> (value("host_alive") == 0),
    SlaveStatus.Disabled      -> (mode == DetectorMode.Disable),
    SlaveStatus.Testing       -> (mode == DetectorMode.Test),
    SlaveStatus.TestAlarm     -> (mode == DetectorMode.Test && state == Alarm),
    SlaveStatus.Waiting       -> (waiting > 0),
    SlaveStatus.Dropped       -> lacking,
    SlaveStatus.Unwell        -> (value("self_test") != SelfTest.Good),
    SlaveStatus.Configuration -> damaged
  ).collect { case (bit, true) => bit }.sum

  override def status(field: String): Option[Int] = {
    field match {
      case "slave_status"                            => Some(statusWord)
      case "slave_node"                              => Some(value("station_alias"))
      case "slave_self_test"                         => Some(value("self_test"))
      case "slave_epoch"                             => Some(value("alarm_epoch"))
      case "slave_dropped"                           => Some(dropped)
      case "slave_links"                             => Some(links())
      case order if Orders(order)                    => Some(0)
      case "broadcast_received" | "message_received" => Some(if (received(field)) 1 else 0)
      case _                                         => None
    }
  }

  /** A byte that changes with time, which random traffic does not know. */
  def isTime(address: Int): Boolean = address == AlarmRegisters.Mode + 2

  /** Of the master, as the last confirmation has told. */
  def masterLife: Int = ordered(AlarmRegisters.Confirm, ConfirmLayout.Life)

  override def written(register: Register, address: Int, byte: Int, byHost: Boolean): Unit = {
    if (register.address == AlarmRegisters.Acknowledge || register.address == AlarmRegisters.Confirm) {
      val isLife = address >= AlarmRegisters.Confirm + ConfirmLayout.Life.offset
      if (isLife && orders.getOrElse(address, 0) != byte) clears = true
      orders += address -> byte
    }
    register.name match {
      case "alarm_acknowledge" if address == register.range.last => acknowledge()
      case "alarm_confirm" if address == register.range.last     => confirm()
      case "alarm_command" =>
        if ((byte & 1) != 0) sounding = false
        if ((byte & 2) != 0) {
          offLeft = 1000L * value("detector_off_time")
          settled(Off)
          lasted = 0
          touched = false
          latched = false
          sounding = false
          rings = false
          restarts = true
        }
        registers.set("alarm_silence", 0)
        registers.set("detector_restart", 0)
      case "detector_debounce" =>
        lasted = 0
        unsteady = 0
        above = false
      case "alarm_broadcast" if address == register.range.last => received += "broadcast_received"
      case "alarm_message" if address == register.range.last   => received += "message_received"
      case _                                                   =>
    }
    look()
  }

  override def acknowledged(register: Register, address: Int): Unit =
    if (register.name == "alarm_messages") received = Set.empty

  /** A message waits for the host. */
  def interrupt: Boolean = received.nonEmpty

  /** Lamp and buzzer are on. */
  def lamp: Boolean   = latched
  def buzzer: Boolean = sounding
}

object AlarmModel {

  /** A record of what has happened. Two of them are never equal.
    *
    * @param test
    *   the detector was being tested
    * @param time
    *   of the slave in us
    */
  final class Record(val sequence: Int, val state: Int, val test: Boolean, val epoch: Int, val time: Long) {

    /** The master has it, as this number. */
    var told: Boolean = false
    var tag: Int      = 0

    /** Somebody must hear of it at once. */
    def isAlarm: Boolean = state == Alarm && !test
  }

  /** Records that are kept. */
  val Depth = 16

  // Tags of records which the server may not have are less than so many ahead of the number that it wants.
  private val Lead = 256

  // A record that is no alarm rests after as many frames (ALARM-09): as many pass without it.
  private val Often = 2
  private val Pause = 15

  // What is only written.
  private val Orders =
    Seq(AlarmRegisters.Acknowledge, AlarmRegisters.Confirm)
      .flatMap(a => AlarmRegisters.all.find(_.address == a).get.fields.map(_.name))
      .toSet

  private val TickUs = 10L

  // Until a record has found its place, with a core clock of 25 MHz.
  private val QueueUs = 30

  /** What the line is in when the comparators of its current give these bits (DET-02). */
  def lineOf(current: Int): Int =
    if ((current & 4) != 0) Short
    else if ((current & 2) != 0) Alarm
    else if ((current & 1) != 0) Normal
    else Open
}
