package flyframe.master

import chisel3._
import chisel3.util._

/** Answers ARP requests for the master's IP address (MST-12), so that the server's computer finds it. */
class ArpResponder extends Module {

  /** A frame, see [[EthernetReceiver]]. */
  val byte  = IO(Flipped(Valid(UInt(8.W))))
  val first = IO(Input(Bool()))
  val end   = IO(Flipped(Valid(Bool())))

  /** MAC and IP address count. */
  val own = IO(Input(new UdpEnd))

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
    for (i <- 0 until 6) when(now === i.U) {
      when(byte.bits =/= 0xff.U) { all := false.B }
      when(byte.bits =/= own.mac(47 - 8 * i, 40 - 8 * i)) { mine := false.B }
    }
    for ((b, i) <- fixed.zipWithIndex) when(now === (12 + i).U && byte.bits =/= b.U) { wrong := true.B }
    when(now >= 22.U && now < 28.U) { mac := Cat(mac(39, 0), byte.bits) }
    when(now >= 28.U && now < 32.U) { ip := Cat(ip(23, 0), byte.bits) }
    for (i <- 0 until 4)
      when(now === (38 + i).U && byte.bits =/= own.ip(31 - 8 * i, 24 - 8 * i)) { wrong := true.B }
  }
  when(end.valid && !answers) {
    answers := end.bits && !wrong && (all || mine) && at >= Bytes.U
    sent    := 0.U
    at      := 0.U
  }

  private val answer = Cat(mac, own.mac, "h0806_0001_0800_0604_0002".U(80.W), own.mac, own.ip, mac, ip)
  bytes.valid     := answers
  bytes.bits.data := VecInit((0 until Bytes).map(i => answer(8 * (Bytes - i) - 1, 8 * (Bytes - i) - 8)))(sent)
  bytes.bits.last := sent === (Bytes - 1).U
  when(bytes.fire) {
    sent := sent + 1.U
    when(bytes.bits.last) { answers := false.B }
  }
}
