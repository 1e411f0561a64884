package flyframe.syncmanager

import chisel3._
import flyframe.memory.BufferEvents

/** What one SyncManager remembers from one access to the next.
  *
  * @param sequential
  *   there is the sequential mode
  */
class SyncManagerState(sequential: Boolean) extends Bundle {

  /** The buffer in the middle, and that of the reader; the third is the writer's. */
  val next   = UInt(2.W)
  val reader = UInt(2.W)

  /** NEXT is newer than the reader's buffer; mailbox: full. */
  val newer      = Bool()
  val anyWritten = Bool()
  val ecatOpen   = Bool()
  val pdiOpen    = Bool()

  /** ECAT had it open when its last frame ended. */
  val leftOpen = Bool()

  /** What ECAT did in this frame: accessed any byte, the first, the last. */
  val touched = Bool()
  val began   = Bool()
  val closed  = Bool()

  /** Events: a buffer has been written, has been read (SM-21). */
  val writeEvent = Bool()
  val readEvent  = Bool()

  /** Sequential mode: the address behind what ECAT has written of the buffer, byte after byte; a byte was
    * left out before the one written last; before the last byte of the last buffer (SM-33).
    */
  val behind   = UInt((if (sequential) 17 else 0).W)
  val gap      = UInt((if (sequential) 1 else 0).W)
  val violated = UInt((if (sequential) 1 else 0).W)

  def writer: UInt = ~(next ^ reader)
}

object SyncManagerState {

  /** As after reset, and whenever work starts or stops (B-50). */
  def start(sequential: Boolean): SyncManagerState = {
    val s = WireDefault(0.U.asTypeOf(new SyncManagerState(sequential)))
    s.next   := 1.U
    s.reader := 2.U
    s
  }
}

/** How a SyncManager is configured; steady while it works. */
class SyncManagerSettings extends Bundle {

  /** Enabled and not deactivated. */
  val works = Bool()

  /** Enabled and deactivated: the whole area is locked (SM-27). */
  val locked    = Bool()
  val isMailbox = Bool()

  /** ECAT writes and the PDI reads; else the other way round. */
  val ecatWrites = Bool()

  /** Sequential mode, where it is built. */
  val isSequential = Bool()
}

/** An access of one side to a byte of a SyncManager's area. What is not allowed has no effect.
  *
  * @param sequential
  *   there is the sequential mode
  * @param byWrite
  *   the PDI acknowledges by writing
  */
class BufferAccess(sequential: Boolean, byWrite: Boolean) extends Bundle {

  /** The side writes; else it reads. */
  val write = Bool()

  /** A byte is accessed. Not set, nothing changes: a question, whether it may be. */
  val touch = Bool()

  /** It is the first byte (SM-01). */
  val first = Bool()

  /** The access to the last byte ends (SM-03). */
  val close = Bool()

  /** The PDI writes the last byte, which closes a buffer that it reads (SM-36). */
  val acknowledge = UInt((if (byWrite) 1 else 0).W)

  /** The buffer is one byte long: events, but no exchange (B-53). */
  val single = Bool()

  /** The byte's address, if ECAT writes it. */
  val address = UInt((if (sequential) 16 else 0).W)
}

/** What becomes of an access. */
class BufferAnswer extends Bundle {

  /** The byte may be accessed. */
  val allowed = Bool()

  /** It may, in the direction of the SyncManager. */
  val inBuffer = Bool()

  /** Number of the buffer, for such an access. */
  val buffer = UInt(2.W)
  val works  = Bool()
  val locked = Bool()
}

/** The logic of a SyncManager (SM-01 to SM-28): from its state and what happens, the state after. One is
  * shared by all SyncManagers, as they act one after the other.
  *
  * Three buffers: the writer's, the reader's and NEXT; closing a written buffer swaps it with NEXT, opening
  * for reading swaps with NEXT if that is newer. A mailbox has one buffer, full or empty.
  *
  * What ECAT does in a frame becomes final with its good end (FP-35); the PDI's accesses act at once. At most
  * one of an access, `good` and `bad` in a cycle.
  *
  * @param sequential
  *   there is the sequential mode (SM-32 to SM-34, B-101)
  * @param byWrite
  *   the PDI closes a buffer that it reads by writing its last byte (SM-36, B-104)
  */
class SyncManager(sequential: Boolean, byWrite: Boolean) extends Module {
  val state    = IO(Input(new SyncManagerState(sequential)))
  val settings = IO(Input(new SyncManagerSettings))

  /** An access, by the PDI or by ECAT. */
  val access = IO(Input(new BufferAccess(sequential, byWrite)))
  val byPdi  = IO(Input(Bool()))

