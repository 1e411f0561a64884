package flyframe.master

import chisel3._
import chisel3.util._

/** The sum of RFC 1071, a byte at a time. The halves change places with every byte, so that the carry of one
  * goes into the next, and round at the end; which of them is the high one depends on how many bytes came.
  */
private class InternetSum extends Bundle {

  /** The half into which the next byte goes. */
  val next  = UInt(8.W)
  val other = UInt(8.W)
  val carry = Bool() // to `next`

  def plus(byte: UInt): InternetSum = {
    val total = (Cat(next, 1.U(1.W)) +& Cat(byte, carry)) >> 1
    InternetSum(other, total(7, 0), total(8))
  }

  /** It is 0xFFFF, which is zero; it isn't 0x0000 once anything but zeroes has come. */
  def isZero: Bool = other.andR && next(7, 1).andR && next(0) =/= carry
}

private object InternetSum {
  def apply(next: UInt, other: UInt, carry: Bool): InternetSum = {
    val sum = Wire(new InternetSum)
    sum.next  := next
    sum.other := other
    sum.carry := carry
    sum
  }

  /** Of one word: its high byte is next. */
  def of(word: Int): InternetSum = apply((word >> 8).U, (word & 0xff).U, false.B)
}

/** Sends UDP datagrams over IPv4 and Ethernet, with both checksums (MST-10). The payload is read twice from a
  * memory: once to be summed, once to be sent.
  */
class UdpSender extends Module {
  import UdpSender._

  /** The addresses, from [[NetworkSettings]]. */
  val settingAddress = IO(Output(UInt(NetworkSettings.NetworkBits.W)))
  val setting        = IO(Input(UInt(8.W)))

  /** Sends `length` bytes of payload, 1 to 1472; not while `busy`. */
  val start  = IO(Input(Bool()))
  val length = IO(Input(UInt(11.W)))
  val busy   = IO(Output(Bool()))

  /** The payload: address, and the byte one or two cycles later. */
  val readAddress = IO(Output(UInt(11.W)))
  val readData    = IO(Input(UInt(8.W)))
  val bytes       = IO(Decoupled(new FrameByte))

  private object State extends ChiselEnum { val idle, sumIp, sumUdp, pad, fold, send = Value }
  private val state  = RegInit(State.idle)  // reset: nothing to send
  private val at     = Reg(UInt(6.W))       // byte of the frame, up to the payload
  private val place  = Reg(UInt(11.W))      // byte of the payload
  private val age    = Reg(UInt(2.W))       // cycles since `at` or `place` has changed, up to 3
  private val size   = Reg(UInt(11.W))
  private val number = RegInit(0.U(16.W))   // identification of the packet; reset: any
  private val sum    = Reg(new InternetSum) // when all is summed: the checksum of UDP
  private val check  = Reg(UInt(16.W))      // the checksum of IP; when that has been sent, of UDP

  private val inPayload                = at === HeaderBytes.U
  private val lengths                  = size + Mux(at(5), 8.U, 28.U) // of UDP, of IP
  private def isWord(first: Int): Bool = at(5, 1) === (first / 2).U
  private def half(word: UInt): UInt   = Mux(at(0), word(7, 0), word(15, 8))
  private val isNumber                 = isWord(18)
  private val isCheck                  = isWord(24) || isWord(40)
  private val isSetting                = at < MacEnd.U || (at >= AddressStart.U && at < AddressEnd.U)
  settingAddress := at - Mux(at < MacEnd.U, 0.U, (AddressStart - MacEnd).U)
  readAddress    := place

  private val byte  = Reg(UInt(8.W))
  private val ready = age === 3.U // it is the one that is asked for
  // IPv4; not to be fragmented; 64 hops; UDP.
  private val constants = Seq(12 -> 0x08, 14 -> 0x45, 20 -> 0x40, 22 -> 0x40, 23 -> 0x11)
  byte := MuxCase(
    MuxLookup(at, 0.U(8.W))(constants.map { case (n, b) => n.U -> b.U(8.W) }),
    Seq(
      inPayload                  -> readData,
      isSetting                  -> setting,
      (isWord(16) || isWord(38)) -> half(lengths.pad(16)),
      isNumber                   -> half(number),
      isCheck                    -> check(15, 8)
    )
  )

  // UDP is summed with bytes inverted: that gives the checksum, with 0xFFFF for 0. Without the checksums; the
  // sum of UDP without what is not of the pseudo header, too.
  private val inverted = state === State.sumUdp || state === State.pad
  private val isSummed = !isCheck &&
    (state === State.sumIp && at < UdpStart.U || state === State.sumUdp && !isNumber)
  private val summed = sum.plus(Mux(isSummed, byte, 0.U) ^ Fill(8, inverted))

  private val following = place + 1.U
  private val isLast    = inPayload && following === size
  private val taken     = ready && Mux(state === State.send, bytes.ready, state =/= State.idle)
  bytes.valid     := state === State.send && ready
  bytes.bits.data := byte
  bytes.bits.last := isLast
  busy            := state =/= State.idle

