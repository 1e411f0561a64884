package flyframe.server

import java.nio.file.attribute.BasicFileAttributes
import java.nio.file.{Files, Path}
import java.sql.{Connection, SQLException}
import java.time.Instant
import scala.util.Try
import anorm._
import anorm.SqlParser._
import org.sqlite.SQLiteConfig
import flyframe.protocol.{DetectorState, EventKind, RingFlag}

/** An event in the log.
  *
  * @param id
  *   counts all entries of the log, in the order in which they came
  * @param number
  *   of the event in its life
  * @param again
  *   an alarm record that the log has already (SRV-19)
  * @param note
  *   what it says, if it is an entry of the server itself: `life` has the life of the server then, and
  *   `number` counts such entries
  */
final case class LogEntry(
    id: Long,
    received: Instant,
    life: Life,
    number: Long,
    event: Event,
    again: Boolean = false,
    note: Option[String] = None
) {

  /** In words. */
  def text: String = note.getOrElse(EventText.text(event))

  /** An urgent message of a node of a ring. */
  def isUrgent: Boolean =
    event.kind == LogEntry.RingMessage && (event.state & RingFlag.Urgent) != 0
}

object LogEntry {

  /** Kind of an entry of the server: what became of an order for a zone (SRV-25); no byte, as those of
    * masters are. Its position is the order, its state one of [[flyframe.protocol.CommandResult]].
    */
  val ZoneOrder = 256

  /** Kinds of entries of a ring's gateway, whose texts stand beside them: a message to the server (position:
    * pipe; node: its source; sequence: its number; state: its flags; epoch: life of its source), news of a
    * node and of the ring (state: 0 well, 1 a fault), and the result of a message of the server (state).
    */
  val RingMessage = 257
  val RingNode    = 258
  val RingBreak   = 259
  val RingResult  = 260

  def isOfRing(kind: Int): Boolean = kind >= RingMessage && kind <= RingResult
}

/** What the log knows of a life of a master.
  *
  * @param next
  *   number of the next event wanted
  * @param gaps
  *   first and last numbers of events that the log does not have, and the master has no more
  */
final case class LifeRecord(life: Life, next: Long, gaps: Vector[(Long, Long)])

/** The log in SQLite: every event once, in the order of its numbers (SRV-05 to SRV-08). What a method has
  * stored is on the disk when it returns. For several threads: those that read do not wait for one that
  * writes.
  *
  * Methods throw `SQLException` when the database cannot be written or read.
  */
final class EventStore private (path: Path, writer: Connection, reader: Connection) extends AutoCloseable {
  import EventStore._
  private val file      = keyOf(path)
  private val writeLock = new AnyRef

  private def reading[A](body: Connection => A): A = reader.synchronized(body(reader))

  /** A life, if the log knows it. */
  def record(life: Life): Option[LifeRecord] = reading(recordOf(life)(_))

  /** Stores those events of a report that the log does not have, and returns the new entries. A life that the
    * log does not know begins. If events before are missing they are noted as a gap: the master has them no
    * more, since a server has acknowledged them (SRV-06).
    */
  def take(report: Report, received: Instant): (Seq[LogEntry], LifeRecord) = transaction { implicit sql =>
    val life = report.life
    if (recordOf(life).isEmpty)
      SQL"insert into life (master, life, next) values (${life.master}, ${life.number}, 0)".executeUpdate()
    val wanted = recordOf(life).get.next
    if (report.first > wanted)
      SQL"""insert into gap (master, life, first, last)
            values (${life.master}, ${life.number}, $wanted, ${report.first - 1})""".executeUpdate()
    val entries = report.events.zipWithIndex.collect {
      case (e, i) if report.first + i >= wanted =>
        insert(LogEntry(0, received, life, report.first + i, e, isKnown(life, e)))
    }
    if (report.end > wanted)
      SQL"""update life set next = ${report.end}
            where master = ${life.master} and life = ${life.number}""".executeUpdate()
    (entries, recordOf(life).get)
  }

  /** The same of a ring's gateway: its parts (GW-04, GW-07). */
  def take(report: RingReport, received: Instant): (Seq[LogEntry], LifeRecord) = transaction { implicit sql =>
    RingLog.take(report, received, insert(_))
  }

  /** What gateways have told last, the youngest life of each. */
  def rings: Seq[Ring] = reading(RingLog.rings(_))

  /** The bytes of messages of a gateway, of its entries in the log behind `id`, at most `limit`. */
  def messages(gateway: Int, id: Long, limit: Int): Seq[(Long, Array[Byte])] =
    reading(RingLog.messages(gateway, id, limit)(_))

  /** Stores entries of the server itself. */
  def note(entries: Seq[LogEntry]): Unit = transaction { implicit sql =>
    for (e <- entries; text <- e.note) {
      val id = insert(e).id
      SQL"insert into note (event, text) values ($id, $text)".executeUpdate()
      if (e.event.kind == LogEntry.RingNode) RingLog.lost(e.life.master, e.event.node)
    }
  }

