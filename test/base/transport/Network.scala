package flyframe.transport

import scala.collection.mutable
import scala.util.Random

/** What goes wrong on the way to each receiver, chances of a frame.
  *
  * @param restarts
  *   chance of a message that some node starts anew behind it, and its receiver when its host has taken it
  * @param breaks
  *   chance of a message that the bus falls into two pieces for up to 200 ms
  */
final case class Faults(
    lost: Double = 0,
    doubled: Double = 0,
    late: Double = 0,
    restarts: Double = 0,
    breaks: Double = 0
)

/** A CAN bus with nodes of which each is the model or the program in C, hosts that send messages at random
  * and take those that come, and a tracker that sees what becomes of each. All is chosen by the seed.
  *
  * @param inC
  *   which nodes are in C
  * @param kbps
  *   bit rate
  */
class Network(count: Int, seed: Long, faults: Faults, inC: Int => Boolean, kbps: Int = 1000) {
  import Network._

  private val random  = new Random(seed)
  private var now     = 0L
  private var tags    = 0
  private var broken  = 0 // nodes below this do not hear the others until `mended`
  private var mended  = 0L
  private val tracker = new Tracker(s"seed $seed")
  private val late = mutable.PriorityQueue.empty[(Long, Int, Int, BusFrame)](Ordering.by(l => (-l._1, -l._2)))
  private var order = 0

  private class Node(index: Int) {
    val address           = index + 1
    var life              = random.nextInt(128)
    private val places    = if (faults == Faults()) 8 else 8 + (index + seed.toInt) % 9
    private var t         = make()
    var slots             = Vector.empty[BusFrame]
    var due               = 0L
    var downUntil         = 0L
    var takeAt            = Option.empty[Long]
    val underWay          = mutable.Map.empty[Int, Sent]
    private var polledAt  = 0L
    private var favourite = 0
    var most              = random.nextInt(4)
    private def params    = TransportParams(address, life, kbps, slots = places)
    private def make() =
      if (inC(index)) new NodeInC(params, now) else new TransportModel(params, now)

    def isDown: Boolean = now < downUntil

    /** Something has happened: the host looks soon. */
    private def hurry(): Unit = due = due min (now max polledAt + PollUs)

    def restart(): Unit = {
      close()
      underWay.values.foreach(m => tracker.abandoned(m))
      underWay.clear()
      slots = Vector.empty
      takeAt = None
      life = life + 1 & 0x7f
      downUntil = now + random.nextInt(50000)
      due = downUntil
      tracker.restarted(address)
      t = make()
    }
    def close(): Unit = t match {
      case c: NodeInC => c.release()
      case _          =>
    }

    def hear(f: BusFrame): Unit = if (!isDown) {
      t.receive(f, now)
      hurry()
    }

    def leave(f: BusFrame): Unit = {
      slots = slots.filterNot(_ eq f)
      t.left(f.id)
      hurry()
    }

    def poll(): Unit = if (!isDown) {
      if (takeAt.exists(now >= _)) {
        for (m <- t.received) {
          val refuse = random.nextInt(100) == 0
          tracker.taken(address, m, refuse)
          t.take(now, refuse)
        }
        takeAt = None
        if (random.nextDouble() < faults.restarts) startAnew(this) // DONE is lost, and the node has forgotten
      }
      if (!isDown) work()
    }

    private def work(): Unit = {
      polledAt = now
      due = t.poll(now)
      val fresh = t.queued()
      for (id <- t.aborted(); f <- slots.find(_.id == id)) leave(f)
      fresh.foreach(f => tracker.queued(address, life, f, underWay.values))
      val urgent = fresh.map(f => FrameId.of(f.id).urgent)
      assert(urgent == urgent.sorted.reverse, "TP-05: a normal frame in front of an urgent one")
      slots ++= fresh
      assert(slots.size <= places && slots.map(_.id).distinct.size == slots.size, "TP-06")
      for (e <- t.ended()) tracker.ended(underWay.remove(e.tag).get, e, now)
      if (takeAt.isEmpty && t.received.nonEmpty) takeAt = Some(now + random.nextInt(3000))
      takeAt.foreach(at => due = due min at)
    }

    /** Up to so many messages under way; if they are many, to one node, so that all pipes are in use. */
    def sends(count: Int): Unit = {
      most = count
      favourite = otherThan(index) + 1
    }

