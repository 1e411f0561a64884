package flyframe.master

import chisel3._
import chisel3.util._
import flyframe.ethernet.{NetworkSettings, UdpReceived}
import flyframe.protocol.AnswerLayout._
import flyframe.protocol.{AnswerLayout, ServerDatagram}
import flyframe.ram.DualPortRam
import flyframe.registers.MasterRegisters

/** What comes from the server (SRV-01 to SRV-03): answers to reports, of which some bring an order for the
  * host. An answer is kept until it can be checked, byte by byte, while the next one comes in. All of it is
  * checked whatever is wrong.
  *
  * The last right answer and the last order are kept: they tell the life of the server, the last echo and the
  * last ticket. So there are four places for answers, which change their roles.
  */
class ServerLink extends Module {

  /** From [[UdpReceiver]]. */
  val data     = IO(Flipped(Valid(UInt(8.W))))
  val offset   = IO(Input(UInt(11.W)))
  val received = IO(Flipped(Valid(new UdpReceived)))

  /** An answer is to be checked: it needs settings, tag and numbers until it does not want them any more. */
  val wants   = IO(Output(Bool()))
  val granted = IO(Input(Bool()))

  // Where bytes come from: settings a cycle after the address, numbers in the same one.
  val settingAddress = IO(Output(UInt(NetworkSettings.AddressBits.W)))
  val setting        = IO(Input(UInt(8.W)))
  val numberAddress  = IO(Output(UInt(3.W))) // counter of reports, then number of the first event
  val number         = IO(Input(UInt(8.W)))

  /** To and from [[AsconTag]]. */
  val tagged   = IO(Decoupled(UInt(8.W)))
  val tagEnd   = IO(Output(Bool()))
  val tag      = IO(Input(Valid(UInt(8.W))))
  val tagReady = IO(Output(Bool()))

  /** Events that are kept; the server has so many of them. */
  val kept   = IO(Input(UInt(EventMemory.CountBits.W)))
  val remove = IO(Output(Valid(UInt(EventMemory.CountBits.W))))

  /** The server lives, and its log. It has another life than before. */
  val alive   = IO(Output(Bool()))
  val newLife = IO(Output(Bool()))

  /** A byte of the life of the server, 0 as long as that is not known; a cycle later. Not while granted. */
  val lifeAddress = IO(Input(UInt(3.W)))
  val life        = IO(Output(UInt(8.W)))

  /** An order waits, as the answer that has brought it, until the host says `take`. */
  val waiting     = IO(Output(Bool()))
  val take        = IO(Input(Bool()))
  val looks       = IO(Input(Bool()))     // the host reads now: not in two cycles one behind the other
  val readAddress = IO(Input(UInt(6.W)))
  val readData    = IO(Output(UInt(8.W))) // a cycle later; it may not be what somebody else has asked for

  /** A datagram was refused. An order was dropped, as another one waits for the host. */
  val refused = IO(Output(Bool()))
  val dropped = IO(Output(Bool()))

  // The roles. Reset: each place has one.
  private val comes    = RegInit(0.U(2.W)) // it comes in, or waits for its check
  private val checks   = RegInit(1.U(2.W)) // it is checked
  private val accepted = RegInit(2.U(2.W)) // it was the last right one, or the one before the last order
  private val ordered  = RegInit(3.U(2.W)) // it has brought the last order
  private val byOrder  = RegInit(false.B)  // the last right one has brought the last order; reset: none
  private val isKnown  = RegInit(false.B)  // there was a right one; reset: none
  private val hasOrder = RegInit(false.B)  // there was an order; reset: none
  private val waits    = RegInit(false.B)  // for the host; reset: none
  private val latest   = Mux(byOrder, ordered, accepted)
  waiting := waits
  when(take) { waits := false.B }

