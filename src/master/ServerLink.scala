package flyframe.master

import chisel3._
import chisel3.util._
import flyframe.memory.DualPortRam

/** What comes from the server: acknowledgements of reports, and messages for the host, which waits in a
  * mailbox (SRV-01 to SRV-04, docs/behaviour.md). Whatever is malformed, too long, from elsewhere or for
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
  private val ram  = DualPortRam(MailboxBytes, 8)(clock)
  ram.io.write        := data.valid && !full && offset < MailboxBytes.U
  ram.io.writeAddress := offset(7, 0)
  ram.io.writeData    := data.bits
  ram.io.readAddress  := readAddress
  readData            := ram.io.readData
  waiting             := full
  length              := size

  // The first bytes; of a shorter datagram some are those of the one before.
  private val header = Reg(UInt((8 * HeaderBytes).W))
  when(data.valid && offset < HeaderBytes.U) { header := Cat(header(8 * HeaderBytes - 9, 0), data.bits) }
  private def field(first: Int, bytes: Int): UInt =
    header(8 * (HeaderBytes - first) - 1, 8 * (HeaderBytes - first - bytes))

  private val bits = received.bits
  private val kind = field(3, 1)
  private val isOurs = bits.good && bits.fromServer && bits.length >= HeaderBytes.U &&
    field(0, 2) === EventReporter.Magic.U && field(2, 1) === EventReporter.Version.U && field(4, 2) === master
  private val isAcknowledgement = kind === EventReporter.KindAcknowledge.U
  private val acknowledges =
    isOurs && isAcknowledgement && bits.length === HeaderBytes.U && field(6, 2) === boot
  private val isMessage = isOurs && !isAcknowledgement && kind =/= EventReporter.KindReport.U &&
    bits.length <= MailboxBytes.U

  acknowledge.valid := received.valid && acknowledges
  acknowledge.bits  := field(8, 4)
  refused           := received.valid && !acknowledges && !isMessage
  dropped           := received.valid && isMessage && full
  when(take) { full := false.B }
  when(received.valid && isMessage && !full) {
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
