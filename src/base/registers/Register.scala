package flyframe.registers

/** What one side (ECAT or PDI) may do with a register. */
sealed abstract class Access(val code: String, val readable: Boolean, val writable: Boolean)
object Access {
  case object None      extends Access("-", false, false)
  case object Read      extends Access("r", true, false)
  case object ReadWrite extends Access("rw", true, true)

  /** Writing is allowed while the register's guard holds, see [[Register.ecatGuard]]. */
  case object ReadGuardedWrite extends Access("r/(w)", true, true)

  /** Reading acknowledges an event. */
  case object ReadAcknowledge extends Access("r/ack", true, false)

  /** A write of any value clears the register and its whole group (ERR-10). */
  case object ReadClear extends Access("r/clr", true, true)
}

/** Where a field's value comes from. */
sealed trait Source
object Source {

  /** Fixed when the hardware is built: the reset value. */
  case object Constant extends Source

  /** Flip-flops written by a bus.
    *
    * @param hardwareSet
    *   a unit may load it as well
    * @param mirrored
    *   also kept as [[Ram]], from where it is read
    */
  final case class Stored(hardwareSet: Boolean = false, mirrored: Boolean = false) extends Source {
    require(
      !(hardwareSet && mirrored),
      "hardwareSet is true but must be false for a mirrored field, whose copy changes by writes only."
    )
  }

  /** Driven by a unit of the controller, which also sees what is written there. */
  case object Status extends Source

  /** Lives in the register RAM: plain storage, no unit sees its value all the time. Takes its reset value by
    * a reset.
    */
  case object Ram extends Source

  /** Kept by its unit in block RAM of the unit's own, which answers a cycle after the address, with the
    * reserved bits. All fields of a register are; those of a unit stand within 256 bytes, from an address on
    * that ends with 00, in which no other unit keeps any.
    *
    * @param written
    *   a write changes it; else only its unit does
    * @param shown
    *   it is what the unit shows, as a [[Status]] is
    */
  final case class Kept(written: Boolean = false, shown: Boolean = false) extends Source

  /** Counts events up to 0xFF and stays there (ERR-10); cleared with all other counters of `group`. A whole
    * byte; of a slave it lives in block RAM.
    */
  final case class Counter(group: String) extends Source
}

/** Bits `high` to `low` (within the register, little endian) of a register. `name` is the signal name in the
  * RTL.
  */
final case class Field(
    name: String,
    high: Int,
    low: Int,
    source: Source,
    reset: BigInt,
    meaning: String
) {
  require(
    high >= low && low >= 0,
    s"field $name has bits $high to $low but must have bits from high to low, down to 0."
  )
  def width: Int = high - low + 1
  source match {
    case Source.Counter(_) =>
      require(
        width == 8 && low % 8 == 0,
        s"field $name counts and has bits $high to $low but must be a whole byte."
      )
    case _ =>
  }

  /** Bits set where the field is in the register. */
  val mask: BigInt = ((BigInt(1) << width) - 1) << low

  /** It is read from the register RAM. */
  def inRam: Boolean = source match {
    case Source.Ram                 => true
    case Source.Stored(_, mirrored) => mirrored
    case _                          => false
  }
}

/** A register that exists once in each of `count` equal units, `stride` bytes apart; this is that of unit
  * `index`.
  */
final case class Block(index: Int, count: Int, stride: Int)

/** One register, a row of a unit's table (see [[RegisterTable]]): the only place where its address, layout,
  * access, reset and meaning are written down. RTL decode, golden model, `docs/registers.md`, the C header
  * and the register tests are derived from it.
  *
  * Bits without a field are reserved: they read 0 and ignore writes. All `bytes` of a register have its
  * access.
  *
  * @param address
  *   first byte, 0x0000 to 0x0F7F
  * @param rule
  *   rule of the specification it implements
  * @param ecatGuard
  *   name of the condition under which ECAT may write, if there is one
  * @param pdiGuard
  *   the same for the PDI
  * @param present
  *   name of the condition under which it is there, if there is one; else nobody may read or write it
  * @param block
  *   set if there are several of its kind
  * @param managed
  *   SyncManagers act on it, as on memory (SM-26)
  * @param bitWritable
  *   an FMMU writes single bits of it; of other registers it writes whole bytes (FMMU-10)
  */
final case class Register(
    name: String,
    title: String,
    address: Int,
    bytes: Int,
    ecat: Access,
    pdi: Access,
    rule: String,
    fields: Seq[Field],
    ecatGuard: Option[String] = None,
    pdiGuard: Option[String] = None,
    present: Option[String] = None,
    block: Option[Block] = None,
    managed: Boolean = false,
    bitWritable: Boolean = false
) {
  require(bytes > 0, s"register $name has $bytes bytes but must have 1 or more.")
  for (f <- fields)
    require(
      f.high < 8 * bytes,
      s"field ${f.name} has bits ${f.high} to ${f.low} but must be within ${8 * bytes - 1} to 0 of " +
        s"register $name."
    )

  /** Names of all conditions for access to it. */
  def guards: Seq[String] = (ecatGuard ++ pdiGuard ++ present).toSeq

  /** It is read from the register RAM. */
  def inRam: Boolean = fields.exists(_.inRam)
  require(
    !inRam || fields.forall(_.inRam),
    s"register $name has ${fields.count(_.inRam)} fields in RAM but must have all ${fields.size} or " +
      "none there."
  )

  /** A write of it changes something. */
  def stores: Boolean = fields.exists(_.source match {
    case _: Source.Stored | Source.Ram | _: Source.Counter => true
    case Source.Kept(written, _)                           => written
    case _                                                 => false
  })

  /** Bits that have a field. */
  def mask: BigInt = fields.map(_.mask).fold(BigInt(0))(_ | _)

  /** Value after a reset. */
  def reset: BigInt = fields.map(f => f.reset << f.low).fold(BigInt(0))(_ | _)

  def covers(byteAddress: Int): Boolean = byteAddress >= address && byteAddress < address + bytes

  /** The beginning of a sentence on its address. */
  private[registers] def place: String =
    f"register $name is at 0x$address%04x to 0x${address + bytes - 1}%04x"

  /** The byte addresses of this register. */
  def range: Range = address until address + bytes
}
