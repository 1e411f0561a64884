package flyframe.relay

import scala.collection.mutable

/** A ring of golden models, core cycle by core cycle. */
class RelayBitRing(val setting: RelayRingSetting) extends RelayRing {
  import setting._
  private val models = IndexedSeq.fill(count)(new RelayModel(p))
  private val ups    = Array.fill(count, 2)(false)
  private val links  = IndexedSeq.tabulate(count, 2)((n, port) => new Link(delay(n, port)))
  private val actions =
    mutable.PriorityQueue.empty[(Long, Long, () => Unit)](Ordering.by(a => (-a._1, -a._2)))
  private var numbers = 0L
  private var time    = 0L

  for (m <- models)
    m.write(flyframe.registers.RingRegisters.LinkBit, Seq(linkBit & 0xff, linkBit >> 8))

  private class Link(delay: Long) {
    private val changes = mutable.Queue.empty[(Long, Boolean)]
    private var heard   = true
    var isDark          = false
    var isFlipped       = false

    /** A bit begins. */
    def send(time: Long, level: Boolean): Unit = {
      changes.enqueue((time + delay, isDark || level != isFlipped))
      isFlipped = false
    }

    def receive(time: Long): Boolean = {
      while (changes.nonEmpty && changes.head._1 <= time) heard = changes.dequeue()._2
      heard
    }
  }

  def now: Long                    = time
  def node(n: Int): RelayNodeModel = models(n).node

  def at(time: Long)(action: => Unit): Unit = {
    actions.enqueue((time, numbers, () => action))
    numbers += 1
  }

  def access(n: Int)(body: RelayHostModel => Unit): Unit = {
    models(n).node.now(models(n).cycle)
    body(models(n).host)
  }

  def setUp(n: Int, port: Int, isUp: Boolean): Unit     = ups(n)(port) = isUp
  def setDark(n: Int, port: Int, isDark: Boolean): Unit = links(n)(port).isDark = isDark
  def flip(n: Int, port: Int): Unit                     = links(n)(port).isFlipped = true

  private def heard(n: Int, port: Int, time: Long) = {
    val (from, out) = target(n, port) // the link back
    links(from)(out).receive(time)
  }

  private def cycle(n: Int): Unit = {
    val m = models(n)
    val t = end(n, m.cycle)
    m.step((heard(n, 0, t), heard(n, 1, t)), (ups(n)(0), ups(n)(1)))
    if (m.cycle % linkBit == 0) for (port <- 0 to 1) links(n)(port).send(t, m.level(port))
  }

  private def cyclesTo(end: Long): Unit = {
    var goes = true
    while (goes) {
      var first = 0
      for (n <- 1 until count) if (ending(n) < ending(first)) first = n
      if (ending(first) < end) cycle(first) else goes = false
    }
    time = end
  }
  private def ending(n: Int) = end(n, models(n).cycle)

  def runTo(end: Long): Unit = {
    while (actions.nonEmpty && actions.head._1 <= end) {
      val (at, _, action) = actions.dequeue()
      cyclesTo(at)
      action()
    }
    cyclesTo(end)
  }
}
