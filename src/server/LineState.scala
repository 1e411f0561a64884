package flyframe.server

import flyframe.protocol.DetectorState
import flyframe.protocol.EventKind

/** What a detector has told last. The epoch is another one after a restart of its slave. */
final case class Detected(state: Int, epoch: Int)

/** A slave on the list of its master.
  *
  * @param answers
  *   false: it is lost
  * @param selfTest
  *   0 not run, 1 good, else what failed
  * @param links
  *   its DL status (0x0110)
  * @param twin
  *   position of a slave before it with the same node ID
  * @param before
  *   ID of the slave before it, if its own is not the next one
  */
final case class Slave(
    node: Int,
    answers: Boolean,
    selfTest: Int,
    links: Int,
    epoch: Int,
    twin: Option[Int] = None,
    before: Option[Int] = None
)

/** A line as the events of its master tell it (SRV-09). Nothing but events changes it.
  *
  * @param slaves
  *   by position, the first at the master; of this life of the master
  * @param detectors
  *   by node ID: so the master knows them too; of all its lives
  * @param beyond
  *   slaves that answer behind the last one the master can list
  */
final case class LineState(
    slaves: Vector[Slave] = Vector.empty,
    detectors: Map[Int, Detected] = Map.empty,
    beyond: Int = 0
) {

  /** The line after the event. */
  def after(e: Event): LineState = e.kind match {
    case EventKind.Detector  => withDetector(e)
    case EventKind.Scanned   => copy(beyond = (e.node - e.position) max 0)
    case EventKind.Present   => withSlave(e)
    case EventKind.Found     => withSlave(e)
    case EventKind.Lost      => changed(e)(_.copy(answers = false))
    case EventKind.Duplicate => changed(e)(_.copy(twin = Some(e.sequence)))
    case EventKind.Gap       => changed(e)(_.copy(before = Some(e.sequence)))
    case _                   => this
  }

  /** State of the detector of the slave at a position, if it has told one since the slave's start. */
  def detector(position: Int): Option[Int] = {
    val slave = slaves(position)
    // What a slave says whose ID another one has too counts for that one: they cannot be told apart.
    if (slave.twin.nonEmpty) None
    else detectors.get(slave.node).filter(_.epoch == slave.epoch).map(_.state)
  }

  /** Detectors in alarm, also of lost slaves. */
  def alarms: Vector[Int] = slaves.indices.filter(detector(_).contains(DetectorState.Alarm)).toVector

  // A slave that has restarted without being missed is known by the epoch of its records.
  private def withDetector(e: Event) =
    changed(e)(s => if (s.node == e.node) s.copy(epoch = e.epoch) else s)
      .copy(detectors = detectors.updated(e.node, Detected(e.state, e.epoch)))

  private def withSlave(e: Event) = {
    val slave = Slave(e.node, answers = true, selfTest = e.state, links = e.sequence, epoch = e.epoch)
    // Slaves are reported in order; one that is missing in between would be an error of the master.
    if (e.position < slaves.size) copy(slaves = slaves.updated(e.position, slave))
    else if (e.position == slaves.size) copy(slaves = slaves :+ slave)
    else this
  }

  private def changed(e: Event)(change: Slave => Slave) =
    if (e.position < slaves.size) copy(slaves = slaves.updated(e.position, change(slaves(e.position))))
    else this
}

object LineState {

  /** What is written on the detector at a position, from 0: 1A, 1B, 2A, ... */
  def label(position: Int): String = s"${position / 2 + 1}${if (position % 2 == 0) "A" else "B"}"
}
