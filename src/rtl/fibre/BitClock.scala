package flyframe.fibre

import chisel3._

/** What times in T are counted by: each ends with the cycle in which it is true (FB-08). */
class BitTicks extends Bundle {
  val eighth  = Bool()
  val bit     = Bool() // T
  val two     = Bool() // 2 T
  val sixteen = Bool() // 16 T
}

/** Divides T, the nominal bit of port F, without a divider (FB-08). */
class BitClock extends Module {

  /** A time quantum ends with this cycle. */
  val quantum = IO(Input(Bool()))

  /** Those of a bit, 8 to 127. */
  val quanta = IO(Input(UInt(7.W)))

  val ticks = IO(Output(new BitTicks))

  // Of an eighth, in eighths of a quantum. Reset: whatever comes first, but the same in simulation and model.
  private val left    = RegInit(0.U(7.W))
  private val eighths = RegInit(0.U(7.W)) // that are over, modulo 16 T

  private val eighth = quantum && left < 8.U
  when(quantum) { left := left - 8.U + Mux(eighth, quanta, 0.U) }
  when(eighth) { eighths := eighths + 1.U }

  private def ends(bits: Int) = eighth && eighths(bits - 1, 0).andR
  ticks.eighth  := eighth
  ticks.bit     := ends(3)
  ticks.two     := ends(4)
  ticks.sixteen := ends(7)
}
