package flyframe.master

import java.nio.ByteBuffer

/** An event as a report tells it (REP-01), with the boot of the master and its number there. */
final case class ReportedEvent(
    boot: Int,
    number: Long,
    kind: Int,
    position: Int,
    node: Int,
    sequence: Int,
    state: Int,
    epoch: Int
)

/** The server of one master: keeps each event of its reports once, and acknowledges them. */
class ServerModel(master: Int) {

  /** It does not hear. */
  var down = false

  /** All events in the order in which it learned of them. */
  var log: Vector[ReportedEvent] = Vector.empty
  private var next               = Map.empty[Int, Long].withDefaultValue(0L)

  /** Reports heard, among them heartbeats. */
  var reports = 0

  /** A datagram of the master; what is sent back. */
  def receive(datagram: Array[Byte]): Option[Array[Byte]] = if (down) None
  else {
    val events = parse(datagram)
    reports += 1
    val boot = ByteBuffer.wrap(datagram).getShort(6) & 0xffff
    events.headOption.foreach(e => require(e.number <= next(boot), s"events before ${e.number} are missing"))
    for (e <- events if e.number == next(boot)) {
      log :+= e
      next += boot -> (e.number + 1)
    }
    Some(
      ByteBuffer
        .allocate(12)
        .putShort(0x4641.toShort)
        .put(1.toByte)
        .put(2.toByte)
        .putShort(master.toShort)
        .putShort(boot.toShort)
        .putInt(next(boot).toInt)
        .array
    )
  }

  /** The events of a report. */
  def parse(datagram: Array[Byte]): Seq[ReportedEvent] = {
    val b     = ByteBuffer.wrap(datagram)
    def u8()  = b.get & 0xff
    def u16() = b.getShort & 0xffff
    def u32() = b.getInt & 0xffffffffL
    require((u16(), u8(), u8(), u16()) == ((0x4641, 1, 1, master)), "no report")
    val boot  = u16()
    val first = u32()
    val count = u8()
    b.position(24)
    val events = Seq.tabulate(count) { i =>
      val e = ReportedEvent(boot, first + i, u8(), u8(), u16(), u16(), u8(), u8())
      b.getLong // slave time, master time
      e
    }
    require(!b.hasRemaining, "report too long")
    events
  }
}

/** UDP over IPv4 over Ethernet, without FCS. */
object UdpFrame {
  private def checksum(bytes: Seq[Int]): Int = {
    val sum = bytes.padTo(bytes.size + bytes.size % 2, 0).grouped(2).map(p => p(0) << 8 | p(1)).sum
    ~((sum & 0xffff) + (sum >> 16) + ((sum & 0xffff) + (sum >> 16) >> 16)) & 0xffff
  }
  private def big(v: Int) = Seq(v >> 8 & 0xff, v & 0xff)

  def apply(mac: Seq[Int], ip: Seq[Int], port: Int, fromIp: Seq[Int], fromPort: Int, data: Seq[Int]): Seq[Int] = {
    val head = Seq(0x45, 0) ++ big(28 + data.size) ++ Seq(0, 0, 0x40, 0, 64, 17, 0, 0) ++ fromIp ++ ip
    val sum  = checksum(head)
    val udp  = big(fromPort) ++ big(port) ++ big(8 + data.size)
    val udpSum = checksum(fromIp ++ ip ++ Seq(0, 17) ++ big(8 + data.size) ++ udp ++ Seq(0, 0) ++ data)
    (mac ++ Seq(2, 0, 0, 0, 0, 1) ++ Seq(8, 0) ++ head.patch(10, big(sum), 2) ++ udp ++ big(udpSum) ++ data)
      .padTo(60, 0)
  }

  /** The data of such a frame. */
  def data(frame: Seq[Int]): Seq[Int] = frame.slice(42, 42 + (frame(38) << 8 | frame(39)) - 8)
}
