package flyframe.registers

import chisel3._
import chisel3.util._
import flyframe.lanes.Lanes
import flyframe.ram.DualPortRam

/** Counters of events in block RAM (ERR-10): one engine visits one of them after the other, a cycle each, and
  * adds the events that have come since its last visit. They count up to 0xFF and stay there.
  *
  * An event is seen in what is read [[EventCounters.delay]] cycles later at the latest; a clear at once.
  *
  * @param counters
  *   byte address and group of each; a group is cleared as a whole
  * @param lanes
  *   bytes of a word that is read
  * @param cyclesPerNibble
  *   an event comes once in so many cycles at most
  */
class EventCounters(counters: Seq[(Int, String)], lanes: Int, cyclesPerNibble: Int) extends Module {
  private val laneBits = log2Ceil(lanes)
  private val n        = counters.size
  private val round    = EventCounters.round(n)

  /** Groups in the order of their first counter. */
  val groups: Seq[String] = counters.map(_._2).distinct

  val event = IO(Input(Vec(n, Bool())))

  /** By group: all its counters are 0 from the next cycle on. */
  val clear = IO(Input(Vec(groups.size, Bool())))

  /** A word is read, by as many low bits of its address as tell the counters apart; `data` has it a cycle
    * later.
    */
  private val places = EventCounters.placeBits(counters.map(_._1), laneBits)
  val readAddress    = IO(Input(UInt(places.W)))
  val data           = IO(Output(UInt((8 * lanes).W)))

  /** By group: `data` counts for a word that is read in this cycle; else its counters are 0. */
  val valid = IO(Output(Vec(groups.size, Bool())))

  // One visit: the engine's own copy is read, and a cycle later written, as is the one that is read from
  // outside.
  private val next = RegInit(0.U(log2Ceil(round).W)) // reset: the first one
  next := Mux(next === (round - 1).U, 0.U, next + 1.U)
  private val visited               = RegNext(next, (round - 1).U) // reset: the one in front of it
  private def visits(i: Int): Bool  = visited === i.U
  private def chosen(of: Seq[Bool]) = of.zipWithIndex.map { case (b, i) => b && visits(i) }.reduce(_ || _)
  private def ofGroup(i: Int): Int  = groups.indexOf(counters(i)._2)
  private def cleared(i: Int): Bool = clear(ofGroup(i))
  private val mostEvents            = (round + cyclesPerNibble - 1) / cyclesPerNibble
  private def taken(i: Int): Bool   = visits(i) || cleared(i)

  // Events since the last visit; reset: none.
  private val events = (0 until n).map { i =>
    val count  = RegInit(0.U(log2Ceil(mostEvents + 1).W)).suggestName(s"events_$i")
    val before = Mux(taken(i), 0.U, count)
    count := before + (event(i) && !before.andR) // a link's pin may bounce faster
    count
  }

  // What the RAM holds of a counter is from before it was cleared.
  private val stale = (0 until n).map { i =>
    val old = RegInit(true.B).suggestName(s"stale_$i") // reset: cleared
    old := cleared(i) || (old && !visits(i))
    old
  }
  for ((group, g) <- groups.zipWithIndex)
    valid(g) := !stale.zip(counters).collect { case (old, (_, `group`)) => old }.reduce(_ || _)

  private val own   = DualPortRam(EventCounters.Words max round, 8)(clock)
  private val added = Mux1H((0 until n).map(i => visits(i) -> events(i)))
  private val sum   = Mux(chosen(stale), 0.U, own.io.readData) +& added
  private val count = sum(7, 0) | Fill(8, sum(8))
  own.io.readAddress  := next
  own.io.write        := true.B
  own.io.writeAddress := visited
  own.io.writeData    := count

  // The other copy.
  private val addresses = (0 until n).map(i => visits(i) -> counters(i)._1.U(12.W))
  private val address   = Mux1H(addresses)
  data := VecInit((0 until lanes).map { lane =>
    val copy = DualPortRam(1 << places, 8)(clock)
    copy.io.readAddress  := readAddress
    copy.io.write        := visited < n.U && Lanes.of(address, lanes) === lane.U
    copy.io.writeAddress := address >> laneBits
    copy.io.writeData    := count
    copy.io.readData
  }).asUInt
}

object EventCounters {

  /** Words of a memory at least, so that it goes to block RAM. */
  private val Words = 64

  /** Cycles from one visit of a counter to the next, if there are `n`; what one has written the next one
    * reads.
    */
  def round(n: Int): Int = n max 3

  /** Cycles from an event to a read that sees it, at most: a round, and a round behind a clear. */
  def delay(n: Int): Int = 2 * round(n) + 2

  /** How many low bits of the word address tell the bytes at these addresses apart. */
  private def placeBits(addresses: Seq[Int], laneBits: Int): Int = {
    def lane(address: Int) = address % (1 << laneBits)
    def places(bits: Int)  = addresses.map(a => (a >> laneBits) % (1 << bits) -> lane(a))
    (log2Ceil(Words) to 12 - laneBits).find(places(_).distinct.size == addresses.size).get
  }
}
