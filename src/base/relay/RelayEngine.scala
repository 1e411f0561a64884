package flyframe.relay

import java.util.PriorityQueue

/** A ring of the same nodes as in [[RelayBitRing]], frame by frame: nothing is done for a bit or a cycle in
  * which nothing happens. A test proves that both do the same in the same cycles.
  */
class RelayEngine(val setting: RelayRingSetting) extends RelayRing {
  import RelayEngine._
  import setting._
  private val timing  = LinkTiming(linkBit)
  private val queue   = new PriorityQueue[Entry]
  private var numbers = 0L
  private var time    = 0L

  /** A node, the links that it sends on, and when it is to send next. */
  private class Station(n: Int) extends LinkSenders {
    val node              = new RelayNodeModel(p, this)
    val host              = new RelayHostModel(p, node)
    val listeners         = (0 to 1).map(node.listener)
    val versions          = Array(0L, 0L) // of the next event of what arrives at a port
    var tickVersion       = 0L
    var cycle             = 0L
    private val frameEnds = Array(0L, 0L) // the bit behind the last frame

    /** The coming bit. */
    def bit: Long = cycle / linkBit + 1

    def quiet(port: Int): Long = (bit - frameEnds(port)) max 0

    /** What is decided for the coming bit leaves a bit later (RB-19). */
    private def send(port: Int, levels: Array[Boolean]): Unit = {
      links(n)(port).send(bit + 1, levels)
      frameEnds(port) = bit + levels.length
      schedule(n, port)
    }

    // What was sent last: header, body, and its first bit.
    private val sent = Array.fill(2)(Option.empty[(LinkHeader, LinkBody, Long)])

    def begin(port: Int, header: LinkHeader, body: LinkBody): Unit = {
      sent(port) = Some((header, body, bit))
      val levels = LinkFrame.levels(header, body)
      links(n)(port).send(bit, true +: levels) // the bit in front of a frame may be flipped still
      frameEnds(port) = bit + levels.length
      schedule(n, port)
    }

    /** A frame that comes is not what it seemed, and so is what is sent of it from bit `from` on. */
    def changes(body: LinkBody, from: Long): Unit =
      for (port <- 0 to 1; (header, b, start) <- sent(port) if (b eq body) && from < frameEnds(port)) {
        val levels = LinkFrame.levels(header, body)
        links(n)(port).send((from max start) + 1, levels.drop(((from - start) max 0).toInt))
        frameEnds(port) = start + levels.length
        schedule(n, port)
        wake(from)
      }

    def abort(port: Int): Unit = if (bit < frameEnds(port)) {
      sent(port) = None
      send(port, Abort)
    }
    def silence(port: Int): Unit = {
      sent(port) = None
      if (bit < frameEnds(port)) send(port, Array.empty)
      frameEnds(port) = bit
    }

    def now(cycle: Long): Unit = {
      this.cycle = cycle
      node.now(cycle)
    }

    /** The next bit counts, as ports or host have changed something. */
    var isAsked = false

    /** Asks for the next bit in which [[RelayNodeModel.tick]] may do something. */
    def wake(next: Long): Unit = {
      val gaps = for (port <- 0 to 1; gap <- node.gap(port)) yield next max frameEnds(port) + gap
      val due  = node.due.map(d => next max (d + linkBit) / linkBit)
      for (bit <- (gaps ++ due ++ (if (isAsked) Some(next) else None)).minOption) {
        tickVersion += 1
        add(end(n, bit * linkBit - 1), Tick, n, tickVersion)
      }
    }
  }

  private val links = IndexedSeq.tabulate(count, 2) { (n, port) =>
    val (to, _) = target(n, port)
    val late    = delay(n, port)
    new EventLink(timing, bit => cycleAt(to, phase(n) + bit * linkBit * periods(n) + late))
  }
  private val stations = IndexedSeq.tabulate(count)(new Station(_))

  for (n <- 0 until count; port <- 0 to 1) {
    val (to, _) = target(n, port)
    links(n)(port).changes = body => stations(to).changes(body, bitAt(to))
  }

