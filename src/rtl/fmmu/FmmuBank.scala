package flyframe.fmmu

import chisel3._
import chisel3.util._
import flyframe.lanes.Lanes
import flyframe.memory.{TableWrite, WideTable}
import flyframe.params.EscParams
import flyframe.ram.DualPortRam
import flyframe.registers.FmmuRegisters

/** What a search finds, for both directions: kept in block RAM until the byte has passed. */
abstract class SearchResults(p: EscParams) extends Module {
  val table     = IO(Input(new TableWrite))
  val search    = IO(Input(new FmmuSearch(p.hasReadWriteOffset)))
  val readSlot  = IO(Input(UInt(2.W)))
  val writeSlot = IO(Input(UInt(2.W)))
  val read      = IO(Output(new Mapped(p.hasBitwiseFmmus)))
  val write     = IO(Output(new Mapped(p.hasBitwiseFmmus)))

  /** Without FMMU: where the byte is written. Nothing is there past the end (bit 16). */
  private def writeAddress: UInt = if (!p.hasReadWriteOffset) search.behind(16, 0)
  else {
    val sum = search.behind(16, 0) +& search.offset
    sum(17, 16).orR ## sum(15, 0)
  }

  /** Keeps where the entry of two cycles ago leads, if it `serves` the direction: 0 reads, 1 writes. */
  protected def keep(found: Mapped)(serves: Int => Bool): Unit = {
    val begins = ShiftRegister(search.index === 0.U, 2)
    val place  = ShiftRegister(search.slot, 2)
    val before = ShiftRegister(search.before, 2)
    for (((result, slot), i) <- Seq(read -> readSlot, write -> writeSlot).zipWithIndex) {
      val kept = DualPortRam(16, result.getWidth)(clock) // four are used; a smaller one is made of registers
      val hit  = Reg(Bool()).suggestName(s"hit_$i")      // an entry before has been found
      val word = WireDefault(found)
      word.hit    := search.direct || (found.hit && serves(i))
      word.before := before
      when(search.direct) { word.address := (if (i == 0) search.behind(16, 0) else writeAddress) }
      for (bits <- word.bits) when(search.direct) { bits := MappedBits.whole }
      when(begins || !hit) { hit := word.hit }
      kept.io.write        := begins || !hit
      kept.io.writeAddress := place
      kept.io.writeData    := word.asUInt
      kept.io.readAddress  := slot
      result               := kept.io.readData.asTypeOf(result)
    }
  }
}

/** Without FMMUs: all bytes have local addresses. */
class NoFmmus(p: EscParams) extends SearchResults(p) {
  keep(0.U.asTypeOf(new Mapped(p.hasBitwiseFmmus)))(_ => false.B)
}

/** Up to eight FMMUs in block RAM and their search, see [[Fmmus]].
  *
  * An entry takes three cycles: its first logical address is read; the distance of the byte from there is
  * known, the rest of the entry is read; where the byte leads is known, and kept.
  *
  * @param number
  *   which eight of all
  */
abstract class FmmuBank(p: EscParams, number: Int) extends SearchResults(p) {

  // FMMUs have the low eight bits of an address to themselves, four of them for the bytes of each.
  require(
    FmmuRegisters.First % 256 == 0 && FmmuRegisters.Stride == 16,
    f"FmmuRegisters has First 0x${FmmuRegisters.First}%04x and Stride ${FmmuRegisters.Stride} " +
      "but must have First at a multiple of 256 and Stride 16."
  )
  private val count     = (p.fmmus - 8 * number) min 8
  private val indexBits = log2Ceil(count) max 1
  private val mine = table.valid && table.word(9, 6) === (FmmuRegisters.First >> 8).U &&
    table.word(5) === number.U && table.word(4, 2) < count.U
  private def isWord(n: Int): Bool = table.word(1, 0) === n.U

