package flyframe.transport

/** What a transport is made with.
  *
  * @param address
  *   own address, 1 to 125
  * @param life
  *   number of the start, 0 to 127
  * @param kbps
  *   bit rate of the ring, 5 to 2000 kbit/s
  * @param pdMs
  *   process data are sent again after this time, 1 to 1000 ms
  * @param slots
  *   frames in the port, 8 to 16 (TB-04)
  * @param hello
  *   bytes 1 to 7 of HELLO
  * @param buffers
  *   for messages of more than six bytes, 4 or more (TP-32)
  */
final case class TransportParams(
    address: Int,
    life: Int = 0,
    kbps: Int = 1000,
    pdMs: Int = 100,
    slots: Int = 8,
    hello: Seq[Int] = Seq.fill(7)(0),
    buffers: Int = 4
) {

  private def bits(count: Int): Long = count * 1000L / kbps

  /** T_answer in us of a message to one node (TP-12), or to all, which so many nodes answer (TB-29), after so
    * many tries.
    */
  def answerUs(nodes: Option[Int], tries: Int): Long =
    50000L max bits(5000 + 250 * nodes.getOrElse(0) << tries min 50000)

  /** The time between two HELLO in us, on a ring with so many nodes (TB-28). */
  def helloUs(nodes: Int): Long = 1000000L max bits(1000 * nodes)

  /** The time between two HELLO in us that tell early of a change, on a ring with so many nodes (TB-33). */
  def newsUs(nodes: Int): Long = bits(10000 * nodes)

  /** A node of which no HELLO has come for so many us is not there (TP-31, TB-28). */
  def memberUs: Long = 3 * helloUs(Sizes.LastAddress)

  /** A source of whose life nothing has come for so many us is forgotten (TP-20, TB-28). */
  def forgetUs: Long = 10000000L max bits(500000)

  /** A pipe of which nothing has come for so many seconds is forgotten, and rests for so many (TB-26). */
  def forgetPipe: Long = 20L max 1000L / kbps
  def restPipe: Long   = forgetPipe + forgetPipe / 10

  /** A wait of a message for its receiver grows up to so many us (TB-06). */
  def longestWaitUs: Long = bits(20000)

  /** A wait of a message to all, which so many nodes answer, for busy ones, when so many have passed (TB-32).
    */
  def waitAllUs(nodes: Int, passed: Int): Long =
    bits(6 * 125 * nodes << (passed min 4)) min (5000000L max bits(100000))

  /** What waits in the port for so many us is taken back (TB-27). */
  def staleUs(id: FrameId): Long = {
    val isValue = id.isData && id.pipe == Sizes.ProcessData
    (if (isValue) 3000L * pdMs else 1000000L) max 20000000L / kbps
  }

  /** A message of which no answer comes for so many us, since all of it has left, ends (TB-26). */
  def unheardUs: Long = forgetPipe * 750000L

  /** While answers wait in the port data frames are held back for so many us, and go free for as many
    * (TB-31).
    */
  def holdUs: Long = 100000L max bits(10000)

  /** T_gap in us (TP-23, TB-30). */
  def gapUs: Long = 20000L max bits(4000)
}

/** How a message that a host has sent ends (TP-13). */
object Outcome extends Enumeration {
  val Delivered, Refused, NotConfirmed = Value
}

/** A message that has ended.
  *
  * @param tag
  *   the host's own number of it
  * @param unconfirmed
  *   who has not delivered it
  */
final case class Ended(tag: Int, outcome: Outcome.Value, unconfirmed: Set[Int])

/** A message for the host.
  *
  * @param repeat
  *   it may be a repeat (TP-30)
  */
final case class Received(
    source: Int,
    toAll: Boolean,
    pipe: Int,
    number: Int,
    urgent: Boolean,
    repeat: Boolean,
    data: Seq[Int]
)

/** What a transport counts, in the order of `enum transport_counter`. Each frame that is ignored is counted
  * once.
  */
object Counter extends Enumeration {

