package flyframe.master

import chisel3._
import chisel3.util._
import flyframe.protocol.{Command => EcatCommand, DatagramLayout, EtherType, RecordLayout}
import flyframe.protocol.DatagramLayout.{Ado, Adp, Command, Index, Length}
import flyframe.registers.AlarmRegisters

/** A word of 16 bits of a datagram that has come back from the line: one of those sent, or a record that a
  * slave has appended.
  */
class AnswerWord extends Bundle {

  /** Which word it is, a constant of [[AnswerWord]]. */
  val place = UInt(3.W)
  val data  = UInt(16.W)
}

/** The words that are kept of a datagram. */
object AnswerWord {
  val Adp = 0

  /** Index in the high half, command in the low one. */
  val Index = 1

  /** The first of six of data, first byte in the low half; behind the last byte undefined. Of those sent four
    * are kept.
    */
  val Data = 2

  /** Of those sent: the working counter. */
  val Counter = 7

  val Count = 8
}

/** Takes EtherCAT frames apart and compares them with what was sent (FP-12, FP-24): command, index and length
  * of each datagram, in order. Behind them come the records of slaves (AP-05), and maybe others.
  *
  * What it reports of a frame counts only when `done` says so, at its end.
  */
class AnswerMatcher extends Module {

  /** A frame, see [[EthernetReceiver]]. */
  val byte  = IO(Flipped(Valid(UInt(8.W))))
  val first = IO(Input(Bool()))
  val end   = IO(Flipped(Valid(Bool())))

  /** What was sent, see [[FrameComposer]]. */
  val length = IO(Input(UInt(FrameComposer.AddressBits.W)))
  val look   = IO(Output(UInt(FrameComposer.AddressBits.W)))
  val sent   = IO(Input(UInt(8.W)))

  /** A word of the datagram at hand. A word of data comes twice, first with its low byte only. */
  val word = IO(Output(Valid(new AnswerWord)))

  /** The datagram at hand is over, and is one to be kept: one that was sent, or a record. */
  val whole = IO(Output(Bool()))

  /** The frame at hand is over; true: it is good EtherCAT, has passed a slave, and holds all that was sent.
    */
  val done = IO(Output(Valid(Bool())))

  private object State extends ChiselEnum { val ethernet, header, data, counter, behind, refused = Value }
  private val state = RegInit(State.refused)  // reset: no frame
  private val at    = Reg(UInt(4.W))          // byte within the part, 15: or a later one
  private val left  = Reg(UInt(11.W))         // data bytes to come
  private val where = Reg(chiselTypeOf(look)) // bytes of the area that have come, up to what was sent
  private val more  = Reg(Bool())
  private val wrong = Reg(Bool())             // not what was sent
  private val other = Reg(Bool())             // it is no record
  private val low   = Reg(UInt(8.W))          // the byte before

  private val isHeader = state === State.header
  private val inData   = state === State.data
  private val both     = Cat(byte.bits, low)
  private val allCame  = where === length
  private val added    = allCame // the datagram at hand stands behind those sent
  look := where

  private def on(n: Int): Bool = at === n.U
  private val isWhole          = state === State.counter && on(DatagramLayout.CounterBytes - 1)
  private val places = Seq(
    (isHeader && on(Index.offset))        -> AnswerWord.Index.U(3.W),
    (isHeader && on(Adp.last))            -> AnswerWord.Adp.U(3.W),
    (inData && at < RecordLayout.bytes.U) -> (AnswerWord.Data.U(3.W) + at(3, 1)),
    (isWhole && !added)                   -> AnswerWord.Counter.U(3.W)
  )
  private val counts = byte.valid && !first
  word.valid      := counts && VecInit(places.map(_._1)).asUInt.orR
  word.bits.place := Mux1H(places)
  word.bits.data  := Cat(byte.bits, Mux(inData && !at(0), byte.bits, low))
  whole           := counts && isWhole && !(added && other)
  done.valid      := end.valid
  // The last four bytes are the FCS.
  done.bits := end.bits && state === State.behind && at(3, 2).orR && !wrong && allCame

  when(byte.valid) {
    low := byte.bits
    when(!at.andR) { at := at + 1.U }
    when(first) {
      state := State.ethernet
      at    := 1.U
      where := 0.U
      wrong := false.B
      other := false.B
    }.otherwise {
      when((isHeader || inData || state === State.counter) && !allCame) { where := where + 1.U }
      switch(state) {
        is(State.ethernet) {
          val (high, low) = ((EtherType.EtherCat >> 8).U, (EtherType.EtherCat & 0xff).U)
          when(on(12) && byte.bits =/= high || on(13) && byte.bits =/= low || on(6) && !byte.bits(1)) {
            state := State.refused
          }
          when(on(15)) {
            at := 0.U
            state := Mux(
              both(15, 12) =/= 1.U,
              State.refused,
              Mux(both(10, 0) === 0.U, State.behind, State.header)
            )
          }
        }
        is(State.header) {
          when(on(Length.last)) {
            left := both(10, 0)
            more := byte.bits(7)
          }
          // Command, index and length are those sent; or those of a record, with its address.
          val mask     = Mux(on(Length.last), 7.U(8.W), 255.U(8.W))
          val compared = Seq(Command.offset, Index.offset, Length.offset, Length.last)
          val record = Seq(
            Command.offset -> EcatCommand.Nop,
            Ado.offset     -> (AlarmRegisters.State & 0xff),
            Ado.last       -> (AlarmRegisters.State >> 8),
            Length.offset  -> RecordLayout.bytes,
            Length.last    -> 0
          )
          when(!added && VecInit(compared.map(on)).asUInt.orR && ((byte.bits ^ sent) & mask).orR) {
            wrong := true.B
          }
          when(Mux1H(record.map { case (n, value) => on(n) -> ((byte.bits & mask) =/= value.U) })) {
            other := true.B
          }
          when(on(DatagramLayout.bytes - 1)) {
            at    := 0.U
            state := Mux(left === 0.U, State.counter, State.data)
          }
        }
        is(State.data) {
          left := left - 1.U
          when(left === 1.U) {
            at    := 0.U
            state := State.counter
          }
        }
        is(State.counter) {
          when(isWhole) {
            at    := 0.U
            state := Mux(more, State.header, State.behind)
            other := false.B
          }
        }
      }
    }
  }
}
