package flyframe.ring

import java.io.{BufferedReader, InputStreamReader}
import java.net.{StandardProtocolFamily, UnixDomainSocketAddress}
import java.nio.channels.{Channels, SocketChannel}
import java.nio.charset.StandardCharsets.UTF_8
import java.nio.file.{Files, Path}
import java.util.concurrent.TimeUnit
import scala.jdk.CollectionConverters._
import flyframe.{Directory, Tier}
import flyframe.cosim.Harness
import flyframe.params.{EscParams, Presets}

/** The simulator of a fibre ring at work, behind its control socket.
  *
  * @param network
  *   the description of the ring; in `make test` its nodes are of 50 MHz unless it names a preset
  * @param options
  *   of the program
  */
final class RingProcess(network: ujson.Value, options: String*) {
  import RingProcess.{Came, Ended}

  val folder: Path   = Directory.lasting("ring")
  private val errors = folder.resolve("errors")
  private val socket = folder.resolve("control")
  private val file   = RingProcess.write(folder, network)
  private val process = {
    // Other suites have the other processor.
    val files     = Seq("--network", s"$file", "--state", s"${folder.resolve("state")}")
    val arguments = files ++ Seq("--control", s"$socket", "--processors", "1", "--with-parent")
    new ProcessBuilder((RingProcess.program +: (arguments ++ options)).asJava)
      .redirectError(errors.toFile)
      .start()
  }
  private val ready = new BufferedReader(new InputStreamReader(process.getInputStream)).readLine()
  assert(ready != null && ready.startsWith("ready: "), Files.readString(errors))
  private val channel = SocketChannel.open(StandardProtocolFamily.UNIX)
  channel.connect(UnixDomainSocketAddress.of(socket))
  private val in  = new BufferedReader(Channels.newReader(channel, UTF_8))
  private val out = Channels.newWriter(channel, UTF_8)

  /** The whole answer to a line. */
  def answer(line: String): String = {
    out.write(s"$line\n")
    out.flush()
    val text = in.readLine()
    assert(text != null, s"$line: no answer\n${Files.readString(errors)}")
    text
  }

  /** The answers to a line that is sent so often before any of them is read. */
  def answers(line: String, count: Int): Seq[String] = {
    out.write(s"$line\n" * count)
    out.flush()
    Seq.fill(count)(in.readLine())
  }

  /** What stands behind `ok`. */
  def ask(line: String): String = {
    val text = answer(line)
    assert(text.startsWith("ok"), s"$line: $text")
    text.drop(3)
  }

  def us(): Long                = ask("time").takeWhile(_.isDigit).toLong / 1000
  def status(): ujson.Value     = ujson.read(ask("status"))
  def node(n: Int): ujson.Value = status()("nodes")(n - 1)

  /** Lets time pass. */
  def run(us: Long): Unit = {
    val end = this.us() + us
    while (this.us() < end) Thread.sleep(2)
  }

  /** Until something holds, or fails after so much simulated time. */
  def await(what: String, withinUs: Long)(holds: => Boolean): Long = {
    val start = us()
    while (!holds) {
      assert(us() < start + withinUs, s"within $withinUs us not: $what\n${ask("status")}")
      Thread.sleep(2)
    }
    us() - start
  }

  private var came  = Map.empty[Int, Seq[Came]].withDefaultValue(Nil)
  private var ended = Map.empty[Int, Seq[Ended]].withDefaultValue(Nil)
  private def look(node: Int): Unit = {
    val now = ujson.read(ask(s"messages $node"))
    came += node -> (came(node) ++ now("came").arr.map(m =>
      Came(m("source").num.toInt, m("to_all").bool, m("urgent").bool, m("repeat").bool, m("data").str)
    ))
    ended += node -> (ended(node) ++ now("ended").arr.map(e =>
      Ended(e("tag").num.toInt, e("outcome").str, e("unconfirmed").arr.map(_.num.toInt).toSeq)
    ))
  }

  /** All messages that have come to a node; all that have ended at their sender. */
  def messages(node: Int): Seq[Came] = { look(node); came(node) }
  def ends(node: Int): Seq[Ended]    = { look(node); ended(node) }

  /** Hands a message to a node; its tag. */
  def send(node: Int, to: Int, data: Seq[Int], urgent: Boolean = false): Int =
    ask(s"${if (urgent) "urgent" else "send"} $node $to ${RingProcess.hex(data)}").toInt

  /** Until all ports are up and every node knows all others. */
  def awaitWhole(withinUs: Long): Unit = await("every node knows all others", withinUs) {
    val nodes     = status()("nodes").arr.toSeq.filter(n => n("host").str == "node")
    val addresses = nodes.map(_("address").num.toInt).toSet
    nodes.forall(n =>
      n.obj.get("members").exists(_.arr.map(_.num.toInt).toSet == addresses - n("address").num.toInt)
    )
  }

