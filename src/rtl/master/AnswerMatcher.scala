package flyframe.master

import chisel3._
import chisel3.util._
import flyframe.lanes.Lanes
import flyframe.memory.DualPortRam
import flyframe.protocol.{DatagramLayout, EtherType}
import flyframe.protocol.DatagramLayout.{Ado, Adp, Command, Index, Length}

/** A word of 16 bits of a datagram that has come back from the line: one of those sent, or one that a slave
  * has appended.
  */
class AnswerWord extends Bundle {

  /** Which word it is, a constant of [[AnswerWord]]. */
  val place = UInt(3.W)
  val data  = UInt(16.W)
}

/** The words that are kept of a datagram, in the order of their places. */
object AnswerWord {

  /** The halves of the address; of a logical one the low and the high half. */
  val Adp = 0
  val Ado = 1

  /** The working counter, the last one to come. */
  val Counter = 2

  /** Bits 10 to 0: length of the data; bit 15: it stands behind those sent: a slave has appended it (AP-05).
    */
  val Kind = 3

  /** The first of four of data, first byte in the low half; behind the last byte undefined. */
  val Data = 4

  val Count = 8
}

/** Takes EtherCAT frames apart and compares them with what was sent (FP-12, FP-24): command, index and length
  * of each datagram, in order. Datagrams behind them are appended ones.
  *
  * What it reports of a frame counts only when `done` says so, at its end.
  *
  * @param maxSubTelegrams
  *   datagrams of a frame that was sent
  */
class AnswerMatcher(maxSubTelegrams: Int) extends Module {

  /** A frame, see [[EthernetReceiver]]. */
  val byte  = IO(Flipped(Valid(UInt(8.W))))
  val first = IO(Input(Bool()))
  val end   = IO(Flipped(Valid(Bool())))

  /** What was sent: `clear` forgets all of it, `expect` adds a datagram. */
  val clear  = IO(Input(Bool()))
  val expect = IO(Flipped(Valid(new DatagramToSend)))

  /** A data byte of the datagram at hand, its place there, and the number of the datagram from 0 on. */
  val data   = IO(Output(Valid(UInt(8.W))))
  val offset = IO(Output(UInt(11.W)))
  val number = IO(Output(UInt(7.W)))

  /** A word of the datagram at hand; with its working counter it is whole. A word of data comes twice, first
    * with its low byte only.
    */
  val word = IO(Output(Valid(new AnswerWord)))

  /** The frame at hand is over; true: it is good EtherCAT, has passed a slave, and holds all that was sent.
    */
  val done = IO(Output(Valid(Bool())))

  private val sent  = RegInit(0.U(8.W)) // datagrams expected; reset: none
  private val ram   = DualPortRam(128, 32)(clock)
  private val came  = Reg(UInt(8.W))    // datagrams of this frame
  private val entry = ram.io.readData   // what the one at hand must be
  ram.io.write        := expect.valid
  ram.io.writeAddress := sent
  ram.io.writeData    := Cat(expect.bits.length.pad(16), expect.bits.index, expect.bits.command)
  ram.io.readAddress  := came
  when(clear) { sent := 0.U }.elsewhen(expect.valid) { sent := sent + 1.U }

  private object State extends ChiselEnum { val ethernet, header, data, counter, behind, refused = Value }
  private val state      = RegInit(State.refused) // reset: no frame
  private val at         = Reg(UInt(11.W))        // byte within the part
  private val area       = Reg(UInt(11.W))        // bytes of the EtherCAT area to come
  private val left       = Reg(UInt(11.W))        // data bytes to come
  private val more       = Reg(Bool())
  private val wrong      = Reg(Bool())            // not what was sent
  private val low        = Reg(UInt(8.W))         // the byte before
  private val isAppended = came >= sent
  private val inData     = state === State.data
  private val both       = Cat(byte.bits, low)

  data.valid := byte.valid && !first && inData
  data.bits  := byte.bits
  offset     := at
  number     := came
  done.valid := end.valid
  // The last four bytes are the FCS.
  done.bits := end.bits && state === State.behind && at(10, 2).orR && !wrong && came >= sent

  private def on(n: Int): Bool                                        = at === n.U
  private def wordAt(s: State.Type, n: Int, place: Int): (Bool, UInt) = (state === s && on(n)) -> place.U(3.W)
  private val isLength = state === State.header && on(Length.last)
  private val places = Seq(
    wordAt(State.header, Adp.last, AnswerWord.Adp),
    wordAt(State.header, Ado.last, AnswerWord.Ado),
    wordAt(State.header, Length.last, AnswerWord.Kind),
    wordAt(State.counter, DatagramLayout.CounterBytes - 1, AnswerWord.Counter),
    (inData && at < 8.U) -> (AnswerWord.Data.U(3.W) | at(2, 1))
  )
  word.valid      := byte.valid && !first && VecInit(places.map(_._1)).asUInt.orR
  word.bits.place := Mux1H(places)
  word.bits.data := Mux(
    isLength,
    Cat(isAppended, 0.U(4.W), both(10, 0)),
    Cat(byte.bits, Mux(inData && !at(0), byte.bits, low))
  )

  when(byte.valid) {
    at  := at + 1.U
    low := byte.bits
    when(first) {
      state := State.ethernet
      at    := 1.U
      came  := 0.U
      wrong := false.B
    }.otherwise {
      switch(state) {
        is(State.ethernet) {
          val (high, low) = ((EtherType.EtherCat >> 8).U, (EtherType.EtherCat & 0xff).U)
          when(on(12) && byte.bits =/= high || on(13) && byte.bits =/= low || on(6) && !byte.bits(1)) {
            state := State.refused
          }
          when(on(15)) {
            area := both(10, 0)
            at   := 0.U
            state := Mux(
              both(15, 12) =/= 1.U,
              State.refused,
              Mux(both(10, 0) === 0.U, State.behind, State.header)
            )
          }
        }
        is(State.header) {
          area := area - 1.U
          when(on(Length.offset)) { left := byte.bits }
          when(on(Length.last)) {
            left := both(10, 0)
            more := byte.bits(7)
          }
          // Command, index and length are those sent.
          val isCompared = on(Command.offset) || on(Index.offset) || on(Length.offset) || on(Length.last)
          val expected   = Lanes.bytes(entry, 4)(Cat(at(2), at(0)))
          val had        = Mux(on(Length.last), byte.bits(2, 0), byte.bits)
          when(isCompared && !isAppended && had =/= expected) { wrong := true.B }
          when(on(DatagramLayout.bytes - 1)) {
            at    := 0.U
            state := Mux(left === 0.U, State.counter, State.data)
          }
        }
        is(State.data) {
          area := area - 1.U
          left := left - 1.U
          when(left === 1.U) {
            at    := 0.U
            state := State.counter
          }
        }
        is(State.counter) {
          area := area - 1.U
          when(on(DatagramLayout.CounterBytes - 1)) {
            came  := came + 1.U
            at    := 0.U
            state := Mux(more, State.header, State.behind)
            // The length of the EtherCAT area must say the same; nothing may come behind 128 datagrams.
            when(more =/= (area =/= 1.U) || came === 127.U) { wrong := true.B }
          }
        }
      }
    }
  }
}
