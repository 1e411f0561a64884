package flyframe.registers

import chisel3._
import chisel3.util._
import scala.collection.immutable.SeqMap
import flyframe.lanes.Lanes
import flyframe.params.EscParams

/** Signals by field name, so that the names survive into the Verilog. */
class FieldRecord(types: SeqMap[String, Data]) extends Record {
  val elements: SeqMap[String, Data] = types.map { case (name, data) => name -> data.cloneType }

  /** The signal of a name; a name without one ends the program. */
  def apply(name: String): Data = elements.getOrElse(
    name,
    throw new IllegalArgumentException(
      s"the name is $name but must be one of ${elements.keys.toSeq.sorted.mkString(", ")}."
    )
  )
  def uint(name: String): UInt        = apply(name).asInstanceOf[UInt]
  def bool(name: String): Bool        = uint(name)(0)
  def pulse(name: String): Bool       = apply(name).asInstanceOf[Bool]
  def load(name: String): Valid[UInt] = apply(name).asInstanceOf[Valid[UInt]]
}

/** Records of signals for the fields of registers, each as a [[RegisterFile]] has it. */
object FieldRecord {

  /** A pulse or a level by each of these names. */
  def pulses(names: Seq[String]): FieldRecord = new FieldRecord(SeqMap.from(names.map(_ -> Bool())))

  /** Present values of the stored fields. */
  def value(registers: Seq[Register]): FieldRecord =
    of(registers) { case f @ Field(_, _, _, _: Source.Stored, _, _) => UInt(f.width.W) }

  /** New values from units, for stored fields that allow it. */
  def set(registers: Seq[Register]): FieldRecord =
    of(registers) { case f @ Field(_, _, _, Source.Stored(true, _), _, _) => Valid(UInt(f.width.W)) }

  /** Values of status fields. */
  def status(registers: Seq[Register]): FieldRecord =
    of(registers) { case f @ Field(_, _, _, Source.Status, _, _) => UInt(f.width.W) }

  /** Pulses that count. */
  def event(registers: Seq[Register]): FieldRecord =
    of(registers) { case Field(_, _, _, Source.Counter(_), _, _) => Bool() }

  /** How many there were, as far as flip-flops count. */
  def count(registers: Seq[Register]): FieldRecord =
    of(registers) { case Field(_, _, _, Source.Counter(_), _, _) => UInt(8.W) }

  /** Conditions under which registers are there, or guarded ones may be written, by name. */
  def guard(registers: Seq[Register]): FieldRecord = pulses(registers.flatMap(_.guards).distinct)

  private def of(registers: Seq[Register])(select: PartialFunction[Field, Data]): FieldRecord =
    new FieldRecord(SeqMap.from(registers.flatMap(_.fields).collect {
      case f if select.isDefinedAt(f) => f.name -> select(f)
    }))
}

/** What a unit keeps in its own block RAM is read.
  *
  * @param addressBits
  *   of the word that is read
  * @param lanes
  *   bytes per word
  */
class KeptRead(addressBits: Int, lanes: Int) extends Bundle {
  val address = Output(UInt(addressBits.W))

  /** In the next cycle: the word. */
  val data = Input(UInt((8 * lanes).W))
  val host = new KeptForHost(addressBits)
}

object KeptRead {

  /** Addresses of the bytes that units keep. */
  def bytes(registers: Seq[Register]): Set[Int] =
    registers.filter(_.fields.exists(_.source.isInstanceOf[Source.Kept])).flatMap(_.range).toSet

  /** Their upper digits: a unit's bytes stand within 256. */
  def pages(registers: Seq[Register]): Seq[Int] = bytes(registers).map(_ >> 8).toSeq.sorted
}

/** What a unit that keeps bytes knows of the host.
  *
  * @param addressBits
  *   of a word
  */
class KeptForHost(addressBits: Int) extends Bundle {

  /** The host reads, not a frame. */
  val reads = Output(Bool())

  /** The host wants to read the word at `address`, and may when it is `ready`. */
  val asks    = Output(Bool())
  val address = Output(UInt(addressBits.W))
  val ready   = Input(Bool())
}

