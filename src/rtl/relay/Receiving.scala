package flyframe.relay

import chisel3._
import chisel3.util._
import flyframe.params.CanParams

/** What becomes of frames that came whole: those of the own address go home, others to [[Sources]], the
  * filters and the FIFO of the port (FR-57, FR-59, RB-06).
  */
class Receiving(p: CanParams) extends Module {
  import Receiving._
  private val entryBits = log2Ceil(p.filters)

  /** Relay mode is on; own address, 0: none. */
  val on      = IO(Input(Bool()))
  val address = IO(Input(UInt(7.W)))

  /** The low half of the us counter at the end of the last bit. */
  val time = IO(Input(UInt(16.W)))

  /** From [[PassingOn]]: a frame begins to come, its identifier is there, it is whole; and its bytes. */
  val starts     = IO(Input(Vec(2, Bool())))
  val identified = IO(Input(Vec(2, Bool())))
  val received   = IO(Input(Vec(2, Bool())))
  val read       = IO(Output(Valid(UInt(5.W))))
  val from       = IO(Output(UInt(1.W)))
  val granted    = IO(Input(Bool()))
  val data       = IO(Input(UInt(8.W)))

  /** A frame of the own address came by a port; it is told soon behind `received`. */
  val home = IO(Output(Vec(2, Valid(new HomeFrame))))

  /** To [[Sources]]. */
  val frame = IO(Output(Valid(new WholeFrame)))
  val done  = IO(Input(Bool()))
  val takes = IO(Input(Bool()))

  /** To [[flyframe.can.AcceptanceFilter]]: searches with this identifier word. */
  val search     = IO(Output(Bool()))
  val identifier = IO(Output(UInt(32.W)))
  val found      = IO(Input(Bool()))
  val matches    = IO(Input(Bool()))
  val entry      = IO(Input(UInt(entryBits.W)))

  /** To [[flyframe.can.ReceiveFifo]]. */
  val store  = IO(Output(Valid(UInt(2.W))))
  val stored = IO(Output(UInt(32.W)))
  val accept = IO(Output(Bool()))
  val second = IO(Output(UInt(32.W)))

  /** A bridge is at work with the last frame; none may be stored. */
  val busy: Option[Bool] = Option.when(p.bridge)(IO(Input(Bool())))

  // Of the frame of each port. Reset: nothing is to be done.
  private val stamps  = Reg(Vec(2, UInt(16.W)))            // of the one that comes
  private val kept    = Reg(Vec(2, UInt(16.W)))            // from its identifier on
  private val isHead  = RegInit(VecInit(false.B, false.B)) // its header is to be looked at
  private val isWhole = RegInit(VecInit(false.B, false.B)) // it is to be delivered, perhaps
  private val isAsked = RegInit(VecInit(false.B, false.B)) // its filter is to be found
  private val isKnown = RegInit(VecInit(false.B, false.B)) // whether a filter matches
  private val isMatch = Reg(Vec(2, Bool()))
  private val isOdd   = Reg(Vec(2, Bool()))                // its identifier has reserved bits
  private val entries = Reg(Vec(2, UInt(entryBits.W)))

  // ---- headers, in front of all else, as frames come home at a fixed time ----

