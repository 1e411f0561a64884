package flyframe.ethernet

import chisel3._
import chisel3.util._

/** The sum of RFC 1071, a byte at a time. The halves change places with every byte, so that the carry of one
  * goes into the next, and round at the end; which of them is the high one depends on how many bytes came.
  */
private[flyframe] class InternetSum extends Bundle {

  /** The half into which the next byte goes. */
  val next  = UInt(8.W)
  val other = UInt(8.W)
  val carry = Bool() // to `next`

  def plus(byte: UInt): InternetSum = {
    val total = (Cat(next, 1.U(1.W)) +& Cat(byte, carry)) >> 1
    InternetSum(other, total(7, 0), total(8))
  }
}

private[flyframe] object InternetSum {
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
  * lengths. Frames to other stations are nothing; what else is not in order is reported as bad. Checksums are
  * not looked at: the frame has an FCS, and the datagram a tag.
  */
class UdpReceiver extends Module {
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
  private val begun   = Reg(Bool())     // a byte of payload has come
  private val place   = Reg(UInt(11.W)) // byte of the payload

  // Bytes of the packet to come. It waits once, at the length of UDP, so that both bytes of that can be
  // compared with it: from there on it is one more, and it stops at one, when the FCS has come as well.
  private val left = Reg(UInt(11.W))

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
    when(payload) {
      begun := true.B
      place := place + 1.U
    }
  }

  received.valid           := RegNext(end.valid && mine, false.B)
  received.bits.length     := place
  received.bits.fromServer := !foreign
  received.bits.good       := RegNext(end.bits && !wrong && begun && left === 1.U)
}

object UdpReceiver {

  /** What is in front of the payload. */
  private val HeaderBytes = 42

  /** Of an IP packet. */
  private val MostBytes = 1500
}
