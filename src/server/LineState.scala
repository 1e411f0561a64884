package flyframe.server

import java.time.Instant
import flyframe.protocol.{DetectorState, EventKind, MasterStatus, SelfTest, SlaveStatus}

/** What a slave has told of itself in an event: more than reports have of it.
  *
  * @param lostRecords
  *   it came back in another epoch after it was absent with records that waited
  */
final case class Detail(
    node: Int,
    selfTest: Int,
    dropped: Int,
    epoch: Int,
    status: Int,
    lostRecords: Boolean = false
)

/** A line as the last report tells it (SRV-09), and since when it burns.
  *
  * @param slaves
  *   by position, the first at the master
  * @param status
  *   of the master, bits of [[flyframe.protocol.MasterStatus]]
  * @param fires
  *   since when each slave, by position, has been in alarm or latched
  * @param smoke
  *   time of the master, us, of the last alarm record at a position
  * @param details
  *   by position
  * @param former
  *   fires of the master's life before: a master that has just started has not asked its slaves yet
  */
final case class LineState(
    slaves: Vector[Reported] = Vector.empty,
    status: Int = 0,
    present: Int = 0,
    cut: Int = 0,
    lost: Long = 0,
    selfTest: Int = SelfTest.Good,
    refused: Int = 0,
    fires: Map[Int, Instant] = Map.empty,
    smoke: Map[Int, Long] = Map.empty,
    details: Map[Int, Detail] = Map.empty,
    former: Map[Int, Instant] = Map.empty
) {
  import LineState._

  def has(bits: Int): Boolean = (status & bits) != 0

  /** There is or was smoke since the last reset. */
  def isBurning: Boolean = fires.nonEmpty || has(MasterStatus.Fire | MasterStatus.Alarm)

  /** The line after a report that came at `now`. The states in it decide; events tell only since when. */
  def after(report: Report, now: Instant): LineState = {
    val records = report.events.filter(e => e.kind == EventKind.Detector && e.state == DetectorState.Alarm)
    val first   = records.reverseIterator.map(e => e.position -> e.masterTime).toMap
    val earlier = smoke.filter { case (_, time) => report.time - time <= RecentUs }
    val isOn    = (report.status & MasterStatus.Fire) != 0
    // A slave that does not answer any more burns until the master's fire is over.
    def burns(s: Reported, position: Int) =
      if (s.has(SlaveStatus.Absent)) isOn && (s.has(Burning) || fires.contains(position)) else s.has(Burning)
    val burning = report.slaves.zipWithIndex.collect { case (s, i) if burns(s, i) => i } ++
      fires.keys.filter(i => isOn && i >= report.slaves.size)
    def since(position: Int): Instant =
      former
        .get(position)
        .filter(_ => report.time <= StartUs)
        .orElse(
          (earlier.get(position) ++ first.get(position)).minOption
            .map(time => now.minusNanos((report.time - time).max(0) * 1000))
        )
        .getOrElse(now)
    LineState(
      report.slaves,
      report.status,
      report.present,
      report.cut,
      report.lost,
      report.selfTest,
      report.refused,
      burning.map(i => i -> fires.getOrElse(i, since(i))).toMap,
      earlier ++ records.map(e => e.position -> e.masterTime),
      report.events.foldLeft(details)(withDetail),
      former
    )
  }

  /** Nothing is known of the line in a new life of the master, but since when it burnt. */
  def renewed: LineState = LineState(former = fires)

  /** Positions of slaves of which one of these bits is 1, absent ones too. */
  def positions(bits: Int): Set[Int] = slaves.indices.filter(slaves(_).has(bits)).toSet

  /** Positions of slaves that answer with a node ID. */
  def answering(node: Int): Vector[Int] =
    slaves.zipWithIndex.collect {
      case (s, i) if s.node == node && !s.has(SlaveStatus.Absent) && !s.isOrdinary => i
    }
}

object LineState {
  private val Burning = SlaveStatus.Alarm | SlaveStatus.Latched

  /** An alarm record is the beginning of a fire that a report tells at most so much later, us. */
  private val RecentUs = 10000000L

  /** So long after its start, us, a master is still getting to know its slaves. */
  private val StartUs = 60000000L

  private def withDetail(details: Map[Int, Detail], e: Event): Map[Int, Detail] =
    if (e.kind != EventKind.Slave) details
    else {
      val before = details.get(e.position).filter(_.node == e.node)
      def owed(d: Detail) =
        (d.status & SlaveStatus.Absent) != 0 && (d.status & SlaveStatus.Waiting) != 0 && d.epoch != e.epoch
      val lost = before.exists(d => d.lostRecords || owed(d))
      details.updated(
        e.position,
        Detail(e.node, e.state, (e.slaveTime >> 8 & 0xff).toInt, e.epoch, e.sequence, lost)
      )
    }

  /** The line as the log tells it (SRV-08): for masters that have not reported since the server's start.
    *
    * @param states
    *   what was told last of each slave, and of the master
    * @param alarms
    *   when the last alarm of each detector came, by position
    */
  def fromLog(states: Seq[Event], alarms: Map[Int, Instant], now: Instant): LineState = {
    val slaves = states.filter(_.kind == EventKind.Slave).map(e => e.position -> e).toMap
    val size   = slaves.keys.maxOption.fold(0)(_ + 1)
    // None is left out unless the log has a gap.
    val listed = Vector.tabulate(size)(i =>
      slaves.get(i).fold(Reported(SlaveStatus.Absent, 0))(e => Reported(e.sequence, e.node))
    )
    val line = states
      .findLast(_.kind == EventKind.Line)
      .fold(LineState())(e =>
        LineState(
          status = EventText.masterStatus(e),
          present = e.position,
          cut = e.node,
          lost = e.slaveTime
        )
      )
    line.copy(
      slaves = listed,
      fires = listed.zipWithIndex.collect {
        case (s, i) if s.has(Burning) => i -> alarms.getOrElse(i, now)
      }.toMap,
      details = states.foldLeft(Map.empty[Int, Detail])(withDetail)
    )
  }
}
