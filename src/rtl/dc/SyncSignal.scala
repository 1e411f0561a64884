package flyframe.dc

import chisel3._
import chisel3.util._

/** One SYNC signal (DC-26 to DC-34, DC-36): counts down to its pulse, and shapes it.
  *
  * @param periodNs
  *   of a core cycle: 8 or 10
  */
class SyncSignal(periodNs: Int) extends Module {

  /** The cyclic unit is active; else there is neither pulse nor level, but those by hand. */
  val active = IO(Input(Bool()))

  /** One pulse at once, also if it is not active. */
  val byHand = IO(Input(Bool()))

  /** Pulses go out. */
  val enabled = IO(Input(Bool()))

  /** The pulse comes in `value` ns. */
  val arm   = IO(Input(Bool()))
  val value = IO(Input(UInt(16.W)))

  /** ns that this cycle counts. */
  val passes = IO(Input(UInt(4.W)))

  /** Length of pulses in 10 ns; 0: until `acknowledge`. */
  val length      = IO(Input(UInt(16.W)))
  val acknowledge = IO(Input(Bool()))

  /** A pulse is to come at a known time. */
  val armed = IO(Output(Bool()))

  /** Its time has come. */
  val fires = IO(Output(Bool()))

  /** The signal. */
  val level = IO(Output(Bool()))

  private val isArmed = RegInit(false.B) // reset: nothing is to come
  private val left    = Reg(UInt(16.W))
  armed := isArmed
  fires := isArmed && left < passes
  left  := Mux(arm, value, left - passes)
  when(fires || !active) { isArmed := false.B }
  when(arm && active) { isArmed := true.B }

  // Of five cycles of 8 ns four count 10 ns.
  private val counts = if (periodNs == 10) true.B else Counter(true.B, 5)._1 =/= 0.U
  private val rest   = RegInit(0.U(16.W)) // reset: no pulse
  private val held   = RegInit(false.B)   // reset: nothing to acknowledge
  private val pings  = RegInit(false.B)   // a pulse by hand goes on; reset: none
  private val sets   = (fires && active || byHand) && enabled
  when(rest =/= 0.U && counts) { rest := rest - 1.U }
  // The host has looked two cycles ago, and has not seen what has come since then.
  private val isNew = RegNext(sets, false.B) || ShiftRegister(sets, 2, false.B, true.B)
  when(acknowledge && !isNew) { held := false.B }
  when(sets) {
    rest := length
    held := true.B
  }
  private val ends = (!active && RegNext(active, false.B)) || !enabled
  when(!level) { pings := false.B }
  when(byHand) { pings := true.B }
  when(ends || (!active && !pings && !byHand)) {
    rest  := 0.U
    held  := false.B
    pings := false.B
  }
  level := Mux(length === 0.U, held, rest =/= 0.U)
}
