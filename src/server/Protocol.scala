package flyframe.server

import java.security.MessageDigest
import flyframe.protocol.{
  AnswerLayout,
  EventLayout,
  HeadedLayout,
  Layout,
  NonceLayout,
  Order,
  ReportEndLayout,
  ReportLayout,
  ReportedSlaveLayout
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

/** A master from one start to the next: its ID and a random number of 64 bits. Its events are numbered from
  * 0.
  */
final case class Life(master: Int, number: Long) {

  /** The number, 16 hexadecimal digits. */
  def hex: String = f"$number%016x"
}

/** State of a slave in a report.
  *
  * @param status
  *   bits of [[flyframe.protocol.SlaveStatus]]
  * @param node
  *   its node ID, or the last one known
  */
final case class Reported(status: Int, node: Int) {

  /** An ordinary EtherCAT slave: it has never told a state. */
  def isOrdinary: Boolean = status == 0 && node == 0

  /** Some of these bits are 1. */
  def has(bits: Int): Boolean = (status & bits) != 0
}

/** What a master reports (REP-01).
  *
  * @param server
  *   life of the server as far as the master knows, or 0
  * @param counter
  *   of the reports of this life, from 1 on
  * @param first
  *   number of the first event
  * @param slaves
  *   by position, the first at the master
  * @param time
  *   of the master, us
  * @param status
  *   bits of [[flyframe.protocol.MasterStatus]]
  * @param lost
  *   frames sent in vain
  * @param present
  *   slaves that answer, also those that are not listed
  * @param selfTest
  *   of the master's host: 0 not run, 1 good, else what failed
  * @param cut
  *   position of the first slave behind the cut of a ring
  * @param refused
  *   datagrams that the master has refused, 255: as many or more
  */
final case class Report(
    life: Life,
    server: Long,
    counter: Long,
    first: Long,
    events: Vector[Event] = Vector.empty,
    slaves: Vector[Reported] = Vector.empty,
    time: Long = 0,
    status: Int = 0,
    lost: Long = 0,
    present: Int = 0,
    selfTest: Int = 1,
    cut: Int = 0,
    refused: Int = 0
) extends Sent {

  /** Number behind that of the last event. */
  def end: Long = first + events.size
}

/** What the server answers (SRV-01).
  *
  * @param server
  *   life of the server
  * @param turn
  *   of the answers of this life of the server, from 1 on
  * @param echo
  *   counter of the report
  * @param number
  *   of the next event wanted
  * @param ticket
  *   of the order; 0 if there is none
  * @param order
  *   one of [[flyframe.protocol.Order]]
  * @param node
  *   ID of a slave, or [[flyframe.protocol.ServerDatagram.AllNodes]]
  * @param seconds
  *   how long a detector is disabled or tested
  * @param trouble
  *   the server cannot write its log
  */
final case class Answer(
    life: Life,
    server: Long,
    turn: Long,
    echo: Long,
    number: Long,
    ticket: Long = 0,
    order: Int = Order.None,
    node: Int = 0,
    seconds: Int = 0,
    trouble: Boolean = false
)

/** The datagrams between master and server, big endian, and their tags. */
object Protocol {

  /** Bytes of the longest report. */
  val MostReportBytes: Int =
    ReportLayout.bytes + 255 * ReportedSlaveLayout.bytes + Most * EventLayout.bytes + ReportEndLayout.bytes

  /** Numbers of events end here. */
  val Numbers = 1L << 32

  /** Where the rest of a report begins; the tag covers what is before it. */
  private def bytesOf(slaves: Int, events: Int): Int =
    ReportLayout.bytes + slaves * ReportedSlaveLayout.bytes + events * EventLayout.bytes

  /** A report, if `datagram` is a whole one. Its tag is not looked at: see [[isRight]]. */
  def report(datagram: Array[Byte]): Option[Report] =
    Option
      .when(datagram.length >= ReportLayout.bytes && isOf(datagram, ReportLayout, KindReport)) {
        def field(f: Layout.Field): Long = ReportLayout.read(datagram, f)
        val (slaves, events)             = (field(ReportLayout.Slaves).toInt, field(ReportLayout.Count).toInt)
        val first                        = field(ReportLayout.Number)
        val isWhole                      = datagram.length == bytesOf(slaves, events) + ReportEndLayout.bytes
        Option.when(events <= Most && isWhole && first + events < Numbers)(
          Report(
            Life(field(ReportLayout.Master).toInt, field(ReportLayout.Life)),
            server = field(ReportLayout.Server),
            counter = field(ReportLayout.Counter),
            first = first,
            events = Vector.tabulate(events)(i => event(datagram, bytesOf(slaves, i))),
            slaves = Vector.tabulate(slaves)(i => reported(datagram, bytesOf(i, 0))),
            time = field(ReportLayout.Time),
            status = field(ReportLayout.Status).toInt,
            lost = field(ReportLayout.Lost),
            present = field(ReportLayout.Present).toInt,
            selfTest = field(ReportLayout.SelfTest).toInt,
            cut = field(ReportLayout.Cut).toInt,
            refused = field(ReportLayout.Refused).toInt
          )
        )
      }
      .flatten

  /** The tag of this report is right, made with the shared `key`. */
  def isRight(report: Report, datagram: Array[Byte], key: Array[Byte]): Boolean = {
    val (message, end) = datagram.splitAt(datagram.length - ReportEndLayout.bytes)
    val tag            = end.slice(ReportEndLayout.Tag.offset, ReportEndLayout.Tag.end)
    MessageDigest.isEqual(tag, AsconTag(key, nonce(report.life.number, OfMaster, report.counter), message))
  }

  private def reported(report: Array[Byte], start: Int): Reported = {
    def field(f: Layout.Field): Int = ReportedSlaveLayout.read(report, f, start).toInt
    Reported(field(ReportedSlaveLayout.Status), field(ReportedSlaveLayout.Node))
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

  /** As a master sends it, but for the balance of the UDP checksum, which is 0. */
  def encode(r: Report, key: Array[Byte]): Array[Byte] = {
    val head = ReportLayout.encode(
      begin(ReportLayout, KindReport, r.life, r.server) ++ Seq(
        ReportLayout.Counter  -> r.counter,
        ReportLayout.Number   -> r.first,
        ReportLayout.Time     -> r.time,
        ReportLayout.Status   -> r.status.toLong,
        ReportLayout.Lost     -> r.lost,
        ReportLayout.Count    -> r.events.size.toLong,
        ReportLayout.Slaves   -> r.slaves.size.toLong,
        ReportLayout.Present  -> r.present.toLong,
        ReportLayout.SelfTest -> r.selfTest.toLong,
        ReportLayout.Cut      -> r.cut.toLong,
        ReportLayout.Refused  -> r.refused.toLong
      ): _*
    )
    val slaves = r.slaves.flatMap(s =>
      ReportedSlaveLayout.encode(
        ReportedSlaveLayout.Status -> s.status.toLong,
        ReportedSlaveLayout.Node   -> s.node.toLong
      )
    )
    val events = r.events.flatMap(e =>
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
    val message = head ++ slaves ++ events
    val tag     = AsconTag(key, nonce(r.life.number, OfMaster, r.counter), message)
    message ++ new Array[Byte](ReportEndLayout.bytes).patch(ReportEndLayout.Tag.offset, tag, tag.length)
  }

  /** As the server sends it. */
  def encode(a: Answer, key: Array[Byte]): Array[Byte] = {
    val datagram = AnswerLayout.encode(
      begin(AnswerLayout, KindAnswer, a.life, a.server) ++ Seq(
        AnswerLayout.Turn    -> a.turn,
        AnswerLayout.Echo    -> a.echo,
        AnswerLayout.Number  -> a.number,
        AnswerLayout.Ticket  -> a.ticket,
        AnswerLayout.Order   -> a.order.toLong,
        AnswerLayout.Node    -> a.node.toLong,
        AnswerLayout.Seconds -> a.seconds.toLong,
        AnswerLayout.Trouble -> (if (a.trouble) 1L else 0L)
      ): _*
    )
    datagram.patch(AnswerLayout.Tag.offset, answerTag(datagram, a.server, a.turn, key), TagBytes)
  }

  /** An answer, if its tag is right: what a master does. */
  def answer(datagram: Array[Byte], key: Array[Byte]): Option[Answer] =
    Option
      .when(datagram.length == AnswerLayout.bytes && isOf(datagram, AnswerLayout, KindAnswer)) {
        def field(f: Layout.Field): Long = AnswerLayout.read(datagram, f)
        Answer(
          Life(field(AnswerLayout.Master).toInt, field(AnswerLayout.Life)),
          server = field(AnswerLayout.Server),
          turn = field(AnswerLayout.Turn),
          echo = field(AnswerLayout.Echo),
          number = field(AnswerLayout.Number),
          ticket = field(AnswerLayout.Ticket),
          order = field(AnswerLayout.Order).toInt,
          node = field(AnswerLayout.Node).toInt,
          seconds = field(AnswerLayout.Seconds).toInt,
          trouble = field(AnswerLayout.Trouble) != 0
        )
      }
      .filter(a =>
        MessageDigest.isEqual(
          datagram.drop(AnswerLayout.Tag.offset),
          answerTag(datagram, a.server, a.turn, key)
        )
      )

  private def answerTag(datagram: Array[Byte], server: Long, turn: Long, key: Array[Byte]): Array[Byte] =
    AsconTag(key, nonce(server, OfServer, turn), datagram.take(AnswerLayout.Tag.offset))

  private[server] def nonce(life: Long, origin: Int, counter: Long): Array[Byte] = NonceLayout.encode(
    NonceLayout.Life    -> life,
    NonceLayout.Origin  -> origin.toLong,
    NonceLayout.Counter -> counter
  )

  /** What a datagram begins with, for [[Layout.encode]]. */
  private[server] def begin(
      layout: HeadedLayout,
      kind: Int,
      life: Life,
      server: Long
  ): Seq[(Layout.Field, Long)] =
    Seq(
      layout.Magic   -> Magic.toLong,
      layout.Version -> Version.toLong,
      layout.Kind    -> kind.toLong,
      layout.Master  -> life.master.toLong,
      layout.Life    -> life.number,
      layout.Server  -> server
    )

  private[server] def isOf(datagram: Array[Byte], layout: HeadedLayout, kind: Int): Boolean = {
    def field(f: Layout.Field): Int = layout.read(datagram, f).toInt
    field(layout.Magic) == Magic && field(layout.Version) == Version && field(layout.Kind) == kind
  }
}
