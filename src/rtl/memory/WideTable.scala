package flyframe.memory

import chisel3._
import chisel3.util._
import flyframe.lanes.Lanes

/** Copies of registers that are looked through one entry per cycle: wide words in block RAM, written byte by
  * byte.
  *
  * A byte write reads its word, puts the byte in and writes it back, one write per cycle; a word that was
  * changed in the cycle before is taken from there.
  *
  * @param entries
  *   words
  * @param bytes
  *   bytes of a word
  * @param copies
  *   read ports; the first one is taken over by a write
  */
class WideTable(entries: Int, bytes: Int, copies: Int) extends Module {
  private val indexBits = log2Ceil(entries) max 1
  private val width     = 8 * bytes

  val write      = IO(Input(Bool()))
  val writeIndex = IO(Input(UInt(indexBits.W)))
  val writeMask  = IO(Input(UInt(bytes.W)))
  val writeData  = IO(Input(UInt(width.W)))

  val readIndex = IO(Input(Vec(copies, UInt(indexBits.W))))

  /** One cycle after `readIndex`. */
  val readData = IO(Output(Vec(copies, UInt(width.W))))

  private val merging = RegNext(write, false.B)
  private val index   = RegNext(writeIndex)
  private val mask    = RegNext(writeMask)
  private val data    = RegNext(writeData)
  private val merged  = Wire(UInt(width.W))
  private val last    = RegNext(merged)
  private val again   = RegNext(merging && write && index === writeIndex, false.B)

  private val rams = Seq.fill(copies)(DualPortRam(entries, width)(clock))
  merged := VecInit((0 until bytes).map { i =>
    Mux(mask(i), Lanes.byte(data, i), Mux(again, Lanes.byte(last, i), Lanes.byte(rams.head.io.readData, i)))
  }).asUInt
  for ((ram, i) <- rams.zipWithIndex) {
    ram.io.write        := merging
    ram.io.writeAddress := index
    ram.io.writeData    := merged
    ram.io.readAddress  := (if (i == 0) Mux(write, writeIndex, readIndex(i)) else readIndex(i))
    readData(i)         := ram.io.readData
  }
}
