package flyframe.alarm

import chisel3._
import chisel3.util._
import flyframe.clocks.LevelCrossing
import flyframe.protocol.DetectorState

/** A two-wire smoke detector of the current type: its current tells its state, taking its supply away resets
  * it (DET-01 to DET-05).
  */
class Detector extends Module {

  /** Outputs of three comparators: the current of the line is above the least of a whole line, above that of
    * an alarm, above that of a short circuit. Asynchronous.
    */
  val current = IO(Input(UInt(3.W)))

  /** Switches the supply of the line. */
  val supply = IO(Output(Bool()))

  /** The unit is to work. */
  val enable = IO(Input(Bool()))

  /** How long a state must last before it counts, in steps of 10 us, of which the first may be shorter; how
    * long the supply stays off at least, in ms.
    */
  val debounce = IO(Input(UInt(16.W)))
  val offTime  = IO(Input(UInt(16.W)))

  /** The debounce time is another one than in the cycle before: what has been counted does not matter. */
  val changes = IO(Input(Bool()))

  /** Switch the supply off and on again. */
  val restart = IO(Input(Bool()))

  /** Of [[AlarmClock]]. */
  val tenth       = IO(Input(Bool()))
  val millisecond = IO(Input(Bool()))

  /** The state, a code of [[flyframe.protocol.DetectorState]]. */
  val state = IO(Output(UInt(DetectorState.Width.W)))

  // Supply. Reset: off for a cycle, then on, since a detector works without a host.
  private val off = RegInit(false.B) // its off time runs; reset: it does not
  private val on  = RegInit(false.B)
  on     := enable && !off && !restart
  supply := on

  // The line as it is, and how long it has been so.
  private val level = VecInit(current.asBools.map { bit =>
    val crossing = Module(new LevelCrossing)
    crossing.in := bit
    crossing.out
  })
  private val seen = PriorityMux(
    Seq(
      !on      -> DetectorState.Off.U,
      level(2) -> DetectorState.Short.U,
      level(1) -> DetectorState.Alarm.U,
      level(0) -> DetectorState.Normal.U,
      true.B   -> DetectorState.Open.U
    )
  )
  private val last = RegInit(DetectorState.Off.U(DetectorState.Width.W)) // reset: as the supply
  last := seen

  // How long it has to stay so until it counts, or the supply has to stay off: one counter does for both. All
  // counters go down, which takes less than comparing them.
  private val rest   = Reg(UInt(16.W))
  private val isLong = !rest.orR
  private val tick   = Mux(off, millisecond, tenth)
  private val isAnew = seen =/= last || changes
  private val limit  = Mux(restart || off, offTime, debounce)
  rest := Mux(restart || (isAnew && !off), limit, rest + Fill(16, tick && !isLong))
  when(tick && isLong) { off := false.B } // the millisecond in which it began does not count
  when(restart) { off := true.B }
  private val isSteady = !isAnew && isLong && !off

  // A line that does not come to rest (DET-03): how many more ticks in which it is not normal there may be.
  // Of those in which it is, each fourth counts against the others.
  private val isNormal = seen === DetectorState.Normal.U
  private val room     = Reg(UInt(16.W))
  private val quarter  = RegInit(0.U(2.W)) // normal ticks since one has counted; reset: none
  private val touched  = RegInit(false.B)  // it was not normal in this tick; reset: it was
  private val above    = RegInit(false.B)  // it was above normal; reset: it was not
  private val isCalm   = tenth && !touched && isNormal
  private val isEmpty  = room === debounce // no tick has counted
  private val isFull   = !room.orR
  private val less     = tenth && !isCalm && !isFull
  private val more     = isCalm && quarter.andR && !isEmpty
  private val isOver   = !on || isSteady || changes
  quarter := quarter + isCalm
  room    := Mux(isOver, debounce, room + Cat(Fill(15, less), less || more))
  touched := on && !tenth && (touched || !isNormal)
  when(isCalm && isEmpty) { above := false.B }
  when(seen === DetectorState.Alarm.U || seen === DetectorState.Short.U) { above := true.B }
  when(isOver) { above := false.B }

  private val steady = RegInit(DetectorState.Off.U(DetectorState.Width.W)) // reset: as the supply
  when(!on) { steady := DetectorState.Off.U }
    .elsewhen(isSteady) { steady := last }
    .elsewhen(isFull && !isEmpty) {
      steady := Mux(above, DetectorState.Alarm.U, DetectorState.Open.U)
    }
  state := steady
}
