package flyframe.server

import java.security.MessageDigest
import java.util.Arrays
import javax.crypto.Mac
import javax.crypto.spec.SecretKeySpec
import flyframe.protocol.{
  AcknowledgementLayout,
  CommandLayout,
  EventLayout,
  HeadedLayout,
  Layout,
  ReportLayout
}
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
  val MostReportBytes = ReportLayout.bytes + Most * EventLayout.bytes

  /** Numbers of events end here. */
  val Numbers = 1L << 32

  /** A report, if `datagram` is a whole and right one. */
  def report(datagram: Array[Byte]): Option[Report] =
    head(ReportLayout, datagram, KindReport).flatMap { case (life, first) =>
      def field(f: Layout.Field): Int = ReportLayout.read(datagram, f).toInt
      val count                       = field(ReportLayout.Count)
      val isWhole                     = datagram.length == ReportLayout.bytes + count * EventLayout.bytes
      Option.when(count <= Most && isWhole && first + count < Numbers)(
        Report(
          life,
          first,
          Vector.tabulate(count)(i => event(datagram, ReportLayout.bytes + i * EventLayout.bytes)),
          field(ReportLayout.SelfTest),
          field(ReportLayout.Present),
          field(ReportLayout.Known),
          ReportLayout.read(datagram, ReportLayout.Time),
          ReportLayout.read(datagram, ReportLayout.Lost)
        )
      )
    }

  private def event(report: Array[Byte], start: Int): Event = {
    def field(f: Layout.Field): Int = EventLayout.read(report, f, start).toInt
    Event(
      field(EventLayout.Kind),
      field(EventLayout.Position),
      field(EventLayout.Node),
      field(EventLayout.Sequence),
      field(EventLayout.State),
      field(EventLayout.Epoch),
      EventLayout.read(report, EventLayout.SlaveTime, start),
      EventLayout.read(report, EventLayout.MasterTime, start)
    )
  }

  /** As a master sends it. */
  def encode(r: Report): Array[Byte] =
    ReportLayout.encode(
      begin(ReportLayout, KindReport, r.life, r.first) ++ Seq(
        ReportLayout.Count    -> r.events.size.toLong,
        ReportLayout.SelfTest -> r.selfTest.toLong,
        ReportLayout.Present  -> r.present.toLong,
        ReportLayout.Known    -> r.known.toLong,
        ReportLayout.Time     -> r.time,
        ReportLayout.Lost     -> r.lost
      ): _*
    ) ++ r.events.flatMap(e =>
      EventLayout.encode(
        EventLayout.Kind       -> e.kind.toLong,
        EventLayout.Position   -> e.position.toLong,
        EventLayout.Node       -> e.node.toLong,
        EventLayout.Sequence   -> e.sequence.toLong,
        EventLayout.State      -> e.state.toLong,
        EventLayout.Epoch      -> e.epoch.toLong,
        EventLayout.SlaveTime  -> e.slaveTime,
        EventLayout.MasterTime -> e.masterTime
      )
    )

  /** All events before `next` are stored (SRV-01). */
  def acknowledgement(life: Life, next: Long): Array[Byte] =
    AcknowledgementLayout.encode(begin(AcknowledgementLayout, KindAcknowledge, life, next): _*)

  /** Life and number of an acknowledgement. */
  def acknowledged(datagram: Array[Byte]): Option[(Life, Long)] =
    head(AcknowledgementLayout, datagram, KindAcknowledge).filter(_ =>
      datagram.length == AcknowledgementLayout.bytes
    )

  /** A command with the code that proves it, made with the shared `key`. */
  def encode(c: Command, key: Array[Byte]): Array[Byte] = {
    val datagram = CommandLayout.encode(
      begin(CommandLayout, KindCommand, c.life, c.counter) ++ Seq(
        CommandLayout.Order -> c.code.toLong,
        CommandLayout.Node  -> c.node.toLong
      ): _*
    )
    datagram.patch(CommandLayout.Code.offset, code(datagram, key), CommandLayout.Code.bytes)
  }

  /** A command, if its code is right: what a master's host does. */
  def command(datagram: Array[Byte], key: Array[Byte]): Option[Command] =
    head(CommandLayout, datagram, KindCommand).collect {
      case (life, counter)
          if datagram.length == CommandLayout.bytes &&
            MessageDigest.isEqual(datagram.drop(CommandLayout.Code.offset), code(datagram, key)) =>
        def field(f: Layout.Field): Int = CommandLayout.read(datagram, f).toInt
        Command(life, counter, field(CommandLayout.Order), field(CommandLayout.Node))
    }

  /** What a datagram begins with, for [[Layout.encode]]. */
  private def begin(layout: HeadedLayout, kind: Int, life: Life, number: Long): Seq[(Layout.Field, Long)] =
    Seq(
      layout.Magic   -> Magic.toLong,
      layout.Version -> Version.toLong,
      layout.Kind    -> kind.toLong,
      layout.Master  -> life.master.toLong,
      layout.Boot    -> life.boot.toLong,
      layout.Number  -> number
    )

  /** Life and number of a datagram that is of this kind and not too short for it. */
  private def head(layout: HeadedLayout, datagram: Array[Byte], kind: Int): Option[(Life, Long)] =
    Option
      .when(datagram.length >= layout.bytes) {
        def field(f: Layout.Field): Int = layout.read(datagram, f).toInt
        Option.when(
          field(layout.Magic) == Magic && field(layout.Version) == Version && field(layout.Kind) == kind
        )((Life(field(layout.Master), field(layout.Boot)), layout.read(datagram, layout.Number)))
      }
      .flatten

  private def code(datagram: Array[Byte], key: Array[Byte]): Array[Byte] = {
    val mac = Mac.getInstance("HmacSHA256")
    mac.init(new SecretKeySpec(key, "HmacSHA256"))
    Arrays.copyOf(mac.doFinal(Arrays.copyOf(datagram, CommandLayout.Code.offset)), CommandLayout.Code.bytes)
  }
}
