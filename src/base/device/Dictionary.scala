package flyframe.device

/** What an entry of the dictionary holds before anybody has written it. */
sealed trait InitialValue

object InitialValue {

  /** A number; of floating point types a whole one. */
  final case class Number(value: BigInt) extends InitialValue

  /** A text, of type STRING. */
  final case class Text(value: String) extends InitialValue
}

/** One subindex of an object.
  *
  * @param dataType
  *   of SDOs; its `bits` are those of the value
  * @param access
  *   16 bit as in an SDO entry description: readable and writable in PREOP, SAFEOP, OP; mappable
  * @param range
  *   lowest and highest value that may be written
  */
final case class DictionaryEntry(
    name: String,
    dataType: DataType,
    access: Int,
    value: InitialValue,
    range: Option[(Long, Long)] = None
)

/** An object: `code` is 7 (variable), 8 (array) or 9 (record), `dataType` the code in its description,
  * `entries` its subindexes from 0 on, None where there is none.
  */
final case class DictionaryObject(
    index: Int,
    name: String,
    code: Int,
    dataType: Int,
    entries: Seq[Option[DictionaryEntry]]
) {

  /** Bytes of complete access: subindex 0 with its padding, and all others bit by bit. */
  def bytes: Int = {
    val own = entries.flatten.map(_.dataType.bits)
    if (code == Dictionary.Variable) (own.sum + 7) / 8 else 2 + (own.tail.sum + 7) / 8
  }
}

/** The object dictionary of a device: what its device file says of identity, process data and parameters, as
  * objects of ETG.1000.6. ESI, SII and the C table of the slave stack come from the same [[Device]].
  */
object Dictionary {
  val Variable = 7
  val Array    = 8
  val Record   = 9

  /** Objects that a device file may add: those of the manufacturer and of device profiles. */
  val Added: Range = 0x2000 to 0xffff

  /** Entries that a mapping object has at least when masters may change it. */
  val MappingRoom = 8

  /** Codes of records in object descriptions. */
  private val (pdoMapping, identity, syncParameter, anyRecord) = (0x21, 0x23, 0x29, 0x2a)

  private val (u8, u16, u32)                 = (typeOf("USINT"), typeOf("UINT"), typeOf("UDINT"))
  private def typeOf(name: String): DataType = DataType.all.find(_.name == name).get

  private def number(value: BigInt) = InitialValue.Number(value)
  private def entry(
      name: String,
      dataType: DataType,
      value: BigInt,
      access: Int = ObjectAccess.ReadOnly.code
  ) =
    DictionaryEntry(name, dataType, access, number(value))
  private def variable(index: Int, e: DictionaryEntry) =
    DictionaryObject(index, e.name, Variable, e.dataType.code, Seq(Some(e)))

  /** An object whose subindex 0 counts `count` of its entries, writable as `access` says. */
  private def counted(index: Int, name: String, code: Int, dataType: Int, count: Int, access: Int)(
      entries: Seq[Option[DictionaryEntry]]
  ) = DictionaryObject(
    index,
    name,
    code,
    dataType,
    Some(entry("Number of entries", u8, count, access)) +: entries
  )
  private def record(index: Int, name: String, dataType: Int)(entries: Seq[Option[DictionaryEntry]]) =
    counted(index, name, Record, dataType, entries.size, ObjectAccess.ReadOnly.code)(entries)

  /** All objects of `d` in ascending order of their indexes. */
  def of(d: Device): Seq[DictionaryObject] =
    (general(d) ++ d.pdos.map(mapping(d, _)) ++ managers(d) ++ processObjects(d) ++ d.objects.map(added))
      .sortBy(_.index)

  private def general(d: Device) = Seq(
    variable(0x1000, entry("Device type", u32, 0)),
    variable(0x1001, entry("Error register", u8, 0)),
    variable(
      0x1008,
      DictionaryEntry(
        "Device name",
        DataType.string(d.product.name.length),
        ObjectAccess.ReadOnly.code,
        InitialValue.Text(d.product.name)
      )
    ),
    record(0x1018, "Identity", identity)(
      Seq(
        "Vendor ID"       -> d.vendor.id,
        "Product code"    -> d.product.code,
        "Revision number" -> d.product.revision,
        "Serial number"   -> d.product.serial
      ).map { case (name, value) => Some(entry(name, u32, value)) }
    )
  )

