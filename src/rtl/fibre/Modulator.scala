package flyframe.fibre

import chisel3._
import chisel3.util.log2Ceil
import flyframe.params.FibreParams

/** Codes of what a port sends. */
object ToneCode {
  val Dominant: UInt  = 0.U(2.W)
  val Recessive: UInt = 1.U(2.W)
  val Search: UInt    = 2.U(2.W)
  val Dark: UInt      = 3.U(2.W)
}

/** Makes light of a tone: a counter of half periods, which a change restarts (FR-01, FR-02, FB-01). */
class Modulator(p: FibreParams) extends Module {

  /** What is to be sent, of [[ToneCode]]. */
  val tone = IO(Input(UInt(2.W)))

  /** To the transmitter: 1 is light. It follows a cycle behind. */
  val light = IO(Output(Bool()))

  private val shortest = p.halfPeriod(p.toneDominantKhz)
  private val longest  = p.halfPeriod(p.toneRecessiveKhz)
  private val left     = Reg(UInt(log2Ceil(longest + 1).W)) // cycles of the level that are still to come
  private val lasted   = RegInit(shortest.U(log2Ceil(shortest + 1).W))
  private val present  = RegInit(ToneCode.Dark)
  private val lit      = RegInit(false.B)

  private val half = VecInit(
    shortest.U,
    longest.U,
    p.halfPeriod(p.toneSearchKhz).U,
    longest.U
  )(tone)
  private val age = Mux(lasted === shortest.U, lasted, lasted + 1.U)
  private val restarted =
    Mux(tone =/= ToneCode.Dominant, half, Mux(lit, shortest.U - age, shortest.U))
  private val next = Mux(tone === present, left - 1.U, restarted)
  private val ends = next === 0.U && tone =/= ToneCode.Dark

  present := tone
  left    := Mux(ends, half, next)
  lasted  := Mux(ends, 0.U, age)
  when(tone === ToneCode.Dark) { lit := lit && age =/= shortest.U }
    .elsewhen(ends) { lit := !lit }
  light := lit
}
