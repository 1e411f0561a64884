package flyframe.dc

import chisel3._

/** What a cycle of the local clock is longer or shorter by: a clock is never set, its rate is (DC-18).
  *
  * It loses 1 ns every `start` - D + 2 cycles, and wins 1 ns every `start` + D + 2 cycles, as the speed
  * counters of ESCs do; D is the speed counter difference. Beside that it falls back, or catches up, by as
  * many ns as it is told, one per eight cycles.
  */
class SpeedControl extends Module {

  /** New values: ns to fall back by (two's complement), and start - D and start + D. */
  val value = IO(Input(UInt(15.W)))
  val slew  = IO(Input(Bool()))
  val lose  = IO(Input(Bool()))
  val win   = IO(Input(Bool()))

  /** Every eighth cycle. */
  val round = IO(Input(Bool()))

  /** ns that this cycle counts beside its period: -2 to 2. */
  val more = IO(Output(SInt(3.W)))

  private def every(changes: Bool): Bool = {
    val period = RegInit(0x1000.U(15.W)) // reset: as without a difference (DC-20)
    val left   = RegInit(0.U(15.W))      // reset: all begin together
    val end    = left === 0.U
    when(changes) { period := value }
    left := Mux(end, period + 1.U, left - 1.U)
    end
  }
  private val loses = every(lose)
  private val wins  = every(win)

  private val behind = RegInit(0.S(14.W)) // reset: nothing to correct
  private val falls  = round && behind > 0.S
  private val climbs = round && behind < 0.S
  when(falls) { behind := behind - 1.S }
  when(climbs) { behind := behind + 1.S }
  when(slew) { behind := value.asSInt }

  private def one(on: Bool): SInt = on.asUInt.zext
  more := RegNext(one(wins) - one(loses) + one(climbs) - one(falls), 0.S) // reset: nothing
}
