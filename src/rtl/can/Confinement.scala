package flyframe.can

import chisel3._

/** What a bit does to the error counters: at most one of each counter's in a cycle. */
class CounterSteps extends Bundle {
  val tecUp8   = Bool()
  val tecDown1 = Bool()
  val recUp1   = Bool()
  val recUp8   = Bool()
  val recDown1 = Bool()
}

/** Whether a node is error passive behind a step up, if that comes. */
class PassiveBehind extends Bundle {
  val tecUp8 = Bool()
  val recUp1 = Bool()
  val recUp8 = Bool()
}

/** TEC and REC, and the states that follow from them (CAN-30 to CAN-34, CB-07).
  *
  * @param firstTec
  *   TEC at the beginning; 0 but in proofs
  */
class Confinement(firstTec: Int = 0) extends Module {
  val steps = IO(Input(new CounterSteps))

  /** The end of a recovery: both counters become 0. */
  val clear = IO(Input(Bool()))

  /** 0 to 256, and 0 to 255. */
  val tec = IO(Output(UInt(9.W)))
  val rec = IO(Output(UInt(8.W)))

  val warning = IO(Output(Bool()))
  val passive = IO(Output(Bool()))
  val busOff  = IO(Output(Bool()))

  val passiveBehind = IO(Output(new PassiveBehind))

  /** The state behind the step of this cycle. */
  val busOffNext = IO(Output(Bool()))

  private val t = RegInit(firstTec.U(9.W)) // reset: no errors
  private val r = RegInit(0.U(8.W))
  tec     := t
  rec     := r
  busOff  := t(8)
  passive := t(8) || t(7) || r(7)
  warning := passive || t(6, 5).andR || r(6, 5).andR

  // Whether a step leads to a state is known before it comes, as samples are two cycles apart at least.
  private def beforehand(condition: Bool) = RegNext(condition, false.B) // reset: far from it
  private val tecNearPassive              = beforehand(t >= 120.U)
  private val tecNearBusOff               = beforehand(t >= 248.U)
  private val recNearPassive              = beforehand(r >= 120.U)
  private val recAtPassive                = beforehand(r >= 127.U)
  passiveBehind.tecUp8 := passive || tecNearPassive
  passiveBehind.recUp1 := passive || recAtPassive
  passiveBehind.recUp8 := passive || recNearPassive
  busOffNext           := busOff || (steps.tecUp8 && tecNearBusOff)

  when(!busOff) {
    when(steps.tecUp8) { t := Mux(t >= 248.U, 256.U, t + 8.U) }
      .elsewhen(steps.tecDown1 && t =/= 0.U) { t := t - 1.U }
    when(steps.recUp8) { r := Mux(r >= 247.U, 255.U, r + 8.U) }
      .elsewhen(steps.recUp1 && !r.andR) { r := r + 1.U }
      .elsewhen(steps.recDown1 && r =/= 0.U) { r := Mux(r(7), 119.U, r - 1.U) }
  }
  when(clear) {
    t := 0.U
    r := 0.U
  }
}
