package flyframe.frame

import chisel3._
import chisel3.util._
import flyframe.params.EscParams
import flyframe.registers.{Register, RegisterMap}
import flyframe.syncmanager.{BufferAccess, BufferAnswer, ManagedSpace}

/** A question to a SyncManager, or what is told to it. */
class AreaRequest(p: EscParams) extends Bundle {
  val valid  = Bool()
  val number = UInt(p.smIndexBits.W)
  val access = new BufferAccess(p.hasSequentialMode, p.acknowledgesByWrite)
}

/** A byte whose place in memory is known.
  *
  * @param p
  *   tells what is known of it
  */
class Fetched(p: EscParams) extends Bundle {

  /** Bit 16: there is nothing. */
  val address = UInt(17.W)

  /** ECAT may access it; in the direction of its SyncManager. */
  val may      = Bool()
  val inBuffer = Bool()

  /** Its SyncManager, and which byte of the area it is. */
  val index  = UInt(p.smIndexBits.W)
  val first  = Bool()
  val last   = Bool()
  val single = Bool()

  /** The address by which it is accessed, wherever its buffer lies: with the sequential mode. */
  val local = UInt((if (p.hasSequentialMode) 16 else 0).W)

  /** That is one of a register: where writes may be refused (SYS-02, SYS-03). */
  val isRegister = UInt((if (p.hasWriteProtection) 1 else 0).W)
}

/** Asks SyncManagers whether the bytes to be read and to be written may be, and where in their buffers they
  * are: *fetch* in [[TranslatedAccess]].
  */
class Fetch(p: EscParams, registers: Seq[Register]) extends Module {
  private def indexBits = p.smIndexBits

  val schedule = IO(Input(new Schedule))

  /** A frame begins; the last one may have ended anywhere. */
  val newFrame = IO(Input(Bool()))

  /** There with `askRead`: what is known of the byte that may be read, of the byte that may be written. */
  val readTarget  = IO(Input(new Target(indexBits)))
  val writeTarget = IO(Input(new Target(indexBits)))

  /** They are to be read, with `askRead`, to be written, with `askWrite`. */
  val reads  = IO(Input(Bool()))
  val writes = IO(Input(Bool()))

  /** Their addresses, there with `keepRead`, with `keepWrite`. */
  val readAddress  = IO(Input(UInt(16.W)))
  val writeAddress = IO(Input(UInt(16.W)))

  /** With `askRead` and `askWrite`; the answer is there with `keepRead` and `keepWrite`. */
  val ask    = IO(Output(new AreaRequest(p)))
  val answer = IO(Input(new BufferAnswer))
  val offset = IO(Input(UInt(17.W)))

  /** After `keepRead`, `keepWrite`. */
  val read  = IO(Output(new Fetched(p)))
  val write = IO(Output(new Fetched(p)))

  private val reading = RegEnable(readTarget, schedule.askRead)
  private val wanted  = RegEnable(reads, schedule.askRead)
  private val writing = RegEnable(writeTarget, schedule.askRead)

  private val asked = Mux(schedule.askRead, readTarget, writing)
  ask.valid := (schedule.askRead && reads && readTarget.managed && readTarget.inMemory) ||
    (schedule.askWrite && writes && writing.managed)
  ask.number             := asked.area.index
  ask.access.first       := asked.area.first
  ask.access.single      := asked.single
  ask.access.write       := schedule.askWrite
  ask.access.touch       := schedule.askRead
  ask.access.close       := false.B
  ask.access.address     := 0.U // nothing is written
  ask.access.acknowledge := 0.U // the PDI does that

  // One adder for both. A buffer does not reach what is past the end, nor a register that SyncManagers do not
  // act on.
  private val at      = Mux(schedule.forRead, reading, writing)
  private val local   = Mux(schedule.forRead, readAddress, writeAddress)
  private val moved   = local +& Mux(at.moves, offset, 0.U)
  private val space   = new ManagedSpace(p, registers)
  private val isOther = if (space.hasOthers) at.managed && space.isOther(moved(15, 0)) else false.B
  private val address = (moved(17, 16).orR || isOther) ## moved(15, 0)

  for (
    (byte, target, keep, wanted) <- Seq(
      (read, reading, schedule.keepRead, wanted),
      (write, writing, schedule.keepWrite, true.B)
    )
  ) {
    val may = RegEnable(target.may(answer) && wanted, keep)
    when(newFrame) { may := false.B }
    byte.address  := RegEnable(address, keep)
    byte.may      := may
    byte.inBuffer := RegEnable(target.inBuffer(answer), keep)
    byte.index    := RegEnable(target.area.index, keep)
    byte.first    := RegEnable(target.area.first, keep)
    byte.last     := RegEnable(target.area.last, keep)
    byte.single   := byte.first && byte.last
    byte.local    := (if (p.hasSequentialMode) RegEnable(local, keep) else 0.U)
    byte.isRegister := (if (p.hasWriteProtection) RegEnable(local < RegisterMap.UserRamStart.U, keep)
                        else 0.U)
  }
}
