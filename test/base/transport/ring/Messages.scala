package flyframe.transport.ring

import flyframe.transport._
import scala.collection.mutable
import scala.util.Random

/** Hosts on a ring that send messages to one another, and what becomes of each (TP-13, TP-30).
  *
  * @param inC
  *   the transports that are the program in C
  * @param kbps
  *   bit rate of the ring
  * @param pollUs
  *   a host looks at its port so often
  * @param faults
  *   between a port and its host: chances of a frame that it is lost, comes twice, or late; all together at
  *   most 1
  */
class Messages(
    ring: RingPort,
    seed: Long,
    inC: Int => Boolean,
    kbps: Int,
    pollUs: Int = 200,
    faults: Faults = Faults()
) {
  val random          = new Random(seed)
  private val tracker = new Network.Tracker(s"seed $seed")
  private var tags    = 0

  private class Node(index: Int) {
    private val address   = index + 1
    private var life      = random.nextInt(128)
    private var t         = make()
    private var downUntil = 0L
    private val slots     = Array.fill(RingPort.Slots)(Option.empty[BusFrame])
    private var takeAt    = Option.empty[Long]
    private var late      = Seq.empty[(Long, BusFrame)] // with when they come
    private var due       = 0L
    var arrivedAt         = 0L                          // when a message has come last
    val underWay          = mutable.Map.empty[Int, Network.Sent]

    def close(): Unit = t match {
      case c: NodeInC => c.release()
      case _          =>
    }

    private def make() = {
      val params = TransportParams(address, life, kbps, slots = RingPort.Slots)
      if (inC(index)) new NodeInC(params, ring.now) else new TransportModel(params, ring.now)
    }
    def isDown: Boolean = ring.now < downUntil

    /** The host starts anew: it has forgotten all, and its port is empty. */
    def restart(): Unit = {
      close()
      underWay.values.foreach(tracker.abandoned)
      underWay.clear()
      ring.clear(index)
      for (i <- slots.indices) slots(i) = None
      takeAt = None
      late = Nil
      life = life + 1 & 0x7f
      downUntil = ring.now + random.between(5000, 50000)
      tracker.restarted(address)
      t = make()
    }

    def poll(): Unit = if (isDown) ring.clear(index)
    else {
      val frames = ring.received(index).flatMap(comes) ++ overdue()
      frames.foreach(t.receive(_, ring.now))
      val waits = if (slots.exists(_.nonEmpty)) ring.pending(index) else 0
      val gone  = slots.indices.filter(i => slots(i).nonEmpty && (waits >> i & 1) == 0)
      for (i <- gone) {
        t.left(slots(i).get.id)
        slots(i) = None
      }
      val takes = takeAt.exists(ring.now >= _)
      if (takes) {
        t.received.foreach(tracker.taken(address, _, refuse = false))
        t.take(ring.now)
        takeAt = None
      }
      if (frames.nonEmpty || gone.nonEmpty || takes || ring.now >= due) work()
    }

    /** What comes of a frame at once. */
    private def comes(frame: BusFrame): Seq[BusFrame] = if (faults == Faults()) Seq(frame)
    else {
      val chance = random.nextDouble()
      if (chance < faults.lost) Nil
      else if (chance < faults.lost + faults.doubled) Seq(frame, frame)
      else if (chance < faults.lost + faults.doubled + faults.late) {
        late :+= ring.now + random.nextInt(Messages.LatestUs) -> frame
        Nil
      } else Seq(frame)
    }

    private def overdue(): Seq[BusFrame] = {
      val (ready, rest) = late.partition(_._1 <= ring.now)
      late = rest
      ready.sortBy(_._1).map(_._2)
    }

    private def work(): Unit = {
      due = t.poll(ring.now)
      for (f <- t.queued()) {
        tracker.queued(address, life, f, underWay.values)
        val slot = slots.indexWhere(_.isEmpty)
        slots(slot) = Some(f)
        ring.request(index, slot, f)
      }
      for (e <- t.ended()) tracker.ended(underWay.remove(e.tag).get, e, ring.now)
      if (takeAt.isEmpty && t.received.nonEmpty) {
        arrivedAt = ring.now
        takeAt = Some(ring.now + random.nextInt(1000))
      }
    }

    def send(to: Int, length: Int): Unit = {
      tags += 1
      val data    = IndexedSeq.fill(length)(random.nextInt(256))
      val urgent  = random.nextInt(5) == 0
      val members = Option.when(to == 0)((1 to ring.count).toSet - address)
      assert(t.send(tags, to, urgent, data, ring.now, members), "no place for a message")
      underWay(tags) = new Network.Sent(address, to, urgent, data, members.getOrElse(Set(to)), ring.now)
      due = ring.now
    }
  }
  private val nodes = IndexedSeq.tabulate(ring.count)(new Node(_))

  private def step(): Unit = {
    ring.runUs(pollUs)
    nodes.foreach(_.poll())
  }

  /** Sends a message of so many bytes from node to node.
    *
    * @param meanwhile
    *   is called again and again until then, with the us that have passed
    * @return
    *   us until its receiver's host finds it, and until its sender knows that
    */
  def single(from: Int, to: Int, length: Int)(meanwhile: Long => Unit = _ => ()): (Long, Long) = {
    val start = ring.now
    nodes(from).send(to + 1, length)
    finish(() => meanwhile(ring.now - start))
    (nodes(to).arrivedAt - start, ring.now - start)
  }

  /** Sends so many messages of random lengths, up to three of a node at a time, and waits until each has
    * ended.
    *
    * @param longest
    *   bytes
    * @param pause
    *   the longest time between two, as so many looks of a host
    * @param restarts
    *   with this chance behind each message a host starts anew
    * @param behind
    *   is called with the number of each message that has been sent
    * @return
    *   in words, what has happened
    */
  def run(messages: Int, longest: Int, pause: Int = 10, restarts: Double = 0)(
      behind: Int => Unit = _ => ()
  ): String = {
    var sent = 0
    while (sent < messages) {
      val from = random.nextInt(ring.count)
      if (!nodes(from).isDown && nodes(from).underWay.size < 3) {
        val other = (from + 1 + random.nextInt(ring.count - 1)) % ring.count + 1
        nodes(from).send(if (random.nextInt(20) == 0) 0 else other, 1 + random.nextInt(longest))
        sent += 1
        behind(sent)
        if (restarts > 0 && random.nextDouble() < restarts) nodes(random.nextInt(ring.count)).restart()
      }
      for (_ <- 0 to random.nextInt(pause)) step()
    }
    finish()
    nodes.foreach(_.close())
    tracker.summary
  }

  private def finish(meanwhile: () => Unit = () => ()): Unit = {
    val end = ring.now + 60000000L
    while (nodes.exists(_.underWay.nonEmpty)) {
      assert(ring.now < end, s"seed $seed: messages are under way after a minute")
      meanwhile()
      step()
    }
  }
}

object Messages {

  /** A frame that comes late does so within this time. */
  private val LatestUs = 20000
}
