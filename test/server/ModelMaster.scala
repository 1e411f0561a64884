package flyframe.server

import java.net.DatagramSocket
import scala.collection.mutable
import scala.util.Random
import flyframe.protocol.{CommandResult, EventKind, MasterStatus, Order, ServerDatagram, SlaveStatus}

/** A master as the server sees it (REP-01 to REP-06), with its host and the network in between.
  *
  * @param key
  *   16 bytes
  * @param faults
  *   how likely a datagram is lost, comes twice or comes late, each, in both directions
  */
final class ModelMaster(
    val life: Life,
    port: Int,
    key: Array[Byte] = ServerBench.key,
    faults: Double = 0,
    random: Random = new Random(1),
    socket: DatagramSocket = ModelStation.socket()
) extends ModelStation(port, faults, random, socket) {
  private val kept    = mutable.Buffer.empty[Event]
  private var first   = 0L
  private var counter = 0L // of the last report
  private var echo    = 0L // of the last answer taken
  private var ticket  = 0L // of the last order taken
  private var known   = 0L // life of the server
  private val started = System.nanoTime()

  // Numbers of reports by which the server that answers had learnt all there is to tell.
  private var told      = Long.MaxValue
  private val knownThen = mutable.Map.empty[Long, Long]

  /** What is told of the line. */
  private var slaves = Vector.empty[Reported]
  private var status = MasterStatus.Unlisted

  /** Orders taken; datagrams that were no answers with a right tag. */
  val orders  = mutable.Buffer.empty[Answer]
  var refused = 0

  /** Events that are not acknowledged yet; all there ever were. */
  def waiting: Int = kept.size
  def all: Long    = first + kept.size

  /** The server has the present states, and has answered by the life that the master knew. */
  def isProven: Boolean = told != Long.MaxValue && echo >= told

  /** us since the start */
  def time: Long = (System.nanoTime() - started) / 1000 + 1

  def happen(events: Event*): Unit = kept ++= events

  /** The line has another state. */
  def line(states: Reported*): Unit = {
    slaves = states.toVector
    status = ModelMaster.statusOf(slaves)
    told = Long.MaxValue
  }
  def slave(position: Int, status: Int): Unit = line(
    slaves.updated(position, slaves(position).copy(status)): _*
  )

  /** Sends a report: states, and the oldest events. */
  def report(): Unit = {
    counter += 1
    knownThen(counter) = known
    val events  = kept.take(ServerDatagram.Most).toVector
    val present = slaves.count(!_.has(SlaveStatus.Absent))
    val report  = Report(life, known, counter, first, events, slaves, time, status, present = present)
    send(Protocol.encode(report, key))
  }

  /** Reports and listens until the server has all states and events, or for a minute. */
  def settle(repeatMs: Int = 10): Unit = {
    val end = System.nanoTime() + 60000000000L
    while ((kept.nonEmpty || !isProven) && System.nanoTime() < end) {
      report()
      listen(repeatMs)
    }
  }

  protected def take(datagram: Array[Byte]): Unit =
    Protocol.answer(datagram, key).filter(_.life == life) match {
      case None => refused += 1
      case Some(a) =>
        if (a.echo > echo) {
          echo = a.echo
          known = a.server
          if (told == Long.MaxValue && knownThen(echo) == known) told = echo
          knownThen.keys.filter(_ < echo).toSeq.foreach(knownThen.remove)
          if (a.number > first && a.number <= first + kept.size) {
            kept.remove(0, (a.number - first).toInt)
            first = a.number
          }
          if (a.order != Order.None && a.ticket != ticket) {
            ticket = a.ticket
            orders += a
            happen(Event(EventKind.Command, a.order, a.node, (a.ticket & 0xffff).toInt, CommandResult.Done))
          }
        }
    }
}

object ModelMaster {

  /** A line whose slaves have these states, and node IDs 1, 2, ... */
  def line(states: Int*): Seq[Reported] = states.zipWithIndex.map { case (s, i) => Reported(s, i + 1) }

  /** Status of a master whose line is such. */
  def statusOf(slaves: Seq[Reported]): Int = {
    def when(bits: Int, status: Int) = if (slaves.exists(_.has(bits))) status else 0
    when(SlaveStatus.Alarm, MasterStatus.Alarm) | when(SlaveStatus.Faults, MasterStatus.SlaveFault) |
      when(SlaveStatus.Alarm | SlaveStatus.Latched, MasterStatus.Fire) |
      when(SlaveStatus.Sounding, MasterStatus.Sounding) |
      when(SlaveStatus.Disabled, MasterStatus.Disabled) | when(SlaveStatus.Testing, MasterStatus.Testing)
  }
}
