package flyframe.server

import java.net.InetAddress
import scala.collection.mutable

/** Why a datagram was ignored; each kind is counted. */
sealed abstract class Refusal(val name: String)
object Refusal {

  /** No report. */
  case object Malformed extends Refusal("malformed")

  /** Longer than any report. */
  case object Oversized extends Refusal("oversized")

  /** Of a master that is not on the list, at another address, or without a key; or of one more than there may
    * be.
    */
  case object Foreign extends Refusal("foreign")

  /** With a wrong tag. */
  case object Forged extends Refusal("forged")

  /** With a counter that is not higher than the last one, or of a life that is over. */
  case object Replayed extends Refusal("replayed")

  /** By a master that does not know this life of the server. */
  case object Unproven extends Refusal("unproven")

  val all: Seq[Refusal] = Seq(Malformed, Oversized, Foreign, Forged, Replayed, Unproven)
}

/** Which reports count (SRV-10, SRV-11): those with a right tag, by a master that knows this life of the
  * server, with a higher counter than those before. Not for several threads.
  *
  * @param clockMs
  *   see [[Supervisor]]
  */
final class Admission(options: Options, keys: Keys, clockMs: () => Long) {
  import Admission._
  private val heard  = mutable.Map.empty[Int, Heard]
  private val doubts = mutable.Map.empty[Int, Doubts]

  /** The report in a datagram, if one of our masters has made it, of whatever age. */
  def authentic(datagram: Array[Byte], from: InetAddress): Either[Refusal, Sent] = for {
    _ <- Either.cond(datagram.length <= Protocol.MostReportBytes, (), Refusal.Oversized)
    report <- Protocol
      .report(datagram)
      .orElse[Sent](RingProtocol.report(datagram))
      .toRight(Refusal.Malformed)
    id     = report.life.master
    onList = options.masters.isEmpty || options.masters.get(id).contains(from)
    key <- keys.of(id).filter(_ => onList).toRight(Refusal.Foreign)
    _   <- Either.cond(isRight(report, datagram, key), (), Refusal.Forged)
  } yield report

  private def isRight(sent: Sent, datagram: Array[Byte], key: Array[Byte]): Boolean = sent match {
    case r: Report     => Protocol.isRight(r, datagram, key)
    case r: RingReport => RingProtocol.isRight(r, datagram, key)
    case _             => false
  }

  /** A report by a master that does not know this life of the server, so it may be of any age.
    *
    * @return
    *   an answer is due, by which the master learns it
    */
  def doubt(report: Sent): Boolean = {
    val (id, now) = (report.life.master, clockMs())
    val before    = doubts.getOrElse(id, Doubts(now, now, proven = true))
    val isOver    = before.proven || now - before.lastMs > options.masterTimeoutMs
    // The master's own reports have the highest counters: older ones, which anybody can send again, must not
    // take their answers.
    val isFresh = report.counter > before.counters.getOrElse(report.life.number, 0L)
    val due     = before.answeredMs.get(isFresh).forall(now - _ >= AnswerDoubtMs)
    doubts(id) = Doubts(
      if (isOver) now else before.sinceMs,
      now,
      proven = false,
      if (isFresh) before.counters.updated(report.life.number, report.counter) else before.counters,
      if (due) before.answeredMs.updated(isFresh, now) else before.answeredMs
    )
    due
  }

  /** A report by a master that knows this life of the server: it counts if it is newer than those before, and
    * there is room for its master.
    */
  def admit(report: Sent, room: Boolean): Either[Refusal, Unit] = {
    val (id, number) = (report.life.master, report.life.number)
    val lives = heard.get(id) match {
      case None => Some(Heard(number, report.counter, Set.empty))
      case Some(h) if h.current == number =>
        Option.when(report.counter > h.counter)(h.copy(counter = report.counter))
      case Some(h) => Option.when(!h.over(number))(Heard(number, report.counter, h.over + h.current))
    }
    for {
      now <- lives.filter(_ => report.counter != 0).toRight(Refusal.Replayed)
      _   <- Either.cond(room, (), Refusal.Foreign)
    } yield {
      heard(id) = now
      doubts.updateWith(id)(_.map(_.copy(proven = true)))
    }
  }

  /** Reports of the master come, and none of them has been proven for longer than a master may be silent. */
  def isUnproven(master: Int): Boolean = {
    val now = clockMs()
    doubts
      .get(master)
      .exists(d =>
        !d.proven && now - d.lastMs <= options.masterTimeoutMs && now - d.sinceMs > options.masterTimeoutMs
      )
  }

  /** All such masters. */
  def unproven: Iterable[Int] = doubts.keys.filter(isUnproven)
}

object Admission {

  /** Between two answers to unproven reports of a master, for each of two kinds: so ten a second, ms. */
  private val AnswerDoubtMs = 200L

  /** Lives of a master that were proven since the start of the server.
    *
    * @param counter
    *   of the last report of the current one
    */
  private final case class Heard(current: Long, counter: Long, over: Set[Long])

  /** Reports of a master that were not proven.
    *
    * @param proven
    *   one was since
    * @param counters
    *   the highest one of each life
    * @param answeredMs
    *   when one with a higher counter than before was answered last, and one without
    */
  private final case class Doubts(
      sinceMs: Long,
      lastMs: Long,
      proven: Boolean,
      counters: Map[Long, Long] = Map.empty,
      answeredMs: Map[Boolean, Long] = Map.empty
  )
}
