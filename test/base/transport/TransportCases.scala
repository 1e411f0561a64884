package flyframe.transport

import org.scalatest.flatspec.AnyFlatSpec
import scala.collection.mutable

/** What all suites have that run on any transport. */
abstract class TransportCases extends AnyFlatSpec {
  import TransportCases._

  protected def withTransport(p: TransportParams, start: Long)(body: TransportUnderTest => Unit): Unit

  /** Runs a test with node 2, life 7. */
  protected def node(p: TransportParams = TransportParams(Own, life = 7))(body: Bench => Unit): Unit =
    withTransport(p, Start)(t => body(new Bench(t)))
}

object TransportCases {
  val Own   = 2
  val Peer  = 23
  val Life  = 5 // of the peer
  val Start = 1000L

  def ms(n: Double): Long = (1000 * n).toLong

  /** A message of which every byte tells its place. */
  def message(length: Int, salt: Int = 0): IndexedSeq[Int] =
    IndexedSeq.tabulate(length)(i => i * 7 + i / 256 + salt & 0xff)

  def id(code: Int, pipe: Int = 0, urgent: Boolean = false, to: Int = Own, from: Int = Peer): FrameId =
    FrameId(urgent, to, isData = false, from, code, pipe, end = true)

  def short(number: Int, data: Seq[Int], pipe: Int = 0, life: Int = Life, urgent: Boolean = false): BusFrame =
    BusFrame(id(Code.Short, pipe, urgent), Seq(number, life) ++ data)
  def open(number: Int, data: Seq[Int], pipe: Int = 0, life: Int = Life, urgent: Boolean = false): BusFrame =
    openOf(number, data.size, Sizes.crc32(data), pipe, life, urgent)
  def openOf(
      number: Int,
      length: Int,
      crc: Int,
      pipe: Int = 0,
      life: Int = Life,
      urgent: Boolean = false
  ): BusFrame = BusFrame(
    id(Code.Open, pipe, urgent),
    Seq(number, life, length - 1 >> 8 & 0xff, length - 1 & 0xff) ++ (24 to 0 by -8).map(crc >> _ & 0xff)
  )

  /** The data frames of a message. */
  def parts(data: Seq[Int], pipe: Int = 0, urgent: Boolean = false, to: Int = Own): IndexedSeq[BusFrame] = {
    val all = data.grouped(8).toIndexedSeq
    all.zipWithIndex.map { case (part, i) =>
      BusFrame(FrameId(urgent, to, isData = true, Peer, i, pipe, end = i == all.size - 1), part)
    }
  }

  // What the peer says to messages of the node.
  def done(number: Int, result: Int = 0, pipe: Int = 0, life: Int = 7, from: Int = Peer): BusFrame =
    BusFrame(id(Code.Done, pipe, from = from), Seq(number, life, Life, result))
  def busy(number: Int, wait: Int, pipe: Int = 0, from: Int = Peer): BusFrame =
    BusFrame(id(Code.Busy, pipe, from = from), Seq(number, 7, wait))
  def unknown(pipe: Int = 0, from: Int = Peer): BusFrame =
    BusFrame(id(Code.Unknown, pipe, from = from), Seq(0))
  def missing(number: Int, first: Int, map: Long, pipe: Int = 0, from: Int = Peer): BusFrame = BusFrame(
    id(Code.Missing, pipe, from = from),
    Seq(number, 7, first) ++ (32 to 0 by -8).map(s => (map >> s & 0xff).toInt)
  )

  def code(f: BusFrame): Int        = FrameId.of(f.id).number
  def isData(f: BusFrame): Boolean  = FrameId.of(f.id).isData
  def isHello(f: BusFrame): Boolean = !isData(f) && code(f) == Code.Hello

