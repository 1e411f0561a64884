package flyframe.fmmu

import chisel3._
import chisel3.util._
import flyframe.memory.{RegisterWrite, WideTable}
import flyframe.params.EscParams

/** Where a logical byte leads, for one direction. */
class Mapped extends Bundle {
  val hit = Bool()

  /** Local address of the byte; bit 16: beyond the address space. */
  val address = UInt(17.W)

  /** Bits of the byte that are mapped, and how far they are moved: local bit = logical bit + shift, -7 to 7.
    */
  val mask  = UInt(8.W)
  val shift = SInt(4.W)
}

/** All FMMUs: their configuration (0x0600 on) and the search for the one that maps a logical byte.
  *
  * The search takes one entry per cycle in banks of eight: `index` counts from 0 to 7, and the result is
  * final three cycles after the last. The lowest-numbered FMMU of each direction wins (FMMU-05).
  */
class Fmmus(p: EscParams) extends Module {
  private val n = p.fmmus

  val write   = IO(Input(Valid(new RegisterWrite(p.lanes))))
  val index   = IO(Input(UInt(3.W)))
  val logical = IO(Input(UInt(32.W)))
  val read    = IO(Output(new Mapped))
  val writes  = IO(Output(new Mapped))

  private val address  = write.bits.byteAddress
  private val hitsArea = write.valid && address(11, 8) === 6.U && address(3, 2) =/= 3.U

  /** An FMMU as the tables hold it, without the bit numbers (B-46). */
  private class Entry extends Bundle {
    val typ           = UInt(8.W)
    val physicalStart = UInt(16.W)
    val length        = UInt(16.W)
    val logicalStart  = UInt(32.W)
  }

  private val results = Seq.tabulate(p.fmmuBanks) { bank =>
    val count = if (p.fmmuBanks == 1) n else if (bank == 0) 8 else n - 8
    val mine  = if (p.fmmuBanks == 1) true.B else address(7) === bank.U
    val unit  = address(6, 4)
    // Of three words of four bytes those that are used.
    val tables = Seq(0 to 3, 0 to 1, Seq(0, 1, 3)).zipWithIndex.map { case (used, part) =>
      val table = Module(new WideTable(count, used.size, copies = 1)).suggestName(s"table_${bank}_$part")
      val mask  = write.bits.maskIn(4)
      val data  = write.bits.dataIn(4)
      table.write        := hitsArea && mine && unit < count.U && address(3, 2) === part.U
      table.writeIndex   := unit
      table.writeMask    := VecInit(used.map(mask(_))).asUInt
      table.writeData    := VecInit(used.map(i => data(8 * i + 7, 8 * i))).asUInt
      table.readIndex(0) := index
      table
    }
    val active = RegInit(VecInit(Seq.fill(8)(false.B))).suggestName(s"active_$bank") // reset: as the register
    for (i <- 0 until count) {
      val byte = write.bits.byteAt(write.valid, 0x60c + 128 * bank + 16 * i)
      when(byte.valid) { active(i) := byte.bits(0) }
    }

    // First stage: distance from the start.
    val entry     = Cat(tables.reverse.map(_.readData(0))).asTypeOf(new Entry)
    val started   = RegNext(index)
    val distance  = RegNext(logical -& entry.logicalStart)
    val length    = RegNext(entry.length)
    val start     = RegNext(entry.physicalStart)
    val forReads  = RegNext(entry.typ(0))
    val forWrites = RegNext(entry.typ(1))
    val takes     = RegNext(active(started))
    val begins    = RegNext(started === 0.U)

    // Second stage: inside? The lowest number wins.
    val inside   = takes && !distance(32) && distance(31, 0) < length
    val physical = start +& distance(15, 0)
    Seq("read" -> forReads, "write" -> forWrites).map { case (direction, enabled) =>
      val found = Reg(new Mapped).suggestName(s"found_${direction}_$bank")
      when(begins || !found.hit) {
        found.hit     := inside && enabled
        found.address := physical
      }
      found
    }
  }
  private def lowest(direction: Int) =
    results.map(_(direction)).reduceRight((low, high) => Mux(low.hit, low, high))
  read   := lowest(0)
  writes := lowest(1)
}