    def send(): Boolean = {
      tags += 1
      val tag    = tags & 0xffff
      val to     = if (random.nextInt(30) == 0) 0 else if (most > 3) favourite else otherThan(index) + 1
      val urgent = random.nextInt(5) == 0
      val length = math.exp(random.nextDouble() * math.log(2049)).toInt
      val data = Iterator
        .continually(IndexedSeq.fill(length)(random.nextInt(256)))
        .find(d => !underWay.values.exists(_.data == d))
      val members = Option.when(to == 0)((1 to count).toSet - address)
      underWay.size < 250 && t.send(tag, to, urgent, data.get, now, members) && {
        underWay(tag) = new Sent(address, to, urgent, data.get, members.getOrElse(Set(to)), now)
        due = now
        true
      }
    }
  }
  private val nodes                 = IndexedSeq.tabulate(count)(new Node(_))
  private def otherThan(index: Int) = (index + 1 + random.nextInt(count - 1)) % count

  private def isCut(a: Node, b: Node) = now < mended && (a.address <= broken) != (b.address <= broken)

  /** A frame arrives at a node, or does not. */
  private def deliver(to: Node, f: BusFrame): Unit = if (random.nextDouble() >= faults.lost) {
    for (_ <- 0 to (if (random.nextDouble() < faults.doubled) 1 else 0))
      if (random.nextDouble() < faults.late) {
        order += 1
        late += ((now + random.nextInt(MaxLateUs), order, to.address, f))
      } else to.hear(f)
  }

  private def step(): Unit = {
    val best = nodes.filter(n => !n.isDown && n.slots.nonEmpty).map(n => n -> n.slots.minBy(_.id))
    if (best.nonEmpty) {
      val (from, f) = best.minBy(_._2.id)
      now += (80 + 10 * f.dlc) * 1000L / kbps
      from.leave(f)
      val to = FrameId.of(f.id).destination
      for (n <- nodes if (n ne from) && (to == 0 || n.address == to) && !isCut(n, from)) deliver(n, f)
    } else now = (nodes.map(_.due) ++ late.headOption.map(_._1)).min max (now + 1)
    while (late.headOption.exists(_._1 <= now)) {
      val (_, _, to, f) = late.dequeue()
      nodes(to - 1).hear(f)
    }
    nodes.filter(_.due <= now).foreach(_.poll())
  }

  private def startAnew(n: Node): Unit = {
    val kept = late.filter(_._3 != n.address) // what is late is in the node's own port
    late.clear()
    late ++= kept
    n.restart()
  }

  /** Sends so many messages, and waits until each has ended.
    *
    * @return
    *   in words, what has happened
    */
  def run(messages: Int): String = {
    var sent = 0
    while (sent < messages) {
      for (n <- nodes if !n.isDown && n.underWay.size < n.most && sent < messages && n.send()) {
        sent += 1
        if (random.nextInt(20) == 0) n.sends(random.nextInt(4))
        // One node at a time uses all of its pipes.
        if (random.nextInt(100) == 0) nodes.foreach(m => m.sends(if (m eq n) 15 else m.most min 3))
        if (random.nextDouble() < faults.restarts) startAnew(nodes(random.nextInt(count)))
        if (random.nextDouble() < faults.breaks) {
          broken = 1 + random.nextInt(count - 1)
          mended = now + random.nextInt(200000)
        }
      }
      if (nodes.forall(_.most == 0)) nodes(random.nextInt(count)).sends(3)
      step()
    }
    val end = now + 60000000L * 1000 / kbps
    while (nodes.exists(_.underWay.nonEmpty)) {
      assert(now < end, s"seed $seed: after long ${nodes.map(_.underWay.size)} messages are under way")
      step()
    }
    nodes.foreach(_.close())
    tracker.summary + f", ${now / 1e6}%.0f s on the bus"
  }
}

object Network {

  /** Shorter than 128 messages of a pipe, behind which a number is no longer older (TP-02). */
  private val MaxLateUs = 15000

  /** A host looks at most so often. */
  private val PollUs = 300