  private def add(time: Long, rank: Int, n: Int, version: Long, action: () => Unit = Nothing): Unit = {
    queue.add(new Entry(time, rank, numbers, n, version, action))
    numbers += 1
  }

  /** The next event of what a port sends. */
  private def schedule(n: Int, port: Int): Unit = {
    val (to, in) = target(n, port)
    val station  = stations(to)
    station.versions(in) += 1
    // RB-21
    for (cycle <- links(n)(port).next)
      add(end(to, cycle - cycle % linkBit + linkBit - 1), in, to, station.versions(in))
  }

  def now: Long                    = time
  def node(n: Int): RelayNodeModel = stations(n).node

  def at(time: Long)(action: => Unit): Unit = add(time, Action, 0, 0, () => action)

  private def happens(n: Int)(body: Station => Unit): Unit = {
    val s = stations(n)
    s.now(cycleAt(n, time))
    body(s)
    s.isAsked = true
    s.wake(s.bit)
  }

  def access(n: Int)(body: RelayHostModel => Unit): Unit = happens(n)(s => body(s.host))

  private val ups = Array.fill(count, 2)(false)

  /** It counts in the first cycle of a bit (RB-20). */
  def setUp(n: Int, port: Int, isUp: Boolean): Unit = {
    ups(n)(port) = isUp
    val first = (cycleAt(n, time) + linkBit - 1) / linkBit * linkBit
    at(end(n, first))(portChanges(n, port))
  }

  private def portChanges(n: Int, port: Int): Unit = {
    val isUp = ups(n)(port)
    if (stations(n).node.isUp(port) != isUp) happens(n) { s =>
      val (from, out) = target(n, port)
      if (links(from)(out).setUp(s.cycle, isUp)) s.listeners(port).ended(isGood = false)
      schedule(from, out)
      s.node.portChanges(port, isUp)
    }
  }

  /** The first bit of a node that begins now or later. */
  private def bitAt(n: Int) = cycleAt(n, time) / linkBit + 1

  def setDark(n: Int, port: Int, isDark: Boolean): Unit = {
    links(n)(port).setDark(bitAt(n), isDark)
    schedule(n, port)
  }

  def flip(n: Int, port: Int): Unit = {
    links(n)(port).flip(bitAt(n))
    schedule(n, port)
  }

  def runTo(end: Long): Unit = {
    while (!queue.isEmpty && (queue.peek.time < end || queue.peek.time == end && queue.peek.rank == Action)) {
      val e = queue.poll()
      time = e.time
      if (e.rank == Action) e.action() else run(e)
    }
    time = end
  }

  private def run(e: Entry): Unit = {
    val s = stations(e.node)
    if (e.rank == Tick) {
      if (e.version == s.tickVersion) {
        s.now(cycleAt(e.node, e.time))
        s.node.tick()
        s.isAsked = false
        s.wake(s.bit + 1)
      }
    } else if (e.version == s.versions(e.rank)) {
      val (from, out) = target(e.node, e.rank)
      s.now(cycleAt(e.node, e.time))
      links(from)(out).take().tell(s.listeners(e.rank))
      schedule(from, out)
      s.wake(s.bit)
    }
  }
}

object RelayEngine {

  // Ranks of what happens in the same cycle: 0 and 1 are the ports.
  private val Action = -1
  private val Tick   = 2

  private val Nothing: () => Unit = () => ()
  private val Abort               = Array.fill(LinkFrame.AbortBits)(false)

  private final class Entry(
      val time: Long,
      val rank: Int,
      val number: Long,
      val node: Int,
      val version: Long,
      val action: () => Unit
  ) extends Comparable[Entry] {
    def compareTo(o: Entry): Int =
      if (time != o.time) java.lang.Long.compare(time, o.time)
      else if (rank != o.rank) Integer.compare(rank, o.rank)
      else java.lang.Long.compare(number, o.number)
  }
}
