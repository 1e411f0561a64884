package flyframe.master

import chisel3._
import chisel3.util._
import flyframe.memory.DualPortRam
import flyframe.protocol.ServerDatagram

/** What comes from the server: acknowledgements of reports, and messages for the host, which waits in a
  * mailbox (SRV-01 to SRV-03, docs/rules/alarm.md). Whatever is malformed, too long, from elsewhere or for
  * another master is refused.
  */
class ServerLink extends Module {
  import ServerLink._

  /** From [[UdpReceiver]]. */
  val data     = IO(Flipped(Valid(UInt(8.W))))
  val offset   = IO(Input(UInt(11.W)))
  val received = IO(Flipped(Valid(new UdpReceived)))

  val master = IO(Input(UInt(16.W))) // ID
  val boot   = IO(Input(UInt(16.W)))

  /** The server has all events before this number. */
  val acknowledge = IO(Output(Valid(UInt(32.W))))

  /** A message waits: its bytes, header included, until the host takes it. */
  val waiting     = IO(Output(Bool()))
  val length      = IO(Output(UInt(9.W)))
  val take        = IO(Input(Bool()))
  val readAddress = IO(Input(UInt(8.W)))
  val readData    = IO(Output(UInt(8.W))) // a cycle later

  /** A datagram was refused; a message was dropped, as another one waits. */
  val refused = IO(Output(Bool()))
  val dropped = IO(Output(Bool()))

  private val full = RegInit(false.B) // reset: no message
  private val size = Reg(UInt(9.W))

  // Whether a datagram has found the mailbox taken is decided by its first byte: else half of it could be kept.
  private val late    = Reg(Bool())
  private val blocked = Mux(offset === 0.U, full, late)
  when(data.valid) { late := blocked }
  private val ram = DualPortRam(MailboxBytes, 8)(clock)
  ram.io.write        := data.valid && !blocked && offset < MailboxBytes.U
  ram.io.writeAddress := offset(7, 0)
  ram.io.writeData    := data.bits
  ram.io.readAddress  := readAddress
  readData            := ram.io.readData
  waiting             := full
  length              := size

  // The header as it comes; of a datagram that is too short some of this is of the one before.
  private val wrong            = Reg(Bool()) // not from such a server, or for another master
  private val earlier          = Reg(Bool()) // of an earlier life
  private val isAcknowledge    = Reg(Bool())
  private val isReport         = Reg(Bool())
  private val number           = Reg(UInt(32.W))
  private def on(n: Int): Bool = offset === n.U
  private val right = MuxLookup(
    offset(2, 0),
    ServerDatagram.Version.U(8.W)
  )(
    Seq(
      0.U -> (ServerDatagram.Magic >> 8).U(8.W),
      1.U -> (ServerDatagram.Magic & 0xff).U(8.W),
      4.U -> master(15, 8),
      5.U -> master(7, 0),
      6.U -> boot(15, 8),
      7.U -> boot(7, 0)
    )
  )
  when(data.valid) {
    val differs = data.bits =/= right
    when(on(0)) {
      wrong   := differs
      earlier := false.B
    }
    when(differs && (on(1) || on(2) || on(4) || on(5))) { wrong := true.B }
    when(differs && (on(6) || on(7))) { earlier := true.B }
    when(on(3)) {
      isAcknowledge := data.bits === ServerDatagram.KindAcknowledge.U
      isReport      := data.bits === ServerDatagram.KindReport.U
    }
    when(offset >= 8.U && offset < HeaderBytes.U) { number := Cat(number(23, 0), data.bits) }
  }

  private val bits         = received.bits
  private val isOurs       = bits.good && bits.fromServer && bits.length >= HeaderBytes.U && !wrong
  private val acknowledges = isOurs && isAcknowledge && bits.length === HeaderBytes.U && !earlier
  private val isMessage    = isOurs && !isAcknowledge && !isReport && bits.length <= MailboxBytes.U

  acknowledge.valid := received.valid && acknowledges
  acknowledge.bits  := number
  refused           := received.valid && !acknowledges && !isMessage
  dropped           := received.valid && isMessage && late
  when(take) { full := false.B }
  when(received.valid && isMessage && !late) {
    full := true.B
    size := bits.length
  }
}

object ServerLink {

  /** Bytes of a message, at most. */
  val MailboxBytes = 256

  /** What every datagram of the server begins with: magic, version, kind, master ID, boot number, a number.
    */
  val HeaderBytes = 12
}