  private def insert(entry: LogEntry)(implicit sql: Connection): LogEntry = {
    val LogEntry(_, received, life, number, e, again, _) = entry
    val id =
      SQL"""insert into event (received, master, life, number, again, kind, position, node, sequence, state,
                               epoch, slave_time, master_time)
            values (${received.toEpochMilli}, ${life.master}, ${life.number}, $number, ${if (again) 1 else 0},
                    ${e.kind}, ${e.position}, ${e.node}, ${e.sequence}, ${e.state}, ${e.epoch},
                    ${e.slaveTime}, ${e.masterTime})""".executeInsert(scalar[Long].single)
    entry.copy(id = id)
  }

  /** An alarm record that the log has already: a master reports it again if it has started anew, or if its
    * slave was absent before it had the acknowledgement. Epoch 0 is that of no start of a host: before that a
    * slave tells the same after each power-up. So it does when an epoch comes again after many starts: a
    * record behind which the slave's log goes on is not the same.
    */
  private def isKnown(life: Life, e: Event)(implicit sql: Connection): Boolean =
    e.kind == EventKind.Detector &&
      SQL"""select max(id) from event
            where kind = #${EventKind.Detector} and master = ${life.master} and epoch <> 0
              and node = ${e.node} and position = ${e.position} and sequence = ${e.sequence}
              and epoch = ${e.epoch} and state = ${e.state}
              and slave_time = ${e.slaveTime}""".as(scalar[Long].singleOpt).exists { id =>
        SQL"""select count(*) from event
              where kind = #${EventKind.Detector} and master = ${life.master} and node = ${e.node}
                and position = ${e.position} and id > $id""".as(scalar[Long].single) < MostBehind
      }

  /** Finds out whether the log can be written, without changing it but for a counter. */
  def probe(): Unit = transaction { implicit sql =>
    SQL"update probe set written = written + 1".executeUpdate()
    ()
  }

  /** The youngest life of each master, the youngest first. */
  def youngest: Seq[LifeRecord] = reading { implicit sql =>
    SQL"select master, life from life where id in (select max(id) from life group by master) order by id desc"
      .as((int("master") ~ long("life")).map { case master ~ life => Life(master, life) }.*)
      .flatMap(recordOf)
  }

  /** What a life has told last of its slaves, by position, and of its master. */
  def states(life: Life): Seq[Event] = reading { implicit sql =>
    SQL"""select * from event where id in
            (select max(id) from event
             where kind in (#${EventKind.Slave}, #${EventKind.Line}) and master = ${life.master}
               and life = ${life.number}
             group by kind, case kind when #${EventKind.Slave} then position else 0 end)
          order by id""".as(entry.*).map(_.event)
  }

  /** When the last alarm of each detector of a master came, by position. */
  def alarms(master: Int): Map[Int, Instant] = reading { implicit sql =>
    SQL"""select position, max(received) as received from event
          where kind = #${EventKind.Detector} and state = #${DetectorState.Alarm} and again = 0
            and master = $master group by position"""
      .as((int("position") ~ long("received")).map { case p ~ r => p -> Instant.ofEpochMilli(r) }.*)
      .toMap
  }

  /** The last alarm records of a master's slaves, at most `limit`, in order, also those that came again. */
  def records(master: Int, limit: Int): Seq[Event] = reading { implicit sql =>
    SQL"""select * from event where kind = #${EventKind.Detector} and master = $master
          order by id desc limit $limit""".as(entry.*).reverse.map(_.event)
  }

  /** Events of a life from number `from` on, at most `limit`, also those that came again. */
  def ofLife(life: Life, from: Long, limit: Int): Seq[LogEntry] = reading { implicit sql =>
    SQL"""select * from event where master = ${life.master} and life = ${life.number} and number >= $from
          order by number limit $limit""".as(entry.*)
  }

  /** Entries behind `id`, at most `limit`, in order; without those that came again. */
  def after(id: Long, limit: Int): Seq[LogEntry] = reading { implicit sql =>
    SQL"#$WithNotes where id > $id and again = 0 order by id limit $limit".as(noted.*)
  }

  /** The last entries, at most `limit`, in order; without those that came again. */
  def latest(limit: Int): Seq[LogEntry] = reading(EventStore.latest("true", limit)(_))

  def close(): Unit = {
    writeLock.synchronized(writer.close())
    reader.synchronized(reader.close())
  }

  private def transaction[A](body: Connection => A): A = writeLock.synchronized {
    // SQLite goes on writing to a file that is not there any more: nobody would ever read that.
    if (keyOf(path) != file) throw new SQLException(s"$path was replaced while the server ran; restart it")
    // A transaction begins by taking the right to write: so it cannot fail in between. In SQL, since the
    // driver's own transactions do not end well when they cannot begin.
    implicit val sql: Connection = writer
    SQL"begin immediate".execute()
    try {
      val result = body(writer)
      SQL"commit".execute()
      result
    } catch { case e: Throwable => Try(SQL"rollback".execute()); throw e }
  }
}

