package flyframe.server

import java.io.IOException
import java.sql.SQLException
import java.util.concurrent.{Executors, RejectedExecutionException, ScheduledExecutorService, TimeUnit}
import java.util.concurrent.atomic.{AtomicBoolean, AtomicLong}
import scala.collection.mutable
import scala.util.control.NonFatal
import io.undertow.server.handlers.sse.ServerSentEventConnection

/** Pushes picture and log to the open pages. A page gets the next message when it has taken the one before,
  * so that a slow one misses pictures in between, but neither the last one nor an entry of the log.
  *
  * A message: `{"state": picture, "log": [entries], "fresh": true}`; fresh: the log begins anew. While the
  * log cannot be read pages are told everything else.
  */
final class PageFeed(picture: () => Picture, store: EventStore, expected: Expected) extends AutoCloseable {
  import PageFeed._

  private class Client(val connection: ServerSentEventConnection) {
    var upTo      = Option.empty[Long] // last entry of the log it has
    var version   = -1L                // of the picture it has
    var busySince = Option.empty[Long] // it has not taken the last message yet
  }
  private val clients = mutable.Set.empty[Client]
  private val executor: ScheduledExecutorService = Executors.newSingleThreadScheduledExecutor { r =>
    val thread = new Thread(r, "pages")
    thread.setDaemon(true)
    thread
  }
  private val version            = new AtomicLong
  private val scheduled          = new AtomicBoolean
  @volatile private var pushedAt = 0L

  executor.scheduleWithFixedDelay(() => guarded(beat()), BeatMs, BeatMs, TimeUnit.MILLISECONDS)

  /** Something has changed that pages show. Returns at once. */
  def changed(): Unit = {
    version.incrementAndGet()
    schedule()
  }

  /** A page has been opened. */
  def add(connection: ServerSentEventConnection): Unit = run {
    if (clients.size >= MostClients) connection.close()
    else {
      val client = new Client(connection)
      clients += client
      connection.addCloseTask(_ => run(clients -= client))
      push(client)
    }
  }

  /** Pages that are open. */
  def size: Int = executor.submit(() => clients.size).get

  // All that follows runs in the executor.
  private def run(body: => Unit): Unit = unlessClosed(executor.execute(() => guarded(body)))
  private def unlessClosed(body: => Unit): Unit =
    try body
    catch { case _: RejectedExecutionException => () }
  private def guarded(body: => Unit): Unit =
    try body
    catch { case NonFatal(e) => Console.err.println(s"The pages could not be told: $e") }

  private def schedule(): Unit = if (scheduled.compareAndSet(false, true)) {
    val wait = math.max(0, pushedAt + PauseMs - now)
    def push(): Unit = guarded {
      scheduled.set(false)
      pushAll()
    }
    unlessClosed(executor.schedule((() => push()): Runnable, wait, TimeUnit.MILLISECONDS))
  }

  private def pushAll(): Unit = {
    pushedAt = now
    clients.foreach(push)
  }

  /** Tells pages that the server lives, and gives up those that take nothing. */
  private def beat(): Unit = {
    clients.filter(_.busySince.exists(now - _ > PatienceMs)).foreach(_.connection.close())
    version.incrementAndGet()
    pushAll()
  }

  private def push(client: Client): Unit = if (client.busySince.isEmpty && client.version != version.get) {
    client.version = version.get
    client.busySince = Some(now)
    val log =
      try Some(client.upTo.fold(store.latest(LogShown))(store.after(_, LogShown)))
      catch { case _: SQLException => None }
    val entries = log.getOrElse(Nil)
    val message = ujson.Obj(
      "state" -> picture().json,
      "log"   -> entries.map(Picture.json(_, expected)),
      "fresh" -> (client.upTo.isEmpty && log.nonEmpty)
    )
    if (log.nonEmpty) client.upTo = entries.lastOption.map(_.id).orElse(client.upTo).orElse(Some(0L))
    // A full message may not be the last one.
    if (entries.size == LogShown) client.version = -1
    client.connection.send(
      message.render(),
      new ServerSentEventConnection.EventCallback {
        def done(c: ServerSentEventConnection, data: String, event: String, id: String): Unit = run {
          client.busySince = None
          if (client.version != version.get) schedule()
        }
        def failed(
            c: ServerSentEventConnection,
            data: String,
            event: String,
            id: String,
            e: IOException
        ): Unit =
          run { clients -= client; c.close() }
      }
    )
  }

  def close(): Unit = {
    run(clients.foreach(_.connection.close()))
    executor.shutdown()
    executor.awaitTermination(1, TimeUnit.SECONDS)
  }

  private def now: Long = System.nanoTime() / 1000000
}

object PageFeed {

  /** Entries of the log in the page, at most; in a message, too. */
  val LogShown = 200

  /** Pages open at a time. */
  val MostClients = 32

  /** Time between two messages at least; without news at most; after which a page that takes nothing is given
    * up. Milliseconds.
    */
  private val PauseMs    = 25L
  private val BeatMs     = 5000L
  private val PatienceMs = 30000L
}
