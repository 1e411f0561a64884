package flyframe.master

import chisel3._
import chisel3.util._

/** The sum of RFC 1071, a byte at a time. */
private class InternetSum extends Bundle {
  val sum = UInt(16.W)

  /** With `byte`, the high or the low one of its word. */
  def plus(byte: UInt, high: Bool): UInt = plus(Mux(high, Cat(byte, 0.U(8.W)), byte.pad(16)))
  def plus(word: UInt): UInt = {
    val total = sum +& word
    total(15, 0) + total(16)
  }
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

  private object State extends ChiselEnum { val idle, sumIp, sumUdp, constants, send = Value }
  private val state    = RegInit(State.idle) // reset: nothing to send
  private val at       = Reg(UInt(11.W))     // byte of the frame
  private val age      = Reg(UInt(2.W))      // cycles since `at` has changed, up to 3
  private val size     = Reg(UInt(11.W))
  private val number   = RegInit(0.U(16.W))  // identification of the packet; reset: any
  private val sum      = Reg(new InternetSum)
  private val ipCheck  = Reg(UInt(16.W))
  private val udpCheck = Reg(UInt(16.W))

  private val udpLength = size +& 8.U
  private val ipLength  = size +& 28.U
  // Bytes 12 to 25, and the last four of the header.
  private val header = Cat(
    "h0800_4500".U(32.W),
    ipLength.pad(16),
    number,
    "h4000_4011".U(32.W), // not to be fragmented; 64 hops; UDP
    ipCheck,
    udpLength.pad(16),
    udpCheck
  )
  private val OwnBytes  = header.getWidth / 8
  private val beforeOwn = at < MacEnd.U
  private val ofUdp     = at >= AddressEnd.U
  private val own       = (at - Mux(ofUdp, (AddressEnd - (AddressStart - MacEnd)).U, MacEnd.U))(4, 0)
  private val isSetting = beforeOwn || (at >= AddressStart.U && !ofUdp)
  settingAddress := at - Mux(beforeOwn, 0.U, (AddressStart - MacEnd).U)
  private val byte  = Reg(UInt(8.W))
  private val ready = age === 3.U // it is that at `at`
  byte := Mux(
    at >= HeaderBytes.U,
    readData,
    Mux(
      isSetting,
      setting,
      VecInit((0 until OwnBytes).map(i => header(8 * (OwnBytes - i) - 1, 8 * (OwnBytes - i) - 8)))(own)
    )
  )
  private val isLast = at === size +& (HeaderBytes - 1).U
  private val taken  = ready && Mux(state === State.send, bytes.ready, state =/= State.idle)
  readAddress     := at - HeaderBytes.U
  bytes.valid     := state === State.send && ready
  bytes.bits.data := byte
  bytes.bits.last := isLast
  busy            := state =/= State.idle

  age := Mux(taken || state === State.idle, 0.U, Mux(ready, age, age + 1.U))
  when(taken) { at := at + 1.U }
  switch(state) {
    is(State.idle) {
      when(start) {
        state    := State.sumIp
        size     := length
        at       := IpStart.U
        sum.sum  := 0.U
        ipCheck  := 0.U
        udpCheck := 0.U
        number   := number + 1.U
      }
    }
    is(State.sumIp) {
      when(taken) {
        sum.sum := sum.plus(byte, !at(0))
        when(at === (UdpStart - 1).U) {
          state   := State.sumUdp
          ipCheck := ~sum.plus(byte, !at(0))
          at      := AddressStart.U
          sum.sum := 0.U
        }
      }
    }
    is(State.sumUdp) {
      when(taken) {
        sum.sum := sum.plus(byte, !at(0))
        when(isLast) { state := State.constants }
      }
    }
    is(State.constants) { // of the pseudo header: protocol and length
      when(taken) {
        val check = ~sum.plus(udpLength +& 17.U)
        udpCheck := Mux(check === 0.U, "hffff".U, check)
        at       := 0.U
        state    := State.send
      }
    }
    is(State.send) { when(taken && isLast) { state := State.idle } }
  }
}