  /** A transport in time, and a port of which frames leave at once, unless they are held. */
  class Bench(val t: TransportUnderTest) {
    var now: Long       = Start
    var isHeld: Boolean = false
    private val held    = mutable.Buffer.empty[BusFrame]
    private val log     = mutable.Buffer.empty[(Long, BusFrame)]
    private val over    = mutable.Buffer.empty[Ended]

    /** When the transport wants to be called again. */
    def due: Long     = dueAt
    private var dueAt = Start

    private def settle(): Long = {
      var due   = t.poll(now)
      var fresh = t.queued()
      var gone  = t.aborted()
      while (fresh.nonEmpty || gone.nonEmpty) {
        log ++= fresh.filterNot(isHello).map(now -> _)
        if (isHeld) held ++= fresh else fresh.foreach(f => t.left(f.id))
        takeBack(gone)
        due = t.poll(now)
        fresh = t.queued()
        gone = t.aborted()
      }
      over ++= t.ended()
      dueAt = due
      due
    }

    /** Held frames are not on the wire. */
    private def takeBack(ids: Seq[Int]): Unit = for (id <- ids) {
      assert(held.exists(_.id == id), "a frame that does not wait is taken back")
      leave(_.id == id)
    }

    private def drain[A](buffer: mutable.Buffer[A]): Seq[A] = {
      val all = buffer.toList
      buffer.clear()
      all
    }

    /** Lets time pass, and tells what the node has sent in it, and when; HELLO left out. */
    def runTimed(us: Long): Seq[(Long, BusFrame)] = {
      val end = now + us
      var due = settle()
      while (due <= end) {
        now = due max now
        due = settle()
      }
      now = end
      settle()
      drain(log)
    }
    def run(us: Long = 0): Seq[BusFrame] = runTimed(us).map(_._2)

    /** Frames come; what the node sends then. */
    def hear(frames: BusFrame*): Seq[BusFrame] = {
      frames.foreach(t.receive(_, now))
      run()
    }

    /** Frames that are held leave: those chosen, or all. */
    def leave(chosen: BusFrame => Boolean = _ => true): Unit = {
      val (gone, kept) = drain(held).partition(chosen)
      held ++= kept
      gone.foreach(f => t.left(f.id))
    }
    def waiting: Seq[BusFrame] = held.toList

    /** The one that is first in CAN order. */
    def first: Option[BusFrame] = held.minByOption(_.id)

    def send(
        data: Seq[Int],
        tag: Int = 1,
        to: Int = Peer,
        urgent: Boolean = false,
        members: Option[Set[Int]] = None
    ): Seq[BusFrame] = {
      assert(t.send(tag, to, urgent, data, now, members), "the message was not taken")
      run()
    }

    def ended(): Seq[Ended] = drain(over)

    /** The host takes the next message. */
    def take(refused: Boolean = false): Received = {
      val m = t.received.getOrElse(throw new AssertionError("no message for the host"))
      t.take(now, refused)
      m
    }

    def counts: Map[Counter.Value, Int] =
      Counter.values.toSeq.map(c => c -> t.count(c)).filter(_._2 != 0).toMap
  }
}

trait OnModel { self: TransportCases =>
  protected def withTransport(p: TransportParams, start: Long)(body: TransportUnderTest => Unit): Unit =
    body(new TransportModel(p, start))
}

trait InC { self: TransportCases =>
  protected def withTransport(p: TransportParams, start: Long)(body: TransportUnderTest => Unit): Unit = {
    val node = new NodeInC(p, start)
    body(node)
    node.release() // one that failed is not used again
  }
}

class SenderRulesSpec      extends SenderRules with OnModel
class SenderRulesInCSpec   extends SenderRules with InC
class ReceiverRulesSpec    extends ReceiverRules with OnModel
class ReceiverRulesInCSpec extends ReceiverRules with InC
class StationRulesSpec     extends StationRules with OnModel
class StationRulesInCSpec  extends StationRules with InC
class LiesSpec             extends LieRules with OnModel
class LiesInCSpec          extends LieRules with InC
