package flyframe

import chisel3._
import chisel3.util._
import flyframe.params.EscParams

/** What a bench does in each nibble slot, in hardware: calls into the simulation take far longer than the
  * simulation itself, so that a slot is one of each kind, and any time without a frame is one.
  */
class Slots(p: EscParams) extends Module {
  private val cycles = p.cyclesPerNibble

  /** A slot begins, or goes on; changes between slots. Without it the receive clocks rest. */
  val run = IO(Input(Bool()))

  /** The receive clock of all ports, which rises in the middle of a slot. */
  val rxClock = IO(Output(Bool()))

  /** With `txTick`, the nibbles that leave the ports, valid within a frame. */
  val txTick = IO(Input(Bool()))
  val tx     = IO(Input(Vec(p.ports, Valid(UInt(4.W)))))

  /** The pins of the EEPROM's master, the answer at the host port. */
  val others = IO(Input(UInt(3.W)))

  /** [[Seen]] as a number. */
  val seen = IO(Output(UInt(Seen.width(p).W)))

  // Between steps the core clock is high, so that the other one rises before it.
  rxClock := run && (if (cycles == 1) !clock.asBool else isMiddle)

  private def isMiddle: Bool = {
    val place = Reg(UInt(log2Ceil(cycles).W)) // of the core cycle in the slot
    place := Mux(run && place =/= (cycles - 1).U, place + 1.U, 0.U)
    place === (cycles / 2).U
  }

  private val ticks   = Reg(UInt(2.W))
  private val nibbles = Reg(UInt(16.W))
  private val last    = Reg(chiselTypeOf(tx))
  when(txTick) {
    ticks := ticks + 1.U
    last  := tx
    when(tx.map(_.valid).reduce(_ || _)) { nibbles := nibbles + 1.U }
  }
  seen := Cat(last.map(n => Cat(n.valid, n.bits)).reverse :+ nibbles :+ ticks :+ others)
}

/** What [[Slots]] shows of itself, from the right: whether the controller pulls the EEPROM's data and clock
  * low, whether it answers the host; how often nibbles have left (modulo 4), and with one of them within a
  * frame (modulo 65,536); the last ones, five bits per port.
  */
final case class Seen(word: Long) {
  private def bits(at: Int, width: Int): Int = (word >> at).toInt & (1 << width) - 1

  def sdaLow: Boolean = bits(0, 1) == 1
  def sclLow: Boolean = bits(1, 1) == 1
  def ack: Boolean    = bits(2, 1) == 1
  def ticks: Int      = bits(3, 2)
  def nibbles: Int    = bits(5, 16)

  /** The last nibble at a port, if it was within a frame. */
  def nibble(port: Int): Option[Int] = {
    val last = bits(21 + 5 * port, 5)
    Option.when(last >= 16)(last & 0xf)
  }
}
object Seen {
  def width(p: EscParams): Int = 21 + 5 * p.ports
}
