package flyframe.server

import java.nio.file.Path
import java.sql.{Connection, DriverManager, SQLException}
import java.time.Instant
import anorm._
import anorm.SqlParser._
import flyframe.protocol.EventKind

/** An event in the log.
  *
  * @param id
  *   counts all entries of the log, in the order in which they came
  * @param number
  *   of the event in its life
  * @param again
  *   an alarm record that the log has from an earlier life of the master (SRV-19)
  */
final case class LogEntry(
    id: Long,
    received: Instant,
    life: Life,
    number: Long,
    event: Event,
    again: Boolean = false
)

/** What the log knows of a life of a master.
  *
  * @param next
  *   number of the next event wanted
  * @param time
  *   the master's time, in us, of a report that came at `heard`; later ones may have come without events
  */
final case class LifeRecord(life: Life, next: Long, time: Long, heard: Instant)

/** The log in SQLite: every event once, in the order of its numbers (SRV-05 to SRV-08). What a method has
  * stored is on the disk when it returns. For several threads.
  *
  * Methods throw `SQLException` when the database cannot be written or read.
  */
final class EventStore private (connection: Connection) extends AutoCloseable {
  import EventStore._
  private implicit val sql: Connection = connection

  /** A life, if it has begun. */
  def record(life: Life): Option[LifeRecord] = synchronized {
    SQL"select * from life where master = ${life.master} and boot = ${life.boot}".as(lifeRecord.singleOpt)
  }

  /** A life begins: its events are wanted from `first` on. Known ones stay as they are. */
  def begin(life: Life, first: Long): Unit = transaction {
    SQL"""insert or ignore into life (master, boot, next, counter, time, heard)
          values (${life.master}, ${life.boot}, $first, 0, 0, 0)""".executeUpdate()
  }

  /** Stores those events of a report which are wanted; none of them if events before are missing. The new
    * entries are the result.
    */
  def append(report: Report, received: Instant): Seq[LogEntry] = transaction {
    val life   = report.life
    val wanted = record(life).getOrElse(throw new IllegalArgumentException(s"$life has not begun")).next
    val fresh = report.events.zipWithIndex.map { case (e, i) => (report.first + i, e) }.filter(_._1 >= wanted)
    if (fresh.isEmpty || report.first > wanted) Nil
    else {
      val entries = fresh.map { case (number, e) =>
        insert(LogEntry(0, received, life, number, e, isKnown(life, e)))
      }
      SQL"""update life set next = ${fresh.last._1 + 1}
            where master = ${life.master} and boot = ${life.boot}""".executeUpdate()
      update(life, report.time, received)
      entries
    }
  }

  /** Remembers the time of a report (SRV-10). */
  def remember(life: Life, time: Long, heard: Instant): Unit = transaction(update(life, time, heard))

  private def update(life: Life, time: Long, heard: Instant): Unit =
    SQL"""update life set time = $time, heard = ${heard.toEpochMilli}
          where master = ${life.master} and boot = ${life.boot}""".executeUpdate()

  private def insert(entry: LogEntry): LogEntry = {
    val LogEntry(_, received, life, number, e, again) = entry
    val id =
      SQL"""insert into event (received, master, boot, number, again, kind, position, node, sequence, state,
                               epoch, slave_time, master_time)
            values (${received.toEpochMilli}, ${life.master}, ${life.boot}, $number, ${if (again) 1 else 0},
                    ${e.kind}, ${e.position}, ${e.node}, ${e.sequence}, ${e.state}, ${e.epoch},
                    ${e.slaveTime}, ${e.masterTime})""".executeInsert(scalar[Long].single)
    entry.copy(id = id)
  }

  /** An alarm record that is in the log. */
  private def isKnown(life: Life, e: Event): Boolean = e.kind == EventKind.Detector &&
    SQL"""select count(*) from event
          where kind = #${EventKind.Detector} and master = ${life.master} and node = ${e.node}
            and sequence = ${e.sequence} and epoch = ${e.epoch} and state = ${e.state}
            and slave_time = ${e.slaveTime}""".as(scalar[Long].single) > 0

  /** A number for a command that is higher than all before in this life, from 1 on. */
  def nextCounter(life: Life): Long = transaction {
    SQL"update life set counter = counter + 1 where master = ${life.master} and boot = ${life.boot}"
      .executeUpdate()
    SQL"select counter from life where master = ${life.master} and boot = ${life.boot}"
      .as(scalar[Long].single)
  }

  /** The youngest life of each master, the youngest first. */
  def youngest: Seq[LifeRecord] = synchronized {
    SQL"select * from life where id in (select max(id) from life group by master) order by id desc"
      .as(lifeRecord.*)
  }