/** Decode, storage and counters of all registers, built from [[RegisterMap]].
  *
  * Reading is combinational in `readAddress`, but for what block RAM holds; words are `lanes` bytes. A write
  * acts at the next clock edge; the caller has checked that its side may write (`writableByEcat`,
  * `writableByPdi`).
  *
  * @param p
  *   registers are those of `RegisterMap(p, added)`
  */
class RegisterFile(p: EscParams, added: Seq[Register] = Nil) extends Module {
  private val lanes     = p.lanes
  private val laneBits  = log2Ceil(lanes)
  private val registers = RegisterMap(p, added)

  private val addressBits = RegisterMap.addressBits(p) - laneBits

  val readAddress    = IO(Input(UInt(addressBits.W)))
  val readData       = IO(Output(UInt((8 * lanes).W)))
  val readableByEcat = IO(Output(UInt(lanes.W)))
  val readableByPdi  = IO(Output(UInt(lanes.W)))
  val writableByEcat = IO(Output(UInt(lanes.W)))
  val writableByPdi  = IO(Output(UInt(lanes.W)))

  /** The byte is read from the register RAM; `readData` is 0 for it. */
  val inRam = IO(Output(UInt(lanes.W)))

  /** The byte is a counter in block RAM: `countData` has it in the next cycle, `readData` is 0 for it. In a
    * master counters are flip-flops, as its units look at them.
    */
  private val blockRamCounts = if (p.isMaster) 0 else 1
  val isCount                = IO(Output(UInt((lanes * blockRamCounts).W)))
  val countData              = IO(Output(UInt((8 * lanes * blockRamCounts).W)))

  /** Bytes that a unit keeps in its own block RAM, where there are any: `isCount` and `countData` have them,
    * too; by the upper digits of their addresses.
    */
  private val keptBytes = KeptRead.bytes(registers)
  val kept: Map[Int, KeptRead] = KeptRead
    .pages(registers)
    .map(page => page -> IO(new KeptRead(addressBits, lanes)).suggestName(f"kept_$page%x00"))
    .toMap

  val keptForHost = Option.when(keptBytes.nonEmpty)(IO(Flipped(new KeptForHost(addressBits))))

  /** See [[FieldRecord]], also for the records below. */
  val guard = IO(Input(FieldRecord.guard(registers)))

  val write        = IO(Input(Bool()))
  val writeAddress = IO(Input(UInt(addressBits.W)))
  val writeMask    = IO(Input(UInt(lanes.W)))
  val writeData    = IO(Input(UInt((8 * lanes).W)))

  /** Bits that are written, where there are registers that are written bit by bit (FMMU-10). */
  val writeBits = Option.when(p.hasBitWrites)(IO(Input(UInt((8 * lanes).W))))

  val value  = IO(Output(FieldRecord.value(registers)))
  val set    = IO(Input(FieldRecord.set(registers)))
  val status = IO(Input(FieldRecord.status(registers)))
  val event  = IO(Input(FieldRecord.event(registers)))

  /** Of a master. */
  val count = IO(Output(FieldRecord.count(if (p.isMaster) registers else Nil)))

  /** A byte address is being written. */
  private def writes(byteAddress: Int): Bool =
    write && writeAddress === (byteAddress >> laneBits).U && writeMask(byteAddress % lanes)

  private def ofLane(word: UInt, byteAddress: Int): UInt = {
    val lane = byteAddress % lanes
    Lanes.byte(word, lane)
  }

  /** The byte to store in place of `old`. */
  private def writtenByte(register: Register, byteAddress: Int, old: UInt): UInt = writeBits match {
    case Some(bits) if register.bitWritable =>
      val mask = ofLane(bits, byteAddress)
      (ofLane(writeData, byteAddress) & mask) | (old & ~mask)
    case _ => ofLane(writeData, byteAddress)
  }

