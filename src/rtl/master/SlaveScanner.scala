package flyframe.master

import chisel3._
import chisel3.util._
import flyframe.protocol.{SlaveStateLayout, SlaveStatus}

/** Reads the states of slaves, in each frame those of some more, and puts them into the table (LM-11).
  *
  * @param maxSlaves
  *   places in the table
  */
class SlaveScanner(maxSlaves: Int) extends Module {
  import SlaveScanner._
  private val bits = log2Ceil(maxSlaves)

  /** A frame is begun. */
  val begin = IO(Input(Bool()))

  /** While a frame is composed: `position` is to be asked, or, when neither that nor `busy`, no more in this
    * frame. It is `taken`.
    */
  val asks     = IO(Input(Bool()))
  val offers   = IO(Output(Bool()))
  val taken    = IO(Input(Bool()))
  val position = IO(Output(UInt(bits.W)))

  /** What [[LineEnds]] says of that position. */
  val mine = IO(Input(Bool()))
  val gone = IO(Input(Bool()))

  /** Slaves in the table. The expected ones are set. */
  val known  = IO(Input(UInt(8.W)))
  val listed = IO(Input(Bool()))

  /** The answer of the slave at `answered` is there to be read, a cycle after its `place`. */
  val start    = IO(Input(Bool()))
  val answered = IO(Input(UInt(bits.W)))
  val place    = IO(Output(UInt(3.W)))
  val answer   = IO(Input(UInt(16.W)))
  val busy     = IO(Output(Bool()))

  /** The table, see [[SlaveTable]]. While it `clears` what is written is 0. */
  val clears    = IO(Input(Bool()))
  val readAt    = IO(Output(new TableAddress(bits)))
  val writeAt   = IO(Output(new TableAddress(bits)))
  val data      = IO(Input(UInt(16.W)))
  val expected  = IO(Input(UInt(16.W)))
  val write     = IO(Output(Bool()))
  val writeData = IO(Output(UInt(16.W)))

  /** What is written is another state, of which the server is to know. */
  val changes = IO(Output(Bool()))

  /** The sounder of a slave has gone on. */
  val newSound = IO(Output(Bool()))

  /** There is nobody at `subject`: what is known of its records does not count any more. */
  val forgets = IO(Output(Bool()))

  /** With `start`: it is the answer to an order, of which only the counter is looked at. The order for
    * `subject` has arrived, or there is nobody for it. What it ends is over in the table, too; `restarts`:
    * smoke, else the sounder.
    */
  val isOrder  = IO(Input(Bool()))
  val restarts = IO(Input(Bool()))
  val ordered  = IO(Output(Bool()))
  val subject  = IO(Output(UInt(bits.W)))

  private object State extends ChiselEnum { val idle, counter, node, status, third, fourth, over = Value }
  import State._
  private val state   = RegInit(idle)                   // reset: nothing to read
  private val turn    = RegInit(0.U(bits.W))            // the next one to be asked; reset: any
  private val asked   = Reg(UInt(log2Ceil(Most + 1).W)) // in this frame
  private val whose   = Reg(UInt(bits.W))               // answer it is
  private val absent  = Reg(Bool())
  private val lies    = Reg(Bool())                     // nobody has been asked
  private val orders  = Reg(Bool())                     // it is that to an order
  private val resets  = Reg(Bool())                     // which ends smoke
  private val hasBeen = Reg(Bool())                     // it has answered before
  private val wrong   = Reg(Bool())

  private val may  = state === idle && asked =/= Most.U && known =/= 0.U
  private val next = turn +& 1.U
  position := turn
  offers   := asks && may && mine
  busy     := state =/= idle || (asks && may && gone)

  private def word(n: SlaveStateLayout.type => Int): UInt = (AnswerWord.Data + n(SlaveStateLayout)).U
  subject          := whose
  ordered          := false.B
  writeAt.position := whose
  writeAt.word     := SlaveStateLayout.Status.word.U
  readAt           := writeAt
  readAt.word := MuxLookup(state, SlaveStateLayout.Node.word.U(2.W))(
    Seq(
      node   -> SlaveStateLayout.Status.word.U,
      status -> SlaveStateLayout.SelfTest.word.U,
      third  -> SlaveStateLayout.Dropped.word.U
    )
  )
  // A status word has marks of the master, other words are written as they come.
  private val marks  = WireDefault(0.U(2.W))
  private val isOver = state === over
  private val isOld  = isOver || state === status && absent
  // The sounder of an absent slave is taken for silent: if it comes back sounding, that is heard.
  private val source = Mux(isOld, data & ~Sounder.U(16.W), answer) & Fill(16, !clears)
  writeData := Mux(
    state === status,
    Cat(marks, source(13, 0)),
    source & ~Mux(isOver && resets, Smoke.U(16.W), 0.U)
  )
  private val mask = MuxLookup(state, 0xffff.U(16.W))(
    Seq(status -> ~SlaveStatus.Waiting.U(16.W), fourth -> 0x00ff.U) // links are none of them
  )
  changes  := write && ((data ^ writeData) & mask).orR
  place    := AnswerWord.Counter.U
  write    := false.B
  newSound := false.B
  forgets  := false.B

  private def advance(): Unit = {
    asked := asked + 1.U
    turn  := next
    when(next >= known) {
      turn  := 0.U
      asked := Most.U // nobody twice
    }
  }
  when(begin) { asked := 0.U }
  when(taken) { advance() }

  switch(state) {
    is(idle) {
      lies   := !start
      whose  := Mux(start, answered, turn)
      orders := start && isOrder
      resets := restarts
      when(start || (asks && may && gone)) { state := counter }
      when(!start && asks && may && gone) { advance() }
    }
    is(counter) {
      place  := word(_.Node.word)
      absent := lies || answer === 0.U
      state  := node
      when(orders) {
        readAt.word := SlaveStateLayout.Status.word.U
        ordered     := answer =/= 0.U
        state       := Mux(answer =/= 0.U, over, idle)
      }
    }
    is(node) {
      place        := word(_.Status.word)
      writeAt.word := SlaveStateLayout.Node.word.U
      write        := !absent // else its node ID stays
      hasBeen      := data =/= 0.U
      wrong        := listed && Mux(absent, expected =/= 0.U, expected === 0.U || expected =/= answer)
      state        := status
    }
    is(status) {
      place := word(_.SelfTest.word)
      write := true.B
      // Of an absent slave all else stays. One that never answered is no alarm slave, if none is expected.
      val isAbsent = absent && (hasBeen || wrong || data(15))
      marks    := Cat(isAbsent, wrong)
      ordered  := absent
      forgets  := absent
      newSound := !absent && (answer & ~data & SlaveStatus.Sounding.U).orR
      state    := Mux(absent, idle, third)
    }
    is(over) {
      write := true.B
      state := idle
    }
    is(third) {
      place        := word(_.Dropped.word)
      writeAt.word := SlaveStateLayout.SelfTest.word.U
      write        := true.B
      state        := fourth
    }
    is(fourth) {
      writeAt.word := SlaveStateLayout.Dropped.word.U
      write        := true.B
      state        := idle
    }
  }
}

object SlaveScanner {

  /** Slaves whose states are read in a frame. */
  private val Most = 4

  /** Bits of the status word that an order ends: each one, and a reset. */
  private val Sounder = SlaveStatus.Sounding
  private val Smoke   = SlaveStatus.Alarm | SlaveStatus.Latched
}
