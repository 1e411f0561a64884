package flyframe.server

import java.sql.Connection
import java.time.Instant
import anorm._
import anorm.SqlParser._
import flyframe.protocol.{RingFlag, RingPart}

/** What the log keeps of rings, within the transactions of [[EventStore]]: every part once, in the order of
  * the numbers; of nodes and ring only what has changed.
  */
private[server] object RingLog {
  private val IsUrgent = s"kind = ${LogEntry.RingMessage} and (state & ${RingFlag.Urgent}) <> 0"
  private val Lost     = Vector[Byte](0)

  /** A sender that hears nothing goes on for 150 s at most (TB-26), ms; the rest is for a gateway and a
    * server that start.
    */
  private val MostRepeatMs = 600000

  def prepare()(implicit sql: Connection): Unit = {
    SQL"""create table if not exists ring_life (
            id integer primary key, gateway integer not null, life integer not null, next integer not null,
            unique (gateway, life))""".execute()
    SQL"create table if not exists ring_message (event integer primary key, data blob not null)".execute()
    // Messages of which the first parts have come.
    SQL"""create table if not exists ring_piece (
            gateway integer not null, life integer not null, source integer not null, pipe integer not null,
            life_byte integer not null, data blob not null,
            unique (gateway, source, pipe, life_byte))""".execute()
    // What was told last of each node; of the ring itself under address 0.
    SQL"""create table if not exists ring_node (
            gateway integer not null, address integer not null, kind integer not null, data blob not null,
            unique (gateway, address))""".execute()
    SQL"""create index if not exists ring_repeat on event (master, node, position)
            where kind = #${LogEntry.RingMessage}""".execute()
    SQL"create index if not exists ring_urgent on event (master) where #$IsUrgent".execute()
    ()
  }

  private def record(life: Life)(implicit sql: Connection): Option[LifeRecord] =
    SQL"select next from ring_life where gateway = ${life.master} and life = ${life.number}"
      .as(scalar[Long].singleOpt)
      .map(LifeRecord(life, _, EventStore.gaps(life)))

  def rings(implicit sql: Connection): Seq[Ring] =
    SQL"""select gateway, life from ring_life
          where id in (select max(id) from ring_life group by gateway) order by id desc"""
      .as((int("gateway") ~ long("life")).map { case gateway ~ life => Life(gateway, life) }.*)
      .flatMap(record(_))
      .map { r =>
        val urgent = EventStore.latest(s"master = ${r.life.master} and $IsUrgent", Ring.MostUrgent)
        val ring   = Ring(r.life.master, Some(r.life)).inLog(r, urgent)
        ring.told(
          SQL"select kind, address, data from ring_node where gateway = ${r.life.master}"
            .as((int("kind") ~ int("address") ~ byteArray("data")).map { case k ~ a ~ d =>
              (k, a, d.toSeq)
            }.*)
        )
      }

  def messages(gateway: Int, id: Long, limit: Int)(implicit sql: Connection): Seq[(Long, Array[Byte])] =
    SQL"""select id, data from event join ring_message on ring_message.event = event.id
          where master = $gateway and id > $id and again = 0 order by id limit $limit"""
      .as((long("id") ~ byteArray("data")).map { case i ~ d => (i, d) }.*)

  /** See [[EventStore.take]]. */
  def take(report: RingReport, received: Instant, insert: LogEntry => LogEntry)(implicit
      sql: Connection
  ): (Seq[LogEntry], LifeRecord) = {
    val life = report.life
    if (record(life).isEmpty) {
      SQL"insert into ring_life (gateway, life, next) values (${life.master}, ${life.number}, 0)"
        .executeUpdate()
      // What a gateway had begun to tell before its restart it tells anew.
      SQL"delete from ring_piece where gateway = ${life.master}".executeUpdate()
    }
    val wanted = record(life).get.next
    if (report.first > wanted)
      SQL"""insert into gap (master, life, first, last)
            values (${life.master}, ${life.number}, $wanted, ${report.first - 1})""".executeUpdate()
    val entries = report.parts.zipWithIndex.flatMap {
      case (p, i) if report.first + i >= wanted => store(life, report.first + i, p, received, insert)
      case _                                    => None
    }
    if (report.end > wanted)
      SQL"""update ring_life set next = ${report.end}
            where gateway = ${life.master} and life = ${life.number}""".executeUpdate()
    (entries, record(life).get)
  }

  /** The entry that a part makes, if it makes one. */
  private def store(
      life: Life,
      number: Long,
      p: Part,
      received: Instant,
      insert: LogEntry => LogEntry
  )(implicit sql: Connection): Option[LogEntry] = {
    def entry(event: Event, text: String, again: Boolean = false): LogEntry = {
      val made = insert(LogEntry(0, received, life, number, event, again, Some(text)))
      SQL"insert into note (event, text) values (${made.id}, $text)".executeUpdate()
      made
    }
    p.kind match {
      case RingPart.Message => message(life, p, received)(entry)
      case RingPart.Node =>
        val isWell = RingNode(p.data).exists(n => n.present && RingText.node(n).forall(_ == "guard"))
        Option.when(isNews(life, p, p.source))(
          entry(Event(LogEntry.RingNode, node = p.source, state = if (isWell) 0 else 1), text(p))
        )
      case RingPart.Ring =>
        val isWhole = Ring(0).told(p.kind, 0, p.data).ends.isEmpty
        Option.when(isNews(life, p, 0))(
          entry(Event(LogEntry.RingBreak, state = if (isWhole) 0 else 1), text(p))
        )
      case _ =>
        Some(entry(Event(LogEntry.RingResult, state = p.data.lastOption.fold(0xff)(_ & 0xff)), text(p)))
    }
  }

  private def text(p: Part): String = RingText.part(p, p.data, isCut = false)

  /** Something else than what was told last: for the page, or only its distances and counters of lives. */
  private def isNews(life: Life, p: Part, address: Int)(implicit sql: Connection): Boolean = {
    val before = keep(life.master, address, p.kind, p.data)
    !before.exists(b => text(p.copy(data = b)) == text(p))
  }

  /** A node is lost, as the server itself has found out. */
  def lost(gateway: Int, address: Int)(implicit sql: Connection): Unit = {
    keep(gateway, address, RingPart.Node, Lost)
    ()
  }

  /** Keeps what was told last of a node, or of the ring; what it was before. Of a lost node the rest stays:
    * it says where it was.
    */
  private def keep(gateway: Int, address: Int, kind: Int, data: Vector[Byte])(implicit
      sql: Connection
  ): Option[Vector[Byte]] = {
    val before =
      SQL"select data from ring_node where gateway = $gateway and address = $address"
        .as(scalar[Array[Byte]].singleOpt)
        .map(_.toVector)
    val isLost            = kind == RingPart.Node && data == Lost
    val kept: Array[Byte] = (data ++ before.filter(_ => isLost).fold(Vector.empty[Byte])(_.drop(1))).toArray
    SQL"""insert or replace into ring_node (gateway, address, kind, data)
          values ($gateway, $address, $kind, $kept)""".executeUpdate()
    before
  }

  /** A piece of a message, which is an entry when it is whole (GW-07). */
  private def message(life: Life, p: Part, received: Instant)(
      entry: (Event, String, Boolean) => LogEntry
  )(implicit sql: Connection): Option[LogEntry] = {
    val before =
      if (p.offset == 0) Some(Array.empty[Byte])
      else
        SQL"""select data from ring_piece where gateway = ${life.master} and life = ${life.number}
              and source = ${p.source} and pipe = ${p.pipe} and life_byte = ${p.lifeByte}"""
          .as(scalar[Array[Byte]].singleOpt)
          .filter(_.length == p.offset)
    val whole = before.getOrElse(Array.empty[Byte]) ++ p.data
    if (p.isLast) {
      val again = p.isRepeat && isKnown(life, p, whole, received)
      val made = entry(
        Event(LogEntry.RingMessage, p.pipe, p.source, p.number, p.flags & RingFlag.Urgent, p.lifeByte),
        RingText.part(p, whole.toSeq, isCut = before.isEmpty),
        again
      )
      SQL"insert into ring_message (event, data) values (${made.id}, $whole)".executeUpdate()
      SQL"""delete from ring_piece where gateway = ${life.master} and source = ${p.source}
            and pipe = ${p.pipe} and life_byte = ${p.lifeByte}""".executeUpdate()
      Some(made)
    } else {
      SQL"""insert or replace into ring_piece (gateway, life, source, pipe, life_byte, data)
            values (${life.master}, ${life.number}, ${p.source}, ${p.pipe}, ${p.lifeByte}, $whole)"""
        .executeUpdate()
      None
    }
  }

  /** The log has it as the last one of its pipe: its number comes again only when others have come between,
    * or when a sender has forgotten its numbers, as another board has.
    */
  private def isKnown(life: Life, p: Part, whole: Array[Byte], received: Instant)(implicit
      sql: Connection
  ): Boolean =
    SQL"""select received, sequence, epoch, data from event join ring_message on ring_message.event = event.id
          where kind = #${LogEntry.RingMessage} and master = ${life.master} and node = ${p.source}
            and position = ${p.pipe} and (epoch & 128) = ${p.lifeByte & 0x80} order by id desc limit 1"""
      .as(
        (long("received") ~ int("sequence") ~ int("epoch") ~ byteArray("data")).map { case r ~ s ~ e ~ d =>
          (r, s, e, d)
        }.singleOpt
      )
      .exists { case (at, number, lifeByte, data) =>
        number == p.number && lifeByte == p.lifeByte && data.sameElements(whole) &&
        (received.toEpochMilli - at).abs <= MostRepeatMs
      }
}
