package flyframe.sii

/** What an EEPROM saw on its lines. */
sealed trait BusEvent
object BusEvent {
  case object Start extends BusEvent
  case object Stop  extends BusEvent

  /** A byte from the master, and whether the EEPROM acknowledged it. */
  final case class Written(byte: Int, acknowledged: Boolean = true) extends BusEvent

  /** A byte from the EEPROM, and whether the master acknowledged it. */
  final case class Read(byte: Int, acknowledged: Boolean = true) extends BusEvent
}

/** An I2C EEPROM, bit by bit: it is given its two lines once per core cycle.
  *
  * @param content
  *   bytes, a power of two of them
  * @param twoByte
  *   two address bytes and three address bits in the control byte; else one address byte
  */
class I2cEeprom(val content: Array[Int], twoByte: Boolean) {
  import BusEvent._

  /** What happened, in order. */
  var log: Vector[BusEvent] = Vector.empty

  /** Cycles of the rising and falling edges of the clock, of a START or STOP. */
  var rises: Vector[Long]  = Vector.empty
  var falls: Vector[Long]  = Vector.empty
  var starts: Vector[Long] = Vector.empty
  var stops: Vector[Long]  = Vector.empty

  /** Edges of the data line while the clock is low. */
  var changes: Vector[Long] = Vector.empty

  /** Nobody acknowledges: there is no EEPROM. */
  var isAbsent = false

  /** Bytes not to acknowledge: number of the transfer, of the byte within it, both from 0. */
  var refuses: (Int, Int) => Boolean = (_, _) => false

  /** Cycles an EEPROM is deaf after a write. */
  var writeCycles = 0L

  /** Both lines changed in one cycle. */
  var races = 0

  /** The EEPROM pulls the data line low. */
  var pulls = false

  private var cycle            = 0L
  private var (scl0, sda0)     = (true, true)
  private var bits             = 0     // clock pulses of this byte
  private var shift            = 0
  private var listens          = false // takes bytes
  private var sends            = false
  private var acknowledges     = false
  private var position         = 0     // of the byte in the transfer
  private var transfers        = 0
  private var number           = 0     // bytes since the first START of the transfer
  private var pointer          = 0
  private var pending          = Vector.empty[Int]
  private var deafUntil        = 0L
  private var isOpen           = false // between START and STOP
  private def at(address: Int) = address & (content.length - 1)
  private val addressBytes     = if (twoByte) 2 else 1

  /** One core cycle with these lines. */
  def step(scl: Boolean, sda: Boolean): Unit = {
    if (scl && scl0) {
      if (sda0 && !sda) start() else if (!sda0 && sda) stop()
    } else {
      if (sda != sda0) { if (scl != scl0) races += 1; changes :+= cycle }
      if (scl && !scl0) { rises :+= cycle; rising(sda) }
      if (!scl && scl0) { falls :+= cycle; falling() }
    }
    scl0 = scl; sda0 = sda
    cycle += 1
  }

  private def start(): Unit = {
    log :+= Start
    starts :+= cycle
    if (!isOpen) { number = 0; isOpen = true }
    bits = 0; shift = 0; position = 0
    listens = true; sends = false; pulls = false
    pending = Vector.empty
  }
  private def stop(): Unit = {
    log :+= Stop
    stops :+= cycle
    if (listens && pending.nonEmpty) {
      for ((b, i) <- pending.zipWithIndex) content(at(pointer + i)) = b
      deafUntil = cycle + writeCycles
    }
    listens = false; sends = false; pulls = false; isOpen = false
    transfers += 1
  }
  private def rising(sda: Boolean): Unit = if (listens || sends) {
    bits += 1
    if (listens && bits <= 8) shift = (shift << 1 | (if (sda) 1 else 0)) & 0xff
    if (bits == 9) {
      if (listens) log :+= Written(shift, !sda)
      else {
        log :+= Read(content(at(pointer)), !sda)
        acknowledges = !sda
      }
    }
  }
  private def falling(): Unit =
    if (listens) bits match {
      case 8 =>
        val deaf = isAbsent || cycle < deafUntil || refuses(transfers, number) ||
          (position == 0 && shift >> 4 != 0xa)
        acknowledges = !deaf
        pulls = acknowledges
      case 9 =>
        pulls = false
        bits = 0
        number += 1
        if (acknowledges) take(shift) else listens = false
        position += 1
      case _ =>
    }
    else if (sends) bits match {
      case 8 => pulls = false
      case 9 =>
        bits = 0
        pointer = at(pointer + 1)
        if (acknowledges) drive() else { sends = false; pulls = false }
      case _ => drive()
    }
  private def drive(): Unit = pulls = (content(at(pointer)) >> (7 - bits) & 1) == 0

  private def take(byte: Int): Unit = position match {
    case 0 if (byte & 1) == 1 =>
      listens = false; sends = true
      drive()
    case 0 => pointer = byte >> 1 & 7
    case n if n <= addressBytes =>
      pointer = pointer << 8 | byte
      if (n == addressBytes) pointer = at(pointer)
    case _ => pending :+= byte
  }
}
