package flyframe.master

import chisel3._
import chisel3.util._
import flyframe.protocol.Command

/** Begins a frame in every cycle, has its datagrams written, and what came back looked at (LM-01 to LM-03).
  * It waits for nobody but the line and the units that read the answer, none of which waits.
  *
  * @param maxSlaves
  *   places in the table
  * @param maxSubTelegrams
  *   datagrams of a frame
  * @param linePorts
  *   ends of the line; the second one has a frame of its own while the ring is not closed
  */
class Scheduler(maxSlaves: Int, maxSubTelegrams: Int, linePorts: Int) extends Module {

  /** Once per nibble slot. */
  val step = IO(Input(Bool()))

  /** The line is to run; length of a cycle in slots. */
  val run   = IO(Input(Bool()))
  val cycle = IO(Input(UInt(20.W)))

  /** Memories are to be cleared, one word after the other. */
  val sweep = IO(Output(Valid(UInt((log2Ceil(maxSlaves) + 2).W))))

  /** The line does not run; nobody uses the table. */
  val stopped = IO(Output(Bool()))
  val idle    = IO(Output(Bool()))

  /** A cycle begins; its frame, or the second one of it, begins; the cycle is over, true: with an answer. */
  val begins   = IO(Output(Bool()))
  val begun    = IO(Output(Bool()))
  val atSecond = IO(Output(Bool()))
  val over     = IO(Output(Valid(Bool())))

  /** Number of the frame, to tell it from those before. */
  val frame = IO(Output(UInt(4.W)))

  /** Silence or reset must be noted, see [[OrderSender]]: that begins with a pulse, and lasts while `noting`.
    */
  val ordersDue = IO(Input(Bool()))
  val notes     = IO(Output(Bool()))
  val noting    = IO(Input(Bool()))
  val ordersMay = IO(Output(Bool()))

  /** A frame is composed, see [[DatagramWriter]]: datagrams of this `kind`, from a unit that `offers` one
    * more, or `seeks` one; when it is written it is `taken`.
    */
  val composes = IO(Output(Bool()))
  val kind     = IO(Output(DatagramKind()))
  val offers   = IO(Input(Bool()))
  val seeks    = IO(Input(Bool()))
  val taken    = IO(Output(Bool()))
  val write    = IO(Output(Bool()))
  val writing  = IO(Input(Bool()))

  /** See [[LineExchange]]. */
  val sending = IO(Input(Bool()))
  val go      = IO(Output(Bool()))
  val done    = IO(Flipped(Valid(Bool())))
  val count   = IO(Input(UInt((LineExchange.NumberBits + 1).W)))
  val number  = IO(Output(UInt(LineExchange.NumberBits.W)))
  val place   = IO(Output(UInt(3.W)))
  val answer  = IO(Input(UInt(8.W))) // the low half of a word

  /** What is at hand, now or a cycle later: the number of slaves; their status words together; the answer of
    * a slave that was read; that to an order; that to an acknowledgement; a record. The latter ones' index is
    * in the high half of `answer`. A unit is `busy` with what it reads, at `unitPlace`.
    */
  val counted   = IO(Output(Bool()))
  val surveyed  = IO(Output(Bool()))
  val read      = IO(Output(Bool()))
  val ordered   = IO(Output(Bool()))
  val told      = IO(Output(Bool()))
  val record    = IO(Output(Bool()))
  val isRecord  = IO(Output(Bool()))
  val unitPlace = IO(Input(UInt(3.W)))
  val busy      = IO(Input(Bool()))

  /** A good answer is there to be looked at; nobody has answered. */
  val heeds  = IO(Output(Bool()))
  val silent = IO(Output(Bool()))

  /** What [[LineEnds]] says when a frame is over: frames come round the ring; positions have changed. */
  val closed  = IO(Input(Bool()))
  val changed = IO(Input(Bool()))

  /** The host has a datagram; it is taken into this cycle; its number in the frame. */
  val request = IO(Flipped(Decoupled()))
  val hosts   = IO(Output(Valid(UInt(4.W))))

  /** The working counter of its answer is at hand. */
  val hostCounted = IO(Output(Bool()))

  private object State extends ChiselEnum {

    /** Between frames: `clear` sweeps memories, `off` waits for the host, `pause` for the next cycle; `note`
      * has noted for whom an order is.
      *
      * A frame: `open` begins it; `choose` looks what comes next, `put` waits until it is written; `send`
      * sends it, `await` waits for its answer.
      *
      * An answer: `heed` begins; `look` takes the next datagram, `sort` sees what it is; `survey` and
      * `status` take the first one, `work` leaves another one to a unit. `close` sees whether the cycle is
      * over.
      */
    val clear, off, pause, note, open, choose, put, send, await, heed, look, sort, survey, status, work,
        close =
      Value
  }
  import State._
  private val state  = RegInit(off)       // reset: until the host lets it run
  private val timer  = RegInit(0.U(20.W)) // slots of this cycle, words to be swept; reset: none
  private val frames = RegInit(0.U(4.W))  // reset: any number
  private val second = RegInit(false.B)   // reset: the first end
  private val stage  = Reg(DatagramKind())
  private val made   = Reg(UInt(5.W))     // datagrams of the frame
  private val at = Reg(UInt((LineExchange.NumberBits + 1).W)) // answer at hand
  private val hosted  = RegInit(false.B) // the host's datagram is in this cycle; reset: no
  private val hostAt  = Reg(UInt(4.W))   // its number, or where it would be
  private val noted   = RegInit(false.B) // before this cycle; reset: no
  private val good    = Reg(Bool())      // the answer at hand
  private val any     = Reg(Bool())      // answer of this cycle
  private val trusted = Reg(Bool())      // positions are still those which the frame was made for

