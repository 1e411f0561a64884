package flyframe.fmmu

import chisel3._
import chisel3.util._
import flyframe.lanes.Lanes
import flyframe.memory.{RegisterWrite, RegisterWrites, WideTable}
import flyframe.params.EscParams
import flyframe.registers.FmmuRegisters

/** Where a logical byte leads, for one direction.
  *
  * The bits of a run may lie anywhere in the local bytes, so those of one logical byte lie in two
  * neighbouring local bytes: the one at `address`, and the one before it, which the logical byte before led
  * to.
  */
class Mapped extends Bundle {
  val hit = Bool()

  /** Local address of the upper of the two bytes; bit 16: beyond the address space. */
  val address = UInt(17.W)

  /** The logical byte is the first, the last of the FMMU. */
  val first = Bool()
  val last  = Bool()

  /** It is the one before the first: nothing of it is mapped, but the first local byte is needed already. */
  val early = Bool()

  /** First mapped bit of the first, last one of the last logical byte. */
  val startBit = UInt(3.W)
  val stopBit  = UInt(3.W)

  /** Bits from a logical bit to its local bit, modulo 8. */
  val turn = UInt(3.W)
}

/** All FMMUs: their configuration ([[FmmuRegisters]], 0x0600 on) and the search for the one that maps a
  * logical byte.
  *
  * The search takes one entry per cycle in banks of eight: `index` counts from 0 to 7, and the result is
  * final three cycles after the last. The lowest-numbered FMMU of each direction wins (FMMU-05).
  */
class Fmmus(p: EscParams) extends Module {
  private val n = p.fmmus

  val write = IO(Input(Valid(new RegisterWrite(p.lanes, p.hasBitWrites))))
  val index = IO(Input(UInt(3.W)))

  /** The logical address *behind* the byte; bit 32: beyond the last one. */
  val behind = IO(Input(UInt(33.W)))
  val read   = IO(Output(new Mapped))
  val writes = IO(Output(new Mapped))

  // FMMUs have the low eight bits of an address to themselves, four of them for the bytes of each.
  require(
    FmmuRegisters.First % 256 == 0 && FmmuRegisters.Stride == 16,
    f"FmmuRegisters has First 0x${FmmuRegisters.First}%04x and Stride ${FmmuRegisters.Stride} " +
      "but must have First at a multiple of 256 and Stride 16."
  )
  private val taken   = new RegisterWrites(FmmuRegisters(p), write)
  private val address = write.bits.byteAddress
  private val hitsArea =
    write.valid && address(11, 8) === (FmmuRegisters.First >> 8).U && address(3, 2) =/= 3.U

  /** Bytes of each group of four that the tables hold: logical start; length and bits; the local side. */
  private val used = if (p.hasBitwiseFmmus) Seq(0 to 3, 0 to 3, 0 to 3) else Seq(0 to 3, 0 to 1, Seq(0, 1, 3))

  /** An FMMU as the tables hold it; without bit numbers if they have no effect (B-46). */
  private class Entry extends Bundle {
    private val bitWidth = if (p.hasBitwiseFmmus) 8 else 0
    val typ              = UInt(8.W)
    val physicalBit      = UInt(bitWidth.W)
    val physicalStart    = UInt(16.W)
    val stopBit          = UInt(bitWidth.W)
    val startBit         = UInt(bitWidth.W)
    val length           = UInt(16.W)
    val logicalStart     = UInt(32.W)
  }

  private val results = Seq.tabulate(p.fmmuBanks) { bank =>
    val count = if (p.fmmuBanks == 1) n else if (bank == 0) 8 else n - 8
    val mine  = if (p.fmmuBanks == 1) true.B else address(7) === bank.U
    val unit  = address(6, 4)
    val tables = used.zipWithIndex.map { case (bytes, part) =>
      val table = Module(new WideTable(count, bytes.size, copies = 1)).suggestName(s"table_${bank}_$part")
      val mask  = write.bits.maskIn(4)
      val data  = write.bits.dataIn(4)
      table.write        := hitsArea && mine && unit < count.U && address(3, 2) === part.U
      table.writeIndex   := unit
      table.writeMask    := VecInit(bytes.map(mask(_))).asUInt
      table.writeData    := VecInit(bytes.map(i => Lanes.byte(data, i))).asUInt
      table.readIndex(0) := index
      table
    }
    val active = RegInit(VecInit(Seq.fill(8)(false.B))).suggestName(s"active_$bank") // reset: as the register
    for (i <- 0 until count) {
      val written = taken.written(s"fmmu${8 * bank + i}_activate")
      when(written.valid) { active(i) := written.bits.asBool }
    }

    // First stage: distance from the start. -1 is the byte before.
    val entry     = Cat(tables.reverse.map(_.readData(0))).asTypeOf(new Entry)
    val started   = RegNext(index)
    val distance  = RegNext(behind + ~(0.U(1.W) ## entry.logicalStart))
    val length    = RegNext(entry.length)
    val start     = RegNext(entry.physicalStart)
    val forReads  = RegNext(entry.typ(0))
    val forWrites = RegNext(entry.typ(1))
    val takes     = RegNext(active(started))
    val begins    = RegNext(started === 0.U)

    // The bits of a local byte come from above (`upward`) or from below.
    def bits(number: UInt) = if (p.hasBitwiseFmmus) number(2, 0) else 0.U(3.W)
    val startBit           = RegNext(bits(entry.startBit))
    val stopBit            = RegNext(if (p.hasBitwiseFmmus) bits(entry.stopBit) else 7.U(3.W))
    val turn               = RegNext(bits(entry.physicalBit) - bits(entry.startBit))
    val upward             = RegNext(bits(entry.physicalBit) > bits(entry.startBit))

    // Second stage: inside? The lowest number wins.
    val left    = length +& ~distance(15, 0) // bytes behind this one; bit 16 not set: beyond the end
    val within  = if (p.hasBitwiseFmmus) left(16) else distance(15, 0) < length
    val isLast  = if (p.hasBitwiseFmmus) !left(15, 0).orR else false.B
    val isEarly = distance.andR && upward && length =/= 0.U
    val inside  = !distance(32) && !distance(31, 16).orR && within
    val sum      = ((start ## true.B) +& (distance(15, 0) ## upward)) >> 1 // with carry in
    val physical = (sum(16) && !isEarly) ## sum(15, 0)
    Seq("read" -> forReads, "write" -> forWrites).map { case (direction, enabled) =>
      val found = Reg(new Mapped).suggestName(s"found_${direction}_$bank")
      when(begins || !found.hit) {
        found.hit      := takes && (inside || isEarly) && enabled
        found.address  := physical
        found.first    := distance(15, 0) === 0.U
        found.last     := isLast
        found.early    := isEarly
        found.startBit := startBit
        found.stopBit  := stopBit
        found.turn     := turn
      }
      found
    }
  }
  private def lowest(direction: Int) =
    results.map(_(direction)).reduceRight((low, high) => Mux(low.hit, low, high))
  read   := lowest(0)
  writes := lowest(1)
}
