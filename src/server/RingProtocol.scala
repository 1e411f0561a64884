package flyframe.server

import java.security.MessageDigest
import flyframe.protocol.{Layout, RingFlag, RingPart, RingPartLayout, RingReportEndLayout, RingReportLayout}
import flyframe.protocol.{RingSendLayout, ServerDatagram}
import flyframe.protocol.ServerDatagram._

/** A part of a ring's report (GW-04).
  *
  * @param kind
  *   one of [[flyframe.protocol.RingPart]]
  * @param source
  *   address of the node
  * @param lifeByte
  *   life of the node, with bit 7 of messages to all
  * @param flags
  *   bits of [[flyframe.protocol.RingFlag]]
  * @param total
  *   bytes of the whole message
  * @param offset
  *   of the data in the message
  */
final case class Part(
    kind: Int,
    source: Int,
    data: Vector[Byte],
    pipe: Int = 0,
    number: Int = 0,
    lifeByte: Int = 0,
    flags: Int = 0,
    total: Int = 0,
    offset: Int = 0
) {

  /** The message may be a repeat. */
  def isRepeat: Boolean = (flags & RingFlag.Repeat) != 0

  /** The message ends with it. */
  def isLast: Boolean = offset + data.size == total
}

/** What a ring's gateway reports (GW-04).
  *
  * @param first
  *   number of the first part
  * @param taken
  *   counter of the last message of the server that it has taken
  * @param status
  *   bits of [[flyframe.protocol.RingStatus]]
  */
final case class RingReport(
    life: Life,
    server: Long,
    counter: Long,
    first: Long,
    taken: Long = 0,
    status: Int = 0,
    parts: Vector[Part] = Vector.empty
) extends Sent {
  def end: Long = first + parts.size
}

/** A message for a node of a ring (GW-06).
  *
  * @param counter
  *   of such messages in this life of the gateway, from 1 on
  * @param destination
  *   address of the node, 0: all
  */
final case class RingSend(
    life: Life,
    server: Long,
    turn: Long,
    counter: Long,
    destination: Int,
    urgent: Boolean,
    data: Vector[Byte]
)

/** The datagrams between a ring's gateway and the server, big endian, and their tags. */
object RingProtocol {

  /** Bytes of the longest datagram. */
  val MostBytes = 1472

  /** Bytes of the longest message of the server; of any message. */
  val MostSendBytes    = 1024
  val MostMessageBytes = 2048

  /** A report, if `datagram` is a whole one. Its tag is not looked at: see [[isRight]]. */
  def report(datagram: Array[Byte]): Option[RingReport] =
    Option
      .when(
        datagram.length >= RingReportLayout.bytes + RingReportEndLayout.bytes &&
          datagram.length <= MostBytes && Protocol.isOf(datagram, RingReportLayout, KindRing)
      ) {
        def field(f: Layout.Field): Long = RingReportLayout.read(datagram, f)
        val first                        = field(RingReportLayout.Number)
        val count                        = field(RingReportLayout.Parts).toInt
        for {
          parts <- partsOf(datagram, count)
          if first + count < Protocol.Numbers
        } yield RingReport(
          Life(field(RingReportLayout.Master).toInt, field(RingReportLayout.Life)),
          field(RingReportLayout.Server),
          field(RingReportLayout.Counter),
          first,
          field(RingReportLayout.Taken),
          field(RingReportLayout.Status).toInt,
          parts
        )
      }
      .flatten

  /** All parts, if they fill what is between head and end. */
  private def partsOf(datagram: Array[Byte], count: Int): Option[Vector[Part]] = {
    val end   = datagram.length - RingReportEndLayout.bytes
    var at    = RingReportLayout.bytes
    var parts = Vector.empty[Part]
    while (parts.size < count && at + RingPartLayout.bytes <= end) {
      def field(f: Layout.Field): Int = RingPartLayout.read(datagram, f, at).toInt
      val start                       = at + RingPartLayout.bytes
      parts :+= Part(
        field(RingPartLayout.Type),
        field(RingPartLayout.Source),
        datagram.slice(start, (start + field(RingPartLayout.Length)) min end).toVector,
        field(RingPartLayout.Pipe),
        field(RingPartLayout.Number),
        field(RingPartLayout.Life),
        field(RingPartLayout.Flags),
        field(RingPartLayout.Total),
        field(RingPartLayout.Offset)
      )
      at = start + field(RingPartLayout.Length)
    }
    Option.when(parts.size == count && at == end && parts.forall(isPossible))(parts)
  }

