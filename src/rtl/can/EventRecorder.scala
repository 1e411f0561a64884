package flyframe.can

import chisel3._
import chisel3.util._
import flyframe.registers.CanRegisters

/** Keeps the last error and the counters of events in the memory of a port (CAN-46). What comes while it
  * works waits: up to three errors, which may come as close as bits do (CB-15), and one event of each other
  * kind, of which a frame has one at most.
  *
  * @param hasBridge
  *   the counter of a bridge is cleared, too
  */
class EventRecorder(hasBridge: Boolean = false) extends Module {
  import EventRecorder._

  val error   = IO(Input(Valid(new ErrorRecord)))
  val lost    = IO(Input(Valid(UInt(6.W))))
  val overrun = IO(Input(Bool()))
  val busOff  = IO(Input(Bool()))

  /** All of them become 0: what has come before, and what comes in the next cycle, which was sampled before.
    */
  val clear = IO(Input(Bool()))

  /** They are being cleared: nobody may read them. */
  val clears = IO(Output(Bool()))

  /** To [[PortMemory]]. */
  val job  = IO(Output(Valid(new MemoryJob)))
  val done = IO(Input(Bool()))

  // What is still to be done, the lowest first, but counting errors; and what is being done, which stays as
  // it is until it is done. Reset: nothing.
  private val tasks   = if (hasBridge) Tasks + 1 else Tasks
  private val todo    = RegInit(0.U(tasks.W))
  private val task    = RegInit(0.U(tasks.W))
  private val ordered = RegNext(clear, false.B) // reset: no order
  private val isReady = done || !task.orR

  // Errors that are not counted yet: how many, and their kinds, the oldest one in the lowest place. It leaves
  // when it has been counted. Reset: none.
  private val waiting = RegInit(0.U(2.W))
  private val kinds   = Reg(Vec(Errors, UInt(3.W)))
  private val counted = done && task(CountError)
  private val left    = Mux(ordered, task(CountError), waiting) - counted
  private val another = waiting(1) || (waiting(0) && !task(CountError))
  private val pushes  = error.valid && !ordered && left =/= Errors.U
  waiting := left + pushes
  when(counted) { for (i <- 1 until Errors) kinds(i - 1) := kinds(i) }
  when(pushes) { kinds(left) := error.bits.kind }

  // What a clear finds undone would be gone at once. It comes behind what is being done.
  private val events = Cat(lost.valid, error.valid, busOff, overrun, lost.valid, 0.U((CountError + 1).W))
  private val next   = PriorityEncoderOH(todo | Mux(another, (1 << CountError).U, 0.U))
  when(isReady) { task := Mux(ordered, 0.U, next) }
  todo := Mux(
    ordered,
    (if (hasBridge) Clears | 1 << ClearBridge else Clears).U,
    (todo & ~Mux(isReady, next, 0.U)) | events
  )

  private val record  = RegEnable(error.bits, error.valid)
  private val lostBit = RegEnable(lost.bits, lost.valid)

  // Of a counter: the byte in the order of CanRegisters.CounterNames.
  private val counter = Mux1H(
    Seq(
      task(CountError) -> (kinds(0) - 1.U),
      task(CountLost)  -> 5.U,
      task(Overrun)    -> 6.U,
      task(BusOff)     -> 7.U
    )
  )
  private val counts   = task(CountError) || task(CountLost) || task(Overrun) || task(BusOff)
  private val ofBridge = (if (hasBridge) task(ClearBridge) else false.B)
  private val isClear  = task(ClearRecord) || task(ClearCounters) || task(ClearCounters + 1) || ofBridge
  private val place = Mux(
    counts,
    PortMemory.register(CanRegisters.Counters) | counter(2),
    Mux1H(
      Seq(
        (task(ClearRecord) || task(Record) || task(RecordLost)) ->
          PortMemory.register(CanRegisters.LastError),
        task(ClearCounters)     -> PortMemory.register(CanRegisters.Counters),
        task(ClearCounters + 1) -> PortMemory.register(CanRegisters.Counters + 4),
        ofBridge                -> PortMemory.register(CanRegisters.BridgeDropped)
      )
    )
  )
  private val last = if (hasBridge) ClearBridge else ClearCounters + 1
  clears          := ordered || todo(last) || task(last)
  job.valid       := task.orR
  job.bits.source := place
  job.bits.target := place
  job.bits.write  := true.B
  job.bits.counts := counts
  job.bits.wide   := false.B
  job.bits.bytes := Mux(
    counts,
    UIntToOH(counter(1, 0)),
    Fill(4, isClear) | (task(RecordLost) ## Fill(3, task(Record)))
  )
  job.bits.data := Mux(
    isClear,
    0.U,
    lostBit ## 0.U(3.W) ## record.bit ## 0.U(3.W) ## record.field ## 0.U(4.W) ## record.sender ## record.kind
  )
}

object EventRecorder {
  private val ClearRecord   = 0
  private val ClearCounters = 1 // two words
  private val Clears        = 7 // the three of them
  private val CountError    = 3
  private val CountLost     = 4
  private val Overrun       = 5
  private val BusOff        = 6
  private val Record        = 7 // these last: of them the newest counts
  private val RecordLost    = 8
  private val Tasks         = 9
  private val ClearBridge   = 9 // where there is a bridge

  /** Errors that may wait. */
  private val Errors = 3
}
