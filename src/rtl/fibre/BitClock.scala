package flyframe.fibre

import chisel3._

/** What times in T are counted by: each ends with the cycle in which it is true (FB-08). */
class BitTicks extends Bundle {
  val eighth    = Bool()
  val bit       = Bool() // T
  val four      = Bool() // 4 T
  val eight     = Bool()
  val sixtyFour = Bool()
}

/** Divides T, the nominal bit of port F, without a divider (FB-08). */
class BitClock extends Module {

  /** A time quantum ends with this cycle. */
  val quantum = IO(Input(Bool()))

  /** Those of a bit, 8 to 127. */
  val quanta = IO(Input(UInt(7.W)))

  val ticks = IO(Output(new BitTicks))

  // Of an eighth, in eighths of a quantum. Reset: as in the model; nothing else depends on it.
  private val left    = RegInit(0.U(7.W))
  private val eighths = RegInit(0.U(9.W)) // that are over, modulo 64 T

  private val isLow  = left(6, 3) === 0.U // less than a quantum is left
  private val eighth = quantum && isLow
  private val low    = left(2, 0) +& quanta(2, 0)
  private val high   = Mux(low(3), quanta(6, 3), ShortCounter.down(quanta(6, 3)))
  when(quantum) {
    left := Mux(isLow, high, ShortCounter.down(left(6, 3))) ## Mux(isLow, low(2, 0), left(2, 0))
  }
  when(eighth) { eighths := eighths + 1.U }

  private def ends(bits: Int) = eighth && eighths(bits - 1, 0).andR
  ticks.eighth    := eighth
  ticks.bit       := ends(3)
  ticks.four      := ends(5)
  ticks.eight     := ends(6)
  ticks.sixtyFour := ends(9)
}
