package flyframe.syncmanager

import chisel3._

/** What the rest of the controller may know of a SyncManager's state. */
class SyncManagerView extends Bundle {

  /** Enabled and not deactivated. */
  val works = Bool()

  /** Enabled and deactivated: the whole area is locked (SM-27). */
  val locked = Bool()

  /** Three buffers; else a mailbox (B-50). */
  val buffered = Bool()

  /** ECAT writes and the PDI reads; else the other way round. */
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

/** The buffers of one SyncManager and who holds them (SM-01 to SM-28).
  *
  * Three buffers: the writer's, the reader's and NEXT; closing a written buffer swaps it with NEXT, opening
  * for reading swaps with NEXT if that is newer. A mailbox has one buffer, full or empty.
  *
  * What ECAT does in a frame becomes final with its good end (FP-35); the PDI's accesses act at once.
  */
class SyncManager extends Module {
  val enabled     = IO(Input(Bool()))
  val deactivated = IO(Input(Bool()))
  val isMailbox   = IO(Input(Bool()))
  val ecatWrites  = IO(Input(Bool()))

  val ecat = IO(Input(new BufferAccess))

  /** Never in the same cycle as an access or a frame end of ECAT (B-58). */
  val pdi = IO(Input(new BufferAccess))

  /** The frame ends, well or badly. */
  val good = IO(Input(Bool()))
  val bad  = IO(Input(Bool()))

  val view = IO(Output(new SyncManagerView))

  /** 0x0805[0] and [1]. */
  val writeEvent = IO(Output(Bool()))
  val readEvent  = IO(Output(Bool()))

  /** 0x0805[5:4]. */
  val lastBuffer = IO(Output(UInt(2.W)))

  /** 0x0805[3]. */
  val full = IO(Output(Bool()))

  /** A buffer has been written completely, for the watchdog (SM-22). */
  val written = IO(Output(Bool()))

  private val works    = enabled && !deactivated
  private val buffered = !isMailbox

  // Reset of all: the state at the start of work (B-50).
  private val next        = RegInit(1.U(2.W))
  private val reader      = RegInit(2.U(2.W))
  private val newer       = RegInit(false.B) // NEXT is newer than the reader's; mailbox: full
  private val anyWritten  = RegInit(false.B)
  private val ecatOpen    = RegInit(false.B)
  private val pdiOpen     = RegInit(false.B)
  private val ecatTouched = RegInit(false.B) // in this frame
  private val ecatBegan   = RegInit(false.B) // the first byte, in this frame
  private val ecatClosed  = RegInit(false.B) // the last byte, in this frame
  private val ecatSingle  = RegInit(false.B)
  private val isWritten   = RegInit(false.B)
  private val isRead      = RegInit(false.B)
  private val writer      = ~(next ^ reader)

  private def opensForReading(open: Bool): Unit = when(buffered && newer && !open) {
    reader := next
    next   := reader
    newer  := false.B
  }
  private def completes(byWriter: Bool, single: Bool): Unit = {
    when(byWriter) {
      isWritten := true.B
      when(!single) {
        newer      := true.B
        anyWritten := true.B
        when(buffered) { next := writer }
      }
    }.otherwise {
      isRead := true.B
      when(isMailbox) { newer := false.B }
    }
  }

  // ECAT.
  when(ecat.touch) {
    ecatTouched := true.B
    ecatSingle  := ecat.single
    when(ecat.first) {
      ecatBegan := true.B
      when(!ecat.single) {
        ecatOpen := true.B
        when(!ecatWrites) { opensForReading(ecatOpen) }
      }
    }
  }
  when(ecat.close) { ecatClosed := true.B }
  when(good) {
    when(ecatBegan && ecatWrites) { isRead := false.B }
    when(ecatBegan && !ecatWrites) { isWritten := false.B }
    when(ecatClosed) {
      ecatOpen := false.B
      completes(ecatWrites, ecatSingle)
    }
  }
  when(bad && ecatTouched) { ecatOpen := false.B }
  when(good || bad) {
    ecatTouched := false.B
    ecatBegan   := false.B
    ecatClosed  := false.B
  }

  // PDI.
  when(pdi.touch && pdi.first) {
    when(ecatWrites) { isWritten := false.B }.otherwise { isRead := false.B }
    when(!pdi.single) {
      pdiOpen := true.B
      when(ecatWrites) { opensForReading(pdiOpen) }
    }
  }
  when(pdi.close) {
    pdiOpen := false.B
    completes(!ecatWrites, pdi.single)
  }

  when(!works) {
    next   := 1.U
    reader := 2.U
    Seq(newer, anyWritten, ecatOpen, pdiOpen, ecatTouched, ecatBegan, ecatClosed, isWritten, isRead)
      .foreach(_ := false.B)
  }

  private val mayWrite = buffered || !newer
  private val mayRead  = Mux(buffered, anyWritten, newer)
  view.works        := works
  view.locked       := enabled && deactivated
  view.buffered     := buffered
  view.ecatWrites   := ecatWrites
  view.ecatOpen     := ecatOpen && !ecatClosed
  view.ecatMayOpen  := Mux(ecatWrites, mayWrite, mayRead) && !ecatClosed
  view.pdiOpen      := pdiOpen
  view.pdiMayOpen   := Mux(ecatWrites, mayRead, mayWrite)
  view.writerBuffer := Mux(buffered, writer, 0.U)
  view.readerBuffer := Mux(buffered, reader, 0.U)

  writeEvent := isWritten
  readEvent  := isRead
  lastBuffer := Mux(buffered, Mux(anyWritten, Mux(newer, next, reader), 3.U), 0.U)
  full       := isMailbox && newer
  written    := works && ((good && ecatClosed && ecatWrites) || (pdi.close && !ecatWrites))
}