  // It comes. Whether there is a place is decided by its first byte: else half of it could be kept.
  private val pending = RegInit(false.B) // reset: none
  private val late    = Reg(Bool())
  private val blocked = Mux(offset === 0.U, pending, late)
  when(data.valid) { late := blocked }
  private val isOurs =
    received.bits.good && received.bits.fromServer && received.bits.length === AnswerLayout.bytes.U && !late
  when(received.valid && isOurs) { pending := true.B }

  // It is checked, three cycles a byte: what it is compared with, itself, both.
  private object State extends ChiselEnum { val idle, nonce, message, tag, numbers = Value }
  private val state   = RegInit(State.idle) // reset: nothing to check
  private val at      = Reg(UInt(6.W))      // byte of the answer, or of the nonce
  private val age     = Reg(UInt(2.W))
  private val other   = Reg(UInt(8.W))
  private val wrong   = Reg(Bool())
  private val isNewer = Reg(Bool())         // its echo is later than the last one
  private val decided = Reg(Bool())         // as some byte of the echo was another one
  private val another = Reg(Bool())         // life of the server
  private val fresh   = Reg(Bool())         // its ticket is another one
  private val orders  = Reg(Bool())
  private val silent  = Reg(Bool())         // the server cannot log
  private val borrow  = Reg(Bool())
  private val zeros   = Reg(Bool())         // of a difference, but for its lowest byte
  private val ones    = Reg(Bool())
  private val lowest  = Reg(UInt(8.W))
  private val begins  = state === State.idle && pending && granted
  private val ends    = RegInit(false.B)    // all has been checked; reset: nothing was
  wants := pending || state =/= State.idle

  private val own = Mux(at(3), Cat(6.U(4.W), at(1, 0)), Cat(2.U(3.W), at(2, 0))) // of the nonce: life, turn
  private val read = Mux(
    state === State.idle,
    Cat(latest, (Server.offset / 8).U(3.W), lifeAddress),
    Mux(
      age === 0.U && state === State.message,
      Cat(Mux(at(5, 3) === (Ticket.offset / 8).U, ordered, latest), at),
      Cat(checks, Mux(state === State.nonce, own, at))
    )
  )
  private val ram = DualPortRam(4 * AnswerLayout.bytes, 8)(clock)
  ram.io.write        := data.valid && !blocked && offset < AnswerLayout.bytes.U
  ram.io.writeAddress := Cat(comes, offset(5, 0))
  ram.io.writeData    := data.bits
  ram.io.readAddress  := Mux(looks, Cat(ordered, readAddress), read)
  private val byte    = ram.io.readData
  private val isOther = RegNext(looks, false.B) // it is for the host
  readData := byte
  life     := byte & Fill(8, isKnown)
  require(AnswerLayout.bytes == 64 && Turn.offset == 24 && Ticket.offset % 8 == 4, "places in an answer")

  // What it is compared with.
  private val constants = Seq(
    Magic.offset   -> (ServerDatagram.Magic >> 8),
    Magic.last     -> (ServerDatagram.Magic & 0xff),
    Version.offset -> ServerDatagram.Version,
    Kind.offset    -> ServerDatagram.KindAnswer
  )
  settingAddress := Mux(at(3), MasterRegisters.MasterLife.U | at(2, 0), MasterRegisters.MasterId.U | !at(0))
  numberAddress  := Cat(at(5), at(1, 0))
  when(state === State.tag) {
    when(tag.valid) { other := tag.bits }
  }.elsewhen(age === 1.U) {
    other := Mux(
      at(5, 4).orR,
      byte & Fill(8, isKnown), // of the last right answer, or of the last order
      Mux(
        at(3) || at(2, 1) === 2.U,
        setting,
        MuxLookup(at(2, 0), 0.U(8.W))(constants.map { case (n, b) => n.U -> b.U(8.W) })
      )
    )
  }
  private val versus  = Mux(state === State.numbers, number, other)
  private val minus   = byte -& versus - (borrow && state === State.numbers)
  private val differs = byte =/= versus

