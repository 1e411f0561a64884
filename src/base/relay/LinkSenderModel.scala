package flyframe.relay

import flyframe.can.StuffingModel

/** Sends link frames bit by bit, those that pass while they come (FR-41 to FR-43, FR-47). */
class LinkSenderModel {
  private val stuffing = new StuffingModel
  private var header   = IndexedSeq.empty[Boolean]
  private var body     = Option.empty[LinkBody]
  private var next     = 0 // bit of the frame, start is 0
  private var aborting = 0 // dominant bits of an abort that are left
  private var silent   = 0L

  /** Recessive bits sent since the last frame; 0 within a frame. */
  def quiet: Long = if (isBusy) 0 else silent

  private def isBusy = body.nonEmpty || aborting > 0

  /** A frame begins with the coming bit. */
  def begin(header: LinkHeader, body: LinkBody): Unit = {
    this.header = header.bits.toIndexedSeq
    this.body = Some(body)
    next = 0
    stuffing.begin()
  }

  /** The frame that is being sent is ended by an abort, from the coming bit on. */
  def abort(): Unit = if (body.nonEmpty) {
    body = None
    aborting = LinkFrame.AbortBits
  }

  /** The port is down: nothing is sent any more. */
  def silence(): Unit = {
    body = None
    aborting = 0
    silent = 0
  }

  /** The level of the coming bit. */
  def send(): Boolean = body match {
    case Some(b) =>
      val bit = if (stuffing.awaits) stuffing.stuffBit else take(b)
      stuffing.take(bit)
      if (next > LinkHeader.Bits + b.total && !stuffing.awaits) {
        body = None
        silent = 0
      }
      bit
    case None if aborting > 0 =>
      aborting -= 1
      silent = 0
      false
    case None =>
      silent += 1
      true
  }

  private def take(b: LinkBody): Boolean = {
    val i = next
    next += 1
    if (i == 0) false
    else if (i <= LinkHeader.Bits) header(i - 1)
    else {
      require(i - LinkHeader.Bits <= b.count, "a link sender has overtaken its frame.")
      b(i - LinkHeader.Bits - 1)
    }
  }
}