  private def isPossible(p: Part): Boolean = p.kind != RingPart.Message ||
    p.data.nonEmpty && p.total <= MostMessageBytes && p.offset + p.data.size <= p.total

  /** The tag of this report is right, made with the shared `key`. */
  def isRight(report: RingReport, datagram: Array[Byte], key: Array[Byte]): Boolean = {
    val (message, tag) = datagram.splitAt(datagram.length - RingReportEndLayout.bytes)
    MessageDigest.isEqual(tag, tagOf(report.life.number, OfMaster, report.counter, key, message))
  }

  private def tagOf(life: Long, origin: Int, counter: Long, key: Array[Byte], message: Array[Byte]) =
    AsconTag(key, Protocol.nonce(life, origin, counter), message)

  /** As a gateway sends it. */
  def encode(r: RingReport, key: Array[Byte]): Array[Byte] = {
    val head = RingReportLayout.encode(
      Protocol.begin(RingReportLayout, KindRing, r.life, r.server) ++ Seq(
        RingReportLayout.Counter -> r.counter,
        RingReportLayout.Number  -> r.first,
        RingReportLayout.Taken   -> r.taken,
        RingReportLayout.Parts   -> r.parts.size.toLong,
        RingReportLayout.Status  -> r.status.toLong
      ): _*
    )
    val parts = r.parts.flatMap(p =>
      RingPartLayout.encode(
        RingPartLayout.Type   -> p.kind.toLong,
        RingPartLayout.Source -> p.source.toLong,
        RingPartLayout.Pipe   -> p.pipe.toLong,
        RingPartLayout.Number -> p.number.toLong,
        RingPartLayout.Life   -> p.lifeByte.toLong,
        RingPartLayout.Flags  -> p.flags.toLong,
        RingPartLayout.Total  -> p.total.toLong,
        RingPartLayout.Offset -> p.offset.toLong,
        RingPartLayout.Length -> p.data.size.toLong
      ) ++ p.data
    )
    val message = head ++ parts
    message ++ tagOf(r.life.number, OfMaster, r.counter, key, message)
  }

  /** As the server sends it. */
  def encode(s: RingSend, key: Array[Byte]): Array[Byte] = {
    val message = RingSendLayout.encode(
      Protocol.begin(RingSendLayout, KindSend, s.life, s.server) ++ Seq(
        RingSendLayout.Turn        -> s.turn,
        RingSendLayout.Counter     -> s.counter,
        RingSendLayout.Destination -> s.destination.toLong,
        RingSendLayout.Flags       -> (if (s.urgent) RingFlag.Urgent.toLong else 0L),
        RingSendLayout.Length      -> s.data.size.toLong
      ): _*
    ) ++ s.data
    message ++ tagOf(s.server, OfServer, s.turn, key, message)
  }

  /** A message of the server, if its tag is right: what a gateway does. */
  def send(datagram: Array[Byte], key: Array[Byte]): Option[RingSend] =
    Option
      .when(
        datagram.length >= RingSendLayout.bytes + RingReportEndLayout.bytes &&
          Protocol.isOf(datagram, RingSendLayout, ServerDatagram.KindSend)
      ) {
        def field(f: Layout.Field): Long = RingSendLayout.read(datagram, f)
        val (message, tag)               = datagram.splitAt(datagram.length - RingReportEndLayout.bytes)
        val right = tagOf(field(RingSendLayout.Server), OfServer, field(RingSendLayout.Turn), key, message)
        Option.when(
          MessageDigest.isEqual(tag, right) &&
            message.length == RingSendLayout.bytes + field(RingSendLayout.Length)
        )(
          RingSend(
            Life(field(RingSendLayout.Master).toInt, field(RingSendLayout.Life)),
            field(RingSendLayout.Server),
            field(RingSendLayout.Turn),
            field(RingSendLayout.Counter),
            field(RingSendLayout.Destination).toInt,
            (field(RingSendLayout.Flags) & RingFlag.Urgent) != 0,
            message.drop(RingSendLayout.bytes).toVector
          )
        )
      }
      .flatten
}