object EventStore {
  private val SchemaVersion = 2

  /** A slave holds 16 records: those that it tells again are among its last ones. */
  private val MostBehind = 32

  /** How long to wait for other programs that hold the database, ms. */
  private val WriterPatienceMs = 1000
  private val ReaderPatienceMs = 100

  /** Tells a file from another one with the same name. */
  private def keyOf(path: Path): Option[AnyRef] =
    Try(Files.readAttributes(path, classOf[BasicFileAttributes]).fileKey).toOption

  private val entry: RowParser[LogEntry] =
    (long("id") ~ long("received") ~ int("master") ~ long("life") ~ long("number") ~ int("again") ~
      int("kind") ~ int("position") ~ int("node") ~ int("sequence") ~ int("state") ~ int("epoch") ~
      long("slave_time") ~ long("master_time")).map {
      case id ~ received ~ master ~ life ~ number ~ again ~ kind ~ position ~ node ~ sequence ~ state ~
          epoch ~ slave ~ time =>
        val event = Event(kind, position, node, sequence, state, epoch, slave, time)
        LogEntry(id, Instant.ofEpochMilli(received), Life(master, life), number, event, again != 0)
    }

  private val WithNotes = "select event.*, text from event left join note on note.event = event.id"
  private val noted     = (entry ~ str("text").?).map { case entry ~ text => entry.copy(note = text) }

  /** The last entries that are so in SQL, at most `limit`, in order; without those that came again. */
  private[server] def latest(condition: String, limit: Int)(implicit sql: Connection): Seq[LogEntry] =
    SQL"#$WithNotes where again = 0 and #$condition order by id desc limit $limit".as(noted.*).reverse

  private def recordOf(life: Life)(implicit sql: Connection): Option[LifeRecord] =
    SQL"select next from life where master = ${life.master} and life = ${life.number}"
      .as(scalar[Long].singleOpt)
      .map(LifeRecord(life, _, gaps(life)))

  private[server] def gaps(life: Life)(implicit sql: Connection): Vector[(Long, Long)] =
    SQL"""select first, last from gap where master = ${life.master} and life = ${life.number}
          order by first"""
      .as((long("first") ~ long("last")).map { case first ~ last => (first, last) }.*)
      .toVector

  private def connect(path: Path, patienceMs: Int): Connection = {
    val config = new SQLiteConfig
    config.setBusyTimeout(patienceMs)
    config.createConnection(s"jdbc:sqlite:$path")
  }

  /** Opens the database at `path`, or makes it; Left: why that is not possible.
    *
    * @param patienceMs
    *   how long a write waits for one who has locked it
    */
  def open(path: Path, patienceMs: Int = WriterPatienceMs): Either[String, EventStore] =
    try {
      val writer = connect(path, patienceMs)
      try
        prepare(writer, path)
          .map(_ => new EventStore(path, writer, connect(path, ReaderPatienceMs)))
          .left
          .map { why => writer.close(); why }
      catch { case e: SQLException => writer.close(); throw e }
    } catch {
      case e: SQLException =>
        Left(s"The database $path cannot be used (${e.getMessage.takeWhile(_ != '\n')}).")
    }

  private def prepare(connection: Connection, path: Path): Either[String, Unit] = {
    implicit val sql: Connection = connection
    val version                  = SQL"pragma user_version".as(scalar[Int].single)
    val tables                   = SQL"select count(*) from sqlite_master".as(scalar[Int].single)
    if (version == 1)
      Left(s"The database $path is of an earlier version of this program: keep it, and give another file.")
    else if (version != SchemaVersion && (version != 0 || tables != 0))
      Left(s"The database $path is not one of this program and version.")
    else {
      // An acknowledged event must survive a power failure: commits wait for the disk.
      SQL"pragma journal_mode = wal".execute()
      SQL"pragma synchronous = full".execute()
      SQL"""create table if not exists life (
              id integer primary key, master integer not null, life integer not null, next integer not null,
              unique (master, life))""".execute()
      SQL"""create table if not exists gap (
              master integer not null, life integer not null, first integer not null,
              last integer not null)""".execute()
      SQL"""create table if not exists event (
              id integer primary key autoincrement, received integer not null, master integer not null,
              life integer not null, number integer not null, again integer not null,
              kind integer not null, position integer not null, node integer not null,
              sequence integer not null, state integer not null, epoch integer not null,
              slave_time integer not null, master_time integer not null,
              unique (master, life, number))""".execute()
      SQL"""create index if not exists record on event (master, node, sequence)
              where kind = #${EventKind.Detector}""".execute()
      SQL"create table if not exists note (event integer primary key, text text not null)".execute()
      SQL"create table if not exists probe (written integer not null)".execute()
      RingLog.prepare()
      SQL"insert into probe select 0 where not exists (select * from probe)".execute()
      SQL"pragma user_version = #$SchemaVersion".execute()
      Right(())
    }
  }
}
