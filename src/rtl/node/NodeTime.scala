package flyframe.node

import chisel3._
import chisel3.util._

/** The time of a node: microseconds since the reset.
  *
  * @param coreClockMhz
  *   clock of this module
  */
class NodeTime(coreClockMhz: Int) extends Module {

  /** A microsecond ends with this cycle; how many had ended before it, modulo 2^32. */
  val us    = IO(Output(Bool()))
  val timer = IO(Output(UInt(32.W)))

  // Reset: time begins.
  private val cycle = RegInit(0.U(log2Ceil(coreClockMhz).W))
  private val count = RegInit(0.U(32.W))
  us    := cycle === (coreClockMhz - 1).U
  timer := count
  cycle := Mux(us, 0.U, cycle + 1.U)
  when(us) { count := count + 1.U }
}

/** Time quanta of a bit timing that never stop, whatever the CAN port does: by them the ring counts its times
  * in T (FB-08). The port's own begin with its start.
  */
class TimeQuanta extends Module {

  /** The setting is possible: else there are none. */
  val possible = IO(Input(Bool()))

  /** Core cycles of a quantum, less one. */
  val prescaler = IO(Input(UInt(11.W)))

  /** A quantum ends with this cycle. */
  val quantum = IO(Output(Bool()))

  // Reset: a quantum begins. Behind a change of the prescaler one may be too long, which counts once.
  private val cycle = RegInit(0.U(11.W))
  private val ends  = RegInit(false.B)
  private val next  = Mux(ends, 0.U, cycle + 1.U)
  cycle   := next
  ends    := next === prescaler
  quantum := ends && possible
}
