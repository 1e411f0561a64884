package flyframe.e2e

import java.nio.file.{Files, Path, Paths}
import org.scalatest.flatspec.AnyFlatSpec
import scala.sys.process.{Process, ProcessLogger}

/** What is wrong is told: by the simulator, and by hosts that were given nonsense. */
class MistakesSpec extends AnyFlatSpec {
  private val folder = AlarmSystem.emptyFolder(Paths.get("build/e2e/mistakes"))
  private val key    = AlarmSystem.makeKey(folder.resolve("key"))
  private val unused = 9 // port of a server that is not there

  "flyframe-alarm" should "answer a mistake with one sentence and exit code 2" in {
    val short = Files.writeString(folder.resolve("short"), "abc\n")
    val good  = Seq("--server-port", s"$unused", "--key", s"$key", "--state", s"$folder/state")
    def without(option: String) = good.patch(good.indexOf(option), Nil, 2)
    val mistakes = Seq[(String, Seq[String])](
      "no server"             -> without("--server-port"),
      "no key"                -> without("--key"),
      "key that is not there" -> (without("--key") ++ Seq("--key", "none")),
      "key too short"         -> (without("--key") ++ Seq("--key", s"$short")),
      "too many slaves"       -> (good ++ Seq("--slaves", "65")),
      "no number"             -> (good ++ Seq("--bus-cycle-us", "fast")),
      "no port"               -> (without("--server-port") ++ Seq("--server-port", "0")),
      "less than no events"   -> (good ++ Seq("--measure", "-1")),
      "less than no datagram" -> (good ++ Seq("--flood", "-1")),
      "less than no errors"   -> (good ++ Seq("--bit-errors", "-1")),
      "less than no seed"     -> (good ++ Seq("--seed", "-1")),
      "state that is a file"  -> (without("--state") ++ Seq("--state", s"$short")),
      "recording nowhere"     -> (good ++ Seq("--line-pcap", s"$folder/none/x.pcap")),
      "unknown option"        -> (good :+ "--nonsense")
    )
    for ((what, arguments) <- mistakes) {
      var said = Vector.empty[String]
      val code = Process(AlarmSystem.program.toString +: arguments).!(ProcessLogger(line => said :+= line))
      assert(code == 2 && said.size == 1, s"$what: $code, $said")
    }
  }

  private def withLine(name: String, options: String*)(check: AlarmLine => Unit): Unit = {
    val own: Path = AlarmSystem.emptyFolder(folder.resolve(name))
    val line      = new AlarmLine(own, unused, key, "--slaves" +: "2" +: options)
    try check(line)
    finally line.close()
  }

  /** The status when so much time has been simulated. */
  private def after(line: AlarmLine, us: Double): ujson.Value = {
    val status = ujson.read(line.ask("status"))
    if (status("time_us").num >= us) status
    else {
      Thread.sleep(50)
      after(line, us)
    }
  }

  "ALARM-08, DET-07: a slave whose node ID is nonsense" should "say so, and watch its detector" in
    withLine("node-id", "--node-id", "65534", "--unlisted") { line =>
      val slaves = after(line, 3000)("slaves").arr
      assert(slaves.map(_("self_test").num.toInt) == Seq(1, 6))
      assert(slaves(0)("notice").str == "" && slaves(1)("notice").str.startsWith("The node ID"))
      assert(slaves.map(_("supply").bool) == Seq(true, true))
      line.ask("smoke 2 on")
      val burning = after(line, 10000)
      assert(burning("slaves")(1)("buzzer").bool)
      assert(burning("master")("sounder").bool && burning("master")("fire").bool)
    }

  "HOST-02: a master whose bus cycle is nonsense" should "say so, and take its own" in
    withLine("bus-cycle", "--bus-cycle-us", "5") { line =>
      val status = after(line, 10000)
      val master = status("master")
      assert(master("self_test").num == 13 && master("notice").str.startsWith("The bus cycle"))
      // 1 ms; some more frames when the line is new.
      assert(status("line")("back").num > 5 && status("line")("sent").num < 30)
      assert(status("plant")("from_master").num > 0)
    }
}