  age := Mux(taken || state === State.idle, 0.U, Mux(ready, age, age + 1.U))
  when(taken) {
    when(inPayload) { place := following }.otherwise { at := at + 1.U }
    sum := summed
    // While the frame is sent the halves of the sum go round: the high one is next at even bytes.
    when(state === State.sumIp || (state === State.send && isCheck)) {
      check := Cat(check(7, 0), Mux(state === State.send, sum.next, ~summed.other))
    }
  }
  when(state === State.idle) { size := length }
  switch(state) {
    is(State.idle) {
      at    := IpStart.U
      place := 0.U
      sum   := InternetSum.of(0)
      when(start) {
        state  := State.sumIp
        number := number + 1.U
      }
    }
    // Two bytes of nothing at the end of each sum fold its carry.
    is(State.sumIp) {
      when(taken && at === (UdpStart + 1).U) {
        state := State.sumUdp
        at    := LengthStart.U
        // The pseudo header has the protocol, 17, and the length of UDP: that of IP, which is summed here,
        // less 20. Then come words of constants.
        sum := InternetSum.of(20 - 17 + 0x4000 + 0x4011)
      }
    }
    is(State.sumUdp) { when(taken && isLast) { state := Mux(place(0), State.fold, State.pad) } }
    is(State.pad) { when(taken) { state := State.fold } }
    is(State.fold) {
      when(taken && place(0)) {
        state := State.send
        at    := 0.U
        place := 0.U
      }
    }
    is(State.send) { when(taken && isLast) { state := State.idle } }
  }
}

object UdpSender {

  /** Where things begin in a frame. */
  private[master] val IpStart      = 14
  private[master] val LengthStart  = 16
  private[master] val MacEnd       = 12
  private[master] val AddressStart = 26
  private[master] val AddressEnd   = 38
  private[master] val UdpStart     = 34
  private[master] val HeaderBytes  = 42
}

/** Why a frame for this station is not a UDP datagram for it. */
class UdpReceived extends Bundle {

  /** Payload bytes. */
  val length = UInt(11.W)

  /** From the IP address of the server. */
  val fromServer = Bool()

  /** In order, and for this end; else it was a frame to this address that is not. */
  val good = Bool()
}

/** Receives UDP datagrams over IPv4 (MST-11): for one address and port, whole (not fragmented), with right
  * lengths and checksums. Frames to other stations are nothing; what else is not in order is reported as bad.
  */
class UdpReceiver extends Module {
  import UdpSender._
  import UdpReceiver._

  /** A frame, see [[EthernetReceiver]]. */
  val byte  = IO(Flipped(Valid(UInt(8.W))))
  val first = IO(Input(Bool()))
  val end   = IO(Flipped(Valid(Bool())))

  /** Of this byte, see [[ExpectedByte]]. */
  val at   = IO(Input(UInt(6.W)))
  val same = IO(Input(Bool()))
  val mine = IO(Input(Bool()))

  /** A byte of payload and its place; it counts if `received` says so later. */
  val data   = IO(Output(Valid(UInt(8.W))))
  val offset = IO(Output(UInt(11.W)))

  /** The end of a frame to this station. */
  val received = IO(Output(Valid(new UdpReceived)))

  private val wrong   = Reg(Bool())
  private val foreign = Reg(Bool())     // not from the server
  private val summed  = Reg(Bool())     // with a UDP checksum
  private val begun   = Reg(Bool())     // a byte of payload has come
  private val place   = Reg(UInt(11.W)) // byte of the payload

  // Bytes of the packet to come. It waits once, at the length of UDP, so that both bytes of that can be
  // compared with it: from there on it is one more, and it stops at one, when the FCS has come as well.
  private val left   = Reg(UInt(11.W))
  private val ipSum  = Reg(new InternetSum)
  private val udpSum = Reg(new InternetSum)

  private val payload                        = at >= HeaderBytes.U && left > 5.U
  private def on(n: Int): Bool               = at === n.U
  private def demand(n: Int, ok: Bool): Unit = when(on(n) && !ok) { wrong := true.B }

  data.valid := byte.valid && payload
  data.bits  := byte.bits
  offset     := place

  when(byte.valid) {
    when(first) {
      wrong   := false.B
      foreign := false.B
      begun   := false.B
      place   := 0.U
      ipSum   := InternetSum.of(0)
      // The pseudo header has the protocol, 17, and the length of UDP: that of IP, which is summed here, less
      // 20.
      udpSum := InternetSum.of(0xffff - (20 - 17))
    }
    when(!same) {
      when(at >= 26.U && at < 30.U) { foreign := true.B }
      when((at >= 30.U && at < 34.U) || on(36) || on(37)) { wrong := true.B }
    }
    demand(12, byte.bits === 0x08.U)
    demand(13, byte.bits === 0x00.U)
    demand(14, byte.bits === 0x45.U)
    demand(16, byte.bits <= (MostBytes >> 8).U)
    demand(17, !(left(10, 8) === (MostBytes >> 8).U && byte.bits > (MostBytes & 0xff).U))
    demand(20, (byte.bits & 0xbf.U) === 0.U) // not a fragment
    demand(21, byte.bits === 0.U)
    demand(23, byte.bits === 17.U)
    demand(38, byte.bits === left(10, 8))
    demand(39, byte.bits === left(7, 0))
    when(on(16) || on(17)) {
      left := Cat(Mux(on(16), byte.bits(2, 0), left(10, 8)), byte.bits)
    }.elsewhen(!on(38) && left > 1.U) { left := left - 1.U }
    when(on(40)) { summed := byte.bits.orR }
    when(on(41) && byte.bits.orR) { summed := true.B }
    when(payload) {
      begun := true.B
      place := place + 1.U
    }
    when(at >= IpStart.U && at < UdpStart.U) { ipSum := ipSum.plus(byte.bits) }
    when(on(16) || on(17) || (at >= AddressStart.U && (at < HeaderBytes.U || payload))) {
      udpSum := udpSum.plus(byte.bits)
    }
  }

  received.valid           := RegNext(end.valid && mine, false.B)
  received.bits.length     := place
  received.bits.fromServer := !foreign
  received.bits.good := RegNext(
    end.bits && !wrong && begun && left === 1.U && ipSum.isZero && (!summed || udpSum.isZero)
  )
}

object UdpReceiver {

  /** Of an IP packet. */
  private val MostBytes = 1500
}
