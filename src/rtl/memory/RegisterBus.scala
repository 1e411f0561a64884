package flyframe.memory

import chisel3._
import chisel3.util._
import flyframe.params.EscParams
import flyframe.registers.{FieldRecord, KeptRead, Register, Source}

/** What frames do, as units see it.
  *
  * @param begins
  *   a frame comes, of whatever kind
  * @param good
  *   a frame has ended, and well
  * @param bad
  *   a frame has ended badly
  * @param busy
  *   a frame is in the frame processor
  * @param error
  *   a frame was in error, or had too many datagrams (B-15, B-16)
  * @param reads
  *   by register: a byte of it is read by the bus, for registers whose reading acknowledges; it counts only
  *   if the frame ends well
  */
final case class FrameEvents(
    begins: Bool,
    good: Bool,
    bad: Bool,
    busy: Bool,
    error: Bool,
    reads: FieldRecord
)

/** What a [[RegisterBus]] needs of registers and register RAM: [[EscMemory]], or a test in place of it. */
trait RegisterPort {

  /** Present values of stored fields; new ones for those that units may load; values of status fields. */
  val value: FieldRecord
  val set: FieldRecord
  val status: FieldRecord

  /** Pulses that count, and conditions under which guarded registers may be written. */
  val event: FieldRecord
  val guard: FieldRecord

  /** The host's accesses. */
  val host: HostPort

  /** A register write of a frame or the host takes effect in this cycle; and it comes from the host. */
  val registerWrite: Valid[RegisterWrite]
  val registerWriteByHost: Bool

  /** Register writes are on their way; those of a frame are about to take effect. */
  val registersBusy: Bool
  val commitStarts: Bool

  /** The register RAM is being cleared after a reset. */
  val clearing: Bool

  /** A unit of the controller writes a register, whatever its access. */
  val unitWrite: DecoupledIO[UnitWrite]

  /** What units keep in their own block RAM is read, where there are such units: by the upper digits of their
    * addresses.
    */
  def kept: Map[Int, KeptRead] = Map.empty

  /** A unit reads the register RAM: byte address, and in a later cycle the byte. */
  val unitRead: DecoupledIO[UInt]
  val unitData: Valid[UInt]
}

/** How a [[RegisterUnit]] meets registers, all of it by the names in their tables.
  *
  * A field has one driver: `status`, `set`, `counts` and `guard` give what a unit connects, and a second call
  * for the same name ends the program. Everybody may ask for values and events.
  *
  * @param registers
  *   all of the controller
  * @param hostAccess
  *   an access of the host is done, to whatever address, and also one that SyncManagers have kept from the
  *   memory
  */
