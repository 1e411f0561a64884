package flyframe.server

import java.net.InetSocketAddress
import java.sql.SQLException
import java.time.Instant
import scala.collection.mutable

/** Why a datagram was ignored; each kind is counted. */
sealed abstract class Refusal(val name: String)
object Refusal {

  /** No report. */
  case object Malformed extends Refusal("malformed")

  /** Longer than any report. */
  case object Oversized extends Refusal("oversized")

  /** Of a master that is not on the list, or at another address; or of one more than there may be. */
  case object Foreign extends Refusal("foreign")

  /** In the name of a master that reports from another address. */
  case object Forged extends Refusal("forged")

  /** Not younger than a report that came before, or of an earlier life. */
  case object Replayed extends Refusal("replayed")

  val all: Seq[Refusal] = Seq(Malformed, Oversized, Foreign, Forged, Replayed)
}

/** A master as the server knows it.
  *
  * @param address
  *   where its reports come from; None: none has come since the start of the server
  * @param heardMs
  *   when the last one came, monotonic; `heard`: the same as a time of day
  * @param begunMs
  *   when the first report of this life came, monotonic
  * @param missing
  *   numbers of events that the master has no more and the log has not
  */
final case class Master(
    life: Life,
    line: LineState,
    last: Report,
    heard: Instant,
    heardMs: Long = 0,
    begunMs: Long = 0,
    address: Option[InetSocketAddress] = None,
    missing: Option[(Long, Long)] = None
)

/** The masters and what comes from them: which reports count, the log, the lines, the commands (SRV-05 to
  * SRV-14). For several threads.
  *
  * @param send
  *   sends a datagram
  * @param changed
  *   called, under the lock, when something has changed that the page shows
  * @param clockMs
  *   a clock that never jumps, milliseconds
  * @param timeOfDay
  *   the other one, which the log goes by
  */
