package flyframe.transport

import scala.collection.immutable.BitSet

/** A message under way, at its sender (TP-03, TP-04, TP-10 to TP-13, TP-31).
  *
  * @param members
  *   who has to confirm it
  * @param answering
  *   of a message to all: how many nodes may answer
  */
private[transport] class OutgoingModel(
    p: TransportParams,
    val tag: Int,
    val destination: Int,
    val urgent: Boolean,
    val pipe: Int,
    val number: Int,
    data: IndexedSeq[Int],
    members: Set[Int],
    answering: Int,
    begin: Long
) {
  import OutgoingModel._

  private val isShort = data.size <= Sizes.Short
  private val toAll   = destination == 0
  private val parts   = if (isShort) IndexedSeq.empty else data.grouped(Sizes.Frame).toIndexedSeq
  private val life    = p.life | (if (toAll) Sizes.ToAll else 0)
  private val all     = BitSet(parts.indices: _*)

  private def answerUs(tries: Int) = p.answerUs(Option.when(toAll)(answering), tries)

  private var open       = true               // OPEN or SHORT is to be sent
  private var todo       = all
  private var closing    = false
  private var closed     = false
  private var busyUntil  = Option.empty[Long]
  private var waits      = 0                  // of those for a busy receiver, how many have passed
  private var awaited    = members
  private var refusing   = Set.empty[Int]
  private var tries      = 0
  private var answers    = 0
  private var restarted  = begin
  private var leftAt     = begin              // the last frame left
  private var progressAt = begin
  private var asksSince  = Option.empty[Long] // everything has left, or the last answer has come since then

  private def control(code: Int, bytes: Seq[Int]) =
    BusFrame(FrameId(urgent, destination, isData = false, p.address, code, pipe, end = true), bytes)
  private def opening =
    if (isShort) control(Code.Short, Seq(number, life) ++ data)
    else
      control(
        Code.Open,
        Seq(number, life) ++ Sizes.bytes(data.size - 1, 2) ++ Sizes.bytes(Sizes.crc32(data), 4)
      )
  private def part(i: Int) = BusFrame(
    FrameId(urgent, destination, isData = true, p.address, i, pipe, end = i == parts.size - 1),
    parts(i)
  )

  /** The next frame to be sent. What waits already is left out (TP-06). */
  def next(slots: SlotsModel): Option[BusFrame] = {
    if (open && slots.waits(opening.id)) open = false
    if (!closing && !open) todo = todo.dropWhile(i => slots.waits(part(i).id))
    if (closed) None
    else if (closing) Some(control(Code.Close, Seq(number, life)))
    else if (busyUntil.nonEmpty && !toAll) None
    else if (open) Some(opening)
    else todo.headOption.map(part)
  }

  /** `next` was put into the port. */
  def sent(): Unit =
    if (closing) closed = true
    else if (open) open = false
    else todo = todo.tail

  def left(now: Long): Unit = {
    leftAt = now
    progressAt = now
  }

  /** How it has ended, if it has. */
  def end: Option[Ended] = {
    val outcome =
      if (awaited.isEmpty && refusing.nonEmpty) Some(Outcome.Refused)
      else if (awaited.isEmpty && members.nonEmpty) Some(Outcome.Delivered)
      else if (closed || members.isEmpty && asksSince.nonEmpty) Some(Outcome.NotConfirmed)
      else None
    outcome.map(Ended(tag, _, awaited ++ refusing))
  }

  /** Does what is due; returns when something will be. */
  def poll(now: Long, isWaiting: Boolean): Long = {
    if (closing && busyUntil.nonEmpty) {
      busyUntil = None
      progressAt = now
    }
    if (busyUntil.exists(now >= _)) {
      busyUntil = None
      waits += 1
      open = true
      progressAt = now
    }
    val isOut = !isWaiting && !open && todo.isEmpty && busyUntil.isEmpty && !closing
    if (isOut) asksSince = asksSince.orElse(Some(now))
    if (isOut && now >= leftAt + answerUs(tries)) {
      tries += 1
      leftAt = now
      progressAt = now
      if (tries == Tries) closing = true else open = true
    }
    val awaits    = isOut && !open && !closing
    val asksUntil = asksSince.map(_ + p.unheardUs).getOrElse(Long.MaxValue)
    val stalls    = if (busyUntil.isEmpty) (progressAt + StallUs) min asksUntil else Long.MaxValue
    if (!isOut && now >= stalls) closed = true
    busyUntil.getOrElse(if (awaits) leftAt + answerUs(tries) else stalls)
  }

  def cancel(): Unit = closing = true

  /** An answer of a node that has not confirmed the message; false: it makes no sense. */
  def answer(from: Int, code: Int, bytes: Seq[Int], now: Long): Option[Counter.Value] = {
    val isThis   = code == Code.Unknown || bytes(0) == number
    val isBefore = code == Code.Done && bytes(0) == (number - 1 & 0xff) && !isShort && bytes(3) <= 1
    if (!awaited(from) || !isThis && !isBefore || code != Code.Unknown && bytes(1) != life)
      Some(Counter.Unexpected)
    else if (isBefore || code == Code.Unknown) unknown(now)
    else
      code match {
        case Code.Done if bytes(3) == Result.WrongCrc =>
          heard(now)
          startAgain(now)
          None
        case Code.Done =>
          heard(now)
          awaited -= from
          if (bytes(3) == Result.Refused) refusing += from
          None
        case Code.Busy =>
          heard(now)
          open = false
          if (!toAll) todo = BitSet.empty // else the others go on
          val until = now + (waitUs(bytes(2)) max (if (toAll) waitAllUs else 0))
          busyUntil = Some(busyUntil.fold(until)(_ max until))
          None
        case _ => missing(bytes, now)
      }
  }

  /** The wait that BUSY names doubles with each that has passed, as far as it is not long already (TB-06). */
  private def waitUs(named: Int): Long = {
    val first = 10000L * (named max 1)
    first max (first << (waits min 20) min p.longestWaitUs)
  }

  /** Of a message to all each OPEN lets those answer again that have it already (TB-32). */
  private def waitAllUs = p.waitAllUs(answering, waits) max answerUs(tries = 0)

  private def heard(now: Long): Unit = {
    tries = 0
    asksSince = asksSince.map(_ => now)
    progressAt = now
  }

  /** An answer after which something is sent again: not for ever (TB-08). */
  private def countAnswer(): Unit = {
    answers += 1
    if (answers >= Answers * members.size) closing = true
  }

  private def startAgain(now: Long): Unit = {
    countAnswer()
    busyUntil = None
    open = true
    todo = all
    restarted = now
  }

  private def unknown(now: Long): Option[Counter.Value] =
    if (isShort) Some(Counter.Unexpected)
    else {
      heard(now)
      if (busyUntil.isEmpty && now >= restarted + RestartUs) startAgain(now)
      None
    }

  private def missing(bytes: Seq[Int], now: Long): Option[Counter.Value] = {
    val map   = Sizes.number(bytes.drop(3))
    val named = BitSet((0 until Sizes.Map).filter(i => (map >> (Sizes.Map - 1 - i) & 1) == 1): _*)
    val first = bytes(2)
    if (named.isEmpty || first + named.last >= parts.size) Some(Counter.BeyondEnd)
    else {
      heard(now)
      waits = 0 // it was taken up
      if (busyUntil.isEmpty || toAll) {
        countAnswer()
        todo ++= named.map(_ + first)
      }
      None
    }
  }
}

private object OutgoingModel {

  /** A message of which no frame has left, and no answer has come, for so long has ended. */
  val StallUs = 10000000L

  /** From OPEN on again at most so often. */
  val RestartUs = 10000L

  /** Ten times without any answer: the end. */
  val Tries = 10

  /** So many answers of each member, after which something was sent again: the end. */
  val Answers = 200
}
