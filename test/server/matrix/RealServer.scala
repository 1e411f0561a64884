package flyframe.matrix

import java.net.{InetAddress, InetSocketAddress}
import java.nio.file.{Files, Path, StandardCopyOption}
import java.sql.{Connection, DriverManager}
import java.time.Instant
import scala.collection.mutable
import scala.util.Random
import flyframe.protocol.ServerDatagram
import flyframe.server.{EventStore, Expected, Keys, Life, Options, Protocol, Reported, Supervisor}
import flyframe.{server => real, system => model}
import flyframe.system.{AlarmServer, ServerState}

/** The real server with its log, in a model of the system: datagrams with tags, without sockets, in the
  * model's time. It can be down, have another key, and a log that is locked or cannot be written.
  *
  * @param directory
  *   for its database
  */
class RealServer(directory: Path, random: Random, changed: () => Unit)
    extends AlarmServer
    with AutoCloseable {
  import ServerState._

  private val path  = directory.resolve("log.db")
  private val aside = directory.resolve("aside.db")
  private val here  = new InetSocketAddress(InetAddress.getByAddress(Array[Byte](127, 0, 0, 1)), 5000)
  private val key   = Array.tabulate[Byte](ServerDatagram.KeyBytes)(i => (3 * i + 1).toByte)
  private val wrong = key.map(b => (b ^ 1).toByte)

  private var now                = 0L
  private var state: ServerState = Works
  private var lock               = Option.empty[Connection]
  private val sent               = mutable.Buffer.empty[Array[Byte]]
  private var store              = open()
  private var supervisor         = start(key)
  private val jobs               = mutable.Queue.empty[() => Unit]
  private var lockedUntil        = 0L

  // In the model's time it waits for `LockTime`.
  private def open() =
    EventStore.open(path, patienceMs = 1).fold(why => throw new IllegalStateException(why), identity)

  private def start(with_ : Array[Byte]) = new Supervisor(
    Options(),
    new Keys(Some(with_)),
    Expected(),
    store,
    (datagram, _) => sent += datagram,
    changed,
    job => jobs += job,
    () => now / 1000,
    () => Instant.ofEpochMilli(1700000000000L + now / 1000),
    () => random.nextLong()
  )

  /** What the server does in the background takes as long as the lock of a database is waited for. */
  private def work(): Unit = while (jobs.nonEmpty && now >= lockedUntil) {
    val job = jobs.dequeue()
    job()
    if (lock.nonEmpty) lockedUntil = now + RealServer.LockTime
  }

  private def moveLog(from: Path, to: Path): Unit = Files.move(from, to, StandardCopyOption.ATOMIC_MOVE)

  override def set(next: ServerState): Unit = if (next != state) {
    // What was wrong ends.
    state match {
      case Locked   => unlock()
      case DiskFull => moveLog(aside, path)
      case _        =>
    }
    lockedUntil = 0
    work()
    if (Set[ServerState](Down, Refuses)(state) || Set[ServerState](Down, Refuses)(next)) {
      if (state != Down) store.close()
      jobs.clear()
      sent.clear()
      if (next != Down) {
        store = open()
        supervisor = start(if (next == Refuses) wrong else key)
      }
    }
    next match {
      case Locked =>
        val other = DriverManager.getConnection(s"jdbc:sqlite:$path")
        other.createStatement.execute("begin immediate")
        lock = Some(other)
      // The server notices it as it does a disk that is full: no transaction begins.
      case DiskFull => moveLog(path, aside)
      case _        =>
    }
    state = next
    changed()
  }

  private def unlock(): Unit = {
    lock.foreach { c =>
      c.createStatement.execute("rollback")
      c.close()
    }
    lock = None
  }

  override def report(r: model.Report, genuine: Boolean, at: Long): Unit = {
    now = at
    if (state != Down) {
      val report = real.Report(
        Life(r.master, r.life),
        r.server,
        r.counter.toLong,
        r.number.toLong,
        r.events.map { e =>
          real.Event(e.kind, e.position, e.node, e.sequence, e.state, e.epoch, e.slaveTime, e.masterTime)
        }.toVector,
        r.slaves.map(s => Reported(s.status, s.node)).toVector,
        r.time,
        r.status,
        r.lost.toLong,
        r.present,
        cut = r.cut,
        refused = r.refused
      )
      // Who forges knows everything but the key.
      supervisor.receive(Protocol.encode(report, if (genuine) key else wrong.reverse), here)
      work()
    }
  }

  override def tick(at: Long): Unit = {
    now = at
    if (state != Down) {
      work()
      supervisor.tick()
      work()
    }
  }

  override def answers(): Seq[model.Answer] = {
    val all = sent.toList
    sent.clear()
    all.map { datagram =>
      val right = Protocol.answer(datagram, key)
      val a     = right.getOrElse(real.Answer(Life(0, 0), 0, 0, 0, 0))
      model.Answer(
        right.nonEmpty,
        a.life.number,
        a.server,
        a.echo.toInt,
        a.number.toInt,
        a.trouble,
        a.ticket.toInt,
        a.order,
        a.node
      )
    }
  }

  private def seen = Option.when(state != Down)(supervisor.picture)

  override def picture: Option[Seq[model.ReportedSlave]] =
    for (p <- seen; m <- p.masters.headOption; _ <- m.master.heardMs)
      yield m.master.line.slaves.map(s => model.ReportedSlave(s.status, s.node))

  override def log: Seq[model.Event] = store.after(0, Int.MaxValue).filterNot(_.again).map(_.event).map { e =>
    model.Event(e.kind, e.position, e.node, e.sequence, e.state, e.epoch, e.slaveTime, e.masterTime)
  }

  override def notices: Set[String] = seen.fold(Set.empty[String]) { p =>
    val refused = p.refused.collect {
      case (name, count) if count > 0 => name
    }.toSet - "replayed" - "unproven"
    // Here the server has no list: that is no fault of the system.
    val said = p.masters.flatMap(_.json("notices").arr.map(_.str)).filterNot(_.startsWith("There is no list"))
    refused ++ p.broken.map(_ => "log") ++ p.masters.filter(_.losesFrames).map(_ => "frames lost") ++ said
  }

  override def order(kind: Int): Unit =
    if (state != Down) supervisor.order(1, kind, ServerDatagram.AllNodes, 0): Unit

  override def close(): Unit = {
    unlock()
    if (state != Down) store.close()
  }
}

object RealServer {

  /** How long the server waits for a locked database, in us. */
  val LockTime = 1000000L
}
