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
