package flyframe.relay

import chisel3._
import chisel3.util._

/** When links have their bits; core cycles (FR-40, RB-05). */
class LinkSetting extends Bundle {
  val bit    = UInt(8.W)
  val sample = UInt(8.W) // from the edge at the start of a bit
  val jump   = UInt(6.W) // greatest change by a resynchronisation
}

object LinkSetting {

  /** What follows from the length of a bit, 25 to 250, a cycle later. */
  def of(bit: UInt): LinkSetting = {
    val setting = Wire(new LinkSetting)
    setting.bit    := bit
    setting.sample := RegNext((((bit << 5) +& (bit << 3) +& bit) >> 6)(7, 0))
    setting.jump   := RegNext((((bit << 1) +& bit) >> 4)(5, 0))
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
  private val cycleReg        = RegInit(0.U(8.W))
  private val behindReg       = RegInit(false.B) // the sample of this bit
  private val beforeReg       = RegInit(true.B)  // the level in the cycle before
  private val lastReg         = RegInit(true.B)  // the last sample
  private val synchronisedReg = RegInit(false.B) // since that

  private val cycle  = Mux(restart, 0.U, cycleReg)
  private val behind = behindReg && !restart

  private val isFree = restart || (beforeReg && lastReg && !synchronisedReg)
  private val edge   = isFree && !heard
  // By the greatest change on, or back.
  private val change  = Mux(behind, setting.jump.pad(9), ~setting.jump.pad(9))
  private val jumped  = ((cycle.pad(9) ## true.B) + (change ## !behind))(9, 1)
  private val isNear  = Mux(behind, jumped >= setting.bit, jumped(8) || jumped === 0.U)
  private val place   = Mux(edge, Mux(hard || isNear, 0.U, jumped(7, 0)), cycle)
  private val isLast  = place === setting.bit - 1.U
  private val samples = !edge && !behind && cycle === setting.sample

  sample.valid := samples
  sample.bits  := heard

  cycleReg        := Mux(isLast, 0.U, place + 1.U)
  behindReg       := (behind || samples) && !isLast && !(edge && (hard || isNear))
  beforeReg       := heard
  synchronisedReg := !samples && (edge || (synchronisedReg && !restart))
  when(samples) { lastReg := heard }.elsewhen(restart) { lastReg := true.B }
}
