package flyframe.syncmanager

import chisel3._

/** What one SyncManager remembers from one access to the next. */
class SyncManagerState extends Bundle {

  /** The buffer in the middle, and that of the reader; the third is the writer's. */
  val next   = UInt(2.W)
  val reader = UInt(2.W)

  /** NEXT is newer than the reader's buffer; mailbox: full. */
  val newer      = Bool()
  val anyWritten = Bool()
  val ecatOpen   = Bool()
  val pdiOpen    = Bool()

  /** What ECAT did in this frame: accessed any byte, the first, the last. */
  val touched = Bool()
  val began   = Bool()
  val closed  = Bool()

  def writer: UInt = ~(next ^ reader)
}

object SyncManagerState {

  /** As after reset, and whenever work starts or stops (B-50). */
  def start: SyncManagerState = {
    val s = WireDefault(0.U.asTypeOf(new SyncManagerState))
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
}

/** What an accessing side may know of a SyncManager. */
class SyncManagerView extends Bundle {
  val works      = Bool()
  val locked     = Bool()
  val ecatWrites = Bool()

  /** The side may access every byte; the first byte. */
  val ecatOpen    = Bool()
  val ecatMayOpen = Bool()
  val pdiOpen     = Bool()
  val pdiMayOpen  = Bool()

  /** Number of the buffer the writer, the reader uses. */
  val writerBuffer = UInt(2.W)
  val readerBuffer = UInt(2.W)
}

/** One side's allowed access to a byte of the buffer, in the direction of the SyncManager. */
class BufferAccess extends Bundle {

  /** A byte is accessed. */
  val touch = Bool()

  /** It is the first byte (SM-01). */
  val first = Bool()

  /** The last byte is accessed (SM-03). */
  val close = Bool()

  /** The buffer is one byte long: events, but no exchange (B-53). */
  val single = Bool()
}

/** The logic of a SyncManager (SM-01 to SM-28): from its state and what happens, the state after. One is
  * shared by all SyncManagers, as they act one after the other.
  *
  * Three buffers: the writer's, the reader's and NEXT; closing a written buffer swaps it with NEXT, opening
  * for reading swaps with NEXT if that is newer. A mailbox has one buffer, full or empty.
  *
  * What ECAT does in a frame becomes final with its good end (FP-35); the PDI's accesses act at once. At most
  * one of `ecat`, `pdi`, `good` and `bad` in a cycle.
  */
class SyncManager extends Module {
  val state    = IO(Input(new SyncManagerState))
  val settings = IO(Input(new SyncManagerSettings))

  val ecat = IO(Input(new BufferAccess))
  val pdi  = IO(Input(new BufferAccess))

  /** The frame has ended, well or badly. */
  val good = IO(Input(Bool()))
  val bad  = IO(Input(Bool()))

  val after = IO(Output(new SyncManagerState))
  val view  = IO(Output(new SyncManagerView))

  /** Events: a buffer has been written, has been read; they rise, they end; rising comes last (B-57). */
  val writeEvent    = IO(Output(Bool()))
  val readEvent     = IO(Output(Bool()))
  val writeEventEnd = IO(Output(Bool()))
  val readEventEnd  = IO(Output(Bool()))

  private val isMailbox  = settings.isMailbox
  private val buffered   = !isMailbox
  private val ecatWrites = settings.ecatWrites

  after         := state
  writeEvent    := false.B
  readEvent     := false.B
  writeEventEnd := false.B
  readEventEnd  := false.B

  // What writer and reader do, whichever side they are on.
  private val ecatOpens  = ecat.touch && ecat.first
  private val pdiOpens   = pdi.touch && pdi.first
  private val ecatCloses = good && state.closed
  private val readerTakes = buffered && state.newer &&
    Mux(
      ecatWrites,
      pdiOpens && !pdi.single && !state.pdiOpen,
      ecatOpens && !ecat.single && !state.ecatOpen
    )
  private val writerDone = Mux(ecatWrites, ecatCloses, pdi.close)
  private val readerDone = Mux(ecatWrites, pdi.close, ecatCloses)
  private val single     = Mux(good, !state.ecatOpen, pdi.single) // a buffer of one byte is never open
  when(readerTakes) {
    after.reader := state.next
    after.next   := state.reader
    after.newer  := false.B
  }
  when(writerDone && !single) {
    after.newer      := true.B
    after.anyWritten := true.B
    when(buffered) { after.next := state.writer }
  }
  when(readerDone && isMailbox) { after.newer := false.B }
  writeEvent := writerDone
  readEvent  := readerDone

  // Beginning a buffer ends the event of the other side's last one.
  private val ecatBegins = good && state.began
  writeEventEnd := Mux(ecatWrites, pdiOpens, ecatBegins)
  readEventEnd  := Mux(ecatWrites, ecatBegins, pdiOpens)

  when(ecatOpens && !ecat.single) { after.ecatOpen := true.B }
  when(ecatCloses || (bad && state.touched)) { after.ecatOpen := false.B }
  when(pdiOpens && !pdi.single) { after.pdiOpen := true.B }
  when(pdi.close) { after.pdiOpen := false.B }
  after.touched := (state.touched || ecat.touch) && !good && !bad
  after.began   := (state.began || ecatOpens) && !good && !bad
  after.closed  := (state.closed || ecat.close) && !good && !bad

  private val mayWrite = buffered || !state.newer
  private val mayRead  = Mux(buffered, state.anyWritten, state.newer)
  view.works        := settings.works
  view.locked       := settings.locked
  view.ecatWrites   := ecatWrites
  view.ecatOpen     := state.ecatOpen && !state.closed
  view.ecatMayOpen  := Mux(ecatWrites, mayWrite, mayRead) && !state.closed
  view.pdiOpen      := state.pdiOpen
  view.pdiMayOpen   := Mux(ecatWrites, mayRead, mayWrite)
  view.writerBuffer := Mux(buffered, state.writer, 0.U)
  view.readerBuffer := Mux(buffered, state.reader, 0.U)
}
