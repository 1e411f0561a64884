package flyframe.master

import flyframe.protocol._

/** An event as a report tells it (REP-01), with the life of the master and its number there. */
final case class ReportedEvent(
    life: Long,
    number: Long,
    kind: Int,
    position: Int,
    node: Int,
    sequence: Int,
    state: Int,
    epoch: Int,
    slaveTime: Long,
    masterTime: Long
)

/** A report, its tag checked.
  *
  * @param slaves
  *   status word and node ID by position
  */
final case class SeenReport(
    life: Long,
    server: Long,
    counter: Long,
    status: Int,
    time: Long,
    lost: Long,
    present: Int,
    selfTest: Int,
    cut: Int,
    refused: Int,
    slaves: Seq[(Int, Int)],
    events: Seq[ReportedEvent]
)

/** The server of one master: keeps each event of its reports once, and answers each of them. */
class ServerModel(master: Int, key: Seq[Int] = ServerModel.Key) {
  import ServerModel._

  /** It does not hear. It is in trouble: it answers, but stores nothing. */
  var down    = false
  var trouble = false

  /** Another start of it: it has another life. */
  var life: Long = 0x5eed0001L

  /** All events in the order in which it learned of them. */
  var log: Vector[ReportedEvent] = Vector.empty
  private var next               = Map.empty[Long, Long].withDefaultValue(0L)

  /** All reports heard, among them heartbeats. */
  var reports: Vector[SeenReport] = Vector.empty
  def last: SeenReport            = reports.last

  private var turn   = 0
  private var ticket = 1000L
  private var order  = Option.empty[(Int, Int, Int)]

  /** An order, which stands in every answer from now on. */
  def command(order: Int, node: Int = ServerDatagram.AllNodes, seconds: Int = 0): Unit = {
    ticket += 1
    this.order = Some((order, node, seconds))
  }
  def noCommand(): Unit = order = None

  /** A datagram of the master; what is sent back. */
  def receive(datagram: Array[Byte]): Option[Array[Byte]] = if (down) None
  else {
    val report = parse(datagram)
    reports :+= report
    val proven = report.server == life
    if (proven && !trouble) {
      report.events.headOption.foreach(e =>
        require(e.number <= next(report.life), s"events before ${e.number} are missing")
      )
      for (e <- report.events if e.number == next(report.life)) {
        log :+= e
        next += report.life -> (e.number + 1)
      }
    }
    val number = if (proven) next(report.life) else report.events.headOption.fold(0L)(_.number)
    Some(answer(report, number))
  }

  private def answer(report: SeenReport, number: Long): Array[Byte] = {
    turn += 1
    val (code, node, seconds) = order.getOrElse((Order.None, 0, 0))
    val message = AnswerLayout
      .encode(
        AnswerLayout.Magic   -> ServerDatagram.Magic.toLong,
        AnswerLayout.Version -> ServerDatagram.Version.toLong,
        AnswerLayout.Kind    -> ServerDatagram.KindAnswer.toLong,
        AnswerLayout.Master  -> master.toLong,
        AnswerLayout.Life    -> report.life,
        AnswerLayout.Server  -> life,
        AnswerLayout.Turn    -> turn.toLong,
        AnswerLayout.Echo    -> report.counter,
        AnswerLayout.Number  -> number,
        AnswerLayout.Ticket  -> ticket,
        AnswerLayout.Order   -> code.toLong,
        AnswerLayout.Trouble -> (if (trouble) 1 else 0),
        AnswerLayout.Node    -> node.toLong,
        AnswerLayout.Seconds -> seconds.toLong
      )
      .take(AnswerLayout.Tag.offset)
    message ++ tag(key, life, ServerDatagram.OfServer, turn.toLong, message)
  }

  /** A report, which must be right in all its parts. */
  def parse(datagram: Array[Byte]): SeenReport = {
    import ReportLayout._
    def header(f: Layout.Field) = ReportLayout.read(datagram, f)
    val expected = Seq(ServerDatagram.Magic, ServerDatagram.Version, ServerDatagram.KindReport, master, 0)
    require(Seq(Magic, Version, Kind, Master, Zero).map(header) == expected.map(_.toLong), "no report")
    val (slaves, count) = (header(Slaves).toInt, header(Count).toInt)
    val states          = ReportLayout.bytes + slaves * ReportedSlaveLayout.bytes
    val end             = states + count * EventLayout.bytes
    require(datagram.length == end + ReportEndLayout.bytes, "length of the report")
    val rest = datagram.slice(end, end + ReportEndLayout.Rest.bytes)
    require(rest.forall(_ == 0), "the rest is not 0")
    val made = tag(key, header(Life), ServerDatagram.OfMaster, header(Counter), datagram.take(end))
    val came = datagram.slice(end + ReportEndLayout.Tag.offset, end + ReportEndLayout.Tag.end)
    require(made.sameElements(came), "the tag is wrong")
    SeenReport(
      header(Life),
      header(Server),
      header(Counter),
      header(Status).toInt,
      header(Time),
      header(Lost),
      header(Present).toInt,
      header(SelfTest).toInt,
      header(Cut).toInt,
      header(Refused).toInt,
      Seq.tabulate(slaves) { i =>
        def field(f: Layout.Field) = ReportedSlaveLayout
          .read(datagram, f, ReportLayout.bytes + i * ReportedSlaveLayout.bytes)
          .toInt
        (field(ReportedSlaveLayout.Status), field(ReportedSlaveLayout.Node))
      },
      Seq.tabulate(count) { i =>
        def field(f: Layout.Field) = EventLayout.read(datagram, f, states + i * EventLayout.bytes)
        ReportedEvent(
          header(Life),
          header(Number) + i,
          field(EventLayout.Kind).toInt,
          field(EventLayout.Position).toInt,
          field(EventLayout.Node).toInt,
          field(EventLayout.Sequence).toInt,
          field(EventLayout.State).toInt,
          field(EventLayout.Epoch).toInt,
          field(EventLayout.SlaveTime),
          field(EventLayout.MasterTime)
        )
      }
    )
  }
}

object ServerModel {
  val Key: Seq[Int] = (0 until 16).map(i => 0x51 + 7 * i & 0xff)

  /** The tag of a message by its sender's life and counter. */
  def tag(key: Seq[Int], life: Long, origin: Int, counter: Long, message: Array[Byte]): Array[Byte] = {
    val nonce = NonceLayout.encode(
      NonceLayout.Life    -> life,
      NonceLayout.Origin  -> origin.toLong,
      NonceLayout.Counter -> counter
    )
    def bytes(b: Array[Byte]) = b.toSeq.map(_ & 0xff)
    AsconModel.tag(key, bytes(nonce), bytes(message)).map(_.toByte).toArray
  }
}
