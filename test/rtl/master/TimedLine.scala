package flyframe.master

import scala.util.Random
import flyframe.model._
import flyframe.params.{EscParams, Presets}

/** A line of modelled slaves, or a ring of them, with the times of its frames, in nibble slots of 40 ns.
  *
  * Cable k is the one before slave k, from the master on; that of a ring behind the last slave has the number
  * of slaves.
  *
  * @param first
  *   the slaves, the one next to the master's first port first
  * @param ring
  *   the last one is wired to the master's second port
  */
class TimedLine(first: Seq[EscModel], ring: Boolean = false) {
  import TimedLine._
  private val all    = first.toArray
  private val moves  = Array.fill(all.length)(Vector.empty[(Double, Int)])
  private val clocks = Array.fill(all.length)(0L) // us that have passed
  private val broken = Array.fill(all.length + 1)(false)
  private val dead   = Array.fill(all.length)(false)
  if (!ring) broken(all.length) = true
  wire()

  def slaves: Seq[EscModel] = all.toSeq

  /** Bits in error of all bits of a frame that leaves or comes back. */
  var errorRate      = 0.0
  private val random = new Random(7)

  /** Frames that something has happened to. */
  var damaged = 0

  /** The line of a detector gets into a state, at a time. */
  def move(slave: Int, state: Int, at: Double): Unit = moves(slave) :+= ((at, state))

  private def whole(cable: Int): Boolean =
    !broken(cable) && !(cable > 0 && dead(cable - 1)) && !(cable < all.length && dead(cable))
  private def wire(): Unit = for (k <- all.indices) {
    all(k).setLink(0, whole(k))
    all(k).setLink(1, whole(k + 1))
  }

  /** Cuts a cable, or mends it. */
  def setCable(cable: Int, intact: Boolean): Unit = {
    broken(cable) = !intact
    wire()
  }

  /** A slave has no supply, or has it again: then it begins anew as `slave`. */
  def kill(slave: Int): Unit = {
    dead(slave) = true
    wire()
  }
  def replace(slave: Int, by: EscModel): Unit = {
    dead(slave) = false
    all(slave) = by
    wire()
  }

  /** What happens at a slave until `now`. */
  private def catchUp(slave: Int, now: Double): Unit = {
    val (done, later) = moves(slave).partition(_._1 + DetectorSlots <= now)
    moves(slave) = later
    def advance(to: Double): Unit = {
      val us = (to / 25).toLong max clocks(slave)
      all(slave).advanceUs((us - clocks(slave)).toInt)
      clocks(slave) = us
    }
    for ((at, state) <- done) {
      all(slave).alarm.foreach(_.setLine(state))
      advance(at)
    }
    advance(now)
  }

  private def flip(frame: WireFrame): WireFrame = {
    val at = random.nextInt(frame.symbols.size)
    WireFrame(frame.symbols.updated(at, Symbol(frame.symbols(at).nibble ^ 1 << random.nextInt(4))))
  }

  /** A frame of the master whose first nibble leaves the port `end` at `start`: what comes back, when, and at
    * which port.
    */
  def send(end: Int, start: Double, payload: Vector[Int]): Option[(Double, Int, SentFrame)] = {
    val errs = random.nextDouble() < errorRate * 4 * payload.size
    if (errs) damaged += 1
    val spoilsOut           = errs && random.nextBoolean()
    val sent                = WireFrame.ofNibbles(payload)
    def spoil(f: WireFrame) = if (errs && !spoilsOut) flip(f) else f
    var now                 = start + CableSlots
    var frame               = if (spoilsOut) flip(sent) else sent
    var at                  = if (end == 0) 0 else all.length - 1
    var port                = end
    var back                = Option.empty[Int]
    var lost                = !whole(if (end == 0) 0 else all.length)
    while (!lost && back.isEmpty) {
      catchUp(at, now)
      all(at).receive(port, frame) match {
        case Some((out, sent)) =>
          now += ForwardSlots + CableSlots + (if (all(at).extension.delayed) AppendSlots else 0)
          frame = sent.onWire
          lost = !whole(at + out)
          if (at + out == 0) back = Some(0)
          else if (at + out == all.length) back = Some(1)
          else {
            at += 2 * out - 1
            port = 1 - out
          }
        case None => lost = true
      }
    }
    Option.when(!lost) {
      val nibbles = spoil(frame).symbols.map(_.nibble)
      (now, back.get, SentFrame(nibbles.indexOf(0xd), nibbles.drop(nibbles.indexOf(0xd) + 1)))
    }
  }

  /** All slaves get on to `now`, also those that frames do not reach. */
  def pass(now: Double): Unit = all.indices.foreach(catchUp(_, now))

  /** Records that the master has not got, and those that wait for the server; nothing more is to come. */
  def waiting: Int  = slaves.flatMap(_.alarm).map(_.waiting).sum
  def kept: Int     = slaves.flatMap(_.alarm).map(_.kept).sum
  def done: Boolean = moves.forall(_.isEmpty) && waiting == 0
}

object TimedLine {
  val parameters: EscParams = Presets.named("alarm-slave").get.params.copy(maxSubTelegrams = 128)

  /** Times of a slave, docs/report.md, and of the cable before it, 10 m. */
  private val ForwardSlots = 100 / 40.0
  private val CableSlots   = 50 / 40.0
  private val AppendSlots  = 11

  /** From the detector's pins to the datagram, without debounce: 10 cycles of 10 ns, rounded up. */
  private val DetectorSlots = 3

  val Epoch = 0x21

  /** A slave that has just got its supply. Its detector has no debounce, and is off for a millisecond when it
    * is reset.
    */
  def fresh(params: EscParams = parameters): EscModel = {
    val s = new EscModel(params)
    Seq(0, 0, 1, 0).zipWithIndex.foreach { case (b, i) => s.hostWrite(0x0ea0 + i, b) }
    s
  }

  /** A slave whose host has started it. */
  def started(node: Int, epoch: Int = Epoch, params: EscParams = parameters): EscModel = {
    val s = fresh(params)
    s.hostWrite(0x12, node & 0xff)
    s.hostWrite(0x13, node >> 8)
    s.hostWrite(0x0ea4, 1)
    s.hostWrite(0x0ea5, epoch)
    Seq(0xff, 0xff).zipWithIndex.foreach { case (b, i) => s.hostWrite(0x0eb4 + i, b) }
    s
  }
}
