package flyframe.can

/** Reads a frame out of its bits without stuff bits, from SOF to the end of the CRC, and knows which bit is
  * the next (CAN-07 to CAN-09). A transmitter reads its own.
  */
class FrameReaderModel {
  import CanField._

  /** The field and the bit of it that come next. */
  var field: Int = Sof
  var bit: Int   = 0

  private var crc      = 0
  private var crcRead  = 0
  private var id       = 0
  private var remote   = false
  private var extended = false
  private var dlc      = 0
  private val data     = Array.fill(8)(0)

  /** The CRC over all bits up to now, 15 bits. */
  def checksum: Int = crc

  /** What was read of the CRC is right. */
  def crcIsRight: Boolean = crc == crcRead

  /** The bit that comes next is part of the arbitration (CAN-11). */
  def inArbitration: Boolean = Seq(Id, RtrOrSrr, Ide, IdExtension, Rtr).contains(field)

  /** Number of the next bit in the arbitration, from 1. */
  def arbitrationBit: Int = field match {
    case Id          => 1 + bit
    case RtrOrSrr    => 12
    case Ide         => 13
    case IdExtension => 14 + bit
    case _           => 32
  }

  /** The frame, when it has been read. */
  def frame: CanFrame =
    CanFrame(id, extended, remote, dlc, data.toSeq.take(CanFrame.size(dlc, remote)))

  def begin(): Unit = {
    go(Sof)
    crc = 0
    crcRead = 0
    id = 0
    extended = false
    dlc = 0
    for (i <- data.indices) data(i) = 0
  }

  /** Takes the next bit.
    *
    * @return
    *   false if it is a recessive FDF: a frame that is none of CAN 2.0 (CAN-08)
    */
  def take(level: Boolean): Boolean = {
    val value = if (level) 1 else 0
    if (field != Crc) crc = Crc15.next(crc, level)
    field match {
      case Sof => go(Id)
      case Id =>
        id = id << 1 | value
        onward(11, RtrOrSrr)
      case RtrOrSrr =>
        remote = level
        go(Ide)
      case Ide =>
        extended = level
        go(if (extended) IdExtension else Fdf)
      case IdExtension =>
        id = id << 1 | value
        onward(18, Rtr)
      case Rtr =>
        remote = level
        go(Fdf)
      case Fdf =>
        go(if (extended) R0 else Dlc)
        return !level
      case R0 => go(Dlc)
      case Dlc =>
        dlc = dlc << 1 | value
        onward(4, if (CanFrame.size(dlc, remote) > 0) Data else Crc)
      case Crc =>
        crcRead = crcRead << 1 | value
        onward(15, CrcDelimiter)
      case _ =>
        val n = field - Data
        data(n) = data(n) << 1 | value
        onward(8, if (n + 1 < CanFrame.size(dlc, remote)) field + 1 else Crc)
    }
    true
  }

  private def go(to: Int): Unit = {
    field = to
    bit = 0
  }
  private def onward(bits: Int, next: Int): Unit = if (bit + 1 < bits) bit += 1 else go(next)
}

object FrameReaderModel {
  import CanField._

  /** The level that the transmitter of `frame` gives to bit `bit` of `field` (CAN-07).
    *
    * @param checksum
    *   the CRC over the bits before
    */
  def level(frame: CanFrame, field: Int, bit: Int, checksum: Int): Boolean = {
    def of(value: Int, bits: Int) = (value >> (bits - 1 - bit) & 1) == 1
    field match {
      case Sof | Fdf | R0       => false
      case Id                   => of(frame.baseId, 11)
      case RtrOrSrr             => frame.extended || frame.remote
      case Ide                  => frame.extended
      case IdExtension          => of(frame.id, 18)
      case Rtr                  => frame.remote
      case Dlc                  => of(frame.dlc, 4)
      case Crc                  => of(checksum, 15)
      case byte if byte >= Data => of(frame.data(byte - Data), 8)
      case _                    => true
    }
  }
}
