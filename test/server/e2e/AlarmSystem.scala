package flyframe.e2e

import java.io.{BufferedReader, InputStreamReader}
import java.net.{StandardProtocolFamily, UnixDomainSocketAddress}
import java.nio.channels.{Channels, SocketChannel}
import java.nio.charset.StandardCharsets.UTF_8
import java.nio.file.attribute.PosixFilePermissions
import java.nio.file.{Files, Path, Paths}
import java.security.SecureRandom
import java.sql.DriverManager
import java.util.concurrent.TimeUnit
import scala.jdk.CollectionConverters._
import scala.sys.process.{Process, ProcessLogger}
import flyframe.cosim.Harness
import flyframe.params.Presets
import flyframe.server.{Options, Server}

/** What a test of the whole system stands on: a simulated line as a process of its own, a server, its log.
  *
  * @param name
  *   of the test; its files are in `build/e2e/NAME`
  * @param settings
  *   options of `flyframe-alarm`
  */
final class AlarmSystem(name: String, settings: String*) extends AutoCloseable {
  import AlarmSystem._

  val folder: Path    = emptyFolder(Paths.get("build/e2e").resolve(name))
  val database: Path  = folder.resolve("log.db")
  val linePcap: Path  = folder.resolve("line.pcap")
  val plantPcap: Path = folder.resolve("plant.pcap")
  private val key     = makeKey(folder.resolve("key"))
  private var running = Option.empty[Server.Running]
  private val udpPort = startServer(0).udpPort
  private val line = new AlarmLine(
    folder,
    udpPort,
    key,
    Seq("--line-pcap", s"$linePcap", "--plant-pcap", s"$plantPcap") ++ settings
  )

  private def startServer(port: Int): Server.Running = {
    val options = Options(
      httpPort = 0,
      udpPort = port,
      database = database,
      key = Some(key),
      masterTimeoutMs = 60000, // of real time, in which the simulation comes far less far
      commandIntervalMs = 3000
    )
    val server = Server.start(options).fold(why => throw new AssertionError(why), identity)
    running = Some(server)
    server
  }
  def page: String = running.get.page

  /** The server ends; it starts again, at the same port and with the same log. */
  def stopServer(): Unit = {
    running.foreach(_.close())
    running = None
  }
  def restartServer(): Unit = startServer(udpPort)

  /** A line for the bench, see src/sim/README.md; its answer. */
  def bench(command: String): String = line.ask(command)
  def status: ujson.Value            = ujson.read(line.ask("status"))

  /** Simulates for at least so long. */
  def simulate(us: Double): Unit = {
    val end = status("time_us").num + us
    await(s"$us us of simulated time")(status("time_us").num >= end)
  }

  /** All events in the log. */
  def log: Seq[Logged] = {
    val connection = DriverManager.getConnection(s"jdbc:sqlite:$database")
    try {
      val rows = connection.createStatement.executeQuery("select * from event order by id")
      Iterator
        .continually(rows)
        .takeWhile(_.next())
        .map(r =>
          Logged(
            r.getInt("boot"),
            r.getInt("number"),
            r.getInt("kind"),
            r.getInt("position"),
            r.getInt("node"),
            r.getInt("sequence"),
            r.getInt("state"),
            r.getInt("epoch")
          )
        )
        .toVector
    } finally connection.close()
  }

  /** Waits until the condition holds; fails with what is known of the system. */
  def await(what: String, seconds: Int = 150)(condition: => Boolean): Unit = {
    val end = System.nanoTime + seconds * 1000000000L
    while (!condition) {
      if (System.nanoTime > end)
        throw new AssertionError(
          s"$name: $what did not happen.\nstatus: $status\nlog:\n${log.mkString("\n")}"
        )
      Thread.sleep(50)
    }
  }

  /** What tshark says of a recording, once the line has ended. */
  def close(): Unit = {
    line.close()
    stopServer()
  }
}

/** An event in the log. */
final case class Logged(
    boot: Int,
    number: Int,
    kind: Int,
    position: Int,
    node: Int,
    sequence: Int,
    state: Int,
    epoch: Int
)

/** The process `flyframe-alarm`, and its control socket. */
final class AlarmLine(folder: Path, serverPort: Int, key: Path, settings: Seq[String]) extends AutoCloseable {
  private val socket = folder.resolve("control.sock")
  private val errors = folder.resolve("line.log")
  private val process = {
    val options = Seq(
      "--server-port",
      s"$serverPort",
      "--key",
      s"$key",
      "--state",
      s"${folder.resolve("state")}",
      "--control",
      s"$socket"
    )
    new ProcessBuilder(((AlarmSystem.program.toString +: options) ++ settings).asJava)
      .redirectError(errors.toFile)
      .start()
  }
  private val ready = new BufferedReader(new InputStreamReader(process.getInputStream)).readLine()
  assert(ready != null && ready.startsWith("ready: "), Files.readString(errors))
  private val channel = SocketChannel.open(StandardProtocolFamily.UNIX)
  channel.connect(UnixDomainSocketAddress.of(socket))
  private val (in, out) =
    (new BufferedReader(Channels.newReader(channel, UTF_8)), Channels.newWriter(channel, UTF_8))

  /** The answer behind `ok`. */
  def ask(line: String): String = synchronized {
    out.write(s"$line\n")
    out.flush()
    val answer = in.readLine()
    assert(answer != null && answer.startsWith("ok"), s"$line: $answer\n${Files.readString(errors)}")
    answer.drop(3)
  }

  /** Ends the process, and makes sure that it ends well. */
  def close(): Unit = {
    if (process.isAlive) ask("quit")
    assert(process.waitFor(30, TimeUnit.SECONDS) && process.exitValue == 0, Files.readString(errors))
  }
}

object AlarmSystem {

  /** The simulator, built when it is first needed. */
  lazy val program: Path =
    new Harness(
      "alarm-test", // not that of `make alarm-sim`, whose host programs see the headers of generated/
      Seq("alarm-master", "alarm-slave").map(Presets.named(_).get.params),
      "-O3"
    ).alarmProgram

  def emptyFolder(path: Path): Path = {
    if (Files.exists(path)) {
      val all = Files.walk(path)
      try all.sorted(java.util.Comparator.reverseOrder[Path]).forEach(p => Files.delete(p))
      finally all.close()
    }
    Files.createDirectories(path)
  }

  /** A key for the owner of the file only. */
  def makeKey(path: Path): Path = {
    val bytes = new Array[Byte](32)
    new SecureRandom().nextBytes(bytes)
    Files.createFile(path, PosixFilePermissions.asFileAttribute(PosixFilePermissions.fromString("rw-------")))
    Files.writeString(path, bytes.map(b => f"$b%02x").mkString("", "", "\n"))
  }

  /** What tshark prints. */
  def tshark(recording: Path, options: String*): Seq[String] =
    Process(Seq("tshark", "-r", recording.toString) ++ options).!!(ProcessLogger(_ => ())).linesIterator.toSeq
}
