package flyframe.can

import chisel3._
import chisel3.util._
import flyframe.registers.CanRegisters

/** Keeps the last error and the counters of events in the memory of a port (CAN-46). What comes while it
  * works waits; it is done long before the next event of its kind can come.
  */
class EventRecorder extends Module {
  import EventRecorder._

  val error   = IO(Input(Valid(new ErrorRecord)))
  val lost    = IO(Input(Valid(UInt(6.W))))
  val overrun = IO(Input(Bool()))
  val busOff  = IO(Input(Bool()))

  /** All of them become 0, when what has come before is done. */
  val clear = IO(Input(Bool()))

  /** They are being cleared: nobody may read them. */
  val clears = IO(Output(Bool()))

  /** To [[PortMemory]]. */
  val job  = IO(Output(Valid(new MemoryJob)))
  val done = IO(Input(Bool()))

  // What is still to be done, the lowest first. Reset: nothing.
  private val todo = RegInit(0.U(Tasks.W))
  private val task = PriorityEncoderOH(todo)

  // A clear waits for what was before it, which is also what was sampled when it was ordered; what happens
  // meanwhile is done behind it. Reset: no order.
  private val events     = Cat(busOff, overrun, Fill(2, lost.valid), Fill(2, error.valid), 0.U(3.W))
  private val later      = RegInit(0.U(Tasks.W))
  private val ordered    = RegNext(clear, false.B)
  private val clearWaits = RegInit(false.B)
  private val clearNow   = clearWaits && !todo.orR
  private val isLater    = clearWaits && !clearNow
  clearWaits := ordered || isLater
  later      := Mux(isLater, later | events, 0.U)

  // The error that is being counted, and one behind it: bits may be shorter than counting takes.
  private val kind      = Reg(UInt(3.W))
  private val nextKind  = Reg(UInt(3.W))
  private val another   = RegInit(false.B) // reset: none
  private val isCounted = done && task(CountError)
  private val counting  = todo(CountError) && !(isCounted && !another)
  when(isCounted && another) {
    kind    := nextKind
    another := false.B
  }
  when(error.valid && counting && !isLater) {
    nextKind := error.bits.kind
    another  := true.B
  }.elsewhen(error.valid) { kind := error.bits.kind }

  private val isOver = Mux(done && !(isCounted && another), task, 0.U)
  todo := (todo & ~isOver) | Mux(isLater, 0.U, events | Mux(clearNow, later, 0.U)) | Fill(3, clearNow)

  private val record  = RegEnable(error.bits, error.valid)
  private val lostBit = RegEnable(lost.bits, lost.valid)

  // Of a counter: the byte in the order of CanRegisters.CounterNames.
  private val counter = Mux1H(
    Seq(
      task(CountError) -> (kind - 1.U),
      task(CountLost)  -> 5.U,
      task(Overrun)    -> 6.U,
      task(BusOff)     -> 7.U
    )
  )
  private val counts  = task(CountError) || task(CountLost) || task(Overrun) || task(BusOff)
  private val isClear = task(ClearRecord) || task(ClearCounters) || task(ClearCounters + 1)
  private val place = Mux(
    counts,
    PortMemory.register(CanRegisters.Counters) | counter(2),
    Mux1H(
      Seq(
        (task(ClearRecord) || task(Record) || task(RecordLost)) ->
          PortMemory.register(CanRegisters.LastError),
        task(ClearCounters)     -> PortMemory.register(CanRegisters.Counters),
        task(ClearCounters + 1) -> PortMemory.register(CanRegisters.Counters + 4)
      )
    )
  )
  clears          := ordered || clearWaits || todo(ClearCounters + 1)
  job.valid       := todo.orR
  job.bits.source := place
  job.bits.target := place
  job.bits.write  := true.B
  job.bits.counts := counts
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
  private val CountError    = 3
  private val Record        = 4
  private val RecordLost    = 5
  private val CountLost     = 6
  private val Overrun       = 7
  private val BusOff        = 8
  private val Tasks         = 9
}