  private def writable(yes: Boolean) = (if (yes) ObjectAccess.PreopWrite else ObjectAccess.ReadOnly).code
  private def can(d: Device, feature: CoeFeature) = d.mailbox.exists(_.coe(feature))

  /** How many entries the mapping object of `pdo` has room for. */
  def room(d: Device, pdo: Pdo): Int =
    if (can(d, CoeFeature.PdoConfig)) pdo.entries.size max MappingRoom else pdo.entries.size

  private def mapping(d: Device, pdo: Pdo) = {
    val access  = writable(can(d, CoeFeature.PdoConfig))
    val entries = pdo.entries.map(e => BigInt(e.index) << 16 | e.subIndex << 8 | e.bits)
    counted(pdo.index, pdo.name, Record, pdoMapping, entries.size, access)(
      entries.padTo(room(d, pdo), BigInt(0)).zipWithIndex.map { case (e, i) =>
        Some(entry(s"Mapping ${i + 1}", u32, e, access))
      }
    )
  }

  /** Types of SyncManagers, assignment of PDOs, synchronization. */
  private def managers(d: Device) = {
    val types = counted(0x1c00, "SyncManager types", Array, u8.code, d.syncManagers.size, writable(false))(
      d.syncManagers.zipWithIndex.map { case (sm, i) => Some(entry(s"Type $i", u8, sm.use.code)) }
    )
    val process = d.syncManagers.zipWithIndex.filter(_._1.use.process).flatMap { case (sm, i) =>
      val own    = (if (sm.use == SmUse.Outputs) d.rxPdos else d.txPdos).filter(_.syncManager == i)
      val access = writable(can(d, CoeFeature.PdoAssign))
      val assignment =
        counted(0x1c10 + i, s"PDO assignment of SyncManager $i", Array, u16.code, own.size, access)(
          own.zipWithIndex.map { case (pdo, k) => Some(entry(s"PDO ${k + 1}", u16, pdo.index, access)) }
        )
      val modes = if (d.dcModes.isEmpty) 3 else 7
      // With the outputs' SyncManager, which for inputs is another code.
      val synchronous = if (sm.use == SmUse.Inputs && d.syncManager(SmUse.Outputs).nonEmpty) 0x22 else 1
      val synchronization = record(0x1c30 + i, s"Synchronization of SyncManager $i", syncParameter)(
        Seq(
          Some(entry("Synchronization type", u16, synchronous, writable(true))),
          Some(entry("Cycle time", u32, 0)),
          Some(entry("Shift time", u32, 0)),
          Some(entry("Synchronization types supported", u16, modes)),
          Some(entry("Minimum cycle time", u32, d.minimumCycleNs))
        )
      )
      Seq(assignment, synchronization)
    }
    types +: process
  }

  /** The objects that PDOs map by default, one per index. */
  private def processObjects(d: Device) = {
    val mapped = for {
      (pdos, access) <- Seq(d.rxPdos -> ObjectAccess.RxMappable, d.txPdos -> ObjectAccess.TxMappable)
      pdo            <- pdos
      e              <- pdo.entries
      t              <- e.dataType
    } yield (e.index, e.subIndex, pdo.name, entry(e.name, t, 0, access))
    mapped.groupBy(_._1).toSeq.map { case (index, own) =>
      val bySubIndex = own.map(o => o._2 -> o._4).toMap
      if (bySubIndex.contains(0)) variable(index, bySubIndex(0))
      else record(index, own.head._3, anyRecord)((1 to bySubIndex.keys.max).map(bySubIndex.get))
    }
  }

  private def added(o: AddedObject) = {
    def entryOf(e: AddedEntry) = DictionaryEntry(
      e.name,
      e.dataType,
      e.access.code | (if (e.mappable) ObjectAccess.mapping(e.access) else 0),
      e.value.getOrElse(if (e.dataType.isText) InitialValue.Text("") else number(0)),
      e.range
    )
    o.entries match {
      case Seq(e) if e.subIndex == 0 => variable(o.index, entryOf(e).copy(name = o.name))
      case several =>
        val bySubIndex = several.map(e => e.subIndex -> entryOf(e)).toMap
        record(o.index, o.name, anyRecord)((1 to several.map(_.subIndex).max).map(bySubIndex.get))
    }
  }
}
