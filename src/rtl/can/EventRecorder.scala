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
  private val todo    = RegInit(0.U(Tasks.W))
  private val record  = Reg(new ErrorRecord)
  private val lostBit = Reg(UInt(6.W))
  private val task    = PriorityEncoderOH(todo)

  when(error.valid) { record := error.bits }
  when(lost.valid) { lostBit := lost.bits }
  private val clearWaits = RegInit(false.B) // reset: no order
  private val clearNow   = clearWaits && !todo.orR
  clearWaits := clear || (clearWaits && !clearNow)
  todo := (todo & ~Mux(done, task, 0.U)) | Cat(
    busOff,
    overrun,
    Fill(2, lost.valid),
    Fill(2, error.valid),
    Fill(3, clearNow)
  )

  // Of a counter: the byte in the order of CanRegisters.CounterNames.
  private val counter = Mux1H(
    Seq(
      task(CountError) -> (record.kind - 1.U),
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
  clears          := clearWaits || todo(ClearCounters + 1)
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
  private val Record        = 3
  private val CountError    = 4
  private val RecordLost    = 5
  private val CountLost     = 6
  private val Overrun       = 7
  private val BusOff        = 8
  private val Tasks         = 9
}
