package flyframe.master

import chisel3._
import chisel3.util._
import flyframe.memory.DualPortRam

/** A datagram that has come back, or come from a slave. */
class DatagramAnswer extends Bundle {

  /** Which of those sent, from 0 on; meaningless if `appended`. */
  val number  = UInt(7.W)
  val command = UInt(8.W)
  val index   = UInt(8.W)
  val address = UInt(32.W)
  val length  = UInt(11.W)
  val counter = UInt(16.W)

  /** It stands behind those sent: a slave has appended it (AP-05). */
  val appended = Bool()
}

/** Takes EtherCAT frames apart and compares them with what was sent (FP-12, FP-24): command, index and length
  * of each datagram, in order. Datagrams behind them are reported as appended ones.
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

  /** What was sent: forget all; one more datagram. */
  val clear  = IO(Input(Bool()))
  val expect = IO(Flipped(Valid(new DatagramRequest)))

  /** A data byte of the datagram at hand, and its place there; the datagram, when its working counter has
    * come.
    */
  val data   = IO(Output(Valid(UInt(8.W))))
  val offset = IO(Output(UInt(11.W)))
  val answer = IO(Output(Valid(new DatagramAnswer)))

  /** The frame at hand is over; true: it is good EtherCAT, has passed a slave, and holds all that was sent.
    */
  val done = IO(Output(Valid(Bool())))

  /** The number of the datagram at hand, as in [[DatagramAnswer]]; it is an appended one. */
  val number   = IO(Output(UInt(7.W)))
  val appended = IO(Output(Bool()))

  private val sent  = RegInit(0.U(8.W)) // datagrams expected; reset: none
  private val entry = Wire(new DatagramRequest)
  private val ram   = DualPortRam(128, 27)(clock)
  private val came  = Reg(UInt(8.W))    // datagrams of this frame
  ram.io.write        := expect.valid
  ram.io.writeAddress := sent
  ram.io.writeData    := Cat(expect.bits.length, expect.bits.index, expect.bits.command)
  ram.io.readAddress  := came
  entry.command       := ram.io.readData(7, 0)
  entry.index         := ram.io.readData(15, 8)
  entry.length        := ram.io.readData(26, 16)
  entry.address       := DontCare
  when(clear) { sent := 0.U }.elsewhen(expect.valid) { sent := sent + 1.U }

  private object State extends ChiselEnum { val ethernet, header, data, counter, behind, refused = Value }
  private val state      = RegInit(State.refused) // reset: no frame
  private val at         = Reg(UInt(11.W))        // byte within the part
  private val area       = Reg(UInt(11.W))        // bytes of the EtherCAT area to come
  private val left       = Reg(UInt(11.W))        // data bytes to come
  private val more       = Reg(Bool())
  private val wrong      = Reg(Bool())            // not what was sent
  private val now        = Reg(new DatagramAnswer)
  private val low        = Reg(UInt(8.W))         // of the working counter
  private val isAppended = came >= sent

  number   := came
  appended := isAppended

  data.valid           := byte.valid && state === State.data
  data.bits            := byte.bits
  offset               := at
  answer.valid         := byte.valid && state === State.counter && at === 1.U
  answer.bits          := now
  answer.bits.counter  := Cat(byte.bits, low)
  answer.bits.number   := came
  answer.bits.appended := isAppended
  done.valid           := end.valid
  done.bits            := end.bits && state === State.behind && !wrong && came >= sent

  private def on(n: Int): Bool = at === n.U
  when(byte.valid) {
    at := at + 1.U
    when(first) {
      state := State.ethernet
      at    := 1.U
      came  := 0.U
      wrong := false.B
    }.otherwise {
      switch(state) {
        is(State.ethernet) {
          val header = Cat(byte.bits, area(7, 0))
          when(on(12) && byte.bits =/= 0x88.U || on(13) && byte.bits =/= 0xa4.U || on(6) && !byte.bits(1)) {
            state := State.refused
          }
          when(on(14)) { area := byte.bits }
          when(on(15)) {
            area := header(10, 0)
            at   := 0.U
            state := Mux(
              header(15, 12) =/= 1.U,
              State.refused,
              Mux(header(10, 0) === 0.U, State.behind, State.header)
            )
          }
        }
        is(State.header) {
          area := area - 1.U
          when(on(0)) { now.command := byte.bits }
          when(on(1)) { now.index := byte.bits }
          when(at >= 2.U && at <= 5.U) { now.address := Cat(byte.bits, now.address(31, 8)) }
          when(on(6)) { now.length := byte.bits }
          when(on(7)) {
            now.length := Cat(byte.bits(2, 0), now.length(7, 0))
            left       := Cat(byte.bits(2, 0), now.length(7, 0))
            more       := byte.bits(7)
          }
          when(on(9)) {
            val same =
              now.command === entry.command && now.index === entry.index && now.length === entry.length
            when(!isAppended && !same) { wrong := true.B }
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
          low  := byte.bits
          when(on(1)) {
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