final class Supervisor(
    options: Options,
    key: Option[Array[Byte]],
    store: EventStore,
    send: (Array[Byte], InetSocketAddress) => Unit,
    changed: () => Unit,
    clockMs: () => Long = () => System.nanoTime() / 1000000,
    timeOfDay: () => Instant = () => Instant.now
) {
  import Supervisor._
  private val masters  = mutable.LinkedHashMap.empty[Int, Master]
  private val commands = mutable.Map.empty[Int, Commands]
  private val silent   = mutable.Set.empty[Int]
  private val refused  = mutable.Map.empty[Refusal, Long].withDefaultValue(0L)
  private var broken   = Option.empty[String]

  // After a start: what the log tells. No master has reported yet.
  for (r <- store.youngest.take(MostMasters).reverse) {
    masters(r.life.master) = Master(r.life, lineOf(r.life), Report(r.life, r.next, time = r.time), r.heard)
    silent += r.life.master
  }

  private def lineOf(life: Life): LineState = Iterator
    .unfold(0L) { from =>
      val page = store.ofLife(life, from, 1000)
      page.lastOption.map(last => (page, last.number + 1))
    }
    .flatten
    .foldLeft(LineState(detectors = store.detectors(life.master)))((line, entry) => line.after(entry.event))

  /** A datagram has come. What it brings is stored and acknowledged, or it is counted and ignored. */
  def receive(datagram: Array[Byte], from: InetSocketAddress): Unit = synchronized {
    val result =
      if (datagram.length > Protocol.MostReportBytes) Left(Refusal.Oversized)
      else
        Protocol
          .report(datagram)
          .toRight(Refusal.Malformed)
          .flatMap(r => admit(r, from).map(take(r, from, _)))
    result.left.foreach(count)
  }

  private def count(why: Refusal): Unit = {
    refused(why) += 1
    changed()
  }

  /** Whether a report counts (SRV-10, SRV-11), and what is known of its master. */
  private def admit(report: Report, from: InetSocketAddress): Either[Refusal, Option[Master]] = {
    val known  = masters.get(report.life.master)
    val onList = options.masters.isEmpty || options.masters.get(report.life.master).contains(from.getAddress)
    val room   = known.nonEmpty || masters.size < MostMasters || silent.nonEmpty
    known match {
      case _ if !onList || !room                                => Left(Refusal.Foreign)
      case Some(m) if !isSilent(m) && !m.address.contains(from) => Left(Refusal.Forged)
      case Some(m) if m.life == report.life => fresh(report, m.last.time, m.heard).map(_ => known)
      case Some(m) if !isSilent(m) && clockMs() - m.begunMs < LeastLifeMs => Left(Refusal.Replayed)
      case _ =>
        store.record(report.life) match {
          case None                                  => Right(known)
          case Some(_) if known.exists(!isSilent(_)) => Left(Refusal.Replayed)
          case Some(r)                               => fresh(report, r.time, r.heard).map(_ => known)
        }
    }
  }

  /** A report is younger than one of the same life that came at `when` and had the master's time `time`. */
  private def fresh(report: Report, time: Long, when: Instant): Either[Refusal, Unit] = {
    val comparable = timeOfDay().toEpochMilli - when.toEpochMilli < ComparableMs
    Either.cond(!comparable || (report.time - time).toInt > 0, (), Refusal.Replayed)
  }

  private def take(report: Report, from: InetSocketAddress, before: Option[Master]): Unit = logged {
    val life    = report.life
    val now     = timeOfDay()
    val held    = before.filter(_.life == life).getOrElse(begin(report, now))
    val entries = store.append(report, now)
    val next    = store.record(life).get.next
    broken = None
    masters(life.master) = held.copy(
      line = entries.foldLeft(held.line)((line, e) => line.after(e.event)),
      last = report.copy(events = Vector.empty),
      heard = now,
      heardMs = clockMs(),
      address = Some(from),
      missing = Option.when(report.first > next)((next, report.first - 1))
    )
    silent -= life.master
    entries.foreach(e => commandsOf(life.master).foreach(_.told(life, e.event)))
    if (report.events.nonEmpty) send(Protocol.acknowledgement(life, next), from)
    changed()
  }

  /** Does what needs the log. If that fails the master gets no answer and repeats what it has to tell. */
  private def logged(body: => Unit): Unit =
    try body
    catch {
      case e: SQLException =>
        broken = Some(s"The log cannot be written (${e.getMessage}).")
        changed()
    }

  /** Another life of a master, or a master that is new. */
  private def begin(report: Report, now: Instant): Master = {
    val life = report.life
    store.begin(life, report.first)
    if (!masters.contains(life.master) && masters.size >= MostMasters) {
      val gone = masters.keys.find(silent).get
      masters -= gone
      silent -= gone
      commands -= gone
    }
    masters.get(life.master).foreach(remember)
    commands.get(life.master).foreach(_.abandon())
    Master(life, lineOf(life), report, now, begunMs = clockMs())
  }

  private def remember(m: Master): Unit = if (m.address.nonEmpty) store.remember(m.life, m.last.time, m.heard)

  /** To be called at the end: what a later start is to know. */
  def close(): Unit = synchronized(logged(masters.values.foreach(remember)))

  private def isSilent(m: Master): Boolean =
    m.address.isEmpty || clockMs() - m.heardMs > options.masterTimeoutMs

  private def commandsOf(master: Int): Option[Commands] = key.map { k =>
    commands.getOrElseUpdate(
      master,
      new Commands(k, options.commandIntervalMs, options.commandTries, store.nextCounter)
    )
  }

  /** An operator's command; Left: why it cannot be sent. */
  def order(master: Int, code: Int, node: Int): Either[String, Order] = synchronized {
    for {
      m     <- masters.get(master).toRight(s"There is no master $master.")
      queue <- commandsOf(master).toRight("The server was started without a key, so it sends no commands.")
      _     <- Either.cond(!isSilent(m), (), s"Master $master is silent.")
      order <- queue.add(m.life, code, node)
    } yield {
      tick()
      changed()
      order
    }
  }

  /** To be called often: sends commands, again if need be, and notices masters that have become silent. */
  def tick(): Unit = synchronized {
    val now = clockMs()
    for ((id, queue) <- commands; m <- masters.get(id); address <- m.address) {
      logged {
        val (datagram, news) = queue.tick(now)
        datagram.foreach(send(_, address))
        if (news) changed()
      }
    }
    for ((id, m) <- masters if isSilent(m) && silent.add(id)) changed()
  }

  /** All there is to be shown. */
  def picture: Picture = synchronized {
    Picture(
      masters.values.toVector.sortBy(_.life.master).map { m =>
        Picture.Seen(m, isSilent(m), commands.get(m.life.master).fold(Seq.empty[Order])(_.all))
      },
      Refusal.all.map(r => r.name -> refused(r)),
      key.nonEmpty,
      broken
    )
  }
}

object Supervisor {

  /** Masters at a time. */
  val MostMasters = 8

  /** A master does not restart more often. */
  private val LeastLifeMs = 1000L

  /** For so long times of a master can be compared: half of the 2^32 us after which they begin anew. */
  private val ComparableMs = (1L << 31) / 1000
}