  /** The frame has ended, well or badly. */
  val good = IO(Input(Bool()))
  val bad  = IO(Input(Bool()))

  val after  = IO(Output(new SyncManagerState(sequential)))
  val answer = IO(Output(new BufferAnswer))

  /** A buffer is complete. */
  val written = IO(Output(Bool()))

  /** What of it has a time (DC-42). */
  val events = IO(Output(new BufferEvents))

  private val buffered   = !settings.isMailbox
  private val ecatWrites = settings.ecatWrites
  private val single     = access.single

  // May it be accessed? After the end no more in this frame (SM-04).
  private val right    = (ecatWrites =/= byPdi) === access.write
  private val open     = Mux(byPdi, state.pdiOpen, state.ecatOpen && !state.closed)
  private val mayWrite = buffered || !state.newer
  private val mayRead  = Mux(buffered, state.anyWritten, state.newer)
  private val mayOpen  = Mux(access.write, mayWrite, mayRead) && (byPdi || !state.closed)
  // Where the PDI acknowledges by writing it closes no buffer by reading, and what it writes is not stored.
  private val isOfReader = if (byWrite) byPdi && ecatWrites else false.B
  private val inBuffer   = settings.works && right && (single || open || (access.first && mayOpen))
  private val takes      = buffered && state.newer && !open // a reader that opens gets NEXT
  answer.allowed  := inBuffer || (settings.works && single && !(isOfReader && access.write))
  answer.inBuffer := inBuffer
  answer.buffer   := Mux(buffered, Mux(access.write, state.writer, Mux(takes, state.next, state.reader)), 0.U)
  answer.works    := settings.works
  answer.locked   := settings.locked

  private val touches   = access.touch && inBuffer
  private val begins    = touches && access.first
  private val ends      = access.close && right && !(isOfReader && !access.write)
  private val ended     = if (byWrite) isOfReader && access.write && access.acknowledge.asBool else false.B
  private val closes    = (ends || ended) && settings.works && (single || open)
  private val ecatBegan = good && state.began
  private val pdiBegan  = begins && byPdi
  private val ecatDone  = good && state.closed
  private val pdiDone   = closes && byPdi

  after         := state
  after.touched := (state.touched || (touches && !byPdi)) && !good && !bad
  after.began   := (state.began || (begins && !byPdi)) && !good && !bad
  after.closed  := (state.closed || (closes && !byPdi)) && !good && !bad
  when(begins && !single) { when(byPdi) { after.pdiOpen := true.B }.otherwise { after.ecatOpen := true.B } }
  when(ecatDone || (bad && state.touched)) { after.ecatOpen := false.B }
  when(pdiDone) { after.pdiOpen := false.B }
  when(good || bad) { after.leftOpen := after.ecatOpen }

  // The same by task. A buffer with a gap is not taken over.
  private val hasGap     = if (sequential) settings.isSequential && state.gap.asBool else false.B
  private val writerDone = Mux(ecatWrites, ecatDone && !hasGap, pdiDone)
  private val readerDone = Mux(ecatWrites, pdiDone, ecatDone)
  private val exchanges  = Mux(good, state.ecatOpen, !single) // a buffer of one byte is never open
  when(begins && !access.write && !single && takes) {
    after.reader := state.next
    after.next   := state.reader
    after.newer  := false.B
  }
  when(writerDone && exchanges) {
    after.newer      := true.B
    after.anyWritten := true.B
    when(buffered) { after.next := state.writer }
  }
  when(readerDone && !buffered) { after.newer := false.B }

  // Beginning a buffer ends the event of the other side's last one; a new one comes behind that (B-57). A
  // host that acknowledges by writing may read an open buffer again, and has not seen what is newer (B-104).
  private val pdiOpens    = if (byWrite) pdiBegan && !state.pdiOpen else pdiBegan
  private val writerBegan = Mux(ecatWrites, ecatBegan, pdiBegan)
  private val readerBegan = Mux(ecatWrites, pdiOpens, ecatBegan)
  after.writeEvent := writerDone || (state.writeEvent && !readerBegan)
  after.readEvent  := readerDone || (state.readEvent && !writerBegan)
  written          := writerDone
  events.byEcat    := Mux(ecatWrites, writerDone, readerDone)
  events.byPdi     := Mux(ecatWrites, readerDone, writerDone)
  events.begun     := pdiBegan

  // The first byte begins a sequence. Bytes may come again, but not before those in front of them.
  if (sequential) {
    when(touches && !byPdi && access.write) {
      when(access.first || access.address === state.behind) { after.behind := access.address +& 1.U }
      after.gap := !access.first && access.address > state.behind
    }
    when(ecatDone && ecatWrites) { after.violated := hasGap }
  }
}
