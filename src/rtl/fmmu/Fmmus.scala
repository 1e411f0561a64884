package flyframe.fmmu

import chisel3._
import flyframe.memory.TableWrite
import flyframe.params.EscParams

/** What the search looks for: a byte of a datagram.
  *
  * @param hasOffset
  *   it may be written to another place than it is read from
  */
class FmmuSearch(hasOffset: Boolean) extends Bundle {

  /** The entry to be looked at, from 0 to 7 in consecutive cycles; 7 until the next search. */
  val index = UInt(3.W)

  /** One cycle after `index`: the logical address *behind* the byte; bit 32: beyond the last one. */
  val behind = UInt(33.W)

  /** Without FMMU. Then `behind` is the byte's local address, of 17 bits, two cycles after index 0. */
  val direct = Bool()

  /** Of the search that begins, from index 0 to 7: where its result is kept; the byte is the one before the
    * datagram.
    */
  val slot   = UInt(2.W)
  val before = Bool()

  /** With `direct`: how far behind `behind` it is written. */
  val offset = UInt((if (hasOffset) 16 else 0).W)

  /** Two cycles after `index`: the byte lies past the last logical address. */
  val past = Bool()
}

/** All FMMUs: their configuration ([[FmmuRegisters]], 0x0600 on), and the search for the one that maps a
  * byte.
  *
  * The search takes one entry per cycle in each bank of eight. The lowest-numbered FMMU of each direction
  * wins (FMMU-05). The result is kept in block RAM, and can be asked for four cycles after index 7 was.
  */
class Fmmus(p: EscParams) extends Module {
  val table  = IO(Input(new TableWrite))
  val search = IO(Input(new FmmuSearch(p.hasReadWriteOffset)))

  /** The bytes of which the results are wanted, and those one cycle later. */
  val readSlot  = IO(Input(UInt(2.W)))
  val writeSlot = IO(Input(UInt(2.W)))
  val read      = IO(Output(new Mapped(p.hasBitwiseFmmus)))
  val write     = IO(Output(new Mapped(p.hasBitwiseFmmus)))

  private val banks = Seq.tabulate(p.fmmuBanks) { number =>
    val bank = Module(
      if (p.fmmus == 0) new NoFmmus(p)
      else if (p.hasBitwiseFmmus) new BitwiseFmmuBank(p, number)
      else new ByteFmmuBank(p, number)
    ).suggestName(s"bank_$number")
    bank.table     := table
    bank.search    := search
    bank.readSlot  := readSlot
    bank.writeSlot := writeSlot
    bank
  }
  private def lowest(results: Seq[Mapped]) = results.reduceRight((low, high) => Mux(low.hit, low, high))
  read  := lowest(banks.map(_.read))
  write := lowest(banks.map(_.write))
}
