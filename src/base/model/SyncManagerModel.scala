package flyframe.model

/** Who accesses a SyncManager. */
sealed trait Side
object Side {
  case object Ecat extends Side
  case object Pdi  extends Side
}

/** What happens to a buffer and has a time (DC-42), with the field that shows it. */
sealed abstract class BufferEvent(val field: String)
object BufferEvent {
  case object EcatChange extends BufferEvent("ecat_buffer_change_time")
  case object PdiStart   extends BufferEvent("pdi_buffer_start_time")
  case object PdiChange  extends BufferEvent("pdi_buffer_change_time")
}

/** How a SyncManager is configured (B-50). `enabled` and `deactivated` as the two sides have set them;
  * `lingering` while its deactivation is delayed (SM-29), `sequences` if there is the sequential mode
  * (SM-32).
  */
final case class SyncManagerSettings(
    start: Int = 0,
    length: Int = 0,
    control: Int = 0,
    enabled: Boolean = false,
    deactivated: Boolean = false,
    lingering: Boolean = false,
    sequences: Boolean = false
) {
  def mailbox: Boolean    = (control & 2) != 0
  def writer: Side        = if ((control & 4) != 0) Side.Ecat else Side.Pdi
  def ecatEvent: Boolean  = (control & 0x10) != 0
  def alEvent: Boolean    = (control & 0x20) != 0
  def triggers: Boolean   = (control & 0x40) != 0
  def sequential: Boolean = sequences && (control & 0x80) != 0
  def working: Boolean    = (enabled || lingering) && !deactivated && length > 0
  def locked: Boolean     = enabled && deactivated && length > 0
  def end: Int            = start + length - 1

  /** Of those to which an access may belong. */
  def covers(side: Side, write: Boolean, address: Int): Boolean = {
    val blocked = locked || (lingering && side == Side.Ecat)
    val buffers = if (blocked && !mailbox) 3 else 1
    (working || locked) && !(lingering && side == Side.Ecat && !write) &&
    address >= start && address < start + buffers * length
  }
}

/** One SyncManager: which access goes where, and what comes of it (B-50 to B-57).
  *
  * @param exists
  *   there is memory at a local address (B-52)
  * @param completelyWritten
  *   called after a complete write, if the watchdog is to be triggered
  * @param happens
  *   called for what has a time (DC-42)
  * @param byWrite
  *   the PDI closes by a write what it reads (SM-36, B-104)
  */
