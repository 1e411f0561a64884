package flyframe.device

/** What a SyncManager is for. `code` is the type byte of the SII, `esi` the text of the ESI element,
  * `control` the low nibble of the control byte (0x0804+8n) that the use demands, `default` the whole byte if
  * the device file gives none.
  */
sealed abstract class SmUse(val code: Int, val name: String, val esi: String, val default: Int) {
  def control: Int     = default & 0x0f
  def mailbox: Boolean = this == SmUse.MailboxOut || this == SmUse.MailboxIn
  def process: Boolean = this == SmUse.Outputs || this == SmUse.Inputs

  /** Buffers in memory (SM-09, SM-17). */
  def buffers: Int = if (process) 3 else 1
}

object SmUse {
  case object Unused extends SmUse(0, "unused", "", 0x00)

  /** Master to device. */
  case object MailboxOut extends SmUse(1, "mailboxOut", "MBoxOut", 0x26)

  /** Device to master. */
  case object MailboxIn extends SmUse(2, "mailboxIn", "MBoxIn", 0x22)

  /** Master to device; triggers the process data watchdog. */
  case object Outputs extends SmUse(3, "outputs", "Outputs", 0x64)

  /** Device to master. */
  case object Inputs extends SmUse(4, "inputs", "Inputs", 0x20)

  val all: Seq[SmUse] = Seq(Unused, MailboxOut, MailboxIn, Outputs, Inputs)
}

/** What an FMMU is for: code of the SII, name in the device file, text in the ESI. */
sealed abstract class FmmuUse(val code: Int, val name: String, val esi: String)

object FmmuUse {
  case object Unused       extends FmmuUse(0, "unused", "")
  case object Outputs      extends FmmuUse(1, "outputs", "Outputs")
  case object Inputs       extends FmmuUse(2, "inputs", "Inputs")
  case object MailboxState extends FmmuUse(3, "mailboxState", "MBoxState")

  val all: Seq[FmmuUse] = Seq(Unused, Outputs, Inputs, MailboxState)
}

/** A data type of process data: name as in the ESI, code as in the SII, length in bits. */
final case class DataType(name: String, code: Int, bits: Int) {
  def isText: Boolean  = code == DataType.TextCode
  def isFloat: Boolean = Set("REAL", "LREAL")(name)

  /** Lowest and highest number of this type; none for texts and floating point numbers. */
  def range: Option[(BigInt, BigInt)] = Option.when(!isText && !isFloat) {
    val half = BigInt(1) << (bits - 1)
    if (Set("SINT", "INT", "DINT", "LINT")(name)) (-half, half - 1) else (BigInt(0), 2 * half - 1)
  }
}

object DataType {
  private val TextCode = 0x09

  /** Text of `length` bytes: 1 to 1024, in objects only. */
  def string(length: Int): DataType = DataType(s"STRING($length)", TextCode, 8 * length)

  val all: Seq[DataType] = Seq(
    DataType("BOOL", 0x01, 1),
    DataType("SINT", 0x02, 8),
    DataType("INT", 0x03, 16),
    DataType("DINT", 0x04, 32),
    DataType("USINT", 0x05, 8),
    DataType("UINT", 0x06, 16),
    DataType("UDINT", 0x07, 32),
    DataType("REAL", 0x08, 32),
    DataType("LREAL", 0x11, 64),
    DataType("LINT", 0x15, 64),
    DataType("ULINT", 0x1b, 64),
    DataType("BYTE", 0x1e, 8),
    DataType("WORD", 0x1f, 16),
    DataType("DWORD", 0x20, 32),
    DataType("BITARR8", 0x2d, 8),
    DataType("BITARR16", 0x2e, 16),
    DataType("BITARR32", 0x2f, 32)
  ) ++ (1 to 8).map(n => DataType(s"BIT$n", 0x2f + n, n))
}

/** The mailbox protocols: bit of SII word 0x1C, name in device file and ESI. The order is that of the ESI. */
sealed abstract class MailboxProtocol(val bit: Int, val name: String)

object MailboxProtocol {
  case object AoE extends MailboxProtocol(0x01, "AoE")
  case object EoE extends MailboxProtocol(0x02, "EoE")
  case object CoE extends MailboxProtocol(0x04, "CoE")
  case object FoE extends MailboxProtocol(0x08, "FoE")
  case object SoE extends MailboxProtocol(0x10, "SoE")
  case object VoE extends MailboxProtocol(0x20, "VoE")

  val all: Seq[MailboxProtocol] = Seq(AoE, EoE, CoE, FoE, SoE, VoE)
}

/** What the CoE server can do: bit of the SII's CoE details, name in device file, attribute in the ESI. */
sealed abstract class CoeFeature(val bit: Int, val name: String, val esi: String)

object CoeFeature {
  case object SdoInfo        extends CoeFeature(0x02, "sdoInfo", "SdoInfo")
  case object PdoAssign      extends CoeFeature(0x04, "pdoAssign", "PdoAssign")
  case object PdoConfig      extends CoeFeature(0x08, "pdoConfig", "PdoConfig")
  case object PdoUpload      extends CoeFeature(0x10, "pdoUpload", "PdoUpload")
  case object CompleteAccess extends CoeFeature(0x20, "completeAccess", "CompleteAccess")