  /** Ends the process, and makes sure that it ends well. */
  def close(): Unit = {
    if (process.isAlive) ask("quit")
    assert(process.waitFor(120, TimeUnit.SECONDS) && process.exitValue == 0, Files.readString(errors))
  }
}

object RingProcess {

  /** A message that has come to a node; how one of its own has ended. */
  final case class Came(source: Int, toAll: Boolean, urgent: Boolean, repeat: Boolean, data: String)
  final case class Ended(tag: Int, outcome: String, unconfirmed: Seq[Int])

  private def preset(name: String) = Presets.named(name).get.params
  private def slow(p: EscParams)   = p.copy(preset = s"${p.preset}-50", coreClockMhz = 50)
  private val (node, pair)         = (preset("ring-node"), preset("ring-node-tp"))
  private lazy val harness = {
    val slowPair = if (Tier.isSoak) pair else slow(pair)
    new Harness("ring-sim", Seq(node, slow(node), slowPair, preset("ring-bus"), preset("ring-server")))
  }

  /** Nodes and nodes with a twisted pair: simulated twice as fast with 50 MHz, which is what `make test` has
    * time for.
    */
  val (ringNode, pairNode) =
    if (Tier.isSoak) (node.preset, pair.preset) else (slow(node).preset, slow(pair).preset)

  private def write(folder: Path, network: ujson.Value): Path = {
    val each = ujson.Obj.from(
      Seq[(String, ujson.Value)]("preset" -> ringNode) ++
        network.obj.get("each").fold(Seq.empty[(String, ujson.Value)])(_.obj.toSeq)
    )
    val whole = ujson.Obj.from(network.obj.toSeq.filterNot(_._1 == "each") :+ ("each" -> each))
    Files.writeString(folder.resolve("network.json"), ujson.write(whole))
  }

  /** The simulator, built when it is first needed. */
  lazy val program: String = harness.ringProgram.toString

  def hex(data: Seq[Int]): String = data.map(b => f"$b%02x").mkString

  /** A ring while a test needs it. */
  def using[A](network: ujson.Value, options: String*)(act: RingProcess => A): A = {
    val ring = new RingProcess(network, options: _*)
    try act(ring)
    finally ring.close()
  }

  /** A line of a log of candump.
    *
    * @param us
    *   when the frame began
    */
  final case class Logged(us: Long, frame: String)

  /** Runs a script through a ring until `endUs`: the same each time.
    *
    * @param logged
    *   nodes with CAN programs whose frames are wanted; the first one is 1
    * @return
    *   what passed at each of them, without errors and changes of state
    */
  def script(
      network: ujson.Value,
      lines: Seq[(Long, String)],
      endUs: Long,
      logged: Seq[Int]
  ): Map[Int, Seq[Logged]] = scriptWithErrors(network, lines, endUs, logged).map { case (n, all) =>
    n -> all.filterNot(_.frame.matches("200002(04|40|88|A0)#.*"))
  }

  /** The same, with errors and changes of state. */
  def scriptWithErrors(
      network: ujson.Value,
      lines: Seq[(Long, String)],
      endUs: Long,
      logged: Seq[Int]
  ): Map[Int, Seq[Logged]] = {
    val folder = Directory.lasting("ring")
    val file   = write(folder, network)
    val text   = lines.sortBy(_._1).map { case (us, line) => s"$us $line\n" }.mkString
    val script = Files.writeString(folder.resolve("script"), text)
    val logs   = logged.map(n => n -> folder.resolve(s"$n.log"))
    val files  = Seq("--network", s"$file", "--state", s"${folder.resolve("state")}", "--script", s"$script")
    val dumps  = logs.flatMap { case (n, log) => Seq("--candump", s"$n=$log") }
    val (said, code) = outputOf(
      files ++ dumps ++ Seq("--end-ms", s"${endUs / 1000.0}", "--processors", "1", "--with-parent"): _*
    )
    assert(code == 0, said)
    val Line = raw"\((\d+)\.(\d{6})\) can0 (\S+)".r
    logs.map { case (n, log) =>
      n -> Files.readAllLines(log).asScala.toSeq.collect { case Line(s, us, frame) =>
        Logged(s.toLong * 1000000 + us.toLong, frame)
      }
    }.toMap
  }

  /** What the program says, and its exit code, when it is started like that. */
  def outputOf(arguments: String*): (String, Int) = {
    val process = new ProcessBuilder((program +: arguments).asJava).redirectErrorStream(true).start()
    val text    = new String(process.getInputStream.readAllBytes(), UTF_8)
    (text, process.waitFor())
  }
}
