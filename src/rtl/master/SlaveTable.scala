package flyframe.master

import chisel3._
import chisel3.util._
import flyframe.memory.DualPortRam

/** The last alarm record of a slave, as far as it must be known again. */
class SlaveRecord extends Bundle {
  val sequence = UInt(16.W)
  val epoch    = UInt(8.W)

  /** The number that it got among the events of the master, low bits. */
  val event = UInt(EventReporter.NumberBits.W)
}

/** What a slave has been told, and what it is still to be told. */
class SlaveFlags extends Bundle {

  /** A record of it has come. */
  val heard = Bool()

  /** The slave has been told that the server has that record. */
  val confirmed = Bool()

  /** The record with the number `answer` is to be acknowledged. */
  val due = Bool()

  /** That has just been done: the record may come once more in the frame of the acknowledgement, which is no
    * reason to acknowledge it again.
    */
  val told = Bool()
}

/** The slaves of a line by their position, in block RAM: their node IDs, last records, what is to be told to
  * them. What is read is also what is written: an entry is changed while it is there to be read.
  *
  * @param maxSlaves
  *   a power of two
  */
class SlaveTable(maxSlaves: Int) extends Module {
  private val bits = log2Ceil(maxSlaves)

  /** The slave to look at, a cycle later: `index`, and what is known of it. */
  val read  = IO(Input(UInt(bits.W)))
  val index = IO(Output(UInt(bits.W)))
  private def part[T <: Data](name: String, gen: T): (Valid[T], T) = {
    val change = IO(Flipped(Valid(gen))).suggestName(s"change_$name")
    val value  = IO(Output(gen)).suggestName(name)
    val ram    = DualPortRam(maxSlaves, gen.getWidth)(clock).suggestName(s"${name}_ram")
    ram.io.write        := change.valid
    ram.io.writeAddress := index
    ram.io.writeData    := change.bits.asUInt
    ram.io.readAddress  := read
    value               := ram.io.readData.asTypeOf(gen)
    (change, value)
  }
  index := RegNext(read)

  val (changeNode, node)     = part("node", UInt(16.W))
  val (changeRecord, record) = part("record", new SlaveRecord)
  val (changeAnswer, answer) = part("answer", UInt(16.W)) // number of a record
  val (changeFlags, flags)   = part("flags", new SlaveFlags)
}
