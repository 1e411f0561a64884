package flyframe.server

import flyframe.protocol.{
  CommandResult,
  DetectorState,
  EventKind,
  MasterStatus,
  Order,
  RingFlag,
  RingResult,
  SelfTest,
  ServerDatagram,
  SlaveStatus
}

/** Events, states and orders in words, for page and CSV. */
object EventText {

  /** Position of the slave an event is about; None: it is about none. */
  def position(e: Event): Option[Int] = e.kind match {
    case EventKind.Detector | EventKind.Slave => Some(e.position)
    case _                                    => None
  }

  /** Node ID, where there is one. */
  def node(e: Event): Option[Int] = e.kind match {
    case EventKind.Detector | EventKind.Slave     => Some(e.node)
    case EventKind.Command                        => Option.when(e.node != ServerDatagram.AllNodes)(e.node)
    case LogEntry.RingMessage | LogEntry.RingNode => Some(e.node)
    case _                                        => None
  }

  def detector(state: Int): String = {
    val text = state & ~DetectorState.Test match {
      case DetectorState.Off    => "off"
      case DetectorState.Normal => "normal"
      case DetectorState.Alarm  => "alarm"
      case DetectorState.Open   => "line open"
      case DetectorState.Short  => "line short"
      case other                => s"unknown state $other"
    }
    if ((state & DetectorState.Test) != 0) s"test: $text" else text
  }

  def selfTest(result: Int): String = result match {
    case SelfTest.NotRun => "self-test not run"
    case SelfTest.Good   => "self-test good"
    case code            => s"self-test failed ($code)"
  }

  /** What the bits of a slave's status say, the most urgent first. */
  private val slaveBits = Seq(
    SlaveStatus.Absent        -> "absent",
    SlaveStatus.Short         -> "line short",
    SlaveStatus.Open          -> "line open",
    SlaveStatus.Wrong         -> "wrong slave",
    SlaveStatus.Configuration -> "FPGA configuration damaged",
    SlaveStatus.Unwatched     -> "not watched",
    SlaveStatus.HostDead      -> "host dead",
    SlaveStatus.Unwell        -> "self-test not good",
    SlaveStatus.Dropped       -> "records dropped",
    SlaveStatus.TestAlarm     -> "test alarm",
    SlaveStatus.Testing       -> "testing",
    SlaveStatus.Disabled      -> "disabled",
    SlaveStatus.Sounding      -> "sounding",
    SlaveStatus.Waiting       -> "records wait"
  )

  /** What a slave's status says, the most urgent first; empty: all is well. */
  def slave(status: Int): Seq[String] = {
    val fire =
      if ((status & SlaveStatus.Alarm) != 0) Seq("alarm")
      else if ((status & SlaveStatus.Latched) != 0) Seq("alarm, smoke is gone")
      else Nil
    fire ++ slaveBits.collect { case (bit, text) if (status & bit) != 0 => text }
  }

  /** What is wrong when these bits of a master's status are 1. */
  val masterFaults: Seq[(Int, String)] = Seq(
    MasterStatus.LineDead      -> "No slave answers.",
    MasterStatus.RingOpen      -> "The ring is cut.",
    MasterStatus.WrongLine     -> "Slaves are missing, or others than the master expects are there.",
    MasterStatus.SlaveFault    -> "A slave has a fault.",
    MasterStatus.ServerSilent  -> "The master has had no right answer of the server for too long.",
    MasterStatus.HostDead      -> "The master's host is dead: no orders.",
    MasterStatus.Configuration -> "The configuration of the master's FPGA is damaged.",
    MasterStatus.Mains         -> "The mains have failed.",
    MasterStatus.Battery       -> "The battery is low.",
    MasterStatus.Earth         -> "There is an earth fault.",
    MasterStatus.Storage       -> "The memory of the master's host does not work: no orders.",
    MasterStatus.Unlisted      -> "The master has no list of its slaves: it cannot miss any.",
    MasterStatus.Full          -> "Events wait at the master: those before are not in this log yet.",
    MasterStatus.PlantDead     -> "The master has had no link to the plant network."
  )