  private def storage(register: Register, field: Field): UInt = {
    // Reset: the register table gives every stored field a defined value after power-on.
    val flipFlops = RegInit(field.reset.U(field.width.W)).suggestName(field.name)
    val parts = (field.low / 8 to field.high / 8).map { byte =>
      val (high, low) = (field.high min 8 * byte + 7, field.low max 8 * byte)
      val address     = register.address + byte
      val old         = flipFlops(high - field.low, low - field.low)
      val oldByte     = (old << (low - 8 * byte)).pad(8)(7, 0)
      Mux(writes(address), writtenByte(register, address, oldByte)(high - 8 * byte, low - 8 * byte), old)
    }
    flipFlops := Cat(parts.reverse)
    field.source match {
      case Source.Stored(true, _) =>
        val load = set.load(field.name)
        when(load.valid) { flipFlops := load.bits }
      case _ =>
    }
    value.uint(field.name) := flipFlops
    flipFlops
  }

  /** A write of any counter of the group. */
  private def clears(group: String): Bool = registers
    .filter(_.fields.exists(_.source == Source.Counter(group)))
    .flatMap(_.range.map(writes))
    .reduce(_ || _)

  /** A counter of a master, in flip-flops. */
  private def counter(field: Field, group: String): UInt = {
    val clear   = clears(group)
    val counted = RegInit(0.U(8.W)).suggestName(field.name) // reset: counters start at 0 (ERR-10)
    when(clear) { counted := 0.U }.elsewhen(event.pulse(field.name) && !counted.andR) {
      counted := counted + 1.U
    }
    count.uint(field.name) := counted
    counted
  }

  // Those of a slave, in block RAM.
  private val counted = for {
    r     <- registers if !p.isMaster
    f     <- r.fields
    group <- Option(f.source).collect { case Source.Counter(group) => group }
  } yield (f, r.address + f.low / 8, group)
  private val counters = Option.when(counted.nonEmpty) {
    val places = counted.map { case (_, address, group) => address -> group }
    val engine = Module(new EventCounters(places, lanes, p.cyclesPerNibble))
    engine.event       := counted.map { case (field, _, _) => event.pulse(field.name) }
    engine.clear       := engine.groups.map(clears)
    engine.readAddress := readAddress(engine.readAddress.getWidth - 1, 0)
    engine
  }
  countData := counters.fold(0.U)(_.data)
  for ((page, port) <- kept) {
    port.address      := readAddress
    port.host.reads   := keptForHost.get.reads
    port.host.asks    := keptForHost.get.asks
    port.host.address := keptForHost.get.address
    when(RegNext(readAddress >> (8 - laneBits) === page.U)) { countData := port.data }
  }
  keptForHost.foreach(_.ready := kept.values.map(_.host.ready).reduce(_ && _))

  /** The byte at this address is a counter in block RAM, which has counted since it was cleared last, or one
    * that its unit keeps.
    */
  private def isCounted(byteAddress: Int): Bool = {
    val group = counted.collectFirst { case (_, `byteAddress`, group) => group }
    group.fold(keptBytes(byteAddress).B)(g => counters.get.valid(counters.get.groups.indexOf(g)))
  }

  private def source(register: Register, field: Field): UInt = field.source match {
    case Source.Constant       => field.reset.U(field.width.W)
    case Source.Ram            => 0.U(field.width.W)
    case _: Source.Kept        => 0.U(field.width.W)
    case _: Source.Stored      => storage(register, field)
    case Source.Status         => status.uint(field.name)
    case Source.Counter(group) => if (p.isMaster) counter(field, group) else 0.U(field.width.W)
  }

  /** The whole register as it reads, reserved bits 0. */
  private def image(register: Register): UInt = {
    val zero  = 0.U((8 * register.bytes).W)
    val parts = register.fields.map(f => (source(register, f) << f.low).pad(8 * register.bytes))
    parts.foldLeft(zero)(_ | _)(8 * register.bytes - 1, 0)
  }

  /** A byte as the decode gives it. */
  private class Decoded extends Bundle {
    val data         = UInt(8.W)
    val inRam        = Bool()
    val isCount      = UInt(blockRamCounts.W)
    val readableEcat = Bool()
    val readablePdi  = Bool()
    val writableEcat = Bool()
    val writablePdi  = Bool()
  }
  private def may(allowed: Boolean, names: Option[String]*): Bool =
    if (allowed) names.flatten.foldLeft(true.B)((all, name) => all && guard.pulse(name)) else false.B

