package flyframe.fibre

import chisel3._
import flyframe.params.FibreParams

/** Makes levels of light. */
abstract class Demodulator(p: FibreParams) extends Module {

  /** Samples of this cycle, the first one in bit 0, behind the crossing. */
  val samples = IO(Input(UInt(p.samplesPerCycle.W)))

  /** The microsecond since reset is an odd one. */
  val odd = IO(Input(Bool()))

  /** The level heard up to the cycle before: 1 is recessive. */
  val level = IO(Output(Bool()))
}

object Demodulator {
  def apply(p: FibreParams): Demodulator =
    if (p.demodulator == 0) new FastDemodulator(p) else new CountingDemodulator(p)
}