  /** Control frames of which code, DLC, end mark, pipe, destination or life byte is impossible; DLC above 8.
    */
  val Malformed = Value

  /** Source 0, 126 or 127. */
  val WrongSource = Value

  /** Frames from the own address. */
  val OwnAddress = Value

  /** Frames to another node. */
  val Foreign = Value

  /** Frames of a life that is older than the source's. */
  val OldLife = Value

  /** OPEN and SHORT with a number that is older than the last one. */
  val OldNumber = Value

  /** OPEN of a message that is too long, or that would go as SHORT. */
  val WrongLength = Value

  /** OPEN and SHORT that found no buffer. */
  val NoBuffer = Value

  /** Data frames behind the end of their message. */
  val TooHigh = Value

  /** Data frames with a wrong DLC. */
  val WrongDlc = Value

  /** Data frames with a wrong end mark. */
  val WrongEnd = Value

  /** Data frames that came already. */
  val Double = Value

  /** Data frames of no open message. */
  val NoMessage = Value

  /** Answers that no message awaits, and CLOSE of a message that has ended. */
  val Unexpected = Value

  /** MISSING that names nothing, or a frame behind the end. */
  val BeyondEnd = Value

  /** Messages that came whole, with a wrong CRC. */
  val WrongCrc = Value

  /** Open messages that were dropped. */
  val Dropped = Value

  /** Answers for which there was no place, in time. */
  val AnswerLost = Value

  /** Process data of an object that nobody follows. */
  val Unwatched = Value
}

/** The transport of a node as its host and its port meet it: the golden model, or the program in C.
  *
  * Time is in us and never goes back. Nothing happens by itself: what is due, and what follows from frames
  * received, left, or sent, is done by `poll`.
  */
trait TransportUnderTest {

  /** Does what is due.
    *
    * @return
    *   when it wants to be called again, if nothing else happens
    */
  def poll(now: Long): Long

  /** The port has received a frame. */
  def receive(frame: BusFrame, now: Long): Unit

  /** The port's frame with this identifier has left: it waits no more. */
  def left(id: Int): Unit

  /** Frames given to the port since the last call. */
  def queued(): Seq[BusFrame]

  /** Identifiers of frames that the port is to take back, since the last call: they leave no more, unless
    * they are on the wire. `left` tells when they wait no more.
    */
  def aborted(): Seq[Int]

  /** The host sends a message.
    *
    * @param tag
    *   the host's own number of it, 0 to 65535
    * @param members
    *   of a message to all: who has to confirm it, or else everyone of whom a HELLO came (TB-28)
    * @return
    *   false: it is impossible, or there is no place
    */
  def send(
      tag: Int,
      destination: Int,
      urgent: Boolean,
      data: Seq[Int],
      now: Long,
      members: Option[Set[Int]] = None
  ): Boolean

  /** The host gives a message up: it ends as not confirmed, unless it is delivered before that. */
  def cancel(tag: Int): Unit

  /** Messages that have ended since the last call. */
  def ended(): Seq[Ended]

  /** The message that the host is to take next; it stays until it is taken. */
  def received: Option[Received]

  /** The host has taken it, or refused it. */
  def take(now: Long, refused: Boolean = false): Unit

  /** Who is there: the addresses of which a HELLO came not too long ago (TB-28). */
  def members(now: Long): Set[Int]

  /** Bytes 1 to 7 of HELLO change. */
  def setHello(bytes: Seq[Int], now: Long): Unit

  /** Process data to be sent, 1 to 8 bytes; none: no valid value. False: there is no place. */
  def setObject(destination: Int, number: Int, data: Seq[Int], now: Long): Boolean

  /** Follows an object of a node. False: there is no place. */
  def watch(source: Int, number: Int): Boolean

  /** Follows and sends no values from now on. */
  def forgetValues(): Unit

  /** The newest value of an object that is followed and whether it is old; before the first one: none, old.
    */
  def value(source: Int, number: Int, now: Long): (Seq[Int], Boolean)

  /** What was counted. */
  def count(counter: Counter.Value): Int
}
