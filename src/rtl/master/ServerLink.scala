package flyframe.master

import chisel3._
import chisel3.util._
import flyframe.memory.DualPortRam
import flyframe.protocol.{AcknowledgementLayout, ServerDatagram}
import flyframe.protocol.AcknowledgementLayout.{Boot, Kind, Magic, Master, Number, Version}

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

  /** A message waits, of `length` bytes with its header, until the host says `take`. */
  val waiting     = IO(Output(Bool()))
  val length      = IO(Output(UInt(9.W)))
  val take        = IO(Input(Bool()))
  val readAddress = IO(Input(UInt(8.W)))
  val readData    = IO(Output(UInt(8.W))) // a cycle later

  /** A datagram was refused. A message was dropped, as another one waits for the host. */
  val refused = IO(Output(Bool()))
  val dropped = IO(Output(Bool()))

  private val full = RegInit(false.B) // reset: no message
  private val size = Reg(UInt(9.W))

  // Whether a datagram has found the mailbox taken is decided by its first byte: else half of it could be
  // kept.
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
      Magic.offset.U  -> (ServerDatagram.Magic >> 8).U(8.W),
      Magic.last.U    -> (ServerDatagram.Magic & 0xff).U(8.W),
      Master.offset.U -> master(15, 8),
      Master.last.U   -> master(7, 0),
      Boot.offset.U   -> boot(15, 8),
      Boot.last.U     -> boot(7, 0)
    )
  )
  when(data.valid) {
    val differs = data.bits =/= right
    when(on(Magic.offset)) {
      wrong   := differs
      earlier := false.B
    }
    when(differs && (on(Magic.last) || on(Version.offset) || on(Master.offset) || on(Master.last))) {
      wrong := true.B
    }
    when(differs && (on(Boot.offset) || on(Boot.last))) { earlier := true.B }
    when(on(Kind.offset)) {
      isAcknowledge := data.bits === ServerDatagram.KindAcknowledge.U
      isReport      := data.bits === ServerDatagram.KindReport.U
    }
    when(offset >= Number.offset.U && offset < Number.end.U) { number := Cat(number(23, 0), data.bits) }
  }

  private val bits   = received.bits
  private val isOurs = bits.good && bits.fromServer && bits.length >= AcknowledgementLayout.bytes.U && !wrong
  private val acknowledges =
    isOurs && isAcknowledge && bits.length === AcknowledgementLayout.bytes.U && !earlier
  private val isMessage = isOurs && !isAcknowledge && !isReport && bits.length <= MailboxBytes.U

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
}