  /** What else the bits of a master's status say. */
  val masterSigns: Seq[(Int, String)] = Seq(
    MasterStatus.Fire     -> "fire",
    MasterStatus.Sounding -> "sounding",
    MasterStatus.Alarm    -> "smoke now",
    MasterStatus.Disabled -> "a detector is disabled",
    MasterStatus.Testing  -> "a detector is being tested"
  )

  /** A master's status in words; empty: all is well. */
  private def master(status: Int): Seq[String] = {
    val faults = masterFaults.map { case (bit, text) => bit -> text.stripSuffix(".") }
    (masterSigns ++ faults).collect { case (bit, text) if (status & bit) != 0 => text }
  }

  /** @param zone
    *   the order is for its slaves
    */
  def order(code: Int, node: Int, seconds: Int = 0, zone: Option[String] = None): String = {
    val what = code match {
      case Order.Silence     => "silence"
      case Order.Reset       => "reset"
      case Order.Disable     => "disable"
      case Order.Test        => "test"
      case Order.Watch       => "watch"
      case Order.Acknowledge => "acknowledge"
      case other             => s"order $other"
    }
    val whom =
      zone.fold(if (node == ServerDatagram.AllNodes) what else s"$what ID $node")(z => s"$what zone $z")
    if (seconds > 0) s"$whom for $seconds s" else whom
  }

  def result(code: Int): String = code match {
    case CommandResult.Done           => "done"
    case CommandResult.UnknownCommand => "the master does not know it"
    case CommandResult.NoAnswer       => "no answer from the line"
    case CommandResult.NoSuchNode     => "no such ID"
    case CommandResult.Refused        => "refused: the memory of the host has failed, or no time is given"
    case other                        => s"unknown result $other"
  }

  /** Status of a master in an event of kind `Line`. */
  def masterStatus(e: Event): Int = e.sequence | e.epoch << 16

  /** How much an event matters: alarm, fault, normal (of a detector), else info. */
  def severity(e: Event): String = {
    def of(status: Int, alarm: Int, faults: Int) =
      if ((status & alarm) != 0) "alarm" else if ((status & faults) != 0) "fault" else "info"
    e.kind match {
      case EventKind.Detector =>
        e.state match {
          case DetectorState.Alarm                      => "alarm"
          case DetectorState.Open | DetectorState.Short => "fault"
          case DetectorState.Normal                     => "normal"
          case _                                        => "info"
        }
      case EventKind.Slave =>
        of(e.sequence, SlaveStatus.Alarm, SlaveStatus.Faults | SlaveStatus.Absent)
      case EventKind.Line => of(masterStatus(e), MasterStatus.Fire, MasterStatus.Faults)
      case EventKind.Command | LogEntry.ZoneOrder => if (e.state == CommandResult.Done) "info" else "fault"
      case LogEntry.RingMessage                   => if ((e.state & RingFlag.Urgent) != 0) "alarm" else "info"
      case LogEntry.RingNode | LogEntry.RingBreak => if (e.state == 0) "normal" else "fault"
      case LogEntry.RingResult                    => if (e.state == RingResult.Delivered) "info" else "fault"
      case _                                      => "info"
    }
  }

  def text(e: Event): String = e.kind match {
    case EventKind.Detector => detector(e.state)
    case EventKind.Slave    => words("slave", slave(e.sequence))
    case EventKind.Line    => words("master", master(masterStatus(e)) :+ s"slaves that answer: ${e.position}")
    case EventKind.Command => s"${order(e.position, e.node)}: ${result(e.state)}"
    case other             => s"event of unknown kind $other"
  }

  private def words(of: String, said: Seq[String]): String =
    s"$of: ${if (said.isEmpty) "all well" else said.mkString(", ")}"
}
