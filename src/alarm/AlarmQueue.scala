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

/** Keeps the events of a detector until the master has acknowledged them, oldest first (ALARM-03, ALARM-04).
  *
  * Every change of the detector's state is an event. While the queue is full the state last reported is kept,
  * and the change to the then present one is an event as soon as there is room: the newest state is never
  * lost.
  *
  * @param depth
  *   events it holds, a power of two
  */
class AlarmQueue(depth: Int) extends Module {
  val state = IO(Input(UInt(DetectorState.Width.W)))
  val time  = IO(Input(UInt(32.W)))

  /** The oldest event, and how many there are. */
  val head    = IO(Output(Valid(new AlarmEvent)))
  val pending = IO(Output(UInt(log2Ceil(depth + 1).W)))

  /** The master has seen the event with this number; anything else than the oldest one's has no effect. */
  val acknowledge = IO(Input(Valid(UInt(16.W))))

  /** The oldest event is in use and must stay. */
  val hold = IO(Input(Bool()))

  private val ram      = DualPortRam(depth, (new AlarmEvent).getWidth)(clock)
  private val first    = RegInit(0.U(log2Ceil(depth).W))                     // reset: empty
  private val count    = RegInit(0.U(log2Ceil(depth + 1).W))
  private val reported = RegInit(DetectorState.Off.U(DetectorState.Width.W)) // reset: as the detector
  private val sequence = RegInit(1.U(16.W)) // of the next event; reset: the first is 1
  private val seen     = RegInit(false.B)   // the oldest has been acknowledged; reset: not

  private val event = Wire(new AlarmEvent)
  event.sequence := sequence
  event.state    := state
  event.time     := time
  private val happens = state =/= reported && state =/= DetectorState.Off.U && count =/= depth.U
  private val leaves  = seen && !hold && count =/= 0.U
  // The RAM answers a cycle after the head has changed.
  private val valid = RegNext(count =/= 0.U && !leaves, false.B)

  ram.io.write        := happens
  ram.io.writeAddress := first + count
  ram.io.writeData    := event.asUInt
  ram.io.readAddress  := first
  head.valid          := valid && !leaves
  head.bits           := ram.io.readData.asTypeOf(new AlarmEvent)
  pending             := count

  when(happens) {
    reported := state
    sequence := Mux(sequence.andR, 1.U, sequence + 1.U)
  }
  when(acknowledge.valid && head.valid && acknowledge.bits === head.bits.sequence) { seen := true.B }
  when(leaves) {
    first := first + 1.U
    seen  := false.B
  }
  count := count + happens - leaves
}
