package flyframe.ethernet

import chisel3._
import chisel3.util._
import flyframe.registers.NetworkAddresses

/** Makes a frame with a UDP datagram over IPv4 to the server (GW-04), a byte every third cycle at most. It
  * makes the bytes three times: for the sum of IP, for that of UDP, and for the wire.
  */
class UdpSender extends Module {
  import UdpSender._

  /** Pulse: a datagram with so many bytes of payload, up to [[UdpSender.MostPayload]], is to be sent. */
  val go     = IO(Input(Bool()))
  val length = IO(Input(UInt(11.W)))
  val busy   = IO(Output(Bool()))

  /** It needs the settings, and is granted them until it is not busy any more. */
  val granted = IO(Input(Bool()))

  /** The address of a setting behind the first address of the network, and of a byte of the payload; the byte
    * comes a cycle later.
    */
  val settingAddress = IO(Output(UInt(NetworkSettings.NetworkBits.W)))
  val setting        = IO(Input(UInt(8.W)))
  val payloadAddress = IO(Output(UInt(11.W)))
  val payload        = IO(Input(UInt(8.W)))

  /** The frame without FCS. */
  val bytes = IO(Decoupled(new FrameByte))

  private object Pass extends ChiselEnum { val idle, ip, udp, wire = Value }
  private val pass = RegInit(Pass.idle) // reset: nothing to send
  private val at   = Reg(UInt(11.W))    // byte of the frame
  private val age  = Reg(UInt(2.W))     // cycles since it has changed, up to 2
  private val byte = Reg(UInt(8.W))
  private val sum  = Reg(new InternetSum)
  private val ip   = Reg(UInt(16.W))    // the checksums
  private val udp  = Reg(UInt(16.W))
  private val size = Reg(UInt(11.W))
  busy := pass =/= Pass.idle

  private val isWire           = pass === Pass.wire
  private val ofUdp            = size +& UdpBytes.U // with its header
  private val ofIp             = ofUdp + IpBytes.U
  private val end              = size + HeaderBytes.U
  private def on(n: Int)       = at === n.U
  private def high(word: UInt) = word.pad(16)(15, 8)

  // Behind what is summed are zeros: they fold the last carry. A checksum is 0 while it is made.
  private val isZero = !isWire && Mux(pass === Pass.ip, at >= IpEnd.U, at >= end)
  private val fixed = Seq(12 -> 0x08, 14 -> 0x45, 20 -> 0x40, 22 -> 0x40, 23 -> Protocol).map { case (n, b) =>
    on(n) -> b.U(8.W)
  }
  private val isSetting = at < MacEnd.U || (at >= AddressStart.U && at < AddressEnd.U)
  private val isPayload = at >= HeaderBytes.U
  private val made = Mux1H(
    Seq(
      on(16)             -> high(ofIp),
      on(17)             -> ofIp(7, 0),
      (on(24) && isWire) -> ip(15, 8),
      (on(25) && isWire) -> ip(7, 0),
      isSetting          -> setting,
      on(38)             -> high(ofUdp),
      on(39)             -> ofUdp(7, 0),
      (on(40) && isWire) -> udp(15, 8),
      (on(41) && isWire) -> udp(7, 0),
      isPayload          -> payload
    ) ++ fixed
  )
  byte := Mux(isZero, 0.U, made)

  // Addresses stand in the header as in the settings, in two pieces.
  settingAddress := at - Mux(at < MacEnd.U, 0.U, (AddressStart - MacEnd).U)
  payloadAddress := at - HeaderBytes.U

  private val ready = age === 2.U
  private val fires = ready && (!isWire || bytes.ready)
  bytes.valid     := ready && isWire
  bytes.bits.data := byte
  bytes.bits.last := at === end - 1.U

  // An even number of bytes is summed, two of them zeros: the high byte of the sum comes next.
  private val last = MuxLookup(pass, end - 1.U)(
    Seq(Pass.ip -> (IpEnd + 1).U, Pass.udp -> (end + 1.U + size(0)))
  )
  private val next   = sum.plus(byte)
  private val made16 = ~Cat(next.next, next.other)
  age := Mux(fires || !busy || !granted, 0.U, Mux(ready, age, age + 1.U))
  when(fires) {
    at  := at + 1.U
    sum := next
    when(at === last) {
      switch(pass) {
        is(Pass.ip) {
          pass := Pass.udp
          at   := AddressStart.U
          ip   := made16
          // The pseudo header has protocol and length beside the addresses.
          sum := InternetSum((ofUdp + Protocol.U).pad(16)(15, 8), (ofUdp + Protocol.U)(7, 0), false.B)
        }
        is(Pass.udp) {
          pass := Pass.wire
          at   := 0.U
          udp  := Mux(made16 === 0.U, 0xffff.U, made16) // 0 would say that there is none
        }
        is(Pass.wire) { pass := Pass.idle }
      }
    }
  }
  when(go && !busy && length <= MostPayload.U) {
    pass := Pass.ip
    at   := IpStart.U
    sum  := InternetSum.of(0)
    size := length
  }
}

object UdpSender {

  /** Bytes of the longest payload. */
  val MostPayload = 1472

  private val Protocol = 17
  private val UdpBytes = 8
  private val IpBytes  = 20

  /** Where things are in a frame. */
  private val MacEnd       = 12
  private val IpStart      = 14
  private val AddressStart = 26
  private val IpEnd        = 34
  private val AddressEnd   = 38
  private val HeaderBytes  = 42

  require(
    NetworkAddresses.MasterIp == MacEnd,
    s"NetworkAddresses.MasterIp is ${NetworkAddresses.MasterIp} but must be $MacEnd."
  )
}