  /** A table of a word of each FMMU: of its bytes the bits that are kept. */
  private def ram(name: String, word: Int, bits: Seq[Int], index: UInt): UInt = {
    val kept = bits.indices.filter(bits(_) > 0)
    val copy = Module(new WideTable(count, kept.map(bits), copies = 1)).suggestName(s"table_$name")
    copy.write        := mine && isWord(word)
    copy.writeIndex   := table.word(4, 2)
    copy.writeMask    := VecInit(kept.map(table.mask(_))).asUInt
    copy.writeData    := Cat(kept.reverse.map(i => Lanes.byte(table.data, i)(bits(i) - 1, 0)))
    copy.readIndex(0) := index
    copy.readData(0)
  }
  // Numbers without an FMMU look at the last one again.
  private val first =
    if (count == 8) search.index
    else Mux(search.index < count.U, search.index, (count - 1).U)(indexBits - 1, 0)
  private val index = RegNext(first)
  // Of an FMMU: its first logical address; its length, and the first and the last bit; where it leads to, and
  // for what. Numbers of bits are kept where they have an effect (B-46).
  private val bit                   = if (p.hasBitwiseFmmus) 3 else 0
  private val logicalStart          = ram("logical", 0, Seq(8, 8, 8, 8), first)
  protected val extent: UInt        = ram("extent", 1, Seq(8, 8, bit, bit), index)
  protected val local: UInt         = ram("local", 2, Seq(8, 8, bit, 2), index)
  protected def length: UInt        = extent(15, 0)
  protected def physicalStart: UInt = local(15, 0)
  private val types                 = local >> (16 + bit)

  private val active     = RegInit(VecInit(Seq.fill(1 << indexBits)(false.B))) // reset: as the register
  private val isActivate = RegNext(mine && isWord(FmmuRegisters.Activate / 4), false.B)
  when(isActivate && table.mask(0)) { active(RegNext(table.word(1 + indexBits, 2))) := table.data(0) }
  private val isActive = RegNext(active(index))

  /** Distance of the byte from the first one; -1 is the byte before. */
  protected val distance: UInt = RegNext(search.behind + ~(0.U(1.W) ## logicalStart))

  /** Where the FMMU leads the byte, if it is active and for the direction. */
  protected def leads: Mapped
  keep(leads)(direction => !search.past && isActive && types(direction))
}

/** FMMUs that map whole bytes. */
class ByteFmmuBank(p: EscParams, number: Int) extends FmmuBank(p, number) {
  protected def leads: Mapped = {
    val m = Wire(new Mapped(false))
    m.hit     := !distance(32, 16).orR && distance(15, 0) < length
    m.address := physicalStart +& distance(15, 0)
    m.before  := DontCare
    m
  }
}

/** FMMUs that map bits. */
class BitwiseFmmuBank(p: EscParams, number: Int) extends FmmuBank(p, number) {
  protected def leads: Mapped = {
    val startBit    = extent(18, 16)
    val stopBit     = extent(21, 19)
    val physicalBit = local(18, 16)

    // The bits of a local byte come from above (`upward`) or from below.
    val upward  = physicalBit > startBit
    val left    = length +& ~distance(15, 0) // bytes behind this one; bit 16 not set: beyond the end
    val isEarly = distance.andR && upward && length =/= 0.U
    val inside  = !distance(32, 16).orR && left(16)
    val sum = ((physicalStart ## true.B) +& (distance(15, 0) ## upward)) >> 1 // with carry in

    val m = Wire(new Mapped(true))
    m.hit     := inside || isEarly
    m.address := (sum(16) && !isEarly) ## sum(15, 0)
    m.before  := DontCare
    for (bits <- m.bits) {
      bits.first    := !distance(15, 0).orR
      bits.last     := !left(15, 0).orR
      bits.early    := isEarly
      bits.startBit := startBit
      bits.stopBit  := stopBit
      bits.turn     := physicalBit - startBit
    }
    m
  }
}
