package flyframe.server

import java.nio.ByteBuffer
import java.security.MessageDigest
import java.util.Arrays
import javax.crypto.Mac
import javax.crypto.spec.SecretKeySpec
import flyframe.protocol.ServerDatagram._

/** Something a master has to tell; the codes of [[flyframe.protocol.EventKind]] say what the fields mean.
  *
  * @param slaveTime
  *   microseconds, of the slave's clock
  * @param masterTime
  *   microseconds, of the master's clock, when it took the event
  */
final case class Event(
    kind: Int,
    position: Int = 0,
    node: Int = 0,
    sequence: Int = 0,
    state: Int = 0,
    epoch: Int = 0,
    slaveTime: Long = 0,
    masterTime: Long = 0
)

/** A master from one start to the next: its ID and boot number. Its events are numbered from 0. */
final case class Life(master: Int, boot: Int)

/** What a master reports (REP-01).
  *
  * @param first
  *   number of the first event
  * @param selfTest
  *   of the master: 0 not run, 1 good, else what failed
  * @param present
  *   slaves that answer
  * @param known
  *   slaves on the master's list
  * @param time
  *   of the master, in us
  * @param lost
  *   frames sent in vain
  */
final case class Report(
    life: Life,
    first: Long,
    events: Vector[Event] = Vector.empty,
    selfTest: Int = 1,
    present: Int = 0,
    known: Int = 0,
    time: Long = 0,
    lost: Long = 0
)

/** An order to a master's host (SRV-12).
  *
  * @param counter
  *   higher than that of every command before in this life
  * @param code
  *   [[ServerDatagram.AlarmClear]] or [[ServerDatagram.DetectorReset]]
  * @param node
  *   ID of a slave, or [[ServerDatagram.AllNodes]]
  */
final case class Command(life: Life, counter: Long, code: Int, node: Int)

/** The datagrams between master and server, big endian. */
object Protocol {

  /** Bytes of the longest report. */
  val MostReportBytes = HeaderBytes + Most * EventBytes

  /** Numbers of events end here. */
  val Numbers = 1L << 32

  private def u8(b: ByteBuffer): Int   = b.get() & 0xff
  private def u16(b: ByteBuffer): Int  = b.getShort() & 0xffff
  private def u32(b: ByteBuffer): Long = b.getInt() & 0xffffffffL

  /** A report, if `datagram` is a whole and right one. */
  def report(datagram: Array[Byte]): Option[Report] = Option
    .when(datagram.length >= HeaderBytes) {
      val b        = ByteBuffer.wrap(datagram)
      val isReport = u16(b) == Magic & u8(b) == Version & u8(b) == KindReport
      val life     = Life(u16(b), u16(b))
      val first    = u32(b)
      val count    = u8(b)
      val isWhole  = count <= Most && datagram.length == HeaderBytes + count * EventBytes
      Option.when(isReport && isWhole && first + count < Numbers) {
        val header = Report(life, first, Vector.empty, u8(b), u8(b), u8(b), u32(b), u32(b))
        header.copy(events = Vector.fill(count)(event(b)))
      }
    }
    .flatten

  private def event(b: ByteBuffer) =
    Event(u8(b), u8(b), u16(b), u16(b), u8(b), u8(b), u32(b), u32(b))

  /** As a master sends it. */
  def encode(r: Report): Array[Byte] = {
    val b = begin(HeaderBytes + r.events.size * EventBytes, KindReport, r.life, r.first)
    b.put(r.events.size.toByte).put(r.selfTest.toByte).put(r.present.toByte).put(r.known.toByte)
    b.putInt(r.time.toInt).putInt(r.lost.toInt)
    for (e <- r.events) {
      b.put(e.kind.toByte).put(e.position.toByte).putShort(e.node.toShort).putShort(e.sequence.toShort)
      b.put(e.state.toByte).put(e.epoch.toByte).putInt(e.slaveTime.toInt).putInt(e.masterTime.toInt)
    }
    b.array
  }

  /** All events before `next` are stored (SRV-01). */
  def acknowledgement(life: Life, next: Long): Array[Byte] =
    begin(AcknowledgementBytes, KindAcknowledge, life, next).array

  /** Life and number of an acknowledgement. */
  def acknowledged(datagram: Array[Byte]): Option[(Life, Long)] =
    Option.when(datagram.length == AcknowledgementBytes)(head(datagram, KindAcknowledge)).flatten

  /** A command with the code that proves it, made with the shared `key`. */
  def encode(c: Command, key: Array[Byte]): Array[Byte] = {
    val b = begin(CommandBytes, KindCommand, c.life, c.counter)
    b.put(c.code.toByte).put(0.toByte).putShort(c.node.toShort)
    b.put(code(b.array, key)).array
  }

  /** A command, if its code is right: what a master's host does. */
  def command(datagram: Array[Byte], key: Array[Byte]): Option[Command] =
    Option.when(datagram.length == CommandBytes)(head(datagram, KindCommand)).flatten.collect {
      case (life, counter) if MessageDigest.isEqual(datagram.drop(SignedBytes), code(datagram, key)) =>
        val b = ByteBuffer.wrap(datagram, AcknowledgementBytes, 4)
        Command(life, counter, u16(b) >> 8, u16(b))
    }

  private def begin(length: Int, kind: Int, life: Life, number: Long): ByteBuffer =
    ByteBuffer
      .allocate(length)
      .putShort(Magic.toShort)
      .put(Version.toByte)
      .put(kind.toByte)
      .putShort(life.master.toShort)
      .putShort(life.boot.toShort)
      .putInt(number.toInt)

  private def head(datagram: Array[Byte], kind: Int): Option[(Life, Long)] = {
    val b = ByteBuffer.wrap(datagram)
    Option.when(u16(b) == Magic & u8(b) == Version & u8(b) == kind)((Life(u16(b), u16(b)), u32(b)))
  }

  private def code(datagram: Array[Byte], key: Array[Byte]): Array[Byte] = {
    val mac = Mac.getInstance("HmacSHA256")
    mac.init(new SecretKeySpec(key, "HmacSHA256"))
    Arrays.copyOf(mac.doFinal(Arrays.copyOf(datagram, SignedBytes)), CommandBytes - SignedBytes)
  }
}
