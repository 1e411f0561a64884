package flyframe.memory

import chisel3._
import chisel3.util._
import flyframe.lanes.Lanes
import flyframe.ram.DualPortRam

/** Register writes as tables of registers take them: in words of four bytes. Bytes that are written to the
  * same word one after the other are gathered, so that whoever writes a word back need not wait for the byte
  * before.
  */
class TableWrite extends Bundle {

  /** A byte of word `word` is written, the registers counted in words. */
  val valid = Bool()
  val word  = UInt(10.W)

  /** A cycle later: the bytes written to that word since another one was written, and the word. */
  val mask = UInt(4.W)
  val data = UInt(32.W)
}

object TableWrite {
  def apply(write: Valid[RegisterWrite]): TableWrite = {
    val table        = Wire(new TableWrite).suggestName("tableWrite")
    val (mask, data) = (write.bits.maskIn(4), write.bits.dataIn(4))
    table.valid := write.valid && mask.orR // not for a write that has been refused
    table.word  := write.bits.byteAddress >> 2
    val before   = RegEnable(table.word, table.valid).suggestName("tableWord")
    val gathered = RegInit(0.U(4.W)).suggestName("tableMask") // reset: no byte of any word
    val bytes = (0 until 4).map { i =>
      RegEnable(Lanes.byte(data, i), table.valid && mask(i)).suggestName(s"tableByte_$i")
    }
    when(table.valid) { gathered := mask | Mux(table.word === before, gathered, 0.U) }
    table.mask := gathered
    table.data := VecInit(bytes).asUInt
    table
  }
}

/** Copies of registers that are looked through one entry per cycle: wide words in block RAM, written byte by
  * byte.
  *
  * A byte write reads its word, puts the byte in and writes it back, one write per cycle.
  *
  * @param entries
  *   words
  * @param bits
  *   bits that are kept of each byte of a word, from bit 0 on
  * @param copies
  *   read ports; the first one is taken over by a write
  */
class WideTable(entries: Int, bits: Seq[Int], copies: Int) extends Module {
  private val indexBits = log2Ceil(entries) max 1
  private val width     = bits.sum

  val write      = IO(Input(Bool()))
  val writeIndex = IO(Input(UInt(indexBits.W)))

  /** One cycle after `write`: which bytes are written, and those bits of all of them that are kept. What has
    * been written in the cycle before is not yet in the word that is read, so that a writer repeats it; see
    * [[TableWrite]].
    */
  val writeMask = IO(Input(UInt(bits.size.W)))
  val writeData = IO(Input(UInt(width.W)))

  val readIndex = IO(Input(Vec(copies, UInt(indexBits.W))))

  /** One cycle after `readIndex`. */
  val readData = IO(Output(Vec(copies, UInt(width.W))))

  private val merging = RegNext(write, false.B)
  private val index   = RegNext(writeIndex)

  private val rams = Seq.fill(copies)(DualPortRam(entries, width)(clock))
  private val merged = Cat(bits.indices.reverse.map { i =>
    val low              = bits.take(i).sum
    def part(word: UInt) = word(low + bits(i) - 1, low)
    Mux(writeMask(i), part(writeData), part(rams.head.io.readData))
  })
  for ((ram, i) <- rams.zipWithIndex) {
    ram.io.write        := merging
    ram.io.writeAddress := index
    ram.io.writeData    := merged
    ram.io.readAddress  := (if (i == 0) Mux(write, writeIndex, readIndex(i)) else readIndex(i))
    readData(i)         := ram.io.readData
  }
}
