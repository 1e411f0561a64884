package flyframe.master

import chisel3._
import chisel3.util._
import flyframe.ram.DualPortRam

/** A word of a slave in the table. */
class TableAddress(positionBits: Int) extends Bundle {
  val position = UInt(positionBits.W)

  /** Of [[flyframe.protocol.SlaveStateLayout]]. */
  val word = UInt(2.W)
}

/** The slaves of a line by their position, in block RAM (LM-11): their states as they were read last, and
  * whether the server has been told; the node IDs that are expected.
  *
  * @param maxSlaves
  *   a power of two
  */
class SlaveTable(maxSlaves: Int) extends Module {
  private val bits = log2Ceil(maxSlaves)

  /** A word to be written. */
  val write     = IO(Input(Bool()))
  val writeAt   = IO(Input(new TableAddress(bits)))
  val writeData = IO(Input(UInt(16.W)))

  /** The server is to be told of the slave at `writeAt`, or has been told. */
  val changes = IO(Flipped(Valid(Bool())))

  /** A word, whether the server is to be told of that slave, and the node ID expected there, a cycle later.
    */
  val readAt   = IO(Input(new TableAddress(bits)))
  val data     = IO(Output(UInt(16.W)))
  val untold   = IO(Output(Bool()))
  val expected = IO(Output(UInt(16.W)))

  /** Nothing is known of any slave, and nothing told; all words one after the other. `writeData` is 0. */
  val sweep = IO(Flipped(Valid(UInt((bits + 2).W))))

  /** For the host: a byte of the state of the slave at `window`, a cycle later, and the node ID that is
    * expected there from now on, 0 for nobody; undefined until it is set. The number of places up to the last
    * one where somebody is expected.
    */
  val window      = IO(Input(UInt(8.W)))
  val windowByte  = IO(Input(UInt(3.W)))
  val windowState = IO(Output(UInt(8.W)))
  val expect      = IO(Flipped(Valid(UInt(16.W))))
  val listed      = IO(Output(UInt(8.W)))

  /** For reports: a byte of [[flyframe.protocol.ReportedSlaveLayout]], a cycle later. */
  val look     = IO(Input(UInt(10.W)))
  val lookData = IO(Output(UInt(8.W)))

  private val swept   = sweep.bits.asTypeOf(new TableAddress(bits))
  private val address = Mux(sweep.valid, swept, writeAt)
  private val writes  = write || sweep.valid

  private def ram(depth: Int, write: Bool, to: UInt, value: UInt, from: UInt): UInt = {
    val ram = DualPortRam(depth, value.getWidth)(clock)
    ram.io.write        := write
    ram.io.writeAddress := to
    ram.io.writeData    := value
    ram.io.readAddress  := from
    ram.io.readData
  }
  data := ram(4 * maxSlaves, writes, address.asUInt, writeData, readAt.asUInt)
  untold := ram(
    maxSlaves max 256, // less would be no block
    changes.valid || sweep.valid,
    Mux(sweep.valid, sweep.bits(bits - 1, 0), writeAt.position),
    !sweep.valid && changes.bits,
    readAt.position
  ).asBool

  // What is read last, for the host and for reports.
  private val shown = ram(
    4 * maxSlaves,
    writes,
    Cat(address.position, address.word),
    writeData,
    Cat(window(bits - 1, 0), windowByte(2, 1))
  )
  windowState := Mux(RegNext(windowByte(0)), shown(15, 8), shown(7, 0))
  private val reported =
    ram(
      2 * maxSlaves,
      writes && !address.word(1),
      Cat(address.position, address.word(0)),
      writeData,
      look(bits + 1, 1)
    )
  // The second byte is of the word whose first byte was read.
  private val isFirst = RegNext(!look(0))
  private val low     = RegEnable(reported(7, 0), isFirst)
  lookData := Mux(isFirst, reported(15, 8), low)

  // What is expected. Behind the last place there is none.
  private val count   = RegInit(0.U(8.W)) // reset: nobody
  private val place   = window(bits - 1, 0)
  private val expects = expect.valid && window < maxSlaves.U
  expected := ram(maxSlaves, expects, place, expect.bits, readAt.position)
  listed   := count
  when(expects) {
    when(expect.bits === 0.U) {
      when(place < count) { count := place }
    }.elsewhen(place >= count) { count := place + 1.U }
  }
}
