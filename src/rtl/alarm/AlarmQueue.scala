package flyframe.alarm

import chisel3._
import chisel3.util._
import flyframe.memory.DualPortRam
import flyframe.protocol.DetectorState

/** What has happened at a detector. */
class AlarmEvent extends Bundle {

  /** Counts the events of this slave from 1 on; 0 is left out when it wraps. */
  val sequence = UInt(16.W)
  val state    = UInt(DetectorState.Width.W)

  /** Slave time in us. */
  val time = UInt(32.W)
}

/** Keeps the events of a detector, oldest first, until the server has them (ALARM-03, ALARM-04). What the
  * master has seen is not reported again, but stays until it is confirmed: a master that starts anew may ask
  * for it.
  *
  * Every change of the detector's state is an event. While the queue is full the state last reported is kept,
  * and the change to the then present one is an event as soon as there is room: the newest state is never
  * lost.
  *
  * @param depth
  *   events it holds, a power of two
  */
class AlarmQueue(depth: Int) extends Module {
  private val countBits = log2Ceil(depth + 1)

  val state = IO(Input(UInt(DetectorState.Width.W)))
  val time  = IO(Input(UInt(32.W)))

  /** The oldest event that the master has not seen; how many there are, seen ones included. */
  val head = IO(Output(Valid(new AlarmEvent)))
  val kept = IO(Output(UInt(countBits.W)))

  /** The master has seen the event with this number; anything else than that of `head` has no effect. */
  val acknowledge = IO(Input(Valid(UInt(16.W))))

  /** The server has the events up to this number; anything else than that of a seen one has no effect, nor
    * has what comes less than three cycles after the one before.
    */
  val confirm = IO(Input(Valid(UInt(16.W))))

  /** The events that are not confirmed are to be reported again. */
  val repeat = IO(Input(Bool()))

  /** The event at the head is in use and must stay there. */
  val hold = IO(Input(Bool()))

  private def next(number: UInt): UInt = Mux(number.andR, 1.U, number + 1.U)

  private val ram      = DualPortRam(depth, (new AlarmEvent).getWidth)(clock)
  private val first    = RegInit(0.U(log2Ceil(depth).W))                     // reset: empty
  private val count    = RegInit(0.U(countBits.W))
  private val told     = RegInit(0.U(countBits.W))                           // of them seen by the master
  private val reported = RegInit(DetectorState.Off.U(DetectorState.Width.W)) // reset: as the detector
  private val sequence = RegInit(1.U(16.W)) // of the next event; reset: the first is 1
  private val seen     = RegInit(false.B)   // the head has been acknowledged; reset: not
  private val again    = RegInit(false.B)   // to begin with the oldest; reset: it does

  // A confirmation is worked out in two cycles, and acts in the third; meanwhile nothing else changes. Reset:
  // none.
  private val takes     = WireDefault(false.B)
  private val subtracts = RegNext(takes, false.B)
  private val acts      = RegNext(subtracts, false.B)
  private val busy      = confirm.valid || subtracts || acts
  takes := confirm.valid && !subtracts && !acts

  private val event = Wire(new AlarmEvent)
  event.sequence := sequence
  event.state    := state
  event.time     := time
  private val happens = state =/= reported && state =/= DetectorState.Off.U && count =/= depth.U && !busy
  private val rewinds = again && !hold && !busy
  private val passes  = seen && !hold && !rewinds && told =/= count && !busy
  // The RAM answers a cycle after the head has changed.
  private val valid = RegNext(told =/= count && !passes && !rewinds, false.B)

  ram.io.write        := happens
  ram.io.writeAddress := first + count
  ram.io.writeData    := event.asUInt
  ram.io.readAddress  := first + told
  head.valid          := valid && !passes && !rewinds
  head.bits           := ram.io.readData.asTypeOf(new AlarmEvent)
  kept                := count

  when(happens) {
    reported := state
    sequence := next(sequence)
  }
  when(acknowledge.valid && head.valid && acknowledge.bits === head.bits.sequence) { seen := true.B }
  when(passes || rewinds) { seen := false.B }
  when(rewinds) { again := false.B }
  when(repeat) { again := true.B }

  // How far the number is behind that of the next event. Number 0 is left out: a borrow is brought around.
  private val isNumber = RegEnable(confirm.bits.orR, takes)
  private val behind   = RegEnable(sequence -& confirm.bits, takes)
  private val distance = RegNext(behind(15, 0) - behind(16))
  private val back     = distance(countBits - 1, 0)
  private val gone     = count - back + 1.U // events up to that number
  private val isSeen   = back =/= 0.U && back <= count && gone <= told
  private val confirms = acts && isNumber && !distance(15, countBits).orR && isSeen
  when(confirms) {
    first := first + gone
    count := back - 1.U
    told  := told - gone
  }

  // Acknowledged and confirmed in one frame: the confirmation waits while the record leaves.
  private val late = RegInit(false.B) // reset: nothing waits
  when(confirm.valid && seen && confirm.bits === head.bits.sequence) { late := true.B }
  when(happens) { count := count + 1.U }
  when(rewinds) { told := 0.U }
  when(passes) {
    told := told + 1.U
    when(late) { // all up to the head
      first := first + told + 1.U
      count := count - told - 1.U + happens
      told  := 0.U
    }
  }
  when(passes || rewinds) { late := false.B }
}
