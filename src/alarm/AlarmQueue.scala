package flyframe.alarm

import chisel3._
import chisel3.util._
import flyframe.memory.DualPortRam

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

  /** The server has the events up to this number; anything else than that of a seen one has no effect. */
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
  private val oldest   = RegInit(1.U(16.W)) // number of the oldest event, or of the next one; reset: the same
  private val seen     = RegInit(false.B)   // the head has been acknowledged; reset: not
  private val again    = RegInit(false.B)   // to begin with the oldest; reset: it does

  private val event = Wire(new AlarmEvent)
  event.sequence := sequence
  event.state    := state
  event.time     := time
  private val happens = state =/= reported && state =/= DetectorState.Off.U && count =/= depth.U
  private val rewinds = again && !hold
  private val passes  = seen && !hold && !rewinds && told =/= count
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

  // Number 0 is left out, so behind the wrap the distance is one less.
  private val distance = (confirm.bits - oldest - (confirm.bits < oldest))(15, 0)
  private val confirms = confirm.valid && confirm.bits =/= 0.U && distance < told
  // Acknowledged and confirmed in one frame: both wait while the record leaves.
  private val late      = RegInit(false.B) // reset: nothing waits
  private val ofHead    = confirm.valid && seen && confirm.bits === head.bits.sequence
  private val completes = passes && (late || ofHead)
  private val gone =
    Mux(completes, told +& 1.U, Mux(confirms, distance(countBits - 1, 0) + 1.U, 0.U))(countBits - 1, 0)
  when(ofHead) { late := true.B }
  when(passes || rewinds) { late := false.B }
  when(confirms) { oldest := next(confirm.bits) }
  when(completes) { oldest := next(head.bits.sequence) }
  first := first + gone
  count := count + happens - gone
  told  := Mux(rewinds, 0.U, told + passes - gone)
}
