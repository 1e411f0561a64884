package flyframe.can

import chisel3._
import chisel3.util._

/** The bit timing as the registers have it: each number is one less than what it means (CAN-01). */
class TimingSetting extends Bundle {
  val sjw       = UInt(4.W)
  val tseg2     = UInt(4.W)
  val tseg1     = UInt(6.W)
  val prescaler = UInt(11.W)
}

/** Time quanta, synchronisation and sample points of one receiver (CAN-01 to CAN-06, CB-01, CB-02). It knows
  * nothing of frames: links use it as well as CAN ports.
  *
  * Everything happens in the last core cycle of a quantum: the level heard there is looked at for an edge,
  * then, if the quantum is that of the sample point, sampled.
  */
class BitTiming extends Module {

  /** What must not change while `run`. */
  val setting      = IO(Input(new TimingSetting))
  val threeSamples = IO(Input(Bool()))

  /** While it is low, the next core cycle is the first one of a bit. */
  val run = IO(Input(Bool()))

  /** The level of the bus, true for recessive, in the clock of this module. */
  val heard = IO(Input(Bool()))

  /** Of the bit that is being driven: edges synchronise hard (CAN-03); it is dominant (CAN-06). */
  val hard     = IO(Input(Bool()))
  val dominant = IO(Input(Bool()))

  /** The sample of a bit, in the cycle in which it is taken. */
  val sample = IO(Output(Valid(Bool())))

  /** The level of the next bit is to be driven from the next core cycle on. */
  val ends = IO(Output(Bool()))

  /** An edge synchronises hard. */
  val restarts = IO(Output(Bool()))

  // What follows from the setting, which rests long before `run` comes.
  private val samplePoint = RegNext(setting.tseg1 +& 1.U)
  private val jump        = RegNext(setting.sjw +& 1.U)
  private val whole       = RegNext(setting.tseg2 +& 1.U)

  // Reset: stopped, as by `run`.
  private val cycle    = RegInit(0.U(11.W)) // of the quantum
  private val tick     = RegInit(false.B)   // its last one
  private val quantum  = RegInit(0.U(7.W))  // in front of the sample point: its number
  private val distance = RegInit(0.U(5.W))  // behind it: quanta to the next bit, 1 for the last one
  private val behind   = RegInit(false.B)   // the sample point of this bit

  // Of `distance`, as it is: at most `jump`, one more than that, 1. Kept, as `ends` has no time for them.
  private val near         = Reg(Bool())
  private val isBeside     = Reg(Bool())
  private val isOne        = Reg(Bool())
  private val synchronised = RegInit(false.B) // since the last sample point
  private val lastSample   = RegInit(true.B)
  private val before       = RegInit(true.B)  // the level in the quantum before, and in that before
  private val twoBefore    = RegInit(true.B)

  private val nextCycle = Mux(tick || !run, 0.U, cycle + 1.U)
  cycle := nextCycle
  tick  := nextCycle === setting.prescaler

  // The level heard is known late in the cycle: what follows from an edge and what does without one is there
  // before it. The phase error is `quantum` in front of the sample point, and minus `distance` behind it.
  private val mayEdge  = tick && before && lastSample && !synchronised
  private val mayApply = mayEdge && (hard || behind || quantum === 0.U || !dominant)
  private val applies  = mayApply && !heard
  private val isNear   = hard || near // this quantum is 0 of the next bit
  private val back     = Mux(hard || quantum <= jump, 0.U, quantum - jump)
  private val ahead    = distance - jump
  private val isDue    = tick && !behind && quantum === samplePoint
  private val endsSoon = behind && (isNear || isBeside)
  private val endsSame = behind && isOne

  sample.valid := isDue && !applies
  sample.bits  := Mux(threeSamples, (heard && before) || (heard && twoBefore) || (before && twoBefore), heard)
  ends         := Mux(applies, endsSoon, tick && endsSame)
  restarts     := mayEdge && hard && !heard
  when(tick) {
    quantum := Mux(
      applies,
      Mux(endsSoon, isNear, back + 1.U),
      Mux(endsSame, 0.U, quantum + 1.U)
    )
    distance  := Mux(applies, ahead - 1.U, Mux(isDue, whole, distance - 1.U))
    near      := Mux(sample.valid, whole <= jump, distance <= jump +& 1.U)
    isBeside  := Mux(sample.valid, whole === jump +& 1.U, distance === jump +& 2.U)
    isOne     := Mux(applies, ahead === 2.U, Mux(isDue, whole === 1.U, distance === 2.U))
    before    := heard
    twoBefore := before
    when(applies) { synchronised := true.B }
    when(sample.valid) {
      behind       := true.B
      synchronised := false.B
      lastSample   := sample.bits
    }
    when(ends) { behind := false.B }
  }
  when(!run) {
    quantum      := 0.U
    behind       := false.B
    synchronised := false.B
    lastSample   := true.B
    before       := true.B
    twoBefore    := true.B
    sample.valid := false.B
    ends         := false.B
    restarts     := false.B
  }
}

object BitTiming {

  /** The setting cannot be kept (CAN-01, CB-04, CB-15): one that was changed counts a cycle later, long
    * before `run` can come, but `threeSamples` may come with it.
    */
  def isImpossible(setting: TimingSetting, threeSamples: Bool): Bool = {
    val never = setting.tseg1 +& setting.tseg2 < 5.U || setting.sjw > setting.tseg2 ||
      (setting.prescaler === 0.U && setting.tseg1 < 2.U) ||
      (setting.prescaler === 1.U && setting.tseg1 === 0.U)
    val wasNever = RegNext(never, true.B) // reset: as the registers, which are 0
    wasNever || (threeSamples && RegNext(setting.tseg1 === 0.U, true.B))
  }
}
