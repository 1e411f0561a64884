package flyframe.transport

import flyframe.can.{Crc15, StuffingModel}
import scala.collection.mutable

/** An idealised CAN bus: without errors and delays, and the frame first in CAN order goes next. Hosts take at
  * once what comes, unless they are busy.
  *
  * @param kbps
  *   its bit rate
  * @param make
  *   a node's transport
  */
class CanBus(kbps: Int, make: TransportParams => TransportUnderTest) {
  import CanBus._
  import TransportCases._

  private val nodes = mutable.LinkedHashMap.empty[Int, Bench]
  private val busy  = mutable.Set.empty[Int]
  private val sent  = mutable.Map.empty[String, Long].withDefaultValue(0L)
  var now: Long     = Start

  /** Messages that hosts have taken: who, and what. */
  val taken = mutable.Buffer.empty[(Int, Received)]

  def start(address: Int): Bench = {
    val b = new Bench(make(TransportParams(address, life = 7, kbps = kbps)))
    b.isHeld = true
    nodes(address) = b
    look(b)
    b
  }
  def stop(address: Int): Unit        = nodes.remove(address).foreach(b => release(b.t))
  def apply(address: Int): Bench      = nodes(address)
  def hostIsBusy(address: Int): Unit  = busy += address
  def hostIsThere(address: Int): Unit = { busy -= address; look(nodes(address)) }
  def addresses: Set[Int]             = nodes.keySet.toSet
  def members(address: Int): Set[Int] = nodes(address).t.members(now)
  def close(): Unit                   = nodes.values.foreach(b => release(b.t))

  private def release(t: TransportUnderTest): Unit = t match {
    case c: NodeInC => c.release()
    case _          =>
  }

  /** The part of the time since the last call in which frames of a kind were on the bus. */
  def load(): Map[String, Double] = {
    val shares = sent.map { case (kind, bits) => kind -> bits * 1000.0 / kbps / (now - loadFrom) }.toMap
    sent.clear()
    frames.clear()
    loadFrom = now
    shares.withDefaultValue(0.0)
  }
  private var loadFrom = Start

  /** Frames of a kind since `load`. */
  val frames = mutable.Map.empty[String, Int].withDefaultValue(0)

  private def look(b: Bench): Unit = {
    b.now = now
    b.run()
    val address = nodes.collectFirst { case (a, node) if node eq b => a }.get
    while (!busy(address) && b.t.received.nonEmpty) {
      taken += address -> b.take()
      b.run()
    }
  }

  /** What is due until `end`, at its time. */
  private def dueUntil(end: Long): Unit = {
    var next = nodes.values.minBy(_.due)
    while (next.due <= end) {
      now = now max next.due
      look(next)
      next = nodes.values.minBy(_.due)
    }
    now = end
  }

  private def step(end: Long): Unit =
    nodes.values.flatMap(b => b.first.map(b -> _)).minByOption(_._2.id) match {
      case Some((from, f)) =>
        val id = FrameId.of(f.id)
        sent(kind(id)) += bits(f)
        frames(kind(id)) += 1
        dueUntil(now + bits(f) * 1000L / kbps)
        from.leave(_ eq f)
        look(from)
        for ((a, b) <- nodes if (b ne from) && (id.destination == 0 || id.destination == a)) {
          b.t.receive(f, now)
          look(b)
        }
      case None => dueUntil(nodes.values.map(_.due).min max now min end)
    }

  def run(us: Long, until: => Boolean = false): Unit = {
    val end = now + us
    while (now < end && !until) step(end)
  }
}

object CanBus {

  /** From the start bit to the gap behind the frame (CAN-07, CAN-09). */
  def bits(f: BusFrame): Long = {
    def of(n: Int, count: Int) = (count - 1 to 0 by -1).map(i => (n >> i & 1) == 1)
    val head                   = of(f.id >> 18, 12) ++ of(3, 2) ++ of(f.id & 0x3ffff, 18) ++ of(f.dlc, 7)
    val begin                  = head ++ f.data.flatMap(of(_, 8))
    val raw                    = begin ++ of(Crc15.of(begin), 15)
    val stuffing               = new StuffingModel
    val stuffed = raw.count { bit =>
      val isBehindFive = stuffing.awaits
      if (isBehindFive) stuffing.take(stuffing.stuffBit)
      stuffing.take(bit)
      isBehindFive
    }
    raw.size + stuffed + 13L
  }

  private val names = Map(
    Code.Open    -> "OPEN",
    Code.Short   -> "SHORT",
    Code.Close   -> "CLOSE",
    Code.Done    -> "DONE",
    Code.Missing -> "MISSING",
    Code.Busy    -> "BUSY",
    Code.Unknown -> "UNKNOWN",
    Code.Hello   -> "HELLO"
  )
  private def kind(id: FrameId) = if (id.isData) "data" else names(id.number)
}
