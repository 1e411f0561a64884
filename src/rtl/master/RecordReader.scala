package flyframe.master

import chisel3._
import chisel3.util._
import flyframe.protocol.{DetectorState, RecordLayout}
import flyframe.ram.DualPortRam

/** Takes the alarm records that slaves have appended to a frame, and has them acknowledged (LM-08 to LM-10).
  *
  * Of each slave the last record is kept that is an alarm, and the last one that is none: a slave offers the
  * others of a kind only when it has the acknowledgement. So a record that comes again is known.
  *
  * @param maxSlaves
  *   places in the table
  * @param linePorts
  *   ends of the line: each is acknowledged by its own frames
  */
class RecordReader(maxSlaves: Int, linePorts: Int) extends Module {
  import RecordReader._
  private val bits = log2Ceil(maxSlaves)

  /** An answer of this end is looked at, or a frame for it is composed. */
  val atSecond = IO(Input(Bool()))

  /** A good answer has come, or other slaves than before: what is to be acknowledged is found anew. */
  val begin = IO(Input(Bool()))

  /** A record is there to be read, a word a cycle after its `place`; its index is that word now. The index
    * counts from the slave at `base` on.
    */
  val start  = IO(Input(Bool()))
  val base   = IO(Input(UInt(8.W)))
  val place  = IO(Output(UInt(3.W)))
  val answer = IO(Input(UInt(16.W)))
  val busy   = IO(Output(Bool()))

  /** The record at this place (highest bit: an alarm) was acknowledged in the frame, or, while that is
    * cleared, is none that is known.
    */
  val told   = IO(Input(Bool()))
  val clears = IO(Input(Bool()))
  val toldAt = IO(Input(UInt((bits + 1).W)))

  /** An alarm record has come that is new. */
  val newAlarm = IO(Output(Bool()))

  /** There is room for records. The number that an event gets when it begins. */
  val room      = IO(Input(Bool()))
  val nextEvent = IO(Input(UInt(16.W)))

  /** See [[EventSlot]]. */
  val free   = IO(Input(Bool()))
  val fills  = IO(Output(Bool()))
  val step   = IO(Output(UInt(3.W)))
  val owner  = IO(Output(UInt(8.W)))
  val offer  = IO(Output(Bool()))
  val cancel = IO(Output(Bool()))
  val begins = IO(Input(Bool()))

  /** While a frame is composed: the record of the slave at `index` is to be acknowledged; bit 7: an alarm. It
    * is `taken`. A word of the acknowledgement comes a cycle after its `ackPlace`.
    */
  val compose  = IO(Input(Bool()))
  val restart  = IO(Input(Bool()))
  val offers   = IO(Output(Bool()))
  val seeks    = IO(Output(Bool())) // not yet
  val taken    = IO(Input(Bool()))
  val index    = IO(Output(UInt(8.W)))
  val ackPlace = IO(Input(UInt(2.W)))
  val ackWord  = IO(Output(UInt(16.W)))

  private object State extends ChiselEnum {

    /** `sort` sees whether it is an alarm; `compare` whether it is the record that is kept, else `store`
      * keeps it. If it has not been taken, `enter` waits for the slot, `fill` writes the event, and `await`
      * waits until it has its number; `mark` notes that it has been taken.
      */
    val idle, sort, compare, store, enter, fill, await, mark = Value
  }
  import State._
  private val state    = RegInit(idle)             // reset: nothing to read
  private val position = Reg(UInt(bits.W))         // of the slave
  private val isAlarm  = Reg(Bool())
  private val at       = Reg(UInt(3.W))            // word at hand; that before it has come
  private val same     = Reg(Bool())               // so far it is the record that is kept
  private val patience = Reg(UInt(PatienceBits.W)) // cycles that the reporter has left

  // What is kept.
  private val ram = DualPortRam(2 * maxSlaves * 8, 16)(clock)
  private def entry(alarm: Bool, position: UInt, word: UInt): UInt =
    Cat(alarm, position(bits - 1, 0), word.pad(3)(2, 0))
  private def of(index: UInt, word: UInt): UInt = entry(index(7), index, word)
  private val kept                              = ram.io.readData

  // What is to be acknowledged: for each end the first ones of its last answer.
  private val list   = DualPortRam(2 << ListBits, 8)(clock)                    // less would be no block
  private val counts = RegInit(VecInit.fill(linePorts)(0.U((ListBits + 1).W))) // reset: none
  private val next   = Reg(UInt((ListBits + 1).W))                             // the next one
  private val end    = if (linePorts == 2) atSecond.asUInt else 0.U(0.W)
  private val count  = counts(end)
  list.io.readAddress  := Cat(end, next(ListBits - 1, 0))
  list.io.write        := false.B
  list.io.writeAddress := Cat(end, count(ListBits - 1, 0))
  list.io.writeData    := Cat(isAlarm, position.pad(7))
  private def listIt(): Unit = when(!count(ListBits)) {
    list.io.write := true.B
    counts(end)   := count + 1.U
  }
  index   := list.io.readData
  offers  := compose && next =/= count && RegNext(compose && !taken && !restart)
  seeks   := compose && next =/= count && !offers
  ackWord := kept
  when(begin) { counts(end) := 0.U }
  when(taken) { next := next + 1.U }
  when(restart) { next := 0.U }