class SyncManagerModel(
    exists: Int => Boolean,
    completelyWritten: () => Unit = () => (),
    happens: BufferEvent => Unit = _ => (),
    byWrite: Boolean = false
) {
  private var now = SyncManagerSettings()

  // Buffer numbers, for the two sides and between them (SM-12).
  private var (writing, next, reading) = (0, 1, 2)
  private var newer                    = false // NEXT is newer than what the reading side has
  private var lastWritten              = 3
  private var full                     = false
  private var open                     = Set.empty[Side]
  private var leftOpen                 = false // by the last frame
  private var events                   = Events(written = false, read = false)
  private var inFrame                  = FrameState()

  // Sequential mode: so many bytes are written without a gap, the last one came behind one.
  private var inSequence = 0
  private var gap        = false
  private var violated   = false

  private case class Events(written: Boolean, read: Boolean)

  /** What this frame has done so far. */
  private case class FrameState(
      touched: Boolean = false,
      first: Boolean = false,
      closing: Boolean = false, // the end has been read ahead, its byte has not passed yet (B-55)
      closed: Boolean = false
  )

  def settings: SyncManagerSettings = now

  /** New settings take effect; starting and stopping to work is a reset. */
  def configure(settings: SyncManagerSettings): Unit = {
    val changes = settings.working != now.working
    now = settings
    if (changes) {
      writing = 0; next = 1; reading = 2
      newer = false
      lastWritten = 3
      full = false
      open = Set.empty
      leftOpen = false
      events = Events(written = false, read = false)
      inFrame = FrameState()
      inSequence = 0
      gap = false
      violated = false
    }
  }

  /** The last buffer had a gap (SM-33). */
  def sequentialError: Boolean = violated

  /** There is something of ECAT's that the host may read (SM-29). */
  def hasData: Boolean =
    now.working && now.writer == Side.Ecat && (if (now.mailbox) full else lastWritten != 3)

  /** The side that writes has its buffer open, or the one that reads has (B-103). */
  def writeOpen: Boolean              = isOpen(now.writer == Side.Ecat)
  def readOpen: Boolean               = isOpen(now.writer != Side.Ecat)
  private def isOpen(byEcat: Boolean) = if (byEcat) leftOpen else open(Side.Pdi)

  def writeEvent: Boolean  = events.written
  def readEvent: Boolean   = events.read
  def mailboxFull: Boolean = full
  def lastBuffer: Int      = if (now.mailbox) 0 else lastWritten

  /** An access to an address it covers: the address in memory, or None if it is denied or absent. */
  def access(side: Side, write: Boolean, address: Int): Option[Int] =
    if (!now.working || (now.lingering && side == Side.Ecat)) None
    else if (byWrite && side == Side.Pdi && write && now.writer == Side.Ecat) {
      if (address == now.end && (open(side) || now.length == 1) && exists(address))
        closedByHost(write = false)
      None
    } else if (now.length == 1) Option.when(exists(address)) { plain(side, write); address }
    else if (write != (side == now.writer)) None       // SM wrong direction, B-54
    else if (side == Side.Ecat && inFrame.closed) None // B-56
    else {
      val first = address == now.start
      val opens = first && !open(side) && mayOpen(write)
      val takes = opens && !write && !now.mailbox && newer
      val buffer =
        if (now.mailbox) 0 else if (write) writing else if (takes) next else reading
      val memory = address + buffer * now.length
      // The byte addressed decides on the access, the one in the buffer on the data (B-52).
      if ((opens || open(side)) && exists(address)) {
        if (takes) take()
        open += side
        touched(side, write, first, last = address == now.end, opens)
        if (side == Side.Ecat && write) follows(address - now.start)
        Option.when(memory <= 0xffff && exists(memory))(memory)
      } else None
    }

  /** SM-32: the first byte begins; bytes may come again, but not before those in front of them. */
  private def follows(offset: Int): Unit = {
    if (offset == 0) inSequence = 1
    else if (offset == inSequence) inSequence += 1
    gap = offset >= inSequence
  }

  private def mayOpen(write: Boolean): Boolean =
    if (now.mailbox) write != full else write || lastWritten != 3

  private def take(): Unit = {
    val old = reading
    reading = next; next = old
    newer = false
  }

  /** Length 1 (B-53): only the side that the direction names completes anything. */
  private def plain(side: Side, write: Boolean): Unit =
    if (write == (side == now.writer)) touched(side, write, first = true, last = true, opens = true)

  private def touched(side: Side, write: Boolean, first: Boolean, last: Boolean, opens: Boolean): Unit =
    side match {
      case Side.Pdi =>
        if (first) {
          happens(BufferEvent.PdiStart)
          // An open buffer that is read again is no newer one (B-104).
          if (opens || write || !byWrite) begin(write)
        }
        if (last && (write || !byWrite)) closedByHost(write)
      case Side.Ecat =>
        inFrame = FrameState(
          touched = true,
          first = inFrame.first || first,
          closing = inFrame.closing || (last && !write),
          closed = inFrame.closed || (last && write)
        )
    }

  private def closedByHost(write: Boolean): Unit = {
    happens(BufferEvent.PdiChange)
    complete(Side.Pdi, write)
  }

  /** The first byte has been accessed: ends an event. */
  private def begin(write: Boolean): Unit =
    events = if (write) events.copy(read = false) else events.copy(written = false)

  /** The last byte has been accessed: the buffer changes hands (SM-13, SM-19). */
  private def complete(side: Side, write: Boolean): Unit = {
    open -= side
    if (now.length > 1) {
      if (now.mailbox) full = write
      else if (write) {
        lastWritten = writing
        val old = writing
        writing = next; next = old
        newer = true
      }
    }
    events = if (write) events.copy(written = true) else events.copy(read = true)
    if (write && now.triggers) completelyWritten()
  }

  /** A frame begins. */
  def frameStarts(): Unit = inFrame = FrameState()

  /** The end has been read since this was asked last. */
  def takeClosing(): Boolean = {
    val due = inFrame.closing
    inFrame = inFrame.copy(closing = false)
    due
  }

  /** The byte of the frame that carries the end has passed. */
  def close(): Unit = inFrame = inFrame.copy(closed = true)

  /** The frame has ended; what it did takes effect, or is forgotten (B-57). */
  def frameEnds(good: Boolean): Unit = {
    val write = now.writer == Side.Ecat
    if (good) {
      if (inFrame.first) begin(write)
      if (inFrame.closed || inFrame.closing) {
        if (write) violated = now.sequential && gap
        if (write && violated) open -= Side.Ecat
        else {
          happens(BufferEvent.EcatChange)
          complete(Side.Ecat, write)
        }
      }
    } else if (inFrame.touched) open -= Side.Ecat
    leftOpen = open(Side.Ecat)
    inFrame = FrameState()
  }
}