  /** What the detectors of a master's slaves have told last, in any life of it, by node ID. */
  def detectors(master: Int): Map[Int, Detected] = synchronized {
    SQL"""select node, state, epoch from event where id in
            (select max(id) from event where kind = #${EventKind.Detector} and master = $master
              group by node)"""
      .as((int("node") ~ int("state") ~ int("epoch")).map { case n ~ s ~ e => n -> Detected(s, e) }.*)
      .toMap
  }

  /** Events of a life from number `from` on, at most `limit`, also those that came again. */
  def ofLife(life: Life, from: Long, limit: Int): Seq[LogEntry] = synchronized {
    SQL"""select * from event where master = ${life.master} and boot = ${life.boot} and number >= $from
          order by number limit $limit""".as(entry.*)
  }

  /** Entries behind `id`, at most `limit`, in order; without those that came again. */
  def after(id: Long, limit: Int): Seq[LogEntry] = synchronized {
    SQL"select * from event where id > $id and again = 0 order by id limit $limit".as(entry.*)
  }

  /** The last entries, at most `limit`, in order; without those that came again. */
  def latest(limit: Int): Seq[LogEntry] = synchronized {
    SQL"select * from event where again = 0 order by id desc limit $limit".as(entry.*).reverse
  }

  def close(): Unit = synchronized(connection.close())

  private def transaction[A](body: => A): A = synchronized {
    connection.setAutoCommit(false)
    try {
      val result = body
      connection.commit()
      result
    } catch { case e: Throwable => connection.rollback(); throw e }
    finally connection.setAutoCommit(true)
  }
}

object EventStore {
  private val SchemaVersion = 1

  private val entry: RowParser[LogEntry] =
    (long("id") ~ long("received") ~ int("master") ~ int("boot") ~ long("number") ~ int("again") ~ int(
      "kind"
    ) ~
      int("position") ~ int("node") ~ int("sequence") ~ int("state") ~ int("epoch") ~ long("slave_time") ~
      long("master_time")).map {
      case id ~ received ~ master ~ boot ~ number ~ again ~ kind ~ position ~ node ~ sequence ~ state ~
          epoch ~ slave ~ time =>
        val event = Event(kind, position, node, sequence, state, epoch, slave, time)
        LogEntry(id, Instant.ofEpochMilli(received), Life(master, boot), number, event, again != 0)
    }

  private val lifeRecord: RowParser[LifeRecord] =
    (int("master") ~ int("boot") ~ long("next") ~ long("time") ~ long("heard")).map {
      case master ~ boot ~ next ~ time ~ heard =>
        LifeRecord(Life(master, boot), next, time, Instant.ofEpochMilli(heard))
    }

  /** Opens the database at `path`, or makes it; Left: why that is not possible. */
  def open(path: Path): Either[String, EventStore] =
    try {
      val connection = DriverManager.getConnection(s"jdbc:sqlite:$path")
      try
        prepare(connection, path).map(_ => new EventStore(connection)).left.map { why =>
          connection.close(); why
        }
      catch { case e: SQLException => connection.close(); throw e }
    } catch {
      case e: SQLException =>
        Left(s"The database $path cannot be used (${e.getMessage.takeWhile(_ != '\n')}).")
    }

  private def prepare(connection: Connection, path: Path): Either[String, Unit] = {
    implicit val sql: Connection = connection
    SQL"pragma busy_timeout = 5000".execute()
    val version = SQL"pragma user_version".as(scalar[Int].single)
    val tables  = SQL"select count(*) from sqlite_master".as(scalar[Int].single)
    if (version != SchemaVersion && (version != 0 || tables != 0))
      Left(s"The database $path is not one of this program and version.")
    else {
      // An acknowledged event must survive a power failure: commits wait for the disk.
      SQL"pragma journal_mode = wal".execute()
      SQL"pragma synchronous = full".execute()
      SQL"""create table if not exists life (
              id integer primary key, master integer not null, boot integer not null, next integer not null,
              counter integer not null, time integer not null, heard integer not null,
              unique (master, boot))""".execute()
      SQL"""create table if not exists event (
              id integer primary key autoincrement, received integer not null, master integer not null,
              boot integer not null, number integer not null, again integer not null,
              kind integer not null, position integer not null, node integer not null,
              sequence integer not null, state integer not null, epoch integer not null,
              slave_time integer not null, master_time integer not null,
              unique (master, boot, number))""".execute()
      SQL"""create index if not exists record on event (master, node, sequence)
              where kind = #${EventKind.Detector}""".execute()
      SQL"pragma user_version = #$SchemaVersion".execute()
      Right(())
    }
  }
}