  private val headAt   = RegInit(0.U(2.W))                  // the byte; reset: the first one
  private val headPort = !isHead(0)
  private val heads    = isHead.asUInt.orR
  private val headGot  = RegNext(heads && granted, false.B) // a byte is there; reset: none
  private val headEnds = RegNext(heads && granted && headAt === 2.U, false.B)
  private val endPort  = RegNext(headPort)
  private val head     = Reg(UInt(16.W))
  private val header   = head ## data
  private val isOwn    = address =/= 0.U && header(20, 14) === address
  when(heads && granted) {
    headAt := Mux(headAt === 2.U, 0.U, headAt + 1.U)
    when(headAt === 2.U) { isHead(headPort) := false.B }
  }
  when(headGot) { head := head(7, 0) ## data }
  for (q <- 0 to 1) {
    home(q).valid         := headEnds && endPort === q.U && isOwn
    home(q).bits.kind     := header(23, 22)
    home(q).bits.leftBy   := header(21)
    home(q).bits.sequence := header(13, 0)
    when(headEnds && endPort === q.U && !isOwn) { isWhole(q) := true.B }
  }

  // ---- the bytes of a word, which come in by its upper end ----

  private val port    = Reg(UInt(1.W))
  private val left    = RegInit(0.U(3.W))      // bytes to be asked for; reset: none
  private val index   = Reg(UInt(5.W))
  private val isUp    = Reg(Bool())            // data: ascending, and those that are missing are 0
  private val end     = Reg(UInt(5.W))         // of data, an index
  private val word    = Reg(UInt(32.W))
  private val missing = isUp && index >= end
  private val mine    = left =/= 0.U && !missing && !heads && granted
  private val got     = RegNext(mine, false.B) // reset: no byte was asked for
  private val skips   = left =/= 0.U && missing && !got
  private val isRead  = left === 0.U && !got
  when(mine || skips) {
    left  := left - 1.U
    index := Mux(isUp, index + 1.U, index - 1.U)
  }
  when(got || skips) { word := Mux(got, data, 0.U) ## word(31, 8) }
  read.valid := heads || (left =/= 0.U && !missing)
  read.bits  := Mux(heads, headAt, index)
  from       := Mux(heads, headPort, port)

  private def reads(first: Int, bytes: Int): Unit = {
    index := first.U
    left  := bytes.U
    isUp  := (first == FirstData).B
  }

  // ---- identifiers for the filters, and whole frames ----

  private object Step extends ChiselEnum {
    val idle, finds, searches, length, header, asks, id, low, high, ends = Value
  }
  private val step       = RegInit(Step.idle) // reset: nothing is to be done
  private val dlc        = Reg(UInt(4.W))
  private val isOddDlc   = Reg(Bool())
  private val isReserved = word(29) || (!word(31) && word(28, 11) =/= 0.U)

  private val ready = (0 to 1).map(q => isWhole(q) && isKnown(q))
  private val next  = !ready(0)
  switch(step) {
    is(Step.idle) {
      when(ready.reduce(_ || _) && !busy.getOrElse(false.B)) {
        port := next
        reads(LengthByte, 1)
        step := Step.length
      }.elsewhen(isAsked.asUInt.orR) {
        port := !isAsked(0)
        reads(WordEnd, 4)
        step := Step.finds
      }
    }
    is(Step.finds) {
      when(isRead) {
        isOdd(port)   := isReserved
        isMatch(port) := false.B
        when(isReserved) {
          isAsked(port) := false.B
          isKnown(port) := true.B
        }
        step := Mux(isReserved, Step.idle, Step.searches)
      }
    }
    // A frame that is whole does not wait for the filters of another one: that is looked for anew then, and
    // so is one that came instead of a frame that broke off.
    is(Step.searches) {
      when(found) {
        isAsked(port) := false.B
        isKnown(port) := true.B
        isMatch(port) := matches
        entries(port) := entry
      }
      when(found || ready.reduce(_ || _) || identified(port)) { step := Step.idle }
    }
    is(Step.length) {
      when(isRead) {
        dlc      := word(27, 24)
        isOddDlc := word(31, 28) =/= 0.U
        reads(HeaderEnd, 4)
        step := Step.header
      }
    }
    is(Step.header) { when(isRead) { step := Step.asks } }
    is(Step.asks) {
      when(done || !frame.valid) {
        isWhole(port) := false.B
        step          := Step.idle
        when(done && takes && isMatch(port)) {
          reads(WordEnd, 4)
          step := Step.id
        }
      }
    }
    is(Step.id) {
      when(isRead) {
        end := FirstData.U +& Mux(word(30), 0.U, Mux(dlc(3), 8.U, dlc))
        reads(FirstData, 4)
        step := Step.low
      }
    }
    is(Step.low) {
      when(isRead) {
        left := 4.U
        step := Step.high
      }
    }
    is(Step.high) { when(isRead) { step := Step.ends } }
    is(Step.ends) { step := Step.idle }
  }
  search     := step === Step.finds && isRead && !isReserved
  identifier := word

  frame.valid           := step === Step.asks && word(28, 22) =/= 0.U
  frame.bits.kind       := Mux(isOdd(port) || isOddDlc, Reserved.U, word(31, 30))
  frame.bits.sentBy     := word(29)
  frame.bits.source     := word(28, 22)
  frame.bits.sequence   := word(21, 8)
  frame.bits.distance   := ~Mux(word(7, 0).andR, 0.U, word(7, 0)) // hops are one less already
  frame.bits.receivedBy := port

  store.valid := isRead && (step === Step.id || step === Step.low || step === Step.high)
  store.bits  := Mux(step === Step.id, 0.U, Mux(step === Step.low, 2.U, 3.U))
  stored      := word
  accept      := step === Step.ends
  second      := kept(port) ## entries(port).pad(8) ## dlc.pad(8)

  for (q <- 0 to 1) {
    when(starts(q)) { stamps(q) := time }
    when(identified(q)) {
      isAsked(q) := true.B
      isKnown(q) := false.B
      kept(q)    := stamps(q)
    }
    when(received(q)) { isHead(q) := true.B }
  }
  when(!on) {
    for (flags <- Seq(isHead, isWhole, isAsked, isKnown)) flags := VecInit(false.B, false.B)
    headAt := 0.U
    left   := 0.U
    step   := Step.idle
  }
}

object Receiving {

  // Places of bytes in a frame, see FrameStore.
  private val HeaderEnd  = 3
  private val WordEnd    = 7
  private val LengthByte = 8
  private val FirstData  = 9

  /** A kind that says nothing but that its source is there. */
  private val Reserved = 2
}