  private val isHere = age === 2.U && !isOther
  private val feeds  = state === State.nonce || state === State.message
  private val fires  = isHere && (!feeds || tagged.ready)
  tagged.valid := isHere && feeds
  tagged.bits := Mux(
    state === State.nonce && at(3, 2) === 2.U,
    Mux(at(1, 0).orR, 0.U, ServerDatagram.OfServer.U),
    byte
  )
  tagEnd   := fires && state === State.message && at === (Tag.offset - 1).U
  tagReady := state === State.tag
  when(state === State.tag) { // its byte is there all the time: that of the tag is waited for
    age := Mux(tag.valid, 2.U, Mux(fires, 0.U, age))
  }.otherwise { age := Mux(fires || isOther || state === State.idle, 0.U, Mux(isHere, age, age + 1.U)) }

  private def on(field: flyframe.protocol.Layout.Field): Bool =
    at >= field.offset.U && at < field.end.U
  when(fires) {
    at := at + 1.U
    switch(state) {
      is(State.nonce) {
        when(at(3, 0).andR) {
          state := State.message
          at    := 0.U
        }
      }
      is(State.message) {
        when(at(5, 4) === 0.U && differs) { wrong := true.B }
        when(at(5, 3) === (Server.offset / 8).U && differs) { another := true.B }
        when(on(Echo)) {
          when(differs) { decided := true.B }
          when(!decided) { isNewer := !minus(8) && differs }
        }
        when(on(Ticket) && differs) { fresh := true.B }
        when(at === Order.offset.U) { orders := byte.orR }
        when(at === Trouble.offset.U) { silent := byte.orR }
        when(at === (Tag.offset - 1).U) { state := State.tag }
      }
      is(State.tag) {
        when(differs) { wrong := true.B }
        when(at.andR) {
          state := State.numbers
          at    := Number.last.U
        }
      }
      is(State.numbers) { // from the lowest byte of `Number` to the highest one of `Echo`
        at     := at - 1.U
        borrow := minus(8) && !(at(1, 0) === 0.U)
        when(at(1, 0).andR) {
          lowest := minus(7, 0)
          zeros  := true.B
          ones   := true.B
        }.otherwise {
          when(minus(7, 0).orR) { zeros := false.B }
          when(!minus(7, 0).andR) { ones := false.B }
        }
        ends := at === Echo.offset.U
      }
    }
  }
  // Number and Echo are each done with their highest byte.
  private val isZero  = zeros && !minus(7, 0).orR
  private val isRight = !wrong && isNewer
  remove.valid := RegNext(
    state === State.numbers && fires && at === Number.offset.U && isRight && isZero && lowest <= kept,
    false.B
  )
  remove.bits := lowest
  private val inTime = RegNext((isZero && lowest === 0.U) || (ones && minus(7, 0).andR && lowest(7, 4).andR))

  private val accepts = ends && isRight
  private val isOrder = accepts && orders && (fresh || !hasOrder) && inTime
  private val isTaken = isOrder && !waits
  alive   := accepts && !silent
  newLife := accepts && (another || !isKnown)
  dropped := isOrder && waits
  refused := (received.valid && !isOurs) || (ends && !isRight)
  when(ends) {
    state := State.idle
    ends  := false.B
  }
  when(accepts) {
    isKnown := true.B
    byOrder := isTaken
    checks  := Mux(isTaken, ordered, accepted)
    when(isTaken) { ordered := checks }.otherwise { accepted := checks }
  }
  when(isTaken) {
    waits    := true.B
    hasOrder := true.B
  }
  when(begins) {
    state   := State.nonce
    at      := 0.U
    comes   := checks
    checks  := comes
    pending := false.B
    wrong   := false.B
    isNewer := false.B
    decided := false.B
    another := false.B
    fresh   := false.B
    borrow  := false.B
  }
}

object ServerLink {

  /** Bytes of an order in the mailbox. */
  val OrderBytes = AnswerLayout.bytes
}
