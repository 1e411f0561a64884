package flyframe.e2e

import java.nio.file.{Files, Path, Paths}
import java.time.Instant
import java.time.temporal.ChronoUnit.MICROS
import java.util.HexFormat
import scala.util.{Random, Using}
import flyframe.protocol.{DetectorState, EventKind, SlaveStatus}
import flyframe.server.{Event, Life, ModelMaster, Options, Server}

/** Times of events from the report's arrival at the server, ms.
  *
  * @param document
  *   until the page's document shows them
  * @param screen
  *   until the browser has drawn that
  * @param clockError
  *   by how much the clock of the page, which runs by itself once the page is loaded, differs from the
  *   computer's at the end
  */
final case class PageTimes(document: Seq[Double], screen: Seq[Double], clockError: Double) {
  private def spread(times: Seq[Double]) = {
    def hundredths(v: Double) = math.round(v * 100) / 100.0
    val sorted                = times.sorted
    ujson.Obj("median" -> hundredths(sorted(sorted.size / 2)), "worst" -> hundredths(sorted.last))
  }

  def json: String = ujson.write(
    ujson.Obj(
      "events"         -> document.size,
      "to_document_ms" -> spread(document),
      "to_screen_ms"   -> spread(screen),
      "clock_error_ms" -> math.round(clockError * 100) / 100.0
    ),
    indent = 2
  )
}

/** Measures how long an event takes from a master's UDP report to the page: a real server with its log, and
  * headless Chromium. The page itself notes when it shows an event, by the clock of this computer.
  *
  * {{{sbt "Test / runMain flyframe.e2e.PageLatency 1000 build/page-latency.json"}}}
  */
object PageLatency {
  private val Slaves      = 5
  private val HeartbeatMs = 1000 // as the master's register has it after reset

  /** Pauses between two events, ms: from the first, at random up to the second. */
  private val Pauses = (30, 230)

  /** Notes for every new entry of the log when it is in the document, when it has been drawn, and what the
    * cards say then.
    */
  private val observe =
    """window.clock = () => performance.timeOrigin + performance.now();
      |window.shown = new Map();
      |new MutationObserver(changes => {
      |  const document_ = clock();
      |  const states = [...document.querySelectorAll(".card[data-state]")].map(c => c.dataset.state).join();
      |  const ids = changes.flatMap(c => [...c.addedNodes]).map(row => Number(row.dataset.id));
      |  requestAnimationFrame(() => {
      |    const drawn = new MessageChannel;
      |    drawn.port1.onmessage = () => {
      |      const screen = clock();
      |      ids.forEach(id => shown.set(id, [document_, screen, states]));
      |    };
      |    drawn.port2.postMessage(0);
      |  });
      |}).observe(document.querySelector("#log"), { childList: true });""".stripMargin

  /** ms since 1970, with microseconds. */
  private def now: Double = MICROS.between(Instant.EPOCH, Instant.now) / 1000.0

  /** @param folder
    *   for the server's log
    */
  def measure(events: Int, folder: Path, seed: Long = 1): PageTimes = {
    val options = Options(
      httpPort = 0,
      udpPort = 0,
      database = folder.resolve("log.db"),
      key = Some(AlarmSystem.makeKey(folder.resolve("key")))
    )
    val key = Files.readString(options.key.get).trim
    Using.resource(Server.start(options).fold(why => throw new AssertionError(why), identity)) { server =>
      Using.resource(new ModelMaster(Life(1, 1), server.udpPort, HexFormat.of.parseHex(key))) { master =>
        Using.resource(new Browser(server.page))(run(master, _, events, new Random(seed)))
      }
    }
  }

  private def run(master: ModelMaster, browser: Browser, events: Int, random: Random): PageTimes = {
    val states         = Array.fill(Slaves)(DetectorState.Normal)
    val sequences      = Array.fill(Slaves)(1)
    def record(i: Int) = Event(EventKind.Detector, i, i + 1, sequences(i), states(i), 1)
    def line = ModelMaster.line(
      states.toSeq.map(s => if (s == DetectorState.Alarm) SlaveStatus.Alarm else 0): _*
    )
    val begin = (0 until Slaves).map(record)
    master.happen(begin: _*)
    master.line(line: _*)
    master.settle()
    until("the line is shown", master)(browser.detectors == Seq.fill(Slaves)("normal"))
    browser.script(observe)

    var heartbeat = now
    val sent = for (n <- 1 to events) yield {
      val slave = random.nextInt(Slaves)
      states(slave) = DetectorState.Normal + DetectorState.Alarm - states(slave)
      sequences(slave) += 1
      master.happen(record(slave))
      master.line(line: _*)
      val at = now
      master.report()
      master.listen(Pauses._1 + random.nextInt(Pauses._2 - Pauses._1))
      until(s"event $n is shown", master)(browser.script("return shown.size") == n)
      if (now > heartbeat + HeartbeatMs) {
        heartbeat = now
        master.report()
        master.listen(random.nextInt(Pauses._1) + 1)
      }
      val expected = states.map(s => if (s == DetectorState.Alarm) "alarm" else "normal").mkString(",")
      (at, begin.size + n, expected)
    }

    val times = for ((at, id, expected) <- sent) yield {
      val seen = browser.script(s"return shown.get($id).join('|')").toString.split('|')
      require(seen(2) == expected, s"event $id: the page shows ${seen(2)} and not $expected")
      (seen(0).toDouble - at, seen(1).toDouble - at)
    }
    val error = browser.script("return String(clock() - Date.now())").toString.toDouble
    PageTimes(times.map(_._1), times.map(_._2), error)
  }

  /** Repeats the report, as a master does, until it holds. */
  private def until(what: String, master: ModelMaster)(holds: => Boolean): Unit = {
    val end = System.nanoTime + 60000000000L
    while (!holds) {
      require(System.nanoTime < end, s"not within a minute: $what")
      master.listen(20)
      if (master.waiting > 0) master.report()
    }
  }

  /** Arguments: number of events (1000), file (standard output). */
  def main(args: Array[String]): Unit = {
    val json =
      measure(args.lift(0).fold(1000)(_.toInt), AlarmSystem.emptyFolder(Paths.get("build/page-latency"))).json
    args.lift(1).map(Paths.get(_)) match {
      case Some(file) =>
        Files.createDirectories(file.toAbsolutePath.getParent); Files.writeString(file, json + "\n")
      case None => println(json)
    }
  }
}
