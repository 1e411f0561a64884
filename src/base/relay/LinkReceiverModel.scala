package flyframe.relay

/** What a link receiver tells, each with the sample of a bit. */
trait LinkListener {

  /** A frame begins. */
  def starts(): Unit

  /** The header of a frame is there, and its check is right. */
  def header(header: LinkHeader, body: LinkBody): Unit

  /** The identifier of that frame is there. */
  def identified(): Unit

  /** The frame whose header was told is over.
    *
    * @param isGood
    *   its CRC was right and its end recessive
    */
  def ended(isGood: Boolean): Unit

  /** To be counted: a header with a wrong check, a frame that was broken. */
  def badHeader(): Unit
  def badFrame(): Unit
}

/** Reads link frames out of sampled bits (FR-41 to FR-43, FR-45, RB-01 to RB-03). */
class LinkReceiverModel(listener: LinkListener) {
  import LinkReceiverModel._
  private var state      = Waits
  private var recessives = 0     // in a row, up to 7
  private var dominants  = 0     // in a row
  private var run        = 0     // equal bits, for the stuffing
  private var last       = true
  private var count      = 0     // bits since start, without stuff bits
  private var word       = 0     // kind to hops
  private var crc8       = 0
  private var check      = 0     // as received
  private var ends       = 0     // bits of the end
  private var crc32      = 0
  private var body       = new LinkBody
  private var broken     = Whole // with a dominant bit, just now: what counts if this is no abort
  private var isStuckNow = false

  /** Edges synchronise hard: the link is idle. */
  def isIdle: Boolean = state == Idle

  /** Dominant for 320 bits (FR-63, RB-04). */
  def isStuck: Boolean = isStuckNow

  /** The port has come up or gone down: nothing counts before idle. */
  def restart(): Unit = {
    state = Waits
    recessives = 0
    dominants = 0
    broken = Whole
  }

  /** A bit is sampled. */
  def take(bit: Boolean): Unit = {
    recessives = if (bit) (recessives + 1) min LinkFrame.EndBits else 0
    dominants = if (bit) 0 else (dominants + 1) min Stuck
    if (dominants == Stuck) isStuckNow = true
    if (bit || dominants == LinkFrame.AbortBits) settle(isAbort = !bit)
    state match {
      case Idle => if (!bit) start()
      case End  => end(bit)
      case Waits =>
        if (recessives == LinkFrame.EndBits) state = Idle
      case _ => if (run == 5) stuffed(bit) else next(bit)
    }
    if (isStuckNow && recessives == LinkFrame.EndBits) isStuckNow = false
  }

  /** An abort was counted where the frame broke first (RB-02). */
  private def settle(isAbort: Boolean): Unit = {
    if (!isAbort && broken == Header) listener.badHeader()
    if (!isAbort && broken == Body) listener.badFrame()
    broken = Whole
  }

  private def start(): Unit = {
    state = Header
    run = 1
    last = false
    count = 0
    word = 0
    crc8 = LinkCrc.Start8
    check = 0
    ends = 0
    crc32 = LinkCrc.Start32
    body = new LinkBody
    listener.starts()
  }

  private def counted(bit: Boolean): Unit = {
    run = if (bit == last) run + 1 else 1
    last = bit
  }

  private def stuffed(bit: Boolean): Unit =
    if (bit == last) {
      if (bit) listener.badFrame() else broken = Body
      breakOff()
    } else {
      counted(bit)
      if (body.isWhole) state = End
    }

  private def breakOff(): Unit = {
    val isKnown = state != Header
    state = Waits
    if (isKnown) listener.ended(isGood = false)
  }

  private def next(bit: Boolean): Unit = {
    counted(bit)
    count += 1
    if (state == Header) inHeader(bit) else inBody(bit)
  }

  private def inHeader(bit: Boolean): Unit = {
    if (count <= 24) crc32 = LinkCrc.next32(crc32, bit)
    if (count <= 32) {
      word = word << 1 | (if (bit) 1 else 0)
      crc8 = LinkCrc.next8(crc8, bit)
    } else check = check << 1 | (if (bit) 1 else 0)
    if (count == LinkHeader.Bits) {
      if (check == (crc8 ^ 0xff)) {
        state = Body
        listener.header(LinkHeader.of(word), body)
      } else {
        state = Waits
        if (bit) listener.badHeader() else broken = Header
      }
    }
  }

  private def inBody(bit: Boolean): Unit = {
    body.add(bit)
    crc32 = LinkCrc.next32(crc32, bit)
    if (count == LinkHeader.Bits + 32) listener.identified()
    if (body.isWhole) {
      // The CRC is inverted: with its own field behind it a frame leaves this.
      if (crc32 != Residue) bad()
      else if (run != 5) state = End
    }
  }

  private def bad(): Unit = {
    listener.badFrame()
    breakOff()
  }

  private def end(bit: Boolean): Unit =
    if (!bit) bad()
    else {
      ends += 1
      if (ends == LinkFrame.EndBits) {
        state = Idle
        listener.ended(isGood = true)
      }
    }

  /** Takes over the state of another one, whose body is left to it. */
  def copyFrom(o: LinkReceiverModel): Unit = {
    state = o.state
    recessives = o.recessives
    dominants = o.dominants
    run = o.run
    last = o.last
    count = o.count
    word = o.word
    crc8 = o.crc8
    check = o.check
    ends = o.ends
    crc32 = o.crc32
    body = o.body
    broken = o.broken
    isStuckNow = o.isStuckNow
  }
}

object LinkReceiverModel {
  private val Waits  = 0
  private val Idle   = 1
  private val Header = 2
  private val Body   = 3
  private val End    = 4
  private val Whole  = 5 // nothing is broken

  /** Dominant bits after which a link has no signal. */
  val Stuck = 320

  /** What the CRC-32 of a frame and of its own inverted CRC is. */
  private val Residue = 0xc704dd7b
}
