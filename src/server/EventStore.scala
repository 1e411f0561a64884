package flyframe.server

import java.nio.file.Path
import java.sql.{Connection, DriverManager, SQLException}
import java.time.Instant
import anorm._
import anorm.SqlParser._

/** An event in the log.
  *
  * @param id
  *   counts all entries of the log, in the order in which they came
  * @param number
  *   of the event in its life
  */
final case class LogEntry(id: Long, received: Instant, life: Life, number: Long, event: Event)

/** The log in SQLite: every event once, in the order of its numbers (SRV-05 to SRV-08). What a method has
  * stored is on the disk when it returns. For several threads.
  *
  * Methods throw `SQLException` when the database cannot be written or read.
  */
final class EventStore private (connection: Connection) extends AutoCloseable {
  import EventStore._
  private implicit val sql: Connection = connection

  /** Number of the next event wanted of a life; None: it is unknown. */
  def next(life: Life): Option[Long] = synchronized {
    SQL"select next from life where master = ${life.master} and boot = ${life.boot}".as(scalar[Long].singleOpt)
  }

  /** A life begins: its events are wanted from `first` on. Known ones stay as they are. */
  def begin(life: Life, first: Long): Unit = transaction {
    SQL"""insert or ignore into life (master, boot, next, counter)
          values (${life.master}, ${life.boot}, $first, 0)""".executeUpdate()
  }

  /** Stores those of the events numbered from `first` on which are wanted; none of them if events before are
    * missing. The new entries are the result.
    */
  def append(life: Life, first: Long, events: Seq[Event], received: Instant): Seq[LogEntry] = transaction {
    val wanted = next(life).getOrElse(throw new IllegalArgumentException(s"$life has not begun"))
    val fresh  = events.zipWithIndex.map { case (e, i) => (first + i, e) }.filter(_._1 >= wanted)
    if (fresh.isEmpty || first > wanted) Nil
    else {
      val entries = fresh.map { case (number, e) =>
        LogEntry(insert(life, number, e, received), received, life, number, e)
      }
      SQL"""update life set next = ${fresh.last._1 + 1}
            where master = ${life.master} and boot = ${life.boot}""".executeUpdate()
      entries
    }
  }

  private def insert(life: Life, number: Long, e: Event, received: Instant): Long =
    SQL"""insert into event (received, master, boot, number, kind, position, node, sequence, state, epoch,
                             slave_time, master_time)
          values (${received.toEpochMilli}, ${life.master}, ${life.boot}, $number, ${e.kind}, ${e.position},
                  ${e.node}, ${e.sequence}, ${e.state}, ${e.epoch}, ${e.slaveTime}, ${e.masterTime})"""
      .executeInsert(scalar[Long].single)

  /** A number for a command that is higher than all before in this life, from 1 on. */
  def nextCounter(life: Life): Long = transaction {
    SQL"update life set counter = counter + 1 where master = ${life.master} and boot = ${life.boot}"
      .executeUpdate()
    SQL"select counter from life where master = ${life.master} and boot = ${life.boot}".as(scalar[Long].single)
  }

  /** The youngest life of each master, the youngest master first, and the last of its events. */
  def youngest: Seq[(Life, Option[LogEntry])] = synchronized {
    SQL"select master, boot from life where id in (select max(id) from life group by master) order by id desc"
      .as((int("master") ~ int("boot")).map { case m ~ b => Life(m, b) }.*)
      .map(life => life -> last(life))
  }

  /** The last event of a life. */
  def last(life: Life): Option[LogEntry] = synchronized {
    SQL"""select * from event where master = ${life.master} and boot = ${life.boot}
          order by number desc limit 1""".as(entry.singleOpt)
  }

  /** Events of a life from number `from` on, at most `limit`. */
  def ofLife(life: Life, from: Long, limit: Int): Seq[LogEntry] = synchronized {
    SQL"""select * from event where master = ${life.master} and boot = ${life.boot} and number >= $from
          order by number limit $limit""".as(entry.*)
  }

  /** Entries behind `id`, at most `limit`, in order. */
  def after(id: Long, limit: Int): Seq[LogEntry] = synchronized {
    SQL"select * from event where id > $id order by id limit $limit".as(entry.*)
  }

  /** The last entries, at most `limit`, in order. */
  def latest(limit: Int): Seq[LogEntry] = synchronized {
    SQL"select * from event order by id desc limit $limit".as(entry.*).reverse
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
    (long("id") ~ long("received") ~ int("master") ~ int("boot") ~ long("number") ~ int("kind") ~
      int("position") ~ int("node") ~ int("sequence") ~ int("state") ~ int("epoch") ~ long("slave_time") ~
      long("master_time")).map {
      case id ~ received ~ master ~ boot ~ number ~ kind ~ position ~ node ~ sequence ~ state ~ epoch ~
          slave ~ time =>
        val event = Event(kind, position, node, sequence, state, epoch, slave, time)
        LogEntry(id, Instant.ofEpochMilli(received), Life(master, boot), number, event)
    }

  /** Opens the database at `path`, or makes it; Left: why that is not possible. */
  def open(path: Path): Either[String, EventStore] =
    try {
      val connection = DriverManager.getConnection(s"jdbc:sqlite:$path")
      try prepare(connection).map(_ => new EventStore(connection)).left.map { why => connection.close(); why }
      catch { case e: SQLException => connection.close(); throw e }
    } catch {
      case e: SQLException => Left(s"The database $path cannot be used (${e.getMessage.takeWhile(_ != '\n')}).")
    }

  private def prepare(connection: Connection): Either[String, Unit] = {
    implicit val sql: Connection = connection
    SQL"pragma busy_timeout = 5000".execute()
    val version = SQL"pragma user_version".as(scalar[Int].single)
    val tables  = SQL"select count(*) from sqlite_master".as(scalar[Int].single)
    if (version != SchemaVersion && (version != 0 || tables != 0))
      Left("The database is not one of this program and version.")
    else {
      // An acknowledged event must survive a power failure: commits wait for the disk.
      SQL"pragma journal_mode = wal".execute()
      SQL"pragma synchronous = full".execute()
      SQL"""create table if not exists life (
              id integer primary key, master integer not null, boot integer not null, next integer not null,
              counter integer not null, unique (master, boot))""".execute()
      SQL"""create table if not exists event (
              id integer primary key autoincrement, received integer not null, master integer not null,
              boot integer not null, number integer not null, kind integer not null, position integer not null,
              node integer not null, sequence integer not null, state integer not null, epoch integer not null,
              slave_time integer not null, master_time integer not null,
              unique (master, boot, number))""".execute()
      SQL"pragma user_version = 1".execute()
      Right(())
    }
  }
}
