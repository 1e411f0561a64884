package flyframe.master

import flyframe.protocol._

/** A report, taken apart and found right. */
final case class Report(
    counter: Long,
    first: Long,
    time: Long,
    server: Long,
    fields: Map[String, Long],
    slaves: Seq[Seq[Int]],
    events: Seq[Seq[Int]]
)

/** What master and server agree on, and the server's side of it, without any RTL. */
object PlantServer {
  val Key: Seq[Int]    = Seq.tabulate(16)(i => i * 29 + 7 & 0xff)
  val MasterLife: Long = 0x8123456789abcdefL
  val MasterId: Int    = 0xbeef
  val SelfTest: Int    = 0x5a

  private def bytes(layout: Layout, values: (Layout.Field, Long)*): Seq[Int] =
    layout.encode(values: _*).toSeq.map(_ & 0xff)

  private def nonce(life: Long, origin: Int, counter: Long) = bytes(
    NonceLayout,
    NonceLayout.Life    -> life,
    NonceLayout.Origin  -> origin.toLong,
    NonceLayout.Counter -> counter
  )

  /** Takes a report apart; everything in it that can be wrong by itself is checked. */
  def read(payload: Seq[Int]): Report = {
    val data                             = payload.map(_.toByte).toArray
    def field(f: Layout.Field)           = ReportLayout.read(data, f)
    def expect(f: Layout.Field, v: Long) = require(field(f) == v, s"${f.name} is ${field(f)} but must be $v.")
    expect(ReportLayout.Magic, ServerDatagram.Magic)
    expect(ReportLayout.Version, ServerDatagram.Version)
    expect(ReportLayout.Kind, ServerDatagram.KindReport)
    expect(ReportLayout.Master, MasterId)
    expect(ReportLayout.Zero, 0)
    expect(ReportLayout.Life, MasterLife)
    expect(ReportLayout.SelfTest, SelfTest)
    expect(ReportLayout.Spare, 0)
    val (slaves, events) = (field(ReportLayout.Slaves).toInt, field(ReportLayout.Count).toInt)
    val states           = ReportLayout.bytes
    val firstEvent       = states + slaves * ReportedSlaveLayout.bytes
    val end              = firstEvent + events * EventLayout.bytes
    require(payload.size == end + ReportEndLayout.bytes && payload.size <= 1472, s"${payload.size} bytes")
    require(payload.slice(end, end + 16).forall(_ == 0), "the rest is not 0")
    val tag = AsconModel.tag(
      Key,
      nonce(MasterLife, ServerDatagram.OfMaster, field(ReportLayout.Counter)),
      payload.take(end)
    )
    require(payload.slice(end + 16, end + 32) == tag, "the tag is wrong")
    Report(
      field(ReportLayout.Counter),
      field(ReportLayout.Number),
      field(ReportLayout.Time),
      field(ReportLayout.Server),
      Seq(
        ReportLayout.Status,
        ReportLayout.Lost,
        ReportLayout.Present,
        ReportLayout.Cut,
        ReportLayout.Refused
      )
        .map(f => f.name -> field(f))
        .toMap,
      payload.slice(states, firstEvent).grouped(ReportedSlaveLayout.bytes).toSeq,
      payload.slice(firstEvent, end).grouped(EventLayout.bytes).toSeq
    )
  }

  /** An answer with its tag. */
  def answer(
      server: Long,
      turn: Long,
      echo: Long,
      number: Long,
      ticket: Long = 0,
      order: Int = Order.None
  ): Seq[Int] = {
    val message = bytes(
      AnswerLayout,
      AnswerLayout.Magic   -> ServerDatagram.Magic.toLong,
      AnswerLayout.Version -> ServerDatagram.Version.toLong,
      AnswerLayout.Kind    -> ServerDatagram.KindAnswer.toLong,
      AnswerLayout.Master  -> MasterId.toLong,
      AnswerLayout.Life    -> MasterLife,
      AnswerLayout.Server  -> server,
      AnswerLayout.Turn    -> turn,
      AnswerLayout.Echo    -> echo,
      AnswerLayout.Number  -> number,
      AnswerLayout.Ticket  -> ticket,
      AnswerLayout.Order   -> order.toLong
    ).take(AnswerLayout.Tag.offset)
    message ++ AsconModel.tag(Key, nonce(server, ServerDatagram.OfServer, turn), message)
  }
}
