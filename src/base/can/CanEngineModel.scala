package flyframe.can

/** What an engine asks and tells of frames. Of a frame to send it knows only the one attempt. */
trait CanFrames {

  /** The frame to send next, if there is one. */
  def offered: Option[CanFrame]

  /** The frame offered is on the wire from now on. */
  def begins(): Unit

  /** It has been sent; `time` is that of its SOF. */
  def sent(time: Int): Unit

  /** The attempt was in vain: arbitration lost, an error, or a stop. */
  def fails(): Unit

  /** A frame has been received; `time` is that of its SOF. */
  def received(frame: CanFrame, time: Int): Unit
}

/** What control bits say to an engine. */
trait CanModes {
  def listenOnly: Boolean
  def loopBack: Boolean
  def recoversItself: Boolean
}

/** The protocol engine, bit by bit: it decides the level of each bit when it begins, and what follows from a
  * bit when it is sampled.
  *
  * @param time
  *   us counter
  * @param isTolerant
  *   a recessive FDF is a protocol exception (CAN-08), else a form error (FB-11)
  */
class CanEngineModel(
    frames: CanFrames,
    modes: CanModes,
    records: CanRecords,
    time: () => Int,
    isTolerant: Boolean = true
) extends BitStream {
  import CanField._
  private val confinement = new ConfinementModel
  private val reader      = new FrameReaderModel
  private val stuffing    = new StuffingModel
  private val flag        = new ErrorFlagModel(confinement)
  private val count       = new RecessiveCount

  private var field = Integrating
  private var bit   = 0

  private var sends        = false                  // role in the frame
  private var receives     = false
  private var attempt      = Option.empty[CanFrame] // on the wire, not yet decided
  private var acknowledges = false                  // the ACK slot of this frame
  private var mayJoin      = false                  // SOF was heard in the last bit of the intermission
  private var stamp        = 0
  private var hard         = true
  private var recovers     = false

  /** The level of the present bit inside; recessive is true. */
  var level: Boolean = true

  def tec: Int               = confinement.tec
  def rec: Int               = confinement.rec
  def isBusOff: Boolean      = confinement.isBusOff
  def isPassive: Boolean     = confinement.isPassive
  def warns: Boolean         = confinement.warns
  def isIntegrating: Boolean = field == Integrating
  def isSending: Boolean     = sends
  def isReceiving: Boolean   = receives

  /** The port starts (CAN-10); bus-off outlasts a stop (CB-04). */
  def start(): Unit = {
    go(if (confinement.isBusOff) BusOff else Integrating)
    count.clear()
    begins()
  }

  /** The port stops. */
  def stop(): Unit = {
    endAttempt()
    takeNoPart()
    level = true
  }

  /** The host asks for the recovery from bus-off (CAN-34). */
  def recover(): Unit = if (confinement.isBusOff) recovers = true

  def isHard: Boolean = hard

  def hardSynchronises(): Unit = count.restart()

  private def go(to: Int, first: Int = 0): Unit = {
    field = to
    bit = first
  }

  private def takeNoPart(): Unit = {
    sends = false
    receives = false
    mayJoin = false
  }

  // ---- a bit begins ----

  def begins(): Unit = {
    if (field == Idle || mayJoin) offer()
    mayJoin = false
    hard = field match {
      case Idle | Suspend | Integrating | BusOff => true
      case Intermission                          => bit > 0
      case _                                     => false
    }
    level = field match {
      case ActiveErrorFlag | OverloadFlag => false
      case AckSlot                        => !acknowledges
      case _                              => attempt.forall(sentLevel)
    }
  }

  /** Begins the frame that is offered, with SOF or behind that of another node (CAN-12). */
  private def offer(): Unit = for (frame <- frames.offered if takesPart) {
    frames.begins()
    attempt = Some(frame)
    sends = true
    receives = false
    if (field == Idle) beginFrame()
  }

  private def beginFrame(): Unit = {
    reader.begin()
    stuffing.begin()
    go(Sof)
  }

  /** It is decided now whether the frame is acknowledged (CB-06). */
  private def goToAckSlot(): Unit = {
    acknowledges = reader.crcIsRight && (receives || modes.loopBack)
    go(AckSlot)
  }

  private def sentLevel(frame: CanFrame): Boolean =
    if (stuffing.awaits) stuffing.stuffBit
    else FrameReaderModel.level(frame, field, bit, reader.checksum)

  // ---- a bit is sampled ----

  def samples(heard: Boolean): Unit = field match {
    case Integrating                      => if (count.reaches11(heard)) go(Idle)
    case BusOff                           => whileBusOff(heard)
    case Idle                             => if (!heard) hearSof()
    case Suspend                          => inSuspend(heard)
    case Intermission                     => inIntermission(heard)
    case ActiveErrorFlag | OverloadFlag   => inDominantFlag(heard)
    case PassiveErrorFlag                 => inPassiveFlag(heard)
    case ErrorDelimiter | OverloadDelim   => inDelimiter(heard)
    case CrcDelimiter if !stuffing.awaits => if (heard) goToAckSlot() else error(CanError.Form)
    case AckSlot                          => inAckSlot(heard)
    case AckDelimiter                     => inAckDelimiter(heard)
    case Eof                              => inEof(heard)
    case _                                => inStuffed(heard)
  }

  private def hearSof(): Unit = {
    beginFrame()
    receives = true
    takeFrameBit(false)
  }

  private def takeFrameBit(heard: Boolean): Unit = {
    if (field == Sof) stamp = time()
    stuffing.take(heard)
    val isCan2 = reader.take(heard)
    if (isCan2 || isTolerant) go(reader.field, reader.bit) else error(CanError.Form)
    if (!isCan2 && isTolerant) {
      takeNoPart()
      count.clear()
      go(Integrating)
    }
  }

  private def inStuffed(heard: Boolean): Unit =
    if (stuffing.awaits) {
      if (heard == stuffing.stuffBit) stuffing.take(heard)
      else if (!sends || (!heard && inFrontOfRtr)) error(CanError.Stuff)
      else error(CanError.Bit)
    } else if (!sends || heard == level) takeFrameBit(heard)
    else if (!heard && reader.inArbitration) {
      records.lost(reader.arbitrationBit)
      endAttempt()
      sends = false
      receives = true
      takeFrameBit(heard)
    } else error(CanError.Bit)

  /** The bit behind the stuff bit is not behind the RTR bit of the own frame. */
  private def inFrontOfRtr =
    reader.inArbitration && (field != Ide || attempt.exists(_.extended))

  private def inAckSlot(heard: Boolean): Unit = {
    if (level) { if (sends && heard) return error(CanError.Ack) } // it does not acknowledge
    else if (heard) return error(CanError.Bit)
    else if (receives) counting(confinement.received())
    go(AckDelimiter)
  }

  private def inAckDelimiter(heard: Boolean): Unit =
    if (receives && !reader.crcIsRight) error(CanError.Crc)
    else if (heard) go(Eof)
    else error(CanError.Form)

  private def inEof(heard: Boolean): Unit = {
    val isLast = bit == 6
    if (!heard) { if (isLast && receives) overload() else error(CanError.Form) }
    else {
      if (bit == 5 && (receives || modes.loopBack)) frames.received(reader.frame, stamp)
      if (!isLast) bit += 1
      else {
        if (sends) {
          attempt = None
          counting(confinement.sent())
          frames.sent(stamp)
        }
        go(Intermission)
      }
    }
  }

  private def inIntermission(heard: Boolean): Unit =
    if (!heard && bit < 2) overload()
    else if (bit < 2) bit += 1
    else {
      val waits = sends && isPassive
      takeNoPart()
      if (!heard) {
        hearSof()
        mayJoin = !isPassive
      } else go(if (waits) Suspend else Idle)
    }

  private def inSuspend(heard: Boolean): Unit =
    if (!heard) hearSof()
    else if (bit < 7) bit += 1
    else go(Idle)

  private def whileBusOff(heard: Boolean): Unit = {
    recovers |= modes.recoversItself
    if (recovers && count.reaches11(heard) && count.elevens == 128) {
      recovers = false
      confinement.recover()
      go(Idle)
    }
  }

  // ---- errors ----

  /** It sends, and its counters change: not in listen only (CAN-42), but in loop back, which goes before that
    * (CB-06).
    */
  private def takesPart = !modes.listenOnly || modes.loopBack

  private def counting(change: => Unit): Unit = if (takesPart) change

  private def endAttempt(): Unit = if (attempt.nonEmpty) {
    attempt = None
    frames.fails()
  }

  private def error(kind: Int): Unit = {
    records.error(kind, sends, field, bit)
    val isAckWhilePassive = kind == CanError.Ack && isPassive
    counting {
      if (!sends) confinement.raise(asTransmitter = false, 1)
      else if (kind != CanError.Stuff && !isAckWhilePassive) confinement.raise(asTransmitter = true, 8)
    }
    endAttempt()
    flagError(isAckWhilePassive)
  }

  private def flagError(isAckWhilePassive: Boolean = false): Unit = {
    flag.begin(isAckWhilePassive)
    go(if (isPassive) PassiveErrorFlag else ActiveErrorFlag)
    leaveIfBusOff()
  }

  private def overload(): Unit = {
    flag.begin()
    go(OverloadFlag)
  }

  private def inDominantFlag(heard: Boolean): Unit =
    if (heard) {
      records.error(CanError.Bit, sends, field, bit)
      counting(confinement.raise(sends, 8))
      flagError()
    } else if (bit < 5) bit += 1
    else go(if (field == OverloadFlag) OverloadDelim else ErrorDelimiter)

  private def inPassiveFlag(heard: Boolean): Unit = {
    if (flag.passiveEnds(heard, sends, takesPart)) go(ErrorDelimiter)
    leaveIfBusOff()
  }

  private def inDelimiter(heard: Boolean): Unit =
    if (bit == 0 && !heard) {
      flag.dominantBehind(isError = field == ErrorDelimiter, sends, takesPart)
      leaveIfBusOff()
    } else if (!heard && bit < 7) error(CanError.Form)
    else if (!heard) overload()
    else if (bit < 7) bit += 1
    else go(Intermission)

  private def leaveIfBusOff(): Unit = if (confinement.isBusOff && field != BusOff) {
    records.busOff()
    takeNoPart()
    count.clear()
    go(BusOff)
  }
}