class RegisterBus(
    p: EscParams,
    memory: RegisterPort,
    registers: Seq[Register],
    val frame: FrameEvents,
    val hostAccess: Bool
) extends RegisterWrites(registers, memory.registerWrite) {

  // ---- what a unit asks ----

  /** Register writes for tables of registers. */
  lazy val tableWrite: TableWrite = TableWrite(write)

  /** The present value of a field: stored, a constant, or what its unit shows. */
  def value(field: String): UInt = {
    val it = names.field(field).field
    it.source match {
      case Source.Constant  => it.reset.U(it.width.W)
      case Source.Status    => memory.status.uint(field)
      case _: Source.Stored => memory.value.uint(field)
      case _ =>
        throw new IllegalArgumentException(
          s"field $field has no value for units but must be stored, status or constant."
        )
    }
  }
  def bool(field: String): Bool = value(field)(0)

  /** The same of a field that may not be built. */
  def bool(field: String, default: Boolean): Bool = if (names.has(field)) bool(field) else default.B

  /** The present value of a register, whose fields all have one; reserved bits are 0. */
  def whole(register: String): UInt = {
    val it = names.register(register)
    it.fields.map(f => value(f.name) << f.low).reduce(_ | _).pad(8 * it.bytes)
  }

  /** The value of a register is another one than in the cycle before, or than after a reset. */
  def changes(register: String): Bool =
    whole(register) =/= RegNext(whole(register), names.register(register).reset.U)

  /** The host reads a byte of the register. Acknowledged a cycle late: what changes in the cycle before it
    * has not seen.
    */
  def hostReads(register: String): Bool =
    memory.host.ack && !memory.host.write && names.register(register).range.map(isHostAt).reduce(_ || _)

  /** The host writes a byte of the register, or tries to. */
  def hostWrites(register: String): Bool =
    memory.host.ack && memory.host.write && names.register(register).range.map(isHostAt).reduce(_ || _)

  /** The host writes the first byte of the register, or tries to. */
  def hostBegins(register: String): Bool =
    memory.host.ack && memory.host.write && isHostAt(names.register(register).address)
  private def isHostAt(address: Int): Bool =
    memory.host.addr(15, log2Ceil(p.lanes)) === (address / p.lanes).U && memory.host.be(address % p.lanes)

  /** The host acknowledges what the register tells of: it reads a byte of it, or writes one (PDI-09). */
  def acknowledges(register: String): Bool =
    if (p.acknowledgesByWrite) hostWrites(register) else hostReads(register)

  /** The write that takes effect comes from the host. */
  def writtenByHost: Bool = memory.registerWriteByHost

  /** Register writes are on their way. */
  def writesPending: Bool = memory.registersBusy

  /** The register writes of a frame are about to take effect. */
  def commits: Bool = memory.commitStarts

  /** Register writes are those by which the register RAM is cleared after a reset: each of its bytes becomes
    * 0.
    */
  def clears: Bool = memory.clearing

  /** An event until the host acknowledges it; what comes while it does so is not lost. */
  def untilAcknowledged(register: String)(happens: Bool): Bool = {
    val event = RegInit(false.B) // reset: has not happened
    when(acknowledges(register) && !RegNext(happens, false.B)) { event := false.B }
    when(happens) { event := true.B }
    event
  }

  /** An event until the bus reads a byte of the register, in a frame that ends well (B-42); what comes behind
    * that read is not lost.
    */
  def untilEcatReads(register: String)(happens: Bool): Bool = {
    val event  = RegInit(false.B) // reset: has not happened
    val isRead = RegInit(false.B) // in this frame; reset: not
    when(frame.reads.pulse(register)) { isRead := true.B }
    when(frame.good || frame.bad) { isRead := false.B }
    when(frame.good && isRead) { event := false.B }
    when(happens) {
      event  := true.B
      isRead := false.B
    }
    event
  }

  /** A frame has begun, and all register writes of the one before it have taken effect: these may last longer
    * than the gap between them.
    */
  lazy val nextFrame: Bool = {
    val waits = RegInit(false.B) // reset: no frame has begun
    val next  = waits && !writesPending
    when(next) { waits := false.B }
    when(frame.begins) { waits := true.B }
    next
  }

  /** A frame is in the processing unit, or its register writes may still take effect. */
  lazy val frameOpen: Bool = {
    val open      = RegInit(false.B) // reset: no frame
    val committed = RegInit(false.B)
    when(frame.bad || (committed && !writesPending)) {
      open      := false.B
      committed := false.B
    }
    when(commits) { committed := true.B }
    when(frame.busy) { open := true.B }
    open || frame.busy || writesPending
  }

  // ---- what a unit drives ----

  /** The value that a status field shows. */
  def status(field: String): UInt = own(field, memory.status.uint(field))

  /** A new value for a stored field that units may load. */
  def set(field: String): Valid[UInt] = own(field, memory.set.load(field))

  /** The same: `value` while `when` is true. */
  def set(field: String, when: Bool, value: UInt): Unit = {
    val load = set(field)
    load.valid := when
    load.bits  := value
  }

  /** An order that the field stands for, which returns to 0 at once. */
  def order(field: String): Bool = {
    set(field, bool(field), 0.U)
    bool(field)
  }

  /** A pulse that the field counts; at most one in a nibble slot. */
  def counts(field: String): Bool = own(field, memory.event.pulse(field))

  /** Registers with this guard may be written. */
  def guard(name: String): Bool = own(name, memory.guard.pulse(name))

  private val driven = scala.collection.mutable.Set.empty[String]
  private def own[T](name: String, signal: T): T = {
    require(driven.add(name), s"$name is driven in two places but must be in 1.")
    signal
  }

  /** Interrupts the host while the level is high. */
  def interrupt(level: Bool): Unit  = interrupts :+= level
  private var interrupts: Seq[Bool] = Nil

  /** What all units ask for together; None: nobody may interrupt. */
  def interruptLevel: Option[Bool] = interrupts.reduceOption(_ || _)

  /** The block RAM is read in which a unit keeps this register, and others with the same upper digits of
    * their addresses.
    */
  def keptRead(register: String): KeptRead = {
    val page = names.register(register).address >> 8
    own(f"what is kept at 0x$page%x00", memory.kept(page))
  }

  // ---- the register RAM ----

  /** Writes bytes of registers, whatever their access; for one unit. */
  def ramWrite: DecoupledIO[UnitWrite] = own("ramWrite", memory.unitWrite)
  memory.unitWrite.valid := false.B
  memory.unitWrite.bits  := DontCare

  /** Reads bytes of registers in RAM: their addresses, and later the bytes; for one unit. */
  def ramRead: DecoupledIO[UInt] = own("ramRead", memory.unitRead)
  def ramData: Valid[UInt]       = memory.unitData
  memory.unitRead.valid := false.B
  memory.unitRead.bits  := 0.U
}