  private def choose(words: Seq[Int], n: UInt): UInt = MuxLookup(n, words.last.U(3.W))(
    words.zipWithIndex.map { case (w, i) => i.U -> w.U(3.W) }
  )
  private val before = at - 1.U
  ram.io.readAddress  := Mux(compose, of(index, choose(Acknowledged, ackPlace)), entry(isAlarm, position, at))
  ram.io.write        := false.B
  ram.io.writeAddress := entry(isAlarm, position, before)
  ram.io.writeData    := answer
  private def write(address: UInt, value: UInt): Unit = {
    ram.io.write        := true.B
    ram.io.writeAddress := address
    ram.io.writeData    := value
  }

  private val number = answer(15, 8) +& base - 1.U
  place    := Mux(state === fill, choose(Entered, at), choose(Keys, at))
  busy     := state =/= idle
  newAlarm := false.B
  fills    := state === fill
  step     := at
  owner    := position
  offer    := false.B
  cancel   := false.B

  at       := at + 1.U
  patience := patience - 1.U
  switch(state) {
    is(idle) {
      place    := (AnswerWord.Data + RecordLayout.State.word).U
      position := number
      when(start && number < maxSlaves.U && answer(15, 8) =/= 0.U) { state := sort }
    }
    is(sort) {
      isAlarm := answer(7, 0) === DetectorState.Alarm.U // not that of a test
      same    := true.B
      at      := 0.U
      state   := compare
    }
    is(compare) {
      when(at =/= 0.U && kept =/= answer) { same := false.B }
      when(at === Ended.U) {
        same  := same
        at    := 0.U
        state := idle
        when(!same || !kept(Known)) {
          newAlarm := isAlarm
          state    := store
        }.elsewhen(!kept(Taken)) {
          state := enter
        }.elsewhen(kept(Told)) {
          // It came in the frame of its acknowledgement.
          write(entry(isAlarm, position, Flags.U), (1 << Known | 1 << Taken).U)
        }.otherwise { listIt() }
      }
    }
    is(store) {
      when(at =/= 0.U) { ram.io.write := true.B }
      when(at === Ended.U) {
        write(entry(isAlarm, position, Flags.U), (1 << Known).U)
        state := enter
      }
    }
    is(enter) {
      at := 0.U
      when(free && room) {
        state := fill
      }.elsewhen(patience === 0.U || !room) { state := idle }
    }
    is(fill) {
      when(at.andR) {
        offer := true.B
        state := await
      }
    }
    is(await) {
      when(begins) {
        write(entry(isAlarm, position, Tag.U), nextEvent)
        state := mark
      }.elsewhen(patience === 0.U) {
        cancel := true.B
        state  := idle
      }
    }
    is(mark) {
      write(entry(isAlarm, position, Flags.U), (1 << Known | 1 << Taken).U)
      listIt()
      state := idle
    }
  }
  when(state =/= enter && state =/= await) { patience := Fill(PatienceBits, true.B) }
  when(told || clears) { write(entry(toldAt(bits), toldAt, Flags.U), Fill(3, told)) }
}

object RecordReader {

  /** Words that tell a record from all others, as an answer has them. They are kept in this order, and behind
    * them the flags, and the number of the event.
    */
  private val Keys = Seq(
    AnswerWord.Adp,
    AnswerWord.Data + RecordLayout.Sequence.word,
    AnswerWord.Data + RecordLayout.State.word,
    AnswerWord.Data + RecordLayout.Time.word,
    AnswerWord.Data + RecordLayout.Time.word + 1
  )
  private val Flags = Keys.size
  private val Tag   = Flags + 1
  private val Ended = Keys.size + 1

  /** The bits of the flags: it has been taken; it has been acknowledged in the last frame; it is the record
    * of a slave that has not been absent since.
    */
  private val Taken = 0
  private val Told  = 1
  private val Known = 2

  /** Words of an acknowledgement: number, guard, tag. */
  private val Acknowledged = Seq(1, 3, Tag)

  /** Words of an answer that an event has behind its first word, in its order. */
  private val Entered = Seq(
    AnswerWord.Adp,
    AnswerWord.Data + RecordLayout.Sequence.word,
    AnswerWord.Data + RecordLayout.State.word
  ) ++ (3 to 0 by -1).map(AnswerWord.Data + RecordLayout.Time.word + _)

  /** A reporter that does not take an event within 64 cycles is taken for one without room. */
  private val PatienceBits = 6

  /** Records of an answer that are acknowledged: not more than there is room for in a frame. */
  private val ListBits = 4
}