  /** A message of a host. */
  class Sent(
      val source: Int,
      val destination: Int,
      val urgent: Boolean,
      val data: IndexedSeq[Int],
      val members: Set[Int],
      val at: Long
  ) {
    var key         = Option.empty[(Int, Int)] // pipe and number
    var isAbandoned = false
    val delivered   = mutable.Set.empty[Int]
    val refused     = mutable.Set.empty[Int]
  }

  /** Sees to TP-13 and TP-30. */
  class Tracker(name: String) {
    private val byKey  = mutable.Map.empty[(Int, Int, Int, Int), List[Sent]].withDefaultValue(Nil)
    private val pipes  = mutable.Set.empty[Int]
    private val starts = mutable.Map.empty[Int, Int].withDefaultValue(0)
    private val times  = mutable.Map.empty[Boolean, (Long, Int)].withDefaultValue((0L, 0))
    private val counts = mutable.LinkedHashMap.empty[String, Int]
    private def add(what: String): Unit = counts(what) = counts.getOrElse(what, 0) + 1

    for (
      what <- Seq(
        "delivered",
        "refused",
        "not confirmed",
        "lost by a restart",
        "repeats, so marked",
        "marked"
      )
    )
      counts(what) = 0

    def restarted(address: Int): Unit = starts(address) += 1
    def abandoned(m: Sent): Unit = {
      m.isAbandoned = true
      add("lost by a restart")
    }

    /** By OPEN and SHORT it is known which message is which. */
    def queued(source: Int, life: Int, f: BusFrame, underWay: Iterable[Sent]): Unit = {
      val id = FrameId.of(f.id)
      if (!id.isData && (id.number == Code.Open || id.number == Code.Short)) {
        val key = (id.pipe, f.data.head)
        pipes += id.pipe
        assert((f.data(1) & 0x7f) == life)
        if (!underWay.exists(m => m.destination == id.destination && m.key.contains(key))) {
          val m = underWay
            .find { m =>
              m.key.isEmpty && m.destination == id.destination && m.urgent == id.urgent &&
              (if (id.number == Code.Short) m.data == f.data.drop(2)
               else m.data.size > 6 && Sizes.bytes(Sizes.crc32(m.data), 4) == f.data.drop(4))
            }
            .getOrElse(throw new AssertionError(s"$name: a message that no host has sent, $f"))
          m.key = Some(key)
          val full = (source, id.destination, key._1, key._2)
          byKey(full) = (m :: byKey(full)).take(4)
        }
      }
    }

    def taken(at: Int, r: Received, refuse: Boolean): Unit = {
      val m = byKey((r.source, if (r.toAll) 0 else at, r.pipe, r.number))
        .find(_.data == r.data)
        .getOrElse(throw new AssertionError(s"$name: a message that nobody has sent, $r"))
      assert(m.urgent == r.urgent, name)
      val isRepeat = m.delivered(at) || m.refused(at)
      if (r.repeat) add("marked")
      if (isRepeat) {
        assert(r.repeat && starts(at) > 0, s"$name: delivered twice, $r")
        add("repeats, so marked")
      }
      if (refuse) m.refused += at else m.delivered += at
    }

    def ended(m: Sent, e: Ended, now: Long): Unit = {
      val confirmed = m.members -- e.unconfirmed
      assert(confirmed.subsetOf(m.delivered), s"$name: confirmed, but not delivered")
      e.outcome match {
        case Outcome.Delivered =>
          assert(e.unconfirmed.isEmpty, name)
          add("delivered")
          val (sum, n) = times(m.urgent)
          times(m.urgent) = (sum + now - m.at, n + 1)
        case Outcome.Refused =>
          assert(e.unconfirmed.nonEmpty && e.unconfirmed.subsetOf(m.refused), name)
          add("refused")
        case _ =>
          assert(e.unconfirmed.nonEmpty, name)
          add("not confirmed")
      }
    }

    private def mean(urgent: Boolean) = times(urgent)._1 / 1e3 / times(urgent)._2

    def summary: String = {
      val isSample = times.size == 2 && times.values.forall(_._2 >= 20)
      assert(
        !isSample || mean(urgent = true) < mean(urgent = false),
        s"$name: urgent messages are not faster"
      )
      counts.map { case (what, n) => s"$n $what" }.mkString(", ") +
        s"; ${pipes.size} pipes in use; on average " +
        f"${mean(urgent = true)}%.0f ms, if urgent, and ${mean(urgent = false)}%.0f ms"
    }
  }
}
