package flyframe.transport

/** The identifier of a frame of the transport, 29 bits.
  *
  * @param destination
  *   0 all, 1 the server or gateway, 2 to 125 nodes
  * @param isData
  *   data, else control, which goes before it
  * @param source
  *   1 to 125
  * @param number
  *   0 to 255: number of a data frame in its message, code of a control frame
  * @param pipe
  *   0 to 14, 15 for process data
  * @param end
  *   end mark: set in the last data frame of a message, and in control frames
  */
final case class FrameId(
    urgent: Boolean,
    destination: Int,
    isData: Boolean,
    source: Int,
    number: Int,
    pipe: Int,
    end: Boolean
) {

  /** As a number of 29 bits; the lower one goes first. */
  def word: Int = (if (urgent) 0 else 1 << 28) | destination << 21 | (if (isData) 1 << 20 else 0) |
    source << 13 | number << 5 | pipe << 1 | (if (end) 1 else 0)

  /** HELLO, of which no answer is awaited. */
  def isHello: Boolean = !isData && number == Code.Hello

  /** DONE, MISSING, BUSY or UNKNOWN. */
  def isAnswer: Boolean = !isData && number >= Code.Done && number <= Code.Unknown
}

object FrameId {
  def of(word: Int): FrameId = FrameId(
    (word >> 28 & 1) == 0,
    word >> 21 & 0x7f,
    (word >> 20 & 1) == 1,
    word >> 13 & 0x7f,
    word >> 5 & 0xff,
    word >> 1 & 0xf,
    (word & 1) == 1
  )
}

/** A data frame with an identifier of 29 bits.
  *
  * @param dlc
  *   0 to 15; above 8 it stands for eight bytes
  * @param data
  *   up to eight bytes
  */
final case class BusFrame(id: Int, dlc: Int, data: Seq[Int])

object BusFrame {
  def apply(id: FrameId, data: Seq[Int]): BusFrame = BusFrame(id.word, data.size, data)
}

/** Codes of control frames. */
object Code {
  val Open    = 0x01
  val Short   = 0x02
  val Close   = 0x03
  val Done    = 0x11
  val Missing = 0x12
  val Busy    = 0x13
  val Unknown = 0x14
  val Hello   = 0x20
}

/** What a DONE says. */
object Result {
  val Delivered = 0
  val Refused   = 1
  val WrongCrc  = 2
}

/** Sizes and numbers that sender and receiver share. */
object Sizes {

  /** Addresses are 1 to this. */
  val LastAddress = 125

  /** Bytes of a message, at most. */
  val Message = 2048

  /** Bytes of a message that goes as SHORT, at most. */
  val Short = 6

  /** Bytes of a data frame. */
  val Frame = 8

  /** Frames that a MISSING can name. */
  val Map = 40

  /** The pipe of process data; lower ones are of messages. */
  val ProcessData = 15

  /** The bit of a life byte that says: about a message to all. */
  val ToAll = 0x80

  /** Messages that a node has under way at the same time; the last place is kept for urgent ones. */
  val Outgoing = 16

  /** Messages of up to six bytes that a receiver holds for its host. */
  val Shorts = 8

  /** Answers that wait for a place in the port; the last four places are kept for urgent ones. */
  val Answers = 16

  /** Values of process data that a node sends. */
  val Objects = 64

  /** Values of process data that a node follows. */
  val Watched = 64

  /** How far number `a` of 8 bits is ahead of `b`: newer if this is 1 to 127. */
  def ahead(a: Int, b: Int): Int = a - b & 0xff

  /** The CRC-32 of a message, as Ethernet and zlib have it. */
  def crc32(data: Seq[Int]): Int = {
    val crc = new java.util.zip.CRC32
    crc.update(data.map(_.toByte).toArray)
    crc.getValue.toInt
  }

  /** A number as bytes, the highest one first. */
  def bytes(number: Long, count: Int): Seq[Int] =
    (count - 1 to 0 by -1).map(i => (number >> 8 * i & 0xff).toInt)

  /** A number out of bytes, the highest one first. */
  def number(bytes: Seq[Int]): Long = bytes.foldLeft(0L)((n, b) => n << 8 | b)
}
