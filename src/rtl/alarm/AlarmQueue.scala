package flyframe.alarm

import chisel3._
import chisel3.util._
import flyframe.protocol.{DetectorState, RecordLayout}
import flyframe.ram.{DualPortRam, DualPortRamIO}

/** The master has a record: [[flyframe.protocol.RecordAckLayout]]. */
class RecordAck extends Bundle {
  val sequence = UInt(16.W)
  val guard    = UInt(16.W)
  val tag      = UInt(16.W)
}

/** Keeps the records of a slave until the server has them, oldest first (ALARM-02 to ALARM-05). A new alarm
  * always finds a place.
  *
  * The records lie in a block RAM of 16-bit words. All work is done by passing through them, word by word:
  * each record is read, perhaps changed, and written to the place behind the last one that stays. A pass
  * takes eight cycles for each record and no more than one piece of work: an acknowledgement, a confirmation,
  * the removal of one record from a full queue. A new record is written behind the others.
  *
  * The record on offer is copied to a place of its own, the box. There the appender reads it, whatever
  * happens to the queue meanwhile. Another place holds the number of the next record and the higher bits of
  * the time.
  *
  * @param depth
  *   records it holds, a power of two
  * @param newRam
  *   makes the RAM; another one for proofs, which cannot see into a black box
  */
