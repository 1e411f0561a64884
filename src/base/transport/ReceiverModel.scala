package flyframe.transport

import scala.collection.mutable

/** The receiving side: lives, pipes, buffers and answers (TP-20 to TP-25, TP-30, TP-32). */
private[transport] class ReceiverModel(p: TransportParams, answers: AnswersModel, counts: CountersModel) {
  import ReceiverModel._

  private class Pipe {
    var last   = Option.empty[(Int, Int)] // number and result
    var isSeen = false                    // the host got a message of it
    var open   = Option.empty[Incoming]
    var heard  = 0L                       // when something of it has come last

    /** The message that its sender may still have under way. */
    def current: Option[Incoming] = open.filterNot(_.isPassed)
  }
  private class Source(var life: Int, var heardAt: Long) {
    val pipes                                   = mutable.Map.empty[(Boolean, Int), Pipe]
    def pipe(toAll: Boolean, number: Int): Pipe = pipes.getOrElseUpdate((toAll, number), new Pipe)
  }
  private val sources  = mutable.Map.empty[Int, Source]
  private val complete = mutable.Buffer.empty[Incoming] // for the host, in the order they came

  private val opened = mutable.LinkedHashSet.empty[(Source, Pipe)]

  private def isOpen(pipe: Pipe) = pipe.open.exists(!complete.contains(_))
  private def inUse(short: Boolean) = (opened.toSeq.map(_._2).filter(isOpen).flatMap(_.open) ++ complete)
    .count(_.isShort == short)

  private def drop(pipe: Pipe): Unit = {
    if (isOpen(pipe)) counts.add(Counter.Dropped)
    pipe.open = None
  }

  private def known(source: Int, now: Long): Option[Source] = {
    for (s <- sources.get(source) if now >= s.heardAt + p.forgetUs) {
      s.pipes.values.foreach(drop)
      sources -= source
    }
    sources.get(source)
  }

  /** A frame shows a source's life (TP-20). None: an old one. */
  private def alive(source: Int, life: Int, now: Long): Option[Source] = {
    val s = known(source, now).getOrElse(sources.getOrElseUpdate(source, new Source(life, now)))
    if ((s.life - life & 0x7f) >= 1 && (s.life - life & 0x7f) <= 63) {
      counts.add(Counter.OldLife)
      None
    } else {
      if (s.life != life) s.pipes.values.foreach { pipe =>
        drop(pipe)
        pipe.last = None
      }
      s.life = life
      s.heardAt = now
      Some(s)
    }
  }

  /** A pipe of which nothing has come for long (TB-26). */
  private def forgetOld(pipe: Pipe, now: Long): Unit =
    if (now / Second - pipe.heard / Second >= p.forgetPipe) {
      pipe.last = None
      pipe.open.foreach(_.isPassed = true)
    }

  /** The sender has message `number` under way: those before it have ended (TB-25). */
  private def passTo(pipe: Pipe, number: Int): Unit = {
    val before  = number - 1 & 0xff
    val isKnown = pipe.last.nonEmpty || pipe.open.nonEmpty
    pipe.open.foreach(_.isPassed = true)
    if (isKnown && !pipe.last.exists(_._1 == before)) pipe.last = Some(before -> Result.Refused)
  }

  def hello(source: Int, life: Int, now: Long): Boolean = alive(source, life, now).nonEmpty

  def close(id: FrameId, bytes: Seq[Int], now: Long): Unit =
    for (s <- alive(id.source, bytes(1) & 0x7f, now)) {
      val pipe   = s.pipe(id.destination == 0, id.pipe)
      val number = bytes(0)
      forgetOld(pipe, now)
      val isLate = pipe.last.exists(n => n._1 == number || isOlder(number, n._1)) ||
        pipe.current.exists(m => isOlder(number, m.number) || m.number == number && complete.contains(m))
      if (isLate) counts.add(Counter.Unexpected)
      else {
        pipe.heard = now
        if (isOpen(pipe)) drop(pipe)
        pipe.open.foreach(_.isPassed = true)
        pipe.last = Some(number -> Result.Refused)
      }
    }

  private def isOlder(number: Int, than: Int) = Sizes.ahead(number, than) > 127

  /** OPEN or SHORT (TP-21). */
  def opening(id: FrameId, bytes: Seq[Int], now: Long): Unit = {
    val isShort = id.number == Code.Short
    val length  = if (isShort) bytes.size - 2 else Sizes.number(bytes.slice(2, 4)).toInt + 1
    if (!isShort && (length <= Sizes.Short || length > Sizes.Message)) counts.add(Counter.WrongLength)
    else
      for (s <- alive(id.source, bytes(1) & 0x7f, now)) {
        val pipe   = s.pipe(id.destination == 0, id.pipe)
        val number = bytes(0)
        val crc    = if (isShort) Sizes.crc32(bytes.drop(2)) else Sizes.number(bytes.drop(4)).toInt
        val isOld  = isOlder(number, _)
        forgetOld(pipe, now)
        val isLast = pipe.last.exists(_._1 == number)
        val isPast = pipe.last.exists(n => isOld(n._1)) || pipe.current.exists(m => isOld(m.number))
        if (isPast && !isLast) counts.add(Counter.OldNumber)
        else {
          pipe.heard = now
          val isThis = pipe.current.exists(_.number == number)
          if (!isThis && !isLast) passTo(pipe, number)
          pipe.open match {
            case _ if isLast                                                         => done(id, s, pipe)
            case Some(m) if complete.contains(m)                                     => busy(id, s, number)
            case Some(m) if isThis && m.length == length && m.crc == crc && !isShort => m.hearsOpen(now)
            case _ =>
              drop(pipe)
              begin(id, s, pipe, number, length, crc, bytes, now)
          }
        }
      }
  }

  private def begin(
      id: FrameId,
      s: Source,
      pipe: Pipe,
      number: Int,
      length: Int,
      crc: Int,
      bytes: Seq[Int],
      now: Long
  ): Unit = {
    val isShort = id.number == Code.Short
    // The last place for short ones is left to urgent ones (TB-35).
    val places = if (!isShort) p.buffers else if (id.urgent) Sizes.Shorts else Sizes.Shorts - 1
    if (inUse(isShort) >= places) {
      counts.add(Counter.NoBuffer)
      busy(id, s, number)
    } else {
      val m = new Incoming(id, number, s.life, length, crc, isShort, !pipe.isSeen, now)
      pipe.open = Some(m)
      opened += s -> pipe
      if (isShort) {
        m.parts(0) = bytes.drop(2)
        finish(pipe, m)
      }
    }
  }

  private def finish(pipe: Pipe, m: Incoming): Unit = {
    complete += m
    pipe.isSeen = true
  }

  private def life(toAll: Boolean, s: Source) = s.life | (if (toAll) Sizes.ToAll else 0)

  private def answer(to: FrameId, code: Int, bytes: Seq[Int]): Unit = answers.put(
    BusFrame(FrameId(to.urgent, to.source, isData = false, p.address, code, to.pipe, end = true), bytes),
    to.destination == 0
  )
  private def busy(id: FrameId, s: Source, number: Int): Unit =
    answer(id, Code.Busy, Seq(number, life(id.destination == 0, s), BusyWait))
  private def done(id: FrameId, s: Source, number: Int, result: Int): Unit = {
    val toAll = id.destination == 0
    answer(
      id,
      Code.Done,
      Seq(number, life(toAll, s), p.life | (if (toAll) Sizes.ToAll else 0), result)
    )
  }
  private def done(id: FrameId, s: Source, pipe: Pipe): Unit =
    pipe.last.foreach { case (number, result) => done(id, s, number, result) }
  private def missing(m: Incoming, s: Source): Unit = for (first <- m.missing.headOption) {
    val named = m.missing.takeWhile(_ < first + Sizes.Map)
    m.highest = named.last
    val map = named.map(n => 1L << (Sizes.Map - 1 - (n - first))).sum
    answer(m.id, Code.Missing, Seq(m.number, life(m.toAll, s), first) ++ Sizes.bytes(map, 5))
  }

  /** A data frame (TP-22 to TP-25). */
  def data(id: FrameId, bytes: Seq[Int], now: Long): Unit = {
    val source = known(id.source, now)
    val pipe   = source.flatMap(_.pipes.get((id.destination == 0, id.pipe)))
    for (p <- pipe) {
      forgetOld(p, now)
      p.heard = now
    }
    pipe.flatMap(_.open) match {
      case Some(m) if complete.contains(m) => counts.add(Counter.Double)
      case Some(m) =>
        m.wrong(id, bytes) match {
          case Some(counter) => counts.add(counter)
          case None          => accept(source.get, pipe.get, m, id.number, bytes, now)
        }
      case None =>
        counts.add(Counter.NoMessage)
        val key = (id.source, id.destination == 0, id.pipe)
        if (answeredAt.get(key).forall(now >= _ + AnswerUs)) {
          answeredAt(key) = now
          source.zip(pipe.filter(_.last.nonEmpty)) match {
            case Some((s, of)) => done(id, s, of)
            case None          => answer(id, Code.Unknown, Seq(if (id.destination == 0) Sizes.ToAll else 0))
          }
        }
    }
  }
  private val answeredAt = mutable.Map.empty[(Int, Boolean, Int), Long] // source, to all, pipe

  private def accept(s: Source, pipe: Pipe, m: Incoming, n: Int, bytes: Seq[Int], now: Long): Unit = {
    s.heardAt = now
    m.arrives(n, bytes, now)
    if (m.parts.size < m.count) {
      if (n == m.count - 1 || n == m.highest) missing(m, s)
    } else if (Sizes.crc32(m.bytes) == m.crc) finish(pipe, m)
    else {
      counts.add(Counter.WrongCrc)
      m.clear()
      done(m.id, s, m.number, Result.WrongCrc)
    }
  }

  /** Looks for gaps; returns when the next one will be. */
  def poll(now: Long): Long = {
    opened.filterInPlace { case (_, pipe) => isOpen(pipe) }
    for {
      (s, pipe) <- opened.toSeq
      m         <- pipe.open if now >= m.heardAt + p.gapUs
    } {
      m.gaps += 1
      m.heardAt = now
      if (m.gaps == Gaps) drop(pipe)
      else {
        m.isSilent()
        missing(m, s)
      }
    }
    opened.toSeq.flatMap(_._2.open).map(_.heardAt + p.gapUs).minOption.getOrElse(Long.MaxValue)
  }

  private def first: Option[Incoming] = complete.find(_.id.urgent).orElse(complete.headOption)

  def received: Option[Received] = first.map { m =>
    Received(m.id.source, m.toAll, m.id.pipe, m.number, m.id.urgent, m.isRepeat, m.bytes)
  }

  /** DONE only goes to a sender that may still await it. */
  def take(refused: Boolean, now: Long): Unit = for (m <- first) {
    val source = known(m.id.source, now)
    complete -= m
    for {
      s    <- source
      pipe <- s.pipes.get((m.toAll, m.id.pipe)) if pipe.open.contains(m)
    } {
      forgetOld(pipe, now)
      pipe.open = None
      if (!m.isPassed) {
        val result = if (refused) Result.Refused else Result.Delivered
        pipe.last = Some(m.number -> result)
        done(m.id, s, m.number, result)
      }
    }
  }
}

