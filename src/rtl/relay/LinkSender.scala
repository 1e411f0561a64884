package flyframe.relay

import chisel3._
import chisel3.util._
import flyframe.can.EqualBits

/** The pins of [[LinkSender]]. */
abstract class LinkSenderPins extends Module {

  /** A frame begins, an own one or one that passes; or what is sent is ended; or the port is down. */
  val begin   = IO(Input(Bool()))
  val own     = IO(Input(Bool()))
  val abort   = IO(Input(Bool()))
  val silence = IO(Input(Bool()))

  /** To the next bit, whose level is there a cycle later. */
  val step  = IO(Input(Bool()))
  val level = IO(Output(Bool()))

  /** Recessive bits since the last frame, up to 31, 0 within one; a frame is being sent. */
  val quiet = IO(Output(UInt(5.W)))
  val busy  = IO(Output(Bool()))

  /** Wants this byte of the frame, the check left out; it comes before the next step. */
  val fetch = IO(Output(Valid(UInt(5.W))))
  val isOwn = IO(Output(Bool()))
  val byte  = IO(Input(Valid(UInt(8.W))))
}

/** Sends link frames bit by bit, those that pass while they come (FR-41 to FR-43, FR-47). Orders come in
  * front of the `step` to the next bit.
  */
class LinkSender extends LinkSenderPins {
  import LinkReceiver.{Crc32, Crc8}

  // Reset: idle, but not for long.
  private val busyReg  = RegInit(false.B)
  private val aborting = RegInit(0.U(3.W)) // dominant bits that are left
  private val silent   = RegInit(0.U(5.W))
  private val levelReg = RegInit(true.B)
  private val loads    = RegInit(false.B)
  private val starts   = Reg(Bool())       // the start bit is next
  private val isEnd    = Reg(Bool())       // all is sent but for a stuff bit
  private val ownReg   = Reg(Bool())
  private val count    = Reg(UInt(8.W))    // bits behind the start
  private val left     = Reg(UInt(5.W))    // bytes behind the one at hand; before the length: enough
  private val isRemote = Reg(Bool())
  private val shift    = Reg(UInt(8.W))
  private val crc8     = Reg(UInt(8.W))
  private val crc32    = Reg(UInt(32.W))
  private val run      = Reg(new EqualBits)

  private val number  = count(7, 3)
  private val isCheck = number === 4.U
  private val isCrc   = ownReg && left < 4.U
  private val data    = Mux(isCheck, !crc8(7), Mux(isCrc, !crc32(31), shift(7)))
  private val isStuff = !starts && run.isFull
  private val bit     = Mux(starts, false.B, Mux(isStuff, !run.level, data))
  private val nextRun = Mux(starts, EqualBits.start, run.and(bit))
  private val takes   = step && busyReg && !isStuff && !starts
  private val byteEnd = count(2, 0) === 7.U
  private val ends    = isEnd || (takes && byteEnd && left === 0.U)

  level := levelReg
  quiet := Mux(busyReg || aborting =/= 0.U, 0.U, silent)
  busy  := busyReg
  isOwn := ownReg

  when(step) {
    levelReg := Mux(busyReg, bit, aborting === 0.U)
    silent   := Mux(silent === 31.U, 31.U, silent + 1.U)
    when(busyReg) {
      run    := nextRun
      starts := false.B
      isEnd  := ends
      silent := 0.U
      when(ends && !nextRun.isFull) { busyReg := false.B }
    }.elsewhen(aborting =/= 0.U) {
      aborting := aborting - 1.U
      silent   := 0.U
    }
  }
  when(takes && !isEnd) {
    count := count + 1.U
    shift := shift(6, 0) ## false.B
    crc8  := Mux(isCheck, crc8(6, 0) ## false.B, Crc8.and(crc8, data))
    when(isCrc) { crc32 := crc32(30, 0) ## false.B }
      .elsewhen(number < 3.U || number > 4.U) { crc32 := Crc32.and(crc32, data) }
    when(byteEnd) {
      left  := left - (number > 8.U)
      loads := number =/= 3.U && left =/= 0.U
    }
  }

  fetch.valid := loads
  fetch.bits  := Mux(number < 4.U, number, number - 1.U)
  when(byte.valid) {
    loads := false.B
    shift := byte.bits
    when(number === 3.U && ownReg) { shift := LinkHeader.Hops.U }
    when(number === 5.U) { isRemote := byte.bits(6) }
    when(number === 9.U) { left := 4.U +& Mux(isRemote, 0.U, Mux(byte.bits(3), 8.U, byte.bits(3, 0))) }
  }
  when(begin) {
    busyReg := true.B
    starts  := true.B
    isEnd   := false.B
    ownReg  := own
    count   := 0.U
    left    := 31.U
    crc8    := LinkCrc.Start8.U
    crc32   := "hffffffff".U
    loads   := true.B
  }
  when(abort && busyReg) {
    busyReg  := false.B
    aborting := LinkFrame.AbortBits.U
  }
  when(silence) {
    busyReg  := false.B
    aborting := 0.U
    silent   := 0.U
  }
  when(abort || silence) { loads := false.B }
}
