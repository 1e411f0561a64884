package flyframe.model

/** One symbol while RX_DV is high: a nibble, and RX_ER. */
final case class Symbol(nibble: Int, error: Boolean = false)

/** What a PHY gives between RX_DV rising and falling: preamble, SFD, payload, as they came. */
final case class WireFrame(symbols: Vector[Symbol]) {

  /** A PHY with RMII gives the same symbols: up to the SFD there is nothing but a preamble, and the carrier
    * is longer than the PHY keeps its data (B-71).
    */
  def isOfRmii: Boolean = symbols.size >= 8 && symbols.map(_.nibble).takeWhile(_ != 0xd).forall(_ == 5)
}

object WireFrame {
  private def nibbles(bytes: Seq[Int]): Seq[Int] = bytes.flatMap(b => Seq(b & 0xf, b >> 4))

  /** A well-formed start, then these payload nibbles. */
  def ofNibbles(payload: Seq[Int], preamble: Int = 15): WireFrame =
    WireFrame((Seq.fill(preamble)(0x5) ++ Seq(0xd) ++ payload).map(Symbol(_)).toVector)

  /** A frame of these bytes, which must hold the FCS already. */
  def ofBytes(bytes: Seq[Int], preamble: Int = 15): WireFrame = ofNibbles(nibbles(bytes), preamble)

  /** A frame of these bytes with its FCS appended. */
  def withFcs(bytes: Seq[Int], preamble: Int = 15): WireFrame = ofBytes(bytes ++ Fcs.of(bytes), preamble)
}

/** What a transmitter sends: nibbles 0x5, the SFD nibble 0xD, then payload nibbles. */
final case class SentFrame(preamble: Int, payload: Vector[Int]) {

  /** The whole bytes of the payload, FCS included. */
  def bytes: Vector[Int] = payload.grouped(2).collect { case Seq(low, high) => low | high << 4 }.toVector

  /** FCS right: what a network card accepts; half a byte behind it does not count (OP-10). */
  def good: Boolean = bytes.size >= 64 && Fcs.good(bytes)

  /** The same on the wire towards the next station. */
  def onWire: WireFrame = WireFrame.ofNibbles(payload, preamble)
}

/** How a receiver judged a frame (ERR-02). */
sealed trait Verdict
object Verdict {
  case object Good extends Verdict

  /** Counted as invalid frame at the port. */
  case object Invalid extends Verdict

  /** Marked by an ESC before (ERR-08). */
  case object Forwarded extends Verdict

  /** In error, but counted by no port: too short with a good FCS. */
  case object TooShort extends Verdict
}

/** A frame behind the receiver.
  *
  * @param preamble
  *   nibbles of preamble (without the SFD nibble)
  * @param hasSfd
  *   the SFD came; else the frame ended in the preamble
  * @param payload
  *   nibbles behind the SFD up to the end or the abort (B-02); in a good frame an odd one is a dribble
  *   (OP-10)
  * @param rxErrors
  *   symbols with RX_ER, all of them
  */
final case class ReceivedFrame(
    preamble: Int,
    hasSfd: Boolean,
    payload: Vector[Int],
    verdict: Verdict,
    rxErrors: Int
) {
  def good: Boolean        = verdict == Verdict.Good
  def wholeBytes: Seq[Int] = payload.grouped(2).collect { case Seq(low, high) => low | high << 4 }.toSeq
}

/** The receiver's part of the auto-forwarder (B-01 to B-03). */
object Receiver {
  private val Limit = 4096 // nibbles of preamble, and of payload

  def receive(frame: WireFrame): ReceivedFrame = {
    val symbols  = frame.symbols
    val rxErrors = symbols.count(_.error)

    def bad(s: Symbol, index: Int): Boolean =
      s.error || (s.nibble != 0x5 && s.nibble != 0xd) || (s.nibble == 0x5 && index >= Limit)
    // The preamble ends with the SFD, with the first faulty symbol, or with the frame.
    val stop =
      symbols.indices.find(i => bad(symbols(i), i) || symbols(i).nibble == 0xd).getOrElse(symbols.size)
    if (stop == symbols.size || bad(symbols(stop), stop)) {
      // In place of the very first symbol a nibble of preamble is passed on in any case.
      ReceivedFrame(stop max 1, hasSfd = false, Vector.empty, Verdict.Invalid, rxErrors)
    } else {
      val behind  = symbols.drop(stop + 1)
      val fault   = behind.indices.find(i => behind(i).error || i >= Limit)
      val payload = behind.take(fault.getOrElse(behind.size)).map(_.nibble)
      val raw     = ReceivedFrame(stop, hasSfd = true, payload, Verdict.Good, rxErrors)
      val bytes   = raw.wholeBytes
      val odd     = payload.size % 2 == 1
      val crcGood = Fcs.good(bytes)
      if (fault.isDefined) raw.copy(verdict = Verdict.Invalid)
      else if (!crcGood) raw.copy(verdict = if (odd) Verdict.Forwarded else Verdict.Invalid)
      else if (bytes.size < 64) raw.copy(verdict = Verdict.TooShort)
      else raw
    }
  }
}

/** The transmitter (B-04, B-05). */
object Transmitter {

  /** A frame that is in order, with the dribble nibble it may have. */
  def good(preamble: Int, payload: Vector[Int]): SentFrame = SentFrame(preamble, payload)

  /** A frame that is in error, to be marked behind what has been sent (ERR-06, ERR-07). */
  def bad(preamble: Int, hasSfd: Boolean, payload: Vector[Int]): SentFrame =
    if (!hasSfd) SentFrame(preamble, Vector(0))
    else {
      val odd     = payload.size % 2 == 1
      val crcGood = Fcs.good(SentFrame(preamble, payload).bytes)
      val added = (odd, crcGood) match {
        case (false, false) => 1
        case (true, true)   => 2
        case (false, true)  => 3
        case (true, false)  => 0
      }
      SentFrame(preamble, payload ++ Vector.fill(added)(0))
    }
}