class AlarmQueue(depth: Int, newRam: (Int, Int, Clock) => DualPortRamIO = DualPortRam(_, _)(_).io)
    extends Module {
  import AlarmQueue._
  private val placeBits = log2Ceil(depth)

  /** What is to be recorded whenever it changes, and under which epoch. */
  val state = IO(Input(UInt(DetectorState.Width.W)))
  val test  = IO(Input(Bool()))
  val epoch = IO(Input(UInt(8.W)))

  /** What was recorded last does not count any more, nor does the present state in this cycle. */
  val forget = IO(Input(Bool()))

  /** Of [[AlarmClock]]: the lowest bits of the time, which must stay as they are while `hold`. */
  val time  = IO(Input(UInt(16.W)))
  val wraps = IO(Input(Bool()))
  val hold  = IO(Output(Bool()))

  /** Orders of the master. They must stay as they are until `changes` is true, at the latest in the cycle
    * before they change. Of two that come too fast the first may have no effect.
    */
  val acknowledge        = IO(Input(Valid(new RecordAck)))
  val acknowledgeChanges = IO(Input(Bool()))
  val confirm            = IO(Input(Valid(UInt(16.W)))) // the server has all before this number
  val confirmChanges     = IO(Input(Bool()))

  /** The master has become another one, which knows of no record. */
  val newMaster = IO(Input(Bool()))

  /** There is a record on offer, it is an alarm, and it is another one than before (for a cycle). It stays as
    * it is while `busy`, which must be true for as long as it may be read, from the cycle behind the last one
    * with `offers` on.
    */
  val offers   = IO(Output(Bool()))
  val isUrgent = IO(Output(Bool()))
  val isNew    = IO(Output(Bool()))
  val busy     = IO(Input(Bool()))

  /** Reads a word of the record on offer, as they stand in [[flyframe.protocol.RecordLayout]]; it comes a
    * cycle later.
    */
  val read     = IO(Input(Bool()))
  val readWord = IO(Input(UInt(WordBits.W)))
  val readData = IO(Output(UInt(16.W)))

  /** The master has not got all records; some were dropped since the queue was empty; how many were dropped,
    * up to 255.
    */
  val waiting = IO(Output(Bool()))
  val lacking = IO(Output(Bool()))
  val dropped = IO(Output(UInt(8.W)))

  private val count    = RegInit(0.U((placeBits + 1).W)) // reset: empty
  private val drops    = RegInit(0.U(8.W))               // reset: none
  private val lacks    = RegInit(false.B)                // since it was empty; reset: none was dropped
  private val reported = RegInit(0.U(StateBits.W))       // state of the last record; reset: off, that is none

  // What the last pass has found: whether there are records that the master has, such that are no alarm, both
  // at once, and the one to be offered.
  private val hasTold      = RegInit(false.B) // reset: empty
  private val hasPlain     = RegInit(false.B)
  private val hasToldPlain = RegInit(false.B)
  private val best         = Reg(UInt(placeBits.W))
  private val hasBest      = RegInit(false.B)
  private val bestIsAlarm  = Reg(Bool())

  // The record in the box.
  private val boxed      = RegInit(false.B)       // it is in the queue, too; reset: none
  private val boxedAt    = Reg(UInt(placeBits.W)) // there
  private val boxIsAlarm = Reg(Bool())
  private val offered    = RegInit(false.B)       // it may be taken; reset: none
  private val isCurrent  = hasBest && boxed && boxedAt === best

  // Orders that wait. Reset: none.
  private val acknowledges = RegInit(false.B)
  private val confirms     = RegInit(false.B)
  private val clears       = RegInit(false.B)

  private val work       = RegInit(Work.none)
  private val live       = Reg(Bool())                // the order is as it was at the beginning
  private val place      = Reg(UInt(placeBits.W))     // of the record at hand
  private val word       = Reg(UInt(WordBits.W))      // of it
  private val to         = Reg(UInt(placeBits.W))     // where it goes
  private val fetched    = RegInit(false.B)           // its word is at the output; reset: not
  private val storing    = work === Work.store
  private val copying    = work === Work.copy
  private val carrying   = work === Work.carry
  private val writesTime = storing && word <= Guard.U // and what stands in front of it
  private val holds      = RegInit(false.B)           // `held` has it; reset: not
  private val advances   = Mux(carrying, holds, fetched) || writesTime
  private val isLast     = word.andR
  private val nextWord   = word + advances
  private val nextOne    = place + (advances && isLast)

  // The next number, and the higher bits of the time: a carry goes to them. Reset: they become 0, then the
  // number 1.
  private val counts  = RegInit(true.B)
  private val carries = RegInit(false.B)
  private val fresh   = RegInit(true.B)
  private val carry   = Reg(Bool())
  hold := writesTime

  // The RAM: the records, behind them the box, the number and the time.
  private val ram = newRam(2 * depth * Words, 16, clock)
  ram.readAddress := Mux(
    read,
    Cat(true.B, Box.U(placeBits.W), MuxLookup(readWord, readWord)(placeOf)),
    Cat(storing || carrying, Mux(storing || carrying, Clock.U(placeBits.W), nextOne), nextWord)
  )
  readData := ram.readData
  private val data = ram.readData

  // The word at hand when the time goes on, else the one before. A block RAM answers late in a cycle, so that
  // what is calculated takes the next one.
  private val held = RegEnable(data, fetched)
  holds := carrying && fetched && !holds

  // What a record is.
  private val isAlarm = Reg(Bool())
  private val isMeant = Reg(Bool())         // by the acknowledgement
  private val wasTold = data(0) && !storing
  private val written = Wire(UInt(16.W))
  private val isTold  = (wasTold && work =/= Work.clear) || (isMeant && live)
  private val ahead   = confirm.bits + held // of its tag, less one, so minus one and less if it is behind
  private val isStored = live && !ahead(15, LeadBits).andR // the server has it, if the master has; at the end
  when(advances) {
    switch(word) {
      is(State.U) { isAlarm := Mux(storing, reported, data(7, 0)) === DetectorState.Alarm.U }
      is(Guard.U) { isMeant := work === Work.acknowledge && data === acknowledge.bits.guard }
      is(Sequence.U) { when(data =/= acknowledge.bits.sequence) { isMeant := false.B } }
    }
  }

  ram.write := advances && work =/= Work.none
  ram.writeAddress := Cat(
    copying || carrying,
    Mux(copying, Box.U, Mux(carrying, Clock.U(placeBits.W), to)),
    word
  )
  ram.writeData := written
  when(advances && carrying) {
    carry := carry && held.andR
    switch(word) {
      is(Guard.U) { carry := counts }
      is(Sequence.U) {
        carry := carries
        when(!fresh) {
          counts  := carry && held.andR // once more: 0 is left out
          carries := false.B
        }
      }
    }
  }
  when(wraps) { carries := true.B }
  written := MuxCase(
    data,
    Seq(
      carrying                      -> Mux(fresh, 0.U, held + carry),
      (storing && word === State.U) -> Cat(epoch, reported(3), 0.U(4.W), reported(2, 0)),
      (storing && word === Guard.U) -> time,
      (word === Tag.U && isMeant)   -> ~acknowledge.bits.tag, // so that it is easy to subtract
      (word === Told.U)             -> isTold
    )
  )

  // The end of a record: whether it stays, and what it is among those that do.
  private val removesTold  = Reg(Bool()) // the first one that the master has
  private val removesPlain = Reg(Bool()) // the first one that is no alarm; with both, which is both
  private val removed      = Reg(Bool())
  private val isEnd        = place === (count - 1.U)(placeBits - 1, 0)
  private val isWanted =
    (removesPlain || removesTold) && (!removesPlain || !isAlarm) && (!removesTold || wasTold)
  private val isVictim = (isEnd || isWanted) && !removed // in any case one
  private val goes = MuxLookup(work, false.B)(
    Seq(Work.confirm -> (wasTold && isStored), Work.remove -> isVictim)
  )
  private val ends = advances && isLast && work =/= Work.none
  when(work =/= Work.none) {
    fetched := !read
    word    := nextWord
    place   := nextOne
  }
  when(ends && copying) {
    boxed      := true.B
    boxedAt    := place
    boxIsAlarm := isAlarm
    work       := Work.none
  }.elsewhen(ends && carrying) {
    fresh := false.B
    work  := Work.none
  }.elsewhen(ends) {
    when(!goes) {
      to := to + 1.U
      when(isTold) {
        hasTold := true.B
        when(!isAlarm) { hasToldPlain := true.B }
      }.elsewhen(!hasBest || (isAlarm && !bestIsAlarm)) {
        hasBest     := true.B
        best        := to
        bestIsAlarm := isAlarm
      }
      when(!isAlarm) { hasPlain := true.B }
    }
    when(goes) { removed := true.B }
    when(boxed && place === boxedAt && !storing) {
      boxed   := !goes
      boxedAt := to
    }
    when(storing || isEnd) {
      count := to +& !goes
      work  := Work.none
    }
  }
  when(acknowledgeChanges && work === Work.acknowledge) { live := false.B }
  when(confirmChanges && work === Work.confirm) { live := false.B }

  // What is done next. A new master is served before what it acknowledges.
  private val present    = Cat(test, state)
  private val happens    = !forget && present =/= reported && state =/= DetectorState.Off.U
  private val isFull     = count(placeBits)
  private val newAlarm   = present === DetectorState.Alarm.U
  private val ordered    = (acknowledges && !acknowledgeChanges) || (confirms && !confirmChanges)
  private val ordersWait = RegInit(false.B) // a new record was the last work; reset: orders need not wait
  isNew := false.B
  private def pass(what: Work.Type): Unit = when(count =/= 0.U) {
    work         := what
    hasTold      := false.B
    hasPlain     := false.B
    hasToldPlain := false.B
    hasBest      := false.B
  }
  private def drop(): Unit = {
    lacks := true.B
    when(!drops.andR) { drops := drops + 1.U }
  }
  when(work === Work.none) {
    offered := isCurrent
    when(!hasBest) { boxed := false.B } // when it comes again it is a new one
    live    := true.B
    word    := 0.U
    place   := 0.U
    to      := 0.U
    removed := false.B
    fetched := false.B
    when(carries || counts) {
      work  := Work.carry
      carry := false.B
    }.elsewhen(hasBest && !isCurrent && !offered && !busy) {
      work  := Work.copy
      place := best
      isNew := true.B
    }.elsewhen(happens && !wraps && !(ordersWait && ordered)) {
      when(!isFull) {
        ordersWait := true.B
        work       := Work.store
        to         := count
        reported   := present
      }.otherwise {
        when(!hasToldPlain) { drop() }
        when(hasPlain || newAlarm) {
          removesTold  := Mux(hasPlain, hasToldPlain, hasTold)
          removesPlain := hasPlain
          pass(Work.remove)
        }.otherwise {
          reported := present
          counts   := true.B
        }
      }
    }.elsewhen(confirms && !confirmChanges) {
      ordersWait := false.B
      confirms   := false.B
      clears     := false.B
      when(hasTold) { pass(Mux(clears, Work.clear, Work.confirm)) }
    }.elsewhen(acknowledges && !acknowledgeChanges) {
      ordersWait   := false.B
      acknowledges := false.B
      pass(Work.acknowledge)
    }
  }
  when(storing && ends) { counts := true.B }
  when(forget) { reported := 0.U }
  when(acknowledge.valid) { acknowledges := true.B }
  when(confirm.valid) { confirms := true.B }
  when(newMaster) { clears := true.B }

  private val waits = RegInit(false.B) // reset: empty
  when(work === Work.none) { waits := hasBest || happens }
  when(count === 0.U) { lacks := false.B }
  waiting  := waits
  lacking  := lacks
  dropped  := drops
  offers   := offered
  isUrgent := boxIsAlarm
}