  private val bytes: Map[Int, Decoded] = registers.flatMap { r =>
    val whole = image(r)
    r.range.map { a =>
      val d = Wire(new Decoded)
      d.data         := (if (r.inRam) 0.U else Lanes.byte(whole, a - r.address))
      d.inRam        := r.inRam.B
      d.isCount      := isCounted(a)
      d.readableEcat := may(r.ecat.readable, r.present)
      d.readablePdi  := may(r.pdi.readable, r.present)
      d.writableEcat := may(r.ecat.writable, r.present, r.ecatGuard)
      d.writablePdi  := may(r.pdi.writable, r.present, r.pdiGuard)
      a              -> d
    }
  }.toMap
  private def none = 0.U.asTypeOf(new Decoded)

  // One case per word that holds a register.
  private type Word = Vec[Decoded]
  private def word(byte: Int => Decoded): Word = VecInit((0 until lanes).map(byte))

  private val inBlocks       = registers.filter(_.block.isDefined).flatMap(_.range).toSet
  private val words          = (bytes.keySet -- inBlocks).map(_ >> laneBits)
  private def wordAt(w: Int) = word(lane => bytes.getOrElse((w << laneBits) + lane, none))

  /** Words of which this is the same decode alike: always so, if there is nothing of their own in it. */
  private def decodesAs(w: Int): Seq[Any] = (0 until lanes).map { lane =>
    val address = (w << laneBits) + lane
    registers.find(_.covers(address)).map { r =>
      val own = r.guards.nonEmpty || r.fields.exists(_.source match {
        case Source.Ram | _: Source.Kept => false
        case _                           => true
      })
      if (own) address else (r.inRam, keptBytes(address), r.ecat, r.pdi)
    }
  }
  private val single =
    if (!p.isMaster && !p.hasAlarm)
      words.groupBy(decodesAs).values.flatMap(AlignedBlock.cover).toSeq.sortBy(_.first).map { block =>
        block.holds(readAddress) -> wordAt(block.first)
      }
    else // Many registers lie close together: eight words share a comparison.
      words.map(_ / 8).toSeq.sorted.map { row =>
        (readAddress >> 3 === row.U) -> VecInit((0 until 8).map(i => wordAt(8 * row + i)))(
          readAddress(2, 0)
        )
      }

  // Equal units: the offset chooses the kind of register, the unit's number the one of its kind.
  private val ofUnits = registers.filter(_.block.exists(_.index == 0)).groupBy(_.block.get).toSeq.flatMap {
    case (block, firsts) =>
      val start      = firsts.map(_.address).min
      val offsetBits = log2Ceil(block.stride)
      val unitBits   = log2Ceil(block.count)
      val area = (readAddress >> (offsetBits + unitBits - laneBits)) === (start >> (offsetBits + unitBits)).U
      val unit =
        if (unitBits == 0) 0.U else readAddress(offsetBits + unitBits - laneBits - 1, offsetBits - laneBits)
      val hit = area && unit < block.count.U
      (0 until block.stride >> laneBits).map { w =>
        val offset = if (offsetBits == laneBits) true.B else readAddress(offsetBits - laneBits - 1, 0) === w.U
        val units = VecInit((0 until block.count).map { n =>
          word(lane => bytes.getOrElse(start + n * block.stride + (w << laneBits) + lane, none))
        })
        (hit && offset) -> units(unit)
      }
  }
  private val selected = Mux1H((single ++ ofUnits).map { case (hit, w) => hit -> w.asUInt })
    .asTypeOf(Vec(lanes, new Decoded))
  readData       := VecInit(selected.map(_.data)).asUInt
  inRam          := VecInit(selected.map(_.inRam)).asUInt
  isCount        := VecInit(selected.map(_.isCount)).asUInt
  readableByEcat := VecInit(selected.map(_.readableEcat)).asUInt
  readableByPdi  := VecInit(selected.map(_.readablePdi)).asUInt
  writableByEcat := VecInit(selected.map(_.writableEcat)).asUInt
  writableByPdi  := VecInit(selected.map(_.writablePdi)).asUInt
}
