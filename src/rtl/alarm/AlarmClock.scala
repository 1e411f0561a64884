package flyframe.alarm

import chisel3._
import chisel3.util._

/** The time of an alarm slave, and the ticks that its parts count (ALARM-02).
  *
  * @param coreClockMhz
  *   core clock
  */
class AlarmClock(coreClockMhz: Int) extends Module {

  /** One cycle long each: every 10 us, every millisecond, every second. */
  val tenth       = IO(Output(Bool()))
  val millisecond = IO(Output(Bool()))
  val second      = IO(Output(Bool()))

  /** The lowest bits of the time since reset in us, and whether they go on to 0 with this cycle. While `hold`
    * they stay as they are; that loses nothing if it is shorter than 1 us.
    */
  val now   = IO(Output(UInt(16.W)))
  val wraps = IO(Output(Bool()))
  val hold  = IO(Input(Bool()))

  // Reset: time begins.
  private val microsecond = Counter(0 until coreClockMhz)._2
  tenth       := Counter(0 until 10, microsecond)._2
  millisecond := Counter(0 until 100, tenth)._2
  second      := Counter(0 until 1000, millisecond)._2

  private val time = RegInit(0.U(16.W))
  private val due  = RegInit(false.B) // a microsecond is over; reset: none
  private val goes = due && !hold
  due   := microsecond || (due && hold)
  time  := time + goes
  now   := time
  wraps := goes && time.andR
}
