package flyframe.alarm

import chisel3._
import chisel3.util._
import flyframe.clocks.LevelCrossing
import flyframe.protocol.DetectorState

/** A two-wire smoke detector of the current type: its current tells its state, taking its supply away resets
  * it (DET-01 to DET-05).
  *
  * @param coreClockMhz
  *   core clock
  */
class Detector(coreClockMhz: Int) extends Module {

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

  /** Switch the supply off and on again. */
  val restart = IO(Input(Bool()))

  /** The state, a code of [[flyframe.protocol.DetectorState]]. */
  val state = IO(Output(UInt(DetectorState.Width.W)))

  /** Since reset, in us. */
  val time = IO(Output(UInt(32.W)))

  // Ticks. Reset: time begins.
  private val microsecond = Counter(0 until coreClockMhz)._2
  private val tenth       = Counter(0 until 10, microsecond)._2 // every 10 us
  private val millisecond = Counter(0 until 100, tenth)._2
  private val now         = RegInit(0.U(32.W))
  when(microsecond) { now := now + 1.U }
  time := now

  // Supply. Reset: off, until the host has switched the unit on.
  private val off = RegInit(0.U(17.W)) // ms it is still off, the one that runs included
  private val on  = RegInit(false.B)
  when(restart) { off := offTime +& 1.U }.elsewhen(millisecond && off =/= 0.U) { off := off - 1.U }
  on     := enable && off === 0.U && !restart
  supply := on

  // The line, once it has been in a state for long enough.
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
  private val last   = RegInit(DetectorState.Off.U(DetectorState.Width.W)) // reset: as the supply
  private val steady = RegInit(DetectorState.Off.U(DetectorState.Width.W))
  private val lasted = Reg(UInt(16.W))
  last := seen
  when(seen =/= last) { lasted := 0.U }.elsewhen(tenth && lasted < debounce) { lasted := lasted + 1.U }
  when(!on) { steady := DetectorState.Off.U }.elsewhen(seen === last && lasted >= debounce) { steady := last }
  state := steady
}