object AlarmQueue {

  /** The server has not got those events of the last 2^8 whose number is not less than the one that it wants:
    * the master keeps fewer.
    */
  private val LeadBits  = 8
  private val Words     = 8
  private val WordBits  = 3
  private val StateBits = DetectorState.Width + 1 // with the test bit

  // The words of a record: those of the datagram, in another order, then what only the queue knows. State and
  // time come first, as both go on. The tag comes before `Told`, so that it is right if that is true.
  private val State    = 0 // and epoch
  private val Guard    = 1 // the low word of the time
  private val Sequence = 2
  private val Tag      = Words - 2
  private val Told     = Words - 1

  // Where the words of the datagram are, if elsewhere.
  private def placeOf = Seq(
    RecordLayout.Sequence.word -> Sequence,
    RecordLayout.State.word    -> State,
    RecordLayout.Time.word     -> Guard
  ).map { case (outside, inside) => outside.U -> inside.U(WordBits.W) }

  // Places behind the records.
  private val Box   = 0
  private val Clock = 1

  private object Work extends ChiselEnum {

    /** What is being done.
      *   - `acknowledge`: the master has a record;
      *   - `confirm`: the server has what the master had before;
      *   - `clear`: another master has none;
      *   - `remove`: one has to make room;
      *   - `store`: a new one is written;
      *   - `copy`: one goes to the box;
      *   - `carry`: the number of the next record, or the time, goes on.
      */
    val none, acknowledge, confirm, clear, remove, store, copy, carry = Value
  }
}
