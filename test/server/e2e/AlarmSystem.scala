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
import flyframe.Tier
import flyframe.cosim.Harness
import flyframe.params.Presets
import flyframe.server.{Options, PageClient, Server, ServerBench}

/** What a test of the whole system stands on: a simulated line as a process of its own, a server, its log.
  * The server expects the same slaves as the master, with the same labels.
  *
  * @param name
  *   of the test; its files are in `build/e2e/NAME`
  * @param settings
  *   options of `flyframe-alarm`
  * @param isAttacked
  *   somebody is between master and server
  */
final class AlarmSystem(name: String, settings: Seq[String] = Nil, isAttacked: Boolean = false)
    extends AutoCloseable {
  import AlarmSystem._

  val folder: Path    = emptyFolder(Paths.get("build/e2e").resolve(name))
  val database: Path  = folder.resolve("log.db")
  val linePcap: Path  = folder.resolve("line.pcap")
  val plantPcap: Path = folder.resolve("plant.pcap")
  val size: Int       = settings.indexOf("--slaves") match { case -1 => 5; case i => settings(i + 1).toInt }
  private val key     = makeKey(folder.resolve("key"))
  private lazy val otherKey = makeKey(folder.resolve("other-key"))
  private var running       = Option.empty[Server.Running]
  private val udpPort       = startServer(0, key).udpPort

  /** Who is between master and server. */
  lazy val attacker: Attacker = new Attacker(udpPort)
  private val line = new AlarmLine(
    folder,
    if (isAttacked) attacker.port else udpPort,
    key,
    Seq("--line-pcap", s"$linePcap", "--plant-pcap", s"$plantPcap") ++ settings
  )

  private def startServer(port: Int, key: Path): Server.Running = {
    val options = Options(
      httpPort = 0,
      udpPort = port,
      database = database,
      key = Some(key),
      expected = Some(expected(folder.resolve("expected.json"), size)),
      masterTimeoutMs = 60000, // of real time, in which the simulation comes far less far
      orderTimeoutMs = 60000
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
  def restartServer(): Unit = startServer(udpPort, key)

  /** Another server is there in its place, which knows another key. */
  def replaceServer(): Unit = {
    stopServer()
    startServer(udpPort, otherKey)
  }

  /** What the page shows of the master and its line, but for the log; None: there is no server. */
  def shown: Option[ujson.Value]   = picture.flatMap(_("masters").arr.headOption)
  def picture: Option[ujson.Value] = running.map(ServerBench.state)

  /** An order of the page, to all slaves if it names no node. */
  def order(command: (String, ujson.Value)*): Unit = {
    val fields = ("master" -> ujson.Num(1)) +: command
    val answer = new PageClient(running.get).command(ujson.Obj.from(fields))
    assert(answer.statusCode == 202, answer.body)
  }

  /** What a process that has the log open keeps the server from. */
  def lockLog(): AutoCloseable = {
    val other = DriverManager.getConnection(s"jdbc:sqlite:$database")
    other.createStatement.execute("begin immediate")
    other
  }

  /** A line for the bench, see src/sim/README.md; its answer. */
  def bench(command: String): String = line.ask(command)
  def status: ujson.Value            = ujson.read(line.ask("status"))

  def master: ujson.Value        = status("master")
  def slave(n: Int): ujson.Value = status("slaves")(n - 1)
  def timeUs: Double             = line.ask("time").stripSuffix(" ns").toDouble / 1000

  /** Waits until the condition holds, which must come to pass within so much simulated time. */
  def within(us: Double, what: String)(condition: => Boolean): Unit = {
    val end = timeUs + us
    await(what) {
      // What holds now may have begun to hold too late.
      val isInTime = timeUs <= end
      val holds    = condition
      if (!isInTime) throw new AssertionError(s"$name: $what did not happen within $us us.\nstatus: $status")
      holds
    }
  }

  /** Simulates for at least so long. */
  def simulate(us: Double): Unit = {
    val end = timeUs + us
    await(s"$us us of simulated time")(timeUs >= end)
  }

  /** All events in the log, without records that have come again (SRV-19). */
  def log: Seq[Logged] = {
    val connection = DriverManager.getConnection(s"jdbc:sqlite:$database")
    try {
      val rows = connection.createStatement.executeQuery("select * from event where again = 0 order by id")
      Iterator
        .continually(rows)
        .takeWhile(_.next())
        .map(r =>
          Logged(
            r.getLong("life"),
            r.getInt("number"),
            r.getInt("kind"),
            r.getInt("position"),
            r.getInt("node"),
            r.getInt("sequence"),
            r.getInt("state"),
            r.getInt("epoch"),
            r.getLong("slave_time")
          )
        )
        .toVector
    } finally connection.close()
  }

  /** Waits until the condition holds; fails with what is known of the system. */
  def await(what: String, seconds: Int = 300)(condition: => Boolean): Unit = {
    val end = System.nanoTime + seconds * 1000000000L
    while (!condition) {
      if (System.nanoTime > end)
        throw new AssertionError(
          s"$name: $what did not happen.\nstatus: $status\npage: $picture\nlog:\n${log.mkString("\n")}"
        )
      Thread.sleep(PollMs)
    }
  }

  def close(): Unit = {
    line.close()
    stopServer()
    if (isAttacked) attacker.close()
  }
}

/** An event in the log. */
final case class Logged(
    life: Long,
    number: Int,
    kind: Int,
    position: Int,
    node: Int,
    sequence: Int,
    state: Int,
    epoch: Int,
    slaveTime: Long
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
    val program = if (settings.contains("--ring")) AlarmSystem.ringProgram else AlarmSystem.program
    new ProcessBuilder(((program.toString +: options) ++ settings).asJava)
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
    assert(process.waitFor(120, TimeUnit.SECONDS) && process.exitValue == 0, Files.readString(errors))
  }
}

object AlarmSystem {

  /** Between two looks at what is waited for: some tenths of a millisecond of simulated time. */
  private val PollMs = 20L

  private def preset(name: String) = Tier.slowest(Presets.named(name).get.params)

  /** The simulator, built when it is first needed: not that of `make alarm-sim`, whose host programs see the
    * headers of generated/.
    */
  lazy val program: Path =
    new Harness("alarm-test", Seq("alarm-master", "alarm-slave").map(preset)).alarmProgram

  /** The one of a ring. Its slaves are acknowledged by write, which their program finds out. */
  lazy val ringProgram: Path = {
    val master = preset("alarm-master").copy(preset = "alarm-master-ring", linePorts = 2)
    val slave  = preset("alarm-slave").copy(acknowledgeByWrite = 1)
    new Harness("alarm-ring-test", Seq(master, slave)).alarmProgram
  }

  /** The list of slaves, as the simulator has it. */
  def expected(path: Path, size: Int): Path = {
    val slaves = (0 until size).map { i =>
      ujson.Obj("node" -> (i + 1), "label" -> label(i + 1), "zone" -> s"zone ${i / 2 + 1}")
    }
    val list = ujson.Obj("masters" -> ujson.Arr(ujson.Obj("id" -> 1, "expected" -> ujson.Arr.from(slaves))))
    Files.writeString(path, list.render())
  }

  /** Of a slave, on panel and page. */
  def label(slave: Int): String = s"${(slave + 1) / 2}${if (slave % 2 == 1) "A" else "B"}"

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
    val bytes = new Array[Byte](16)
    new SecureRandom().nextBytes(bytes)
    Files.createFile(path, PosixFilePermissions.asFileAttribute(PosixFilePermissions.fromString("rw-------")))
    Files.writeString(path, bytes.map(b => f"$b%02x").mkString("", "", "\n"))
  }

  /** What tshark prints. */
  def tshark(recording: Path, options: String*): Seq[String] =
    Process(Seq("tshark", "-r", recording.toString) ++ options).!!(ProcessLogger(_ => ())).linesIterator.toSeq
}
