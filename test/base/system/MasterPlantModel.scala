package flyframe.system

import scala.collection.mutable
import flyframe.protocol._

/** The plant side of a [[MasterModel]]: the memory of events that wait for the server, reports, and what
  * answers change. Times in us.
  *
  * @param started
  *   when the master started
  * @param changed
  *   called when something is other than before
  */
final class MasterPlantModel(settings: MasterSettings, life: Long, started: Long, changed: () => Unit) {
  import MasterPlantModel._

  private val events      = mutable.Queue.empty[Event]
  private var firstEvent  = 0
  private var full        = false
  private var reports     = 0
  private var lastReport  = started - settings.heartbeat
  private var reportNow   = true
  private var lastAnswer  = started
  private var lastEcho    = 0
  private var serverLife  = 0L
  private var serverQuiet = false
  private var refused     = 0
  private var lastTicket  = 0

  /** Orders of the server for the host. */
  val mailbox: mutable.Queue[Answer] = mutable.Queue.empty

  def waiting: Int            = events.size
  def first: Int              = firstEvent
  def nextEvent: Int          = firstEvent + events.size
  def isFull: Boolean         = full
  def isServerSilent: Boolean = serverQuiet

  def hasRoomForRecords: Boolean = events.size < RecordsRoom
  def hasRoomForStates: Boolean  = events.size < StatesRoom

  /** The mark that the memory is full has a hysteresis. */
  def countFull(): Unit = full = if (full) events.size >= FullEnds else events.size >= FullBegins

  def emit(event: Event): Unit = {
    events += event
    reportNow = true
    changed()
  }

  /** The next report does not wait for the heartbeat. */
  def reportSoon(): Unit = reportNow = true

  /** Is the server silent now? */
  def watch(now: Long): Unit = if (!serverQuiet && now - lastAnswer > settings.serverTimeout) {
    serverQuiet = true
    changed()
  }

  /** When something happens next without the line. */
  def due(now: Long): Long = {
    val report =
      if (reportNow) now max (lastReport + ReportGap)
      else lastReport + (if (events.nonEmpty) settings.repeat min settings.heartbeat else settings.heartbeat)
    if (serverQuiet) report else report min (lastAnswer + settings.serverTimeout + 1)
  }

  /** A report with what the master knows, if one is due. */
  def report(
      now: Long
  )(status: => Int, lost: Int, present: Int, cut: Int, slaves: => Seq[ReportedSlave]): Option[Report] = {
    val since = now - lastReport
    Option.when(
      reportNow && since >= ReportGap || since >= settings.heartbeat ||
        events.nonEmpty && since >= settings.repeat
    ) {
      reportNow = false
      lastReport = now
      reports += 1
      Report(
        settings.id,
        life,
        serverLife,
        reports,
        firstEvent,
        now - started,
        status,
        lost,
        present,
        cut,
        refused,
        slaves,
        events.take(ServerDatagram.Most).toSeq
      )
    }
  }

  /** An answer has come. What is not right changes nothing but a counter. */
  def answer(a: Answer, now: Long): Unit = {
    if (a.genuine && a.life == life && Integer.compareUnsigned(a.echo, lastEcho) > 0) {
      lastEcho = a.echo
      if (!a.trouble) {
        lastAnswer = now
        if (serverQuiet) {
          serverQuiet = false
          reportNow = true
          changed()
        }
      }
      if (a.server != serverLife) {
        serverLife = a.server
        reportNow = true
        changed()
      }
      val done = a.number - firstEvent
      if (done > 0 && done <= events.size) {
        events.dropInPlace(done)
        firstEvent = a.number
        if (events.nonEmpty) reportNow = true
        changed()
      }
      if (
        a.order != Order.None && a.ticket != lastTicket && reports - a.echo <= OrderAge && mailbox.isEmpty
      ) {
        lastTicket = a.ticket
        mailbox.enqueue(a)
        changed()
      }
    } else refused = (refused + 1) min 255
  }

  /** The host has carried out an order. */
  def commanded(order: Answer, result: Int, now: Long): Unit =
    if (events.size < Places)
      emit(Event(EventKind.Command, order.order, order.node, order.ticket & 0xffff, result, 0, 0, now))
}

object MasterPlantModel {

  // Event memory.
  val Places      = 128
  val RecordsRoom = 120
  val StatesRoom  = 64
  val FullBegins  = 64
  val FullEnds    = 32

  /** Between two reports in us. */
  val ReportGap = 1000L

  /** How many reports an order may be behind. */
  val OrderAge = 16
}
