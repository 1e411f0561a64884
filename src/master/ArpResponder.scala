package flyframe.master

import chisel3._
import chisel3.util._

/** Answers ARP requests for the master's IP address (MST-12), so that the server's computer finds it. */
class ArpResponder extends Module {

  /** A frame, see [[EthernetReceiver]]. */
  val byte  = IO(Flipped(Valid(UInt(8.W))))
  val first = IO(Input(Bool()))
  val end   = IO(Flipped(Valid(Bool())))

  /** What this byte must be if it is one of an address, see [[ExpectedByte]]. */
  val expected = IO(Input(UInt(8.W)))

  /** The master's addresses for the answer, from [[NetworkSettings]]. */
  val settingAddress = IO(Output(UInt(NetworkSettings.NetworkBits.W)))
  val setting        = IO(Input(UInt(8.W)))

  /** The answer. A request that comes while one is being answered is lost; it will be made again. */
  val bytes = IO(Decoupled(new FrameByte))

  private val Bytes   = 42               // of a request and of its answer
  private val at      = Reg(UInt(6.W))   // byte of the frame, up to 63
  private val wrong   = Reg(Bool())
  private val all     = Reg(Bool())      // to everybody, as far as is known
  private val mine    = Reg(Bool())      // to this station, as far as is known
  private val mac     = Reg(UInt(48.W))
  private val ip      = Reg(UInt(32.W))
  private val answers = RegInit(false.B) // reset: nothing asked
  private val sent    = Reg(UInt(6.W))

  // What a request must have from byte 12 on: type; Ethernet, IPv4, lengths, request.
  private val fixed = Seq(0x08, 0x06, 0x00, 0x01, 0x08, 0x00, 0x06, 0x04, 0x00, 0x01)
  private val now   = Mux(first, 0.U, at)
  when(byte.valid && !answers) {
    at := Mux(now.andR, now, now + 1.U)
    when(first) {
      wrong := false.B
      all   := true.B
      mine  := true.B
    }
    when(now < 6.U) {
      when(byte.bits =/= 0xff.U) { all := false.B }
      when(byte.bits =/= expected) { mine := false.B }
    }
    for ((b, i) <- fixed.zipWithIndex) when(now === (12 + i).U && byte.bits =/= b.U) { wrong := true.B }
    when(now >= 22.U && now < 28.U) { mac := Cat(mac(39, 0), byte.bits) }
    when(now >= 28.U && now < 32.U) { ip := Cat(ip(23, 0), byte.bits) }
    when(now >= 38.U && now < Bytes.U && byte.bits =/= expected) { wrong := true.B }
  }
  when(end.valid && !answers) {
    answers := end.bits && !wrong && (all || mine) && at >= Bytes.U
    sent    := 0.U
    at      := 0.U
  }

  // The answer: the asker's address, ours, type and kind, our addresses, the asker's. The latter go round as
  // they are sent.
  private val kind      = "h0806_0001_0800_0604_0002".U(80.W)
  private val kindBytes = VecInit((9 to 0 by -1).map(i => kind(8 * i + 7, 8 * i)))
  private val isMac     = sent < 6.U || (sent >= 32.U && sent < 38.U)
  private val isIp      = sent >= 38.U
  private val isKind    = sent >= 12.U && sent < 22.U
  private val age       = Reg(UInt(2.W)) // cycles since `sent` has changed, up to 2
  private val reply     = Reg(UInt(8.W))
  settingAddress  := Mux(sent < 12.U, sent, sent - 16.U)
  age             := Mux(bytes.fire || !answers, 0.U, Mux(age === 2.U, age, age + 1.U))
  bytes.valid     := age === 2.U
  bytes.bits.data := reply
  reply := Mux(
    isMac,
    mac(47, 40),
    Mux(isIp, ip(31, 24), Mux(isKind, kindBytes((sent - 12.U)(3, 0)), setting))
  )
  bytes.bits.last := sent === (Bytes - 1).U
  when(bytes.fire) {
    sent := sent + 1.U
    when(isMac) { mac := Cat(mac(39, 0), mac(47, 40)) }
    when(isIp) { ip := Cat(ip(23, 0), ip(31, 24)) }
    when(bytes.bits.last) { answers := false.B }
  }
}
