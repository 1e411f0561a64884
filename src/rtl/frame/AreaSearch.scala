package flyframe.frame

import chisel3._
import chisel3.util._
import flyframe.fmmu.Mapped
import flyframe.params.EscParams
import flyframe.registers.Register
import flyframe.syncmanager.{AreaEntry, AreaHit, AreaScan, BufferAnswer, ManagedSpace}

/** What is known of a local byte before its SyncManager is asked. */
class Target(indexBits: Int) extends Bundle {

  /** There is an address. */
  val exists = Bool()

  /** It is one that SyncManagers act on, with memory or a register of theirs there. */
  val inManaged = Bool()
  val inMemory  = Bool()
  val area      = new AreaHit(indexBits)

  /** The area is one byte long. */
  def single: Bool = area.first && area.last

  /** The byte belongs to a SyncManager. */
  def managed: Bool = area.hit && inManaged

  /** The byte is to be found in the SyncManager's buffer, not at its own address. */
  def moves: Bool = managed && !single

  /** ECAT may access the byte. */
  def may(answer: BufferAnswer): Bool = exists && (!managed || (inMemory && answer.allowed))

  /** It may, in the direction of the byte's SyncManager. */
  def inBuffer(answer: BufferAnswer): Bool = managed && inMemory && answer.inBuffer
}

/** The search for the SyncManager that a byte belongs to, for one direction: *area* in [[TranslatedAccess]].
  *
  * @param reads
  *   bytes are read; else written
  */
class AreaSearch(p: EscParams, registers: Seq[Register], reads: Boolean) extends Module {
  val schedule = IO(Input(new Schedule))

  /** There with `keepMapped`. */
  val mapped = IO(Input(new Mapped(p.hasBitwiseFmmus)))

  /** Of the SyncManagers, one after the other, from the cycle after `keepMapped` on. */
  val entries = Option.when(p.syncManagers > 0)(IO(Input(Vec(p.smBanks, new AreaEntry(p.smIndexBits)))))
  val ramOpen = IO(Input(Bool()))

  /** There with `askRead`, a byte time later. */
  val target = IO(Output(new Target(p.smIndexBits)))

  private val exists                    = RegEnable(mapped.exists, schedule.keepMapped)
  private val address                   = RegEnable(mapped.address(15, 0), schedule.keepMapped)
  private def known(signal: Bool): Bool = RegEnable(signal, schedule.keepMapped) // while the next is searched
  target.exists := known(exists)
  entries match {
    case None =>
      target.inManaged := false.B
      target.inMemory  := false.B
      target.area      := 0.U.asTypeOf(target.area)
    case Some(banks) =>
      val space = new ManagedSpace(p, registers)
      target.inManaged := known(space.acts(address))
      target.inMemory  := known(exists && space.exists(address, ramOpen))
      target.area := AreaScan.lowest(banks.map { entry =>
        val scan = Module(new AreaScan(p.smIndexBits))
        scan.entry                                                := entry
        if (reads && p.hasDeactivationDelay) scan.entry.takesPart := entry.takesReads
        scan.address                                              := address
        scan.result
      })
  }
}
