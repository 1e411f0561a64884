package flyframe.fibre

import chisel3._
import chisel3.util.log2Ceil
import flyframe.params.FibreParams

/** Makes levels of light, by distances between rising edges (FR-04). */
class FastDemodulator(p: FibreParams) extends Demodulator(p) {
  private val short = p.dominantTenths(15)
  private val quiet = p.dominantTenths(25)

  /** What is known behind a sample. */
  private class State extends Bundle {
    val light    = Bool()
    val distance = UInt(log2Ceil(quiet + 1).W) // samples since the last rising edge, at most `quiet`
    val wasShort = Bool()                      // the distance before
    val level    = Bool()
  }

  private val state = RegInit {
    val start = Wire(new State)
    start.light    := false.B
    start.distance := quiet.U
    start.wasShort := false.B
    start.level    := true.B
    start
  }

  private def behind(before: State, light: Bool): State = {
    val next     = Wire(new State)
    val distance = Mux(before.distance === quiet.U, quiet.U, before.distance + 1.U)
    val rises    = light && !before.light
    val isShort  = distance <= short.U
    next.light    := light
    next.distance := Mux(rises, 0.U, distance)
    next.wasShort := Mux(rises, isShort, before.wasShort)
    next.level    := before.level
    when(rises && isShort && before.wasShort) { next.level := false.B }
      .elsewhen(!rises && distance === quiet.U) { next.level := true.B }
    next
  }

  state := (0 until p.samplesPerCycle).foldLeft(state)((s, i) => behind(s, samples(i)))
  level := state.level
}
