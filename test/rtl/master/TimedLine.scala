package flyframe.master

import scala.util.Random
import flyframe.model._
import flyframe.params.{EscParams, Presets}

/** A line of modelled alarm slaves with the times of its frames, in nibble slots of 40 ns.
  *
  * Detectors have no debounce: a state counts when it is there.
  *
  * @param nodes
  *   node IDs, first slave first
  */
class TimedLine(nodes: Seq[Int]) {
  import TimedLine._
  val slaves: IndexedSeq[EscModel] = nodes.toIndexedSeq.map(started)
  private val moves                = Array.fill(slaves.size)(Vector.empty[(Double, Int)])
  private val clocks               = Array.fill(slaves.size)(0L) // us that have passed
  private var depth                = slaves.size
  slaves.last.setLink(1, up = false)

  /** Bits in error of all bits on their way to and fro. */
  var errorRate      = 0.0
  private val random = new Random(7)

  /** Frames that something has happened to. */
  var damaged = 0

  /** The line of a detector gets into a state, at a time. */
  def move(slave: Int, state: Int, at: Double): Unit = moves(slave) :+= ((at, state))

  /** Cuts the cable before a slave, or mends it. */
  def setCable(slave: Int, intact: Boolean): Unit = {
    slaves(slave).setLink(0, intact)
    slaves(slave - 1).setLink(1, intact)
    depth = if (intact) slaves.size else slave
  }

  private def advance(slave: Int, to: Double): Unit = {
    val us = (to / 25).toLong max clocks(slave)
    slaves(slave).advanceUs((us - clocks(slave)).toInt)
    clocks(slave) = us
  }

  /** What has happened at a slave until `now`. */
  private def catchUp(slave: Int, now: Double): Unit = {
    val (done, later) = moves(slave).partition(_._1 + DetectorSlots <= now)
    moves(slave) = later
    for ((at, state) <- done) {
      slaves(slave).alarm.foreach(_.setLine(state))
      advance(slave, at)
    }
    advance(slave, now)
  }

  private def flip(frame: WireFrame): WireFrame = {
    val at = random.nextInt(frame.symbols.size)
    WireFrame(frame.symbols.updated(at, Symbol(frame.symbols(at).nibble ^ 1 << random.nextInt(4))))
  }

  /** A frame of the master whose first nibble leaves at `start`: what comes back, and when. */
  def send(start: Double, payload: Vector[Int]): Option[(Double, SentFrame)] = {
    val bits = 4 * payload.size
    val hits = Seq.fill((1 to bits).count(_ => random.nextDouble() < errorRate))(random.nextInt(2 * depth))
    if (hits.nonEmpty) damaged += 1
    def damage(frame: WireFrame, count: Int) = (1 to count).foldLeft(frame)((f, _) => flip(f))
    var now                                  = start + CableSlots
    var frame                                = WireFrame.ofNibbles(payload)
    for (k <- 0 until depth) {
      catchUp(k, now)
      val Some((_, sent)) = slaves(k).receive(0, damage(frame, hits.count(_ == k)))
      now += ForwardSlots + CableSlots + (if (slaves(k).extension.delayed) AppendSlots else 0)
      frame = sent.onWire
    }
    now += (depth - 1) * (ForwardSlots + CableSlots)
    val back = damage(frame, hits.count(_ >= depth)).symbols.map(_.nibble)
    Some((now, SentFrame(back.indexOf(0xd), back.drop(back.indexOf(0xd) + 1))))
  }

  /** Slaves that frames reach. */
  def present: Int = depth

  /** Events at slaves, and whether nothing more is to come. */
  def waiting: Int  = slaves.map(_.registers.byte(0x0e88)).sum
  def done: Boolean = moves.forall(_.isEmpty) && waiting == 0
}

object TimedLine {
  private val parameters: EscParams = Presets.named("alarm-slave").get.params

  /** Times of a slave, docs/report.md, and of the cable before it, 10 m. */
  private val ForwardSlots = 140 / 40.0
  private val CableSlots   = 50 / 40.0
  private val AppendSlots  = 10

  /** From the detector's pins to the datagram, without debounce: 10 cycles of 10 ns, rounded up. */
  private val DetectorSlots = 3

  /** A slave whose host has started it. */
  private def started(node: Int): EscModel = {
    val s = new EscModel(parameters)
    s.hostWrite(0x12, node & 0xff)
    s.hostWrite(0x13, node >> 8)
    (0x0ea0 to 0x0ea3).foreach(s.hostWrite(_, 0))
    Seq(1, Epoch, 3).zipWithIndex.foreach { case (b, i) => s.hostWrite(0x0ea4 + i, b) }
    s
  }
  val Epoch = 0x21
}
