package flyframe.master

import flyframe.protocol.{AcknowledgementLayout, EventLayout, Layout, ReportLayout, ServerDatagram}

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
    val boot = ReportLayout.read(datagram, ReportLayout.Boot).toInt
    events.headOption.foreach(e => require(e.number <= next(boot), s"events before ${e.number} are missing"))
    for (e <- events if e.number == next(boot)) {
      log :+= e
      next += boot -> (e.number + 1)
    }
    Some(
      AcknowledgementLayout.encode(
        AcknowledgementLayout.Magic   -> ServerDatagram.Magic.toLong,
        AcknowledgementLayout.Version -> ServerDatagram.Version.toLong,
        AcknowledgementLayout.Kind    -> ServerDatagram.KindAcknowledge.toLong,
        AcknowledgementLayout.Master  -> master.toLong,
        AcknowledgementLayout.Boot    -> boot.toLong,
        AcknowledgementLayout.Number  -> next(boot)
      )
    )
  }

  /** The events of a report. */
  def parse(datagram: Array[Byte]): Seq[ReportedEvent] = {
    def header(f: Layout.Field) = ReportLayout.read(datagram, f)
    val expected = Seq(ServerDatagram.Magic, ServerDatagram.Version, ServerDatagram.KindReport, master)
    val came =
      Seq(ReportLayout.Magic, ReportLayout.Version, ReportLayout.Kind, ReportLayout.Master).map(header)
    require(came == expected.map(_.toLong), "no report")
    val count = header(ReportLayout.Count).toInt
    require(datagram.length == ReportLayout.bytes + count * EventLayout.bytes, "length of the report")
    Seq.tabulate(count) { i =>
      def field(f: Layout.Field) =
        EventLayout.read(datagram, f, ReportLayout.bytes + i * EventLayout.bytes).toInt
      ReportedEvent(
        header(ReportLayout.Boot).toInt,
        header(ReportLayout.Number) + i,
        field(EventLayout.Kind),
        field(EventLayout.Position),
        field(EventLayout.Node),
        field(EventLayout.Sequence),
        field(EventLayout.State),
        field(EventLayout.Epoch)
      )
    }
  }
}
