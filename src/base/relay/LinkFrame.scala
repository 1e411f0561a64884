package flyframe.relay

import flyframe.can.{CanFrame, StuffingModel}

/** The header of a link frame (FR-41).
  *
  * @param kind
  *   0 data, 1 start of a life, 2 and 3 are passed on only
  * @param direction
  *   port by which the source sent this copy, 0 or 1
  * @param source
  *   address, 7 bits
  * @param sequence
  *   14 bits
  * @param hops
  *   255 at the source, less one at each node
  */
final case class LinkHeader(kind: Int, direction: Int, source: Int, sequence: Int, hops: Int) {

  /** Kind to sequence, 24 bits: what all copies of a direction have in common. */
  def word: Int = kind << 22 | direction << 21 | source << 14 | sequence

  /** The check field: CRC-8 over the 32 bits from kind to hops. */
  def check: Int = {
    val checked = word << 8 | hops
    var crc     = LinkCrc.Start8
    for (i <- 31 to 0 by -1) crc = LinkCrc.next8(crc, (checked >>> i & 1) == 1)
    crc ^ 0xff
  }

  /** Kind to check, 40 bits. */
  def bits: Seq[Boolean] = LinkFrame.bits(word, 24) ++ LinkFrame.bits(hops, 8) ++ LinkFrame.bits(check, 8)
}

object LinkHeader {

  /** At the source. */
  val Hops = 255

  /** Bits from kind to check. */
  val Bits = 40

  /** The number of the byte of the hops, from kind on. */
  val HopsByte = 3

  /** Of the 32 bits in front of the check. */
  def of(word: Int): LinkHeader =
    LinkHeader(word >>> 30, word >>> 29 & 1, word >>> 22 & 0x7f, word >>> 8 & 0x3fff, word & 0xff)
}

/** What stands behind the header: identifier word, length, data, CRC, without stuffing, as far as it is
  * there. It passes through the nodes unchanged.
  */
final class LinkBody {
  import LinkBody._
  private val bits = new Array[Boolean](MaxBits)

  /** How many bits are there. */
  var count = 0

  /** How many there will be; known when the length is there. */
  var total: Int = MaxBits

  def apply(i: Int): Boolean = bits(i)

  def add(bit: Boolean): Unit = {
    bits(count) = bit
    count += 1
    if (count == HeadBits) {
      val isRemote = bits(1)
      total = HeadBits + 8 * CanFrame.size(number(36, 4), isRemote) + CrcBits
    }
  }

  /** The bits from `from` on as a number. */
  private def number(from: Int, length: Int): Int =
    (from until from + length).foldLeft(0)((n, i) => n << 1 | (if (bits(i)) 1 else 0))

  def isWhole: Boolean = count == total

  /** Has the same bits. */
  def isLike(o: LinkBody): Boolean = count == o.count && (0 until count).forall(i => bits(i) == o.bits(i))

  /** Takes over the bits of another one. */
  def copyFrom(o: LinkBody): Unit = {
    System.arraycopy(o.bits, 0, bits, 0, MaxBits)
    count = o.count
    total = o.total
  }

  /** The arbitration field as [[CanFrame.order]] has it, if the identifier is there. */
  def order: Long = LinkFrame.order(number(0, WordBits))

  /** Bits that are 0 in every frame of today: 29 of the word, the high ones of an 11-bit identifier, four of
    * the length.
    */
  private def isReserved: Boolean = {
    val word = number(0, WordBits)
    (word >> 29 & 1) == 1 || number(WordBits, 4) != 0 || (word >= 0 && (word & 0x1ffff800) != 0)
  }

  /** The CAN frame of a whole body, if it is one (RB-06). */
  def frame: Option[CanFrame] = if (!isWhole || isReserved) None
  else {
    val word = number(0, WordBits)
    val dlc  = number(36, 4)
    val data = (0 until (total - HeadBits - CrcBits) / 8).map(i => number(HeadBits + 8 * i, 8))
    Some(CanFrame(word & 0x1fffffff, word < 0, (word >> 30 & 1) == 1, dlc, data))
  }
}

object LinkBody {
  private val WordBits = 32
  private val HeadBits = 40
  private val CrcBits  = 32
  val MaxBits: Int     = HeadBits + 64 + CrcBits

  /** The body of a frame behind this header. */
  def of(header: LinkHeader, frame: CanFrame): LinkBody = {
    val body    = new LinkBody
    val covered = bitsOf(frame)
    val crc     = LinkCrc.of(LinkFrame.bits(header.word, 24) ++ covered)
    (covered ++ LinkFrame.bits(crc, CrcBits)).foreach(body.add)
    body
  }

  private def bitsOf(frame: CanFrame) =
    LinkFrame.bits(frame.word, WordBits) ++ LinkFrame.bits(frame.dlc, 8) ++
      frame.data.flatMap(LinkFrame.bits(_, 8))
}

/** Link frames as levels (FR-41 to FR-43). */
object LinkFrame {

  /** Recessive bits that end a frame, and dominant ones that abort it. */
  val EndBits   = 7
  val AbortBits = 7

  /** Recessive bits behind an end, in front of a frame that is passed on and of an own one (FR-44). */
  val PassingGap = 1
  val OwnGap     = 9

  /** From so many waiting frames on there is no gap, and no own frame begins (FR-48, RB-07). */
  val Many = 4

  /** The low `count` bits of a number, the most significant one first. */
  def bits(value: Int, count: Int): Seq[Boolean] = (count - 1 to 0 by -1).map(i => (value >>> i & 1) == 1)

  /** The arbitration field of a frame with this identifier word: the lower one comes first in CAN order. */
  def order(word: Int): Long = {
    val remote = (word >>> 30 & 1).toLong
    if (word < 0) (word >>> 18 & 0x7ffL) << 21 | 3L << 19 | (word & 0x3ffffL) << 1 | remote
    else (word & 0x7ffL) << 21 | remote << 20
  }

  /** The levels from start to CRC, stuffed. */
  def levels(header: LinkHeader, body: LinkBody): Array[Boolean] = {
    val out      = new Array[Boolean](MostLevels)
    val stuffing = new StuffingModel
    var count    = 0
    def level(bit: Boolean): Unit = {
      out(count) = bit
      count += 1
      stuffing.take(bit)
    }
    def put(bit: Boolean): Unit = {
      level(bit)
      if (stuffing.awaits) level(stuffing.stuffBit)
    }
    def number(value: Int, bits: Int): Unit = {
      var i = bits - 1
      while (i >= 0) {
        put((value >>> i & 1) == 1)
        i -= 1
      }
    }
    stuffing.begin()
    put(false)
    number(header.word, 24)
    number(header.hops, 8)
    number(header.check, 8)
    var i = 0
    while (i < body.total) {
      put(i < body.count && body(i))
      i += 1
    }
    java.util.Arrays.copyOf(out, count)
  }

  /** Bits of the longest frame: a stuff bit behind every fourth bit is the worst case. */
  val MostLevels: Int = (1 + LinkHeader.Bits + LinkBody.MaxBits) * 5 / 4 + 1
}