  sweep.valid := state === clear
  sweep.bits  := timer
  stopped     := state === off
  idle        := state === pause || state === await
  begins      := false.B
  begun       := false.B
  atSecond    := (if (linePorts == 2) second else false.B)
  over.valid  := false.B
  over.bits   := any
  frame       := frames
  notes       := false.B
  ordersMay   := state === note
  composes    := state === choose || state === put
  kind        := stage
  taken       := false.B
  write       := false.B
  go          := state === send
  number      := at
  counted     := state === survey
  surveyed    := state === status
  read        := false.B
  ordered     := false.B
  told        := false.B
  record      := false.B
  isRecord    := at >= made
  heeds       := state === heed
  silent      := false.B
  hosts.valid := hosted
  hosts.bits  := hostAt

  private val ofHost = hosted && at === hostAt && !isRecord
  hostCounted   := state === work && ofHost
  request.ready := begins
  place := MuxLookup(state, unitPlace)(
    Seq(
      look   -> AnswerWord.Index.U,
      sort   -> Mux(at === 0.U, AnswerWord.Adp.U, unitPlace),
      survey -> AnswerWord.Data.U
    )
  )

  when(state === clear || step && timer =/= 0.U) { timer := timer - 1.U }
  switch(state) {
    is(clear) {
      when(sweep.bits === 1.U) { // from 0 down
        timer := 0.U
        state := pause
      }
    }
    is(off) {
      timer := 0.U
      when(run) { state := clear }
    }
    is(pause) {
      second := false.B
      good   := false.B
      any    := false.B
      when(!run) {
        state := off
      }.elsewhen(timer === 0.U && ordersDue && !noted) {
        noted := true.B // once: a button that is held keeps no frame
        notes := true.B
        state := note
      }.elsewhen(timer === 0.U) {
        begins := true.B
        noted  := false.B
        timer  := cycle
        hosted := request.valid
        state  := open
      }
    }
    is(note) { when(!noting) { state := Mux(good, look, pause) } }

    is(open) { // a late answer ends a frame
      stage   := DatagramKind.survey
      made    := 0.U
      good    := false.B
      trusted := true.B
      when(!sending) {
        begun  := true.B
        frames := frames + 1.U
        state  := choose
      }
    }
    is(choose) {
      // There is always a place for the last one.
      val fits = stage =/= DatagramKind.acknowledge || made =/= (maxSubTelegrams - 1).U
      when(stage === DatagramKind.host) { hostAt := made }
      when(offers && fits) {
        write := true.B
        state := put
      }.elsewhen(!seeks || !fits) { stage := DatagramKind.safe(stage.asUInt + 1.U)._1 }
    }
    is(put) {
      when(!writing) {
        made  := made + 1.U
        taken := true.B
        state := choose
        switch(stage) {
          is(DatagramKind.survey) { stage := DatagramKind.read }
          is(DatagramKind.host) { stage := DatagramKind.acknowledge }
          is(DatagramKind.confirm) { state := send }
        }
      }
    }
    is(send) { state := await }
    is(await) {
      at := 0.U
      when(done.valid) {
        good   := done.bits
        any    := any || done.bits
        state  := Mux(done.bits, heed, close)
        silent := !done.bits
      }
    }

    is(heed) {
      notes := ordersDue
      state := Mux(ordersDue, note, look)
    }
    is(look) { state := Mux(at === count, close, sort) }
    is(sort) {
      at    := at + 1.U
      state := look
      when(at === 0.U) {
        at    := at
        state := survey
      }.elsewhen(isRecord) {
        at     := at
        record := true.B
        state  := work
      }.elsewhen(ofHost) {
        at    := at
        state := work
      }.elsewhen(trusted) {
        when(answer === Command.Aprd.U) {
          at    := at
          read  := true.B
          state := work
        }
        when(answer === Command.Apwr.U) {
          told := at >= hostAt
          when(at < hostAt) {
            at      := at
            ordered := true.B
            state   := work
          }
        }
      }
    }
    is(survey) { state := status }
    is(status) {
      at    := 1.U
      state := look
    }
    is(work) {
      when(!busy) {
        at    := at + 1.U
        state := look
      }
    }
    is(close) {
      state := pause
      if (linePorts == 2) {
        when(!second && !(good && closed)) {
          second := true.B
          state  := open
        }.otherwise { over.valid := true.B }
      } else { over.valid := true.B }
      when(over.valid) { hosted := false.B }
    }
  }
  when(changed) { trusted := false.B }
}