object UdpSender {

  /** Where things begin in a frame. */
  private[master] val IpStart      = 14
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

  /** A frame, see [[EthernetReceiver]]. */
  val byte  = IO(Flipped(Valid(UInt(8.W))))
  val first = IO(Input(Bool()))
  val end   = IO(Flipped(Valid(Bool())))

  /** What this byte must be if it is one of an address, see [[ExpectedByte]]. */
  val expected = IO(Input(UInt(8.W)))

  /** A byte of payload and its place; it counts if `received` says so later. */
  val data   = IO(Output(Valid(UInt(8.W))))
  val offset = IO(Output(UInt(11.W)))

  /** The end of a frame to this station. */
  val received = IO(Output(Valid(new UdpReceived)))

  private val at       = Reg(UInt(11.W))  // byte of the frame, up to 2047
  private val previous = Reg(UInt(8.W))
  private val ours     = RegInit(false.B) // to this station, as far as is known; reset: no frame
  private val wrong    = Reg(Bool())
  private val foreign  = Reg(Bool())      // not from the server
  private val ipLength = Reg(UInt(16.W))
  private val summed   = Reg(Bool())      // with a UDP checksum
  private val ipSum    = Reg(new InternetSum)
  private val udpSum   = Reg(new InternetSum)

  private val now                            = Mux(first, 0.U, at)
  private val word                           = Cat(previous, byte.bits)
  private val ipEnd                          = ipLength +& IpStart.U
  private val payload                        = now >= HeaderBytes.U && now < ipEnd
  private def on(n: Int): Bool               = now === n.U
  private def demand(n: Int, ok: Bool): Unit = when(on(n) && !ok) { wrong := true.B }

  data.valid := byte.valid && payload
  data.bits  := byte.bits
  offset     := now - HeaderBytes.U

  when(byte.valid) {
    previous := byte.bits
    at       := Mux(now.andR, now, now + 1.U)
    when(first) {
      ours       := true.B
      wrong      := false.B
      foreign    := false.B
      ipSum.sum  := 0.U
      udpSum.sum := 0.U
      ipLength   := 0.U
      summed     := false.B
    }
    when(byte.bits =/= expected) {
      when(now < 6.U) { ours := false.B }
      when(now >= 26.U && now < 30.U) { foreign := true.B }
      when((now >= 30.U && now < 34.U) || on(36) || on(37)) { wrong := true.B }
    }
    when(on(17)) { ipLength := word }
    when(on(41)) { summed := word =/= 0.U }
    demand(13, word === 0x0800.U)
    demand(14, byte.bits === 0x45.U)
    demand(17, word >= 29.U && word <= 1500.U)
    demand(21, (word & 0xbfff.U) === 0.U) // not a fragment
    demand(23, byte.bits === 17.U)
    demand(39, word === ipLength - 20.U)
    when(now >= IpStart.U && now < UdpStart.U) { ipSum.sum := ipSum.plus(byte.bits, !now(0)) }
    when(now >= AddressStart.U && (now < HeaderBytes.U || payload)) {
      udpSum.sum := udpSum.plus(byte.bits, !now(0))
    }
  }

  private val total = Reg(UInt(16.W)) // with the rest of the pseudo header
  total := udpSum.plus((ipLength - 20.U)(15, 0) + 17.U)
  private val sumsGood = ipSum.sum.andR && (!summed || total.andR)

  // A cycle after the end, for the sum.
  received.valid           := RegNext(end.valid && ours, false.B)
  received.bits.length     := ipLength - 28.U
  received.bits.fromServer := !foreign
  received.bits.good       := RegNext(end.bits && !wrong && at >= ipEnd && at >= HeaderBytes.U) && sumsGood
  when(end.valid) { ours := false.B }
}