  val all: Seq[CoeFeature] = Seq(SdoInfo, PdoAssign, PdoConfig, PdoUpload, CompleteAccess)
}

/** Maker. `id`: 32 bit, assigned by the EtherCAT Technology Group; 0 = none. */
final case class Vendor(id: Long, name: String)

/** Identity: `code`, `revision`, `serial` 32 bit each. `order` is the order number; masters show it as the
  * device's name.
  */
final case class Product(code: Long, revision: Long, serial: Long, order: String, name: String)

/** Group under which tools list the device. */
final case class Group(kind: String, name: String)

/** SII words 0 to 6, 16 bit each: what the controller loads at power-on (SII-05). */
final case class Configuration(
    pdiControl: Int = 0,
    pdiConfiguration: Int = 0,
    syncPulse: Int = 0,
    extendedPdiConfiguration: Int = 0,
    stationAlias: Int = 0,
    escA5: Int = 0,
    escA6: Int = 0
) {

  /** In the order of the SII. */
  def words: Seq[Int] =
    Seq(pdiControl, pdiConfiguration, syncPulse, extendedPdiConfiguration, stationAlias, escA5, escA6)
}

/** A SyncManager: first byte address, length of one buffer in bytes, control byte (0x0804+8n). */
final case class SyncManager(use: SmUse, start: Int, size: Int, control: Int)

/** One variable in a PDO; `dataType` None is padding. `bits`: 1 to 255. */
final case class PdoEntry(index: Int, subIndex: Int, name: String, dataType: Option[DataType], bits: Int)

/** A process data object, carried by SyncManager number `syncManager`. */
final case class Pdo(index: Int, name: String, syncManager: Int, entries: Seq[PdoEntry]) {
  def bits: Int = entries.map(_.bits).sum
}

/** Area of a mailbox: first byte address and bytes. */
final case class MailboxArea(start: Int, size: Int)

/** What the bootstrap state uses instead of the mailbox SyncManagers. `receive`: master to device. */
final case class Bootstrap(receive: MailboxArea, send: MailboxArea)

/** What the host software offers through the mailbox. No protocol: masters set it up and send nothing.
  * `repeat`: the host answers repeat requests (SM-35).
  */
final case class Mailbox(
    protocols: Set[MailboxProtocol] = Set.empty,
    coe: Set[CoeFeature] = Set.empty,
    repeat: Boolean = false,
    bootstrap: Option[Bootstrap] = None
)

/** A way to use distributed clocks. Times in ns; `assignActivate` goes to 0x0980:0x0981. A cycle is
  * `cycleTime0`, or, if that is 0, the master's cycle times `cycleFactor0`; `cycleFactor1` counts SYNC0
  * cycles.
  */
final case class DcMode(
    name: String,
    description: String,
    assignActivate: Int,
    cycleTime0: Long = 0,
    cycleFactor0: Int = 0,
    shiftTime0: Int = 0,
    cycleFactor1: Int = 0,
    shiftTime1: Int = 0
)

/** Who may access an entry: `code` as in an SDO entry description, `name` in the device file. */
sealed abstract class ObjectAccess(val code: Int, val name: String)

object ObjectAccess {
  case object ReadOnly   extends ObjectAccess(0x07, "ro")
  case object ReadWrite  extends ObjectAccess(0x3f, "rw")
  case object PreopWrite extends ObjectAccess(0x0f, "rwPreop")

  val all: Seq[ObjectAccess] = Seq(ReadOnly, ReadWrite, PreopWrite)

  private val (receive, transmit) = (0x40, 0x80)

  /** Outputs and inputs of a device. */
  val RxMappable: Int = ReadWrite.code | receive
  val TxMappable: Int = ReadOnly.code | transmit

  /** How an entry may be mapped: what masters may not write is an input. */
  def mapping(access: ObjectAccess): Int = if (access == ReadOnly) transmit else receive
}

/** An entry of an object that a device file adds. `mappable`: into a TxPDO if it is `ro`, else into an RxPDO.
  * `range`: what masters may write.
  */
final case class AddedEntry(
    subIndex: Int,
    name: String,
    dataType: DataType,
    access: ObjectAccess,
    value: Option[InitialValue],
    range: Option[(Long, Long)],
    mappable: Boolean
)

/** An object that a device file adds; a single entry with subindex 0 is a variable, all else a record. */
final case class AddedObject(index: Int, name: String, entries: Seq[AddedEntry])

/** A device: everything masters and tools learn from SII and ESI. Read by [[DeviceFile]], checked against a
  * controller by [[DeviceCheck]]. `minimumCycleNs`: the shortest process data cycle that the program keeps.
  */
final case class Device(
    vendor: Vendor,
    product: Product,
    group: Group,
    configuration: Configuration,
    eepromBytes: Int,
    syncManagers: Seq[SyncManager],
    fmmus: Seq[FmmuUse],
    rxPdos: Seq[Pdo],
    txPdos: Seq[Pdo],
    mailbox: Option[Mailbox],
    dcModes: Seq[DcMode],
    objects: Seq[AddedObject] = Nil,
    minimumCycleNs: Long = 0
) {
  def pdos: Seq[Pdo] = rxPdos ++ txPdos

  /** The first SyncManager used for `use`. */
  def syncManager(use: SmUse): Option[SyncManager] = syncManagers.find(_.use == use)
}
