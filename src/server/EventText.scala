package flyframe.server

import flyframe.protocol.{CommandResult, DetectorState, EventKind, SelfTest, ServerDatagram}

/** Events and commands in words, for page and CSV. */
object EventText {
  private val Unlisted = 255

  /** Label of the slave an event is about; empty if it is about none, or about one that is not listed. */
  def label(e: Event): String = e.kind match {
    case EventKind.Scanned | EventKind.Command => ""
    case _ if e.position == Unlisted           => ""
    case _                                     => LineState.label(e.position)
  }

  /** Node ID, where there is one. */
  def node(e: Event): Option[Int] = e.kind match {
    case EventKind.Scanned => None
    case EventKind.Command => Option.when(e.node != ServerDatagram.AllNodes)(e.node)
    case _                 => Some(e.node)
  }

  def detector(state: Int): String = state match {
    case DetectorState.Off    => "off"
    case DetectorState.Normal => "normal"
    case DetectorState.Alarm  => "alarm"
    case DetectorState.Open   => "line open"
    case DetectorState.Short  => "line short"
    case other                => s"unknown state $other"
  }

  def selfTest(result: Int): String = result match {
    case SelfTest.NotRun => "self-test not run"
    case SelfTest.Good   => "self-test good"
    case code            => s"self-test failed ($code)"
  }

  def command(code: Int, node: Int): String = {
    val what = code match {
      case ServerDatagram.AlarmClear    => "alarm clear"
      case ServerDatagram.DetectorReset => "detector reset"
      case other                        => s"command $other"
    }
    if (node == ServerDatagram.AllNodes) what else s"$what, ID $node"
  }

  def result(code: Int): String = code match {
    case CommandResult.Done           => "done"
    case CommandResult.UnknownCommand => "the master does not know it"
    case CommandResult.NoAnswer       => "no answer from the line"
    case CommandResult.NoSuchNode     => "no such ID"
    case other                        => s"unknown result $other"
  }

  /** How much an event matters: alarm, fault, normal (of a detector), else info. */
  def severity(e: Event): String = (e.kind, e.state) match {
    case (EventKind.Detector, DetectorState.Alarm)                           => "alarm"
    case (EventKind.Detector, DetectorState.Open | DetectorState.Short)      => "fault"
    case (EventKind.Detector, DetectorState.Normal)                          => "normal"
    case (EventKind.Lost | EventKind.Duplicate, _)                           => "fault"
    case (EventKind.Present | EventKind.Found, test) if test > SelfTest.Good => "fault"
    case (EventKind.Command, result) if result != CommandResult.Done         => "fault"
    case _                                                                   => "info"
  }

  def text(e: Event): String = e.kind match {
    case EventKind.Detector if e.position == Unlisted => s"not listed: ${detector(e.state)}"
    case EventKind.Detector                           => detector(e.state)
    case EventKind.Scanned if e.node > e.position =>
      s"line listed, slaves: ${e.position} of ${e.node} that answer"
    case EventKind.Scanned   => s"line listed, slaves: ${e.position}"
    case EventKind.Present   => s"present, ${selfTest(e.state)}"
    case EventKind.Lost      => "lost"
    case EventKind.Found     => s"found again, ${selfTest(e.state)}"
    case EventKind.Duplicate => s"same ID as ${LineState.label(e.sequence)}"
    case EventKind.Gap       => s"ID does not follow that of the slave before it (${e.sequence})"
    case EventKind.Command   => s"${command(e.position, e.node)}: ${result(e.state)}"
    case other               => s"event of unknown kind $other"
  }
}
