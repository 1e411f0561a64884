package flyframe.ethernet

import chisel3._
import chisel3.util._
import flyframe.lanes.Lanes

/** Answers ARP requests for the master's IP address (MST-12), so that the server's computer finds it. */
class ArpResponder extends Module {

  /** A frame, see [[EthernetReceiver]]. */
  val byte  = IO(Flipped(Valid(UInt(8.W))))
  val first = IO(Input(Bool()))
  val end   = IO(Flipped(Valid(Bool())))

  /** Of this byte, see [[ExpectedByte]]. */
  val at   = IO(Input(UInt(6.W)))
  val same = IO(Input(Bool()))
  val mine = IO(Input(Bool()))

  /** The master's addresses for the answer, from [[NetworkSettings]], when they may be read. */
  val wants          = IO(Output(Bool()))
  val granted        = IO(Input(Bool()))
  val settingAddress = IO(Output(UInt(NetworkSettings.NetworkBits.W)))
  val setting        = IO(Input(UInt(8.W)))

  /** The asker's MAC and IP address, from byte 22 to 31 of the request, each at its place modulo 32: to a
    * memory that has the byte a cycle after its address, while `granted`.
    */
  val note        = IO(Output(Valid(UInt(8.W))))
  val noteAddress = IO(Output(UInt(5.W)))
  val readAddress = IO(Output(UInt(5.W)))
  val asker       = IO(Input(UInt(8.W)))

  /** The answer. A request that comes while one is being answered is lost; it will be made again. */
  val bytes = IO(Decoupled(new FrameByte))

  private val Bytes   = 42               // of a request and of its answer, without FCS
  private val wrong   = Reg(Bool())
  private val all     = Reg(Bool())      // to everybody, as far as is known
  private val answers = RegInit(false.B) // reset: nothing asked
  private val sent    = Reg(UInt(6.W))

  // What a request must have from byte 12 on: type; Ethernet, IPv4, lengths, request.
  private val fixed = Seq(0x08, 0x06, 0x00, 0x01, 0x08, 0x00, 0x06, 0x04, 0x00, 0x01)
  when(byte.valid && !answers) {
    when(first) {
      wrong := false.B
      all   := true.B
    }
    when(at < 6.U && !byte.bits.andR) { all := false.B }
    for ((b, i) <- fixed.zipWithIndex) when(at === (12 + i).U && byte.bits =/= b.U) { wrong := true.B }
    when(at >= 38.U && at < Bytes.U && !same) { wrong := true.B }
  }
  when(answers) { wrong := true.B } // a frame that begins meanwhile is not looked at
  when(end.valid && !answers) {
    answers := end.bits && !wrong && (all || mine) && at >= (Bytes + 4).U
    sent    := 0.U
  }

  note.valid  := byte.valid && !answers && at >= 22.U && at < 32.U
  note.bits   := byte.bits
  noteAddress := at

  // The answer: the asker's MAC address, ours, type and kind, our addresses, the asker's.
  private val kind      = "h0806_0001_0800_0604_0002".U(80.W)
  private val kindBytes = VecInit((9 to 0 by -1).map(i => Lanes.byte(kind, i)))
  private val isAsker   = sent < 6.U || sent >= 32.U
  private val isKind    = sent >= 12.U && sent < 22.U
  private val age       = Reg(UInt(2.W)) // cycles since `sent` has changed, up to 2
  private val reply     = Reg(UInt(8.W))
  readAddress     := sent - 10.U // 0 to 5 comes to 22 to 27, modulo 32, like 32 to 37
  settingAddress  := sent(3, 0)  // 6 to 11, and 22 to 31 to 6 to 15
  wants           := answers
  age             := Mux(bytes.fire || !answers || !granted, 0.U, Mux(age === 2.U, age, age + 1.U))
  bytes.valid     := age === 2.U
  bytes.bits.data := reply
  bytes.bits.last := sent === (Bytes - 1).U
  reply           := Mux(isAsker, asker, Mux(isKind, kindBytes((sent - 12.U)(3, 0)), setting))
  when(bytes.fire) {
    sent := sent + 1.U
    when(bytes.bits.last) { answers := false.B }
  }
}
