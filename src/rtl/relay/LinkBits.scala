package flyframe.relay

import chisel3._
import chisel3.util._

/** When links have their bits; core cycles (FR-40, RB-05). */
class LinkSetting extends Bundle {
  val last   = UInt(8.W) // of the cycles of a bit
  val sample = UInt(8.W) // from the edge at the start of a bit
  val jump   = UInt(6.W) // greatest change by a resynchronisation
  val fewer  = UInt(6.W) // one less
  val late   = UInt(8.W) // an edge from here on is at most so much in front of the next bit
  val beside = UInt(8.W) // the cycle before that
}

object LinkSetting {

  /** What follows from the length of a bit, 25 to 250, a cycle later; what is not needed in front of its
    * fourth cycle two cycles later.
    */
  def of(bit: UInt): LinkSetting = {
    val setting = Wire(new LinkSetting)
    setting.last   := RegNext(bit - 1.U)
    setting.sample := RegNext((((bit << 5) +& (bit << 3) +& bit) >> 6)(7, 0))
    setting.jump   := RegNext((((bit << 1) +& bit) >> 4)(5, 0))
    setting.fewer  := RegNext(setting.jump - 1.U)
    setting.beside := RegNext(setting.last - setting.jump)
    setting.late   := RegNext(setting.last - setting.jump + 1.U)
    setting
  }
}

/** Finds the samples of a link's bits (CAN-03 to CAN-06 with a core cycle as the quantum). Bits may be longer
  * than those of [[flyframe.can.BitTiming]], and a link needs no sync segment of its own bits.
  */
class LinkBits extends Module {
  val setting = IO(Input(new LinkSetting))

  /** This cycle is the first one of a bit, whatever was before. */
  val restart = IO(Input(Bool()))

  /** The level heard, and whether edges synchronise hard. */
  val heard = IO(Input(Bool()))
  val hard  = IO(Input(Bool()))

  val sample = IO(Output(Valid(Bool())))

  // Reset: as behind `restart`.
  private val cycle           = RegInit(0.U(8.W))
  private val behind          = RegInit(false.B) // the sample of this bit
  private val beforeReg       = RegInit(true.B)  // the level in the cycle before
  private val lastReg         = RegInit(true.B)  // the last sample
  private val synchronisedReg = RegInit(false.B) // since that

  private val isFree = restart || (beforeReg && lastReg && !synchronisedReg)
  private val edge   = isFree && !heard
  // The next cycle, by the greatest change on, or back; which comes to the end of the bit only if on.
  private val jumped =
    ((cycle ## true.B) + (Mux(behind, setting.jump.pad(8), ~setting.fewer.pad(8)) ## true.B))(8, 1)
  private val isNear  = Mux(behind, cycle >= setting.late, cycle <= setting.jump)
  private val isStart = restart || (edge && (hard || isNear))
  private val isLast  = !isStart && Mux(edge, behind && cycle === setting.beside, cycle === setting.last)
  private val samples = !edge && !restart && !behind && cycle === setting.sample

  sample.valid := samples
  sample.bits  := heard

  cycle           := Mux(isLast, 0.U, Mux(isStart, 1.U, Mux(edge, jumped, cycle + 1.U)))
  behind          := (behind || samples) && !isLast && !isStart
  beforeReg       := heard
  synchronisedReg := !samples && (edge || (synchronisedReg && !restart))
  when(samples) { lastReg := heard }.elsewhen(restart) { lastReg := true.B }
}
