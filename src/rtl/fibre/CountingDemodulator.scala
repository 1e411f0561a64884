package flyframe.fibre

import chisel3._
import chisel3.util.{log2Ceil, PopCount}
import flyframe.params.FibreParams

/** Makes levels of light as published: counts rising edges for a microsecond, and decides in the next one
  * (FR-08).
  */
class CountingDemodulator(p: FibreParams) extends Demodulator(p) {
  private val enough = p.toneDominantKhz * 4 / 5 / 1000 // four fifths of what a dominant tone has

  private val before = RegNext(samples(p.samplesPerCycle - 1), false.B)
  private val count  = RegInit(0.U(log2Ceil(p.sampleMhz / 2 + 1).W)) // reset: the first microsecond counts
  private val isOver = RegNext(odd, false.B)
  private val heard  = RegInit(true.B)                               // reset: recessive

  when(!odd) { count := count +& PopCount(samples & ~(samples ## before)(p.samplesPerCycle - 1, 0)) }
    .elsewhen(!isOver) { heard := count < enough.U }
    .otherwise { count := 0.U }
  level := heard
}
