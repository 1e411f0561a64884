package flyframe.relay

/** Ports and fibres of a ring in relay mode, as FR-12 to FR-14 have them, with times instead of tones: cuts,
  * mends, dead nodes, and the ports that go down and come up because of them.
  *
  * @param upUs
  *   microseconds of signal without search until a port comes up
  * @param heldUs
  *   how long three losses within that time keep a port down
  */
class RingFaults(ring: RelayRing, upUs: Int = 10000, heldUs: Int = 1000000) {
  import RingFaults._
  private val count = ring.setting.count
  private val ports = IndexedSeq.tabulate(count, 2)(new Port(_, _))
  private val alive = Array.fill(count)(true)

  /** What a port sends, and hears. */
  private class Port(n: Int, port: Int) {
    var isCut    = false // the fibre of what it sends
    var sends    = Dark
    var hears    = Dark
    var isUp     = false
    var changes  = 0
    var losses   = Seq.empty[Long]
    var heldTill = 0L
    var last     = new Change(0)

    def isGood: Boolean = hears == Symbols && alive(n)

    /** What leaves by the fibre follows from what is heard. */
    def send(): Unit = {
      val now = if (!alive(n) || isCut) Dark else if (hears == Dark) Search else Symbols
      if (now != sends) {
        sends = now
        ring.setDark(n, port, now != Symbols)
        val (to, in) = ring.setting.target(n, port)
        val lag      = if (now == Dark) DarkUs else if (now == Search) SearchUs else SymbolsUs
        val change   = new Change(ring.now + ring.setting.delay(n, port) + (lag * Us).toLong)
        // What lasted too short a time is not noticed.
        if (last.time >= change.time) last.counts = false
        last = change
        ring.at(change.time)(if (change.counts) ports(to)(in).hear(now))
      }
    }

    /** Something else is heard, or the node has died or come back. */
    def hear(what: Int): Unit = {
      hears = what
      changes += 1
      if (!isGood) goDown() else if (!isUp) await(changes)
      send()
    }

    private def goDown(): Unit = if (isUp) {
      isUp = false
      losses = (losses :+ ring.now).takeRight(3)
      if (losses.size == 3 && losses.last - losses.head <= heldUs * Us)
        heldTill = ring.now + (heldUs * Us).toLong
      ring.setUp(n, port, isUp = false)
    }

    private def await(change: Int): Unit = ring.at(heldTill max ring.now + (upUs * Us).toLong) {
      if (change == changes && isGood && !isUp) {
        isUp = true
        ring.setUp(n, port, isUp = true)
      }
    }

    /** A node that has lost its power has lost what it heard, too. */
    def again(): Unit = hear(hears)
  }

  /** Light comes on. */
  def start(): Unit = for (n <- 0 until count; port <- 0 to 1) ports(n)(port).again()

  /** The fibre of what a port sends is cut, or mended. */
  def cut(n: Int, port: Int, isCut: Boolean = true): Unit = {
    ports(n)(port).isCut = isCut
    ports(n)(port).send()
  }

  /** A node dies, or comes back. */
  def kill(n: Int, isDead: Boolean = true): Unit = {
    alive(n) = !isDead
    ports(n).foreach(_.again())
  }

  def isAlive(n: Int): Boolean         = alive(n)
  def isUp(n: Int, port: Int): Boolean = ports(n)(port).isUp

  /** What a port hears: nothing, search, or symbols. */
  def hears(n: Int, port: Int): Int = ports(n)(port).hears

  /** All ports of all nodes that are alive and have living neighbours are up. */
  def isWhole: Boolean = ports.flatten.forall(_.isUp)
}

object RingFaults {
  val Dark    = 0
  val Search  = 1
  val Symbols = 2

  private val Us = 1e6

  /** A change of what is sent, when the other end notices it. */
  private final class Change(val time: Long) {
    var counts = true
  }

  // How long it takes to know that nothing comes, that search comes, that it is over: FR-10, FR-11, FR-04.
  private val DarkUs    = 2.5
  private val SearchUs  = 3.3
  private val SymbolsUs = 0.3
}
