package flyframe.server

import java.io.OutputStream
import java.net.InetAddress
import java.util.concurrent.{CountDownLatch, Executors, RejectedExecutionException, TimeUnit}
import java.util.logging.{Level, Logger}
import scala.util.control.NonFatal

/** The server of the smoke-alarm system (docs/server.md): takes the reports of masters, keeps the log, serves
  * the page.
  */
object Server {

  /** A server that runs until it is closed. */
  final class Running private[Server] (
      options: Options,
      store: EventStore,
      udp: UdpLink,
      feed: PageFeed,
      web: WebServer,
      stopWorking: () => Unit
  ) extends AutoCloseable {

    /** Port of the page; of the reports. */
    val httpPort: Int = web.port
    val udpPort: Int  = udp.port

    /** Address of the page; of the reports. */
    val page: String    = s"http://${shown(options.listen)}:$httpPort/"
    val reports: String = s"${shown(options.listen)}:$udpPort"

    /** Takes no more reports, closes the pages and the log. */
    def close(): Unit = {
      udp.close()
      stopWorking()
      feed.close()
      web.close()
      store.close()
    }
  }

  private val TickMs = 20L

  /** What is being written gets so much time at the end, ms. */
  private val StopMs = 5000L

  // Held here: loggers that nobody holds forget their level. What they tell below a warning is of no use.
  private val quiet = Seq("org.xnio", "io.undertow", "org.jboss").map(Logger.getLogger)

  /** Starts a server; Left: why that is not possible, in one sentence. */
  def start(options: Options): Either[String, Running] = {
    quiet.foreach(_.setLevel(Level.WARNING))
    for {
      file     <- options.key.toRight("Give the keys of the masters (--key FILE): no report counts without.")
      keys     <- Keys.read(file)
      expected <- options.expected.map(Expected.read).getOrElse(Right(Expected()))
      store    <- EventStore.open(options.database)
      socket   <- closing(store)(UdpLink.bind(options.listen, options.udpPort))
      running <- closing(socket)(closing(store) {
        // Two threads, since what has to be done in time must not wait for the disk.
        val ticking = Executors.newSingleThreadScheduledExecutor()
        val writing = Executors.newSingleThreadExecutor()
        lazy val supervisor: Supervisor = new Supervisor(
          options,
          keys,
          expected,
          store,
          (datagram, to) => udp.send(datagram, to),
          () => feed.changed(),
          work => writing.execute(() => guarded(work()))
        )
        lazy val udp  = new UdpLink(socket, (datagram, from) => supervisor.receive(datagram, from))
        lazy val feed = new PageFeed(() => supervisor.picture, store, expected)
        def stopWorking(): Unit = for (executor <- Seq(ticking, writing)) {
          executor.shutdown()
          executor.awaitTermination(StopMs, TimeUnit.MILLISECONDS)
        }
        val stopper: AutoCloseable = () => stopWorking()
        closing(stopper)(closing(feed)(WebServer.start(options, supervisor, store, feed, expected))).map {
          web =>
            ticking.scheduleWithFixedDelay(
              () => guarded(supervisor.tick()),
              TickMs,
              TickMs,
              TimeUnit.MILLISECONDS
            )
            udp.start()
            new Running(options, store, udp, feed, web, () => stopWorking())
        }
      })
    } yield running
  }

  private def guarded(body: => Unit): Unit =
    try body
    catch {
      case _: RejectedExecutionException => () // the server ends
      case NonFatal(e)                   => Console.err.println(s"The server could not do its work: $e")
    }

  /** Closes what has been opened if what comes after it fails. */
  private def closing[A](opened: AutoCloseable)(body: => Either[String, A]): Either[String, A] =
    try {
      val result = body
      if (result.isLeft) opened.close()
      result
    } catch { case e: Throwable => opened.close(); throw e }

  private def shown(address: InetAddress): String = address match {
    case v6: java.net.Inet6Address => s"[${v6.getHostAddress}]"
    case v4                        => v4.getHostAddress
  }

  /** Runs the command line `args` until the process is ended; the result is the exit code. */
  def run(args: Seq[String]): Int =
    Options.parse(args) match {
      case Right(Left(help)) => println(help); 0
      case parsed =>
        val started = for (r <- parsed; options <- r; running <- start(options)) yield (options, running)
        started match {
          case Left(sentence) =>
            Console.err.println(sentence)
            2
          case Right((options, running)) =>
            val ended = new CountDownLatch(1)
            sys.addShutdownHook {
              running.close()
              ended.countDown()
            }
            println(s"page: ${running.page}")
            println(s"reports: udp ${running.reports}")
            if (options.withInput) endWithInput()
            ended.await()
            0
        }
    }

  /** What comes there is of no interest. */
  private def endWithInput(): Unit = {
    val reader = new Thread(() =>
      try System.in.transferTo(OutputStream.nullOutputStream)
      finally sys.exit(0)
    )
    reader.setDaemon(true)
    reader.start()
  }

  def main(args: Array[String]): Unit = sys.exit(run(args.toSeq))
}