private object ReceiverModel {
  val AnswerUs = 10000L
  val Second   = 1000000L

  /** Gaps in a row after which a message is dropped. */
  val Gaps = 10

  /** What BUSY says, in 10 ms. */
  val BusyWait = 2
}

/** A message that comes in. */
private class Incoming(
    val id: FrameId,
    val number: Int,
    val life: Int,
    val length: Int,
    val crc: Int,
    val isShort: Boolean,
    val isRepeat: Boolean,
    var heardAt: Long
) {
  val parts   = mutable.Map.empty[Int, Seq[Int]]
  var highest = -1 // the highest frame that a MISSING has named
  var gaps    = 0

  /** Its sender has given it up (TB-25). */
  var isPassed = false

  def toAll: Boolean = id.destination == 0
  val count: Int     = (length + Sizes.Frame - 1) / Sizes.Frame

  private var newest   = -1   // the last frame of which it is known that it was sent
  private var openLast = true // OPEN is what came last

  /** What was sent and has not come (TB-30). */
  def missing: Seq[Int] = (0 to newest).filterNot(parts.contains)
  def bytes: Seq[Int]   = (0 until count).flatMap(parts)

  private def hears(now: Long): Unit = {
    heardAt = now
    gaps = 0
  }
  def hearsOpen(now: Long): Unit = {
    hears(now)
    openLast = true
  }
  def arrives(n: Int, bytes: Seq[Int], now: Long): Unit = {
    hears(now)
    openLast = false
    newest = newest max n
    parts(n) = bytes
  }

  /** T_gap has passed. Behind OPEN it means that the sender sends nothing unasked. */
  def isSilent(): Unit = if (openLast) newest = count - 1

  /** All frames are to come again. */
  def clear(): Unit = {
    parts.clear()
    highest = -1
    newest = -1
  }

  /** What is wrong with a data frame of it (TP-22). */
  def wrong(frame: FrameId, data: Seq[Int]): Option[Counter.Value] = {
    val isLast = frame.number == count - 1
    if (frame.number >= count) Some(Counter.TooHigh)
    else if (frame.end != isLast) Some(Counter.WrongEnd)
    else if (data.size != (if (isLast) length - (count - 1) * Sizes.Frame else Sizes.Frame))
      Some(Counter.WrongDlc)
    else if (parts.contains(frame.number)) Some(Counter.Double)
    else None
  }
}
