package flyframe.device

/** The mailbox words of one state: receive is master to device. Byte addresses and bytes, 16 bit. */
final case class SiiMailbox(receiveStart: Int, receiveSize: Int, sendStart: Int, sendSize: Int) {
  def words: Seq[Int] = Seq(receiveStart, receiveSize, sendStart, sendSize)
}

object SiiMailbox {
  val none: SiiMailbox = SiiMailbox(0, 0, 0, 0)
}

/** Words 0x00 to 0x3F of an SII image. `configuration`: words 0 to 6. `checksum`: word 7 as it stands if it
  * is not simply the checksum, such as 0x88A4, which switches the check off (SII-03). `others`: words of no
  * meaning here that are not 0, by word address. `sizeKbit`: EEPROM size in Kbit, 1 to 65536.
  */
final case class SiiHeader(
    configuration: Seq[Int],
    checksum: Option[Int],
    vendor: Long,
    product: Long,
    revision: Long,
    serial: Long,
    bootstrap: SiiMailbox,
    mailbox: SiiMailbox,
    protocols: Int,
    others: Map[Int, Int],
    sizeKbit: Int,
    version: Int
)

/** A category of an SII image. */
sealed trait SiiCategory {

  /** The type in the category's header. */
  def code: Int
}

/** Texts, referred to by their number from 1; 0 = none. `rest`: bytes behind the last, if unlike the usual
  * padding.
  */
final case class SiiStrings(texts: Seq[String], rest: Seq[Int] = Nil) extends SiiCategory {
  def code: Int = SiiCategory.Strings
}

/** General. `group`, `image`, `order`, `name`, `groupName`: numbers of strings. `flags`: [0] SafeOp, [1] no
  * LRW, [2] mailbox repeat. `current`: drawn from the EBUS, mA, negative if fed. `ports`: four bits per port,
  * 1 = MII, 3 = EBUS. `reserved`: byte 4, `rest`: bytes from 0x12 on.
  */
final case class SiiGeneral(
    group: Int,
    image: Int,
    order: Int,
    name: Int,
    coe: Int,
    foe: Int,
    eoe: Int,
    soeChannels: Int,
    ds402Channels: Int,
    sysmanClass: Int,
    flags: Int,
    current: Int,
    groupName: Int,
    ports: Int,
    reserved: Seq[Int] = Seq(0, 0),
    rest: Seq[Int] = Seq.fill(14)(0)
) extends SiiCategory {
  def code: Int = SiiCategory.General
}

/** Use of each FMMU, a byte each; 0xFF, also used as padding, is none. */
final case class SiiFmmus(uses: Seq[Int]) extends SiiCategory {
  def code: Int = SiiCategory.Fmmu
}

/** One SyncManager as the SII holds it. `enable`: [0] enabled, [1] fixed, [2] virtual, [3] in Op only. */
final case class SiiSyncManager(start: Int, size: Int, control: Int, status: Int, enable: Int, kind: Int)

final case class SiiSyncManagers(managers: Seq[SiiSyncManager]) extends SiiCategory {
  def code: Int = SiiCategory.SyncManager
}

/** `name`: number of a string; `dataType`: code of [[DataType]], 0 = padding; `bits`: 0 to 255. */
final case class SiiPdoEntry(index: Int, subIndex: Int, name: Int, dataType: Int, bits: Int, flags: Int)

/** `syncManager` 0xFF: not assigned. `flags`: [0] mandatory, [4] fixed. */
final case class SiiPdo(
    index: Int,
    syncManager: Int,
    dcSync: Int,
    name: Int,
    flags: Int,
    entries: Seq[SiiPdoEntry]
)

/** The TxPDOs (inputs of the master) or RxPDOs. */
final case class SiiPdos(tx: Boolean, pdos: Seq[SiiPdo]) extends SiiCategory {
  def code: Int = if (tx) SiiCategory.TxPdo else SiiCategory.RxPdo
}

/** Times in ns; factors as in [[DcMode]]; `name`, `description`: numbers of strings. */
final case class SiiDcMode(
    cycleTime0: Long,
    shiftTime0: Int,
    shiftTime1: Int,
    cycleFactor1: Int,
    assignActivate: Int,
    cycleFactor0: Int,
    name: Int,
    description: Int,
    reserved: Seq[Int] = Seq.fill(4)(0)
)

final case class SiiDcModes(modes: Seq[SiiDcMode]) extends SiiCategory {
  def code: Int = SiiCategory.Dc
}

/** A category that is not interpreted, such as those of the device's maker. */
final case class SiiOther(code: Int, bytes: Seq[Int]) extends SiiCategory

object SiiCategory {
  val Strings     = 10
  val General     = 30
  val Fmmu        = 40
  val SyncManager = 41
  val TxPdo       = 50
  val RxPdo       = 51
  val Dc          = 60
  val End         = 0xffff

  /** Name of the category type `code`. */
  def name(code: Int): String = code match {
    case Strings     => "STRINGS"
    case General     => "GENERAL"
    case Fmmu        => "FMMU"
    case SyncManager => "SYNCM"
    case TxPdo       => "TXPDO"
    case RxPdo       => "RXPDO"
    case Dc          => "DC"
    case other       => s"$other"
  }
}

/** The contents of an SII EEPROM. `bytes`: its length; what is behind the last category is 0xFF but for
  * `tail`.
  */
final case class SiiImage(header: SiiHeader, categories: Seq[SiiCategory], bytes: Int, tail: Seq[Int] = Nil) {

  /** Text number `number`, from 1; empty for 0 and numbers without a text. */
  def text(number: Int): String =
    categories.collectFirst { case s: SiiStrings => s.texts }.flatMap(_.lift(number - 1)).getOrElse("")
}
