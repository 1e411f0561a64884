package flyframe.server

import java.io.File
import java.nio.file.{Files, Path, StandardCopyOption}
import java.time.Duration
import java.util.logging.{Level, Logger}
import scala.jdk.CollectionConverters._
import scala.util.Using
import org.openqa.selenium.{By, JavascriptExecutor, OutputType, WebElement}
import org.openqa.selenium.chrome.{ChromeDriver, ChromeDriverService, ChromeOptions}
import org.openqa.selenium.support.ui.WebDriverWait
import org.scalatest.BeforeAndAfterAll
import org.scalatest.flatspec.AnyFlatSpec
import ServerBench._
import flyframe.Directory
import flyframe.protocol.{DetectorState, EventKind, ServerDatagram}

/** The page in headless Chromium. Screenshots: build/page. */
class PageSpec extends AnyFlatSpec with BeforeAndAfterAll {
  private val (program, driverProgram) = (new File("/usr/bin/chromium"), new File("/usr/bin/chromedriver"))
  private lazy val browser: ChromeDriver = {
    for (file <- Seq(program, driverProgram))
      assert(
        file.exists,
        s"$file is missing: install the Debian packages chromium and chromium-driver (make tools-page)."
      )
    val options = new ChromeOptions
    options.setBinary(program)
    // As root, as in CI, there is no sandbox; only our own page is shown.
    options.addArguments(
      "--headless=new",
      "--no-sandbox",
      "--disable-gpu",
      "--disable-dev-shm-usage",
      "--lang=en"
    )
    // It misses a protocol of its own for this version of Chromium, which is not used.
    quiet.setLevel(Level.SEVERE)
    val service =
      new ChromeDriverService.Builder().usingDriverExecutable(driverProgram).usingAnyFreePort().build
    new ChromeDriver(service, options)
  }
  private val quiet             = Logger.getLogger("org.openqa.selenium")
  private var begun             = false
  override def afterAll(): Unit = if (begun) browser.quit()

  private def within(what: String, seconds: Int = 60)(holds: => Boolean): Unit =
    new WebDriverWait(browser, Duration.ofSeconds(seconds.toLong), Duration.ofMillis(20))
      .withMessage(what)
      .ignoring(classOf[org.openqa.selenium.StaleElementReferenceException])
      .until(_ => holds)
  private def all(css: String): Seq[WebElement] = browser.findElements(By.cssSelector(css)).asScala.toSeq
  private def one(css: String): WebElement      = browser.findElement(By.cssSelector(css))
  private def script(code: String, args: AnyRef*): AnyRef =
    browser.asInstanceOf[JavascriptExecutor].executeScript(code, args: _*)
  private def screenshot(name: String): Unit = {
    val to = Path.of("build/page")
    Files.createDirectories(to)
    Files.move(
      browser.getScreenshotAs(OutputType.FILE).toPath,
      to.resolve(s"$name.png"),
      StandardCopyOption.REPLACE_EXISTING
    )
  }
  private def size(width: Int, height: Int): Unit =
    browser.executeCdpCommand(
      "Emulation.setDeviceMetricsOverride",
      Map[String, AnyRef](
        "width"             -> Integer.valueOf(width),
        "height"            -> Integer.valueOf(height),
        "deviceScaleFactor" -> Integer.valueOf(1),
        "mobile"            -> java.lang.Boolean.valueOf(width < 600)
      ).asJava
    )
  private def scheme(name: String): Unit = browser.executeCdpCommand(
    "Emulation.setEmulatedMedia",
    Map[String, AnyRef](
      "features" -> java.util.List.of(java.util.Map.of("name", "prefers-color-scheme", "value", name))
    ).asJava
  )

  private def present(i: Int) = Event(EventKind.Present, i, i + 1, state = 1, epoch = 1)
  private var records         = 0
  private def told(i: Int, state: Int) = {
    records += 1
    Event(EventKind.Detector, i, i + 1, records, state, 1)
  }
  private val five                = (0 to 4).map(present) :+ Event(EventKind.Scanned, 5)
  private def calm                = five ++ (0 to 4).map(told(_, DetectorState.Normal))
  private def shown: Seq[String]  = all(".card .label").map(_.getText).tail
  private def states: Seq[String] = all(".card[data-state]").map(_.getDomAttribute("data-state"))
  private def words: Seq[String]  = all(".card[data-state] .state").map(_.getText.toLowerCase)

  /** Server, master with the events, and the page opened. The master goes on reporting. */
  private def opened(events: Seq[Event], change: Options => Options = identity[Options] _)(
      check: (Server.Running, ModelMaster) => Unit
  ): Unit = withServer(change) { server =>
    begun = true
    size(1100, 900)
    scheme("light")
    Using.resource(new ModelMaster(Life(1, 1), server.udpPort, key)) { master =>
      master.happen(events: _*)
      master.report()
      master.settle()
      browser.get(server.page)
      within("the page is live")(one("#connection").getText == "live" && (events.isEmpty || states.nonEmpty))
      check(server, master)
    }
  }

  "SRV-15: the page" should "show each detector by label, word, shape and colour" in opened(
    calm ++ Seq(
      told(1, DetectorState.Alarm),
      told(2, DetectorState.Open),
      Event(EventKind.Present, 3, 9, state = 1, epoch = 2),
      Event(EventKind.Lost, 4, 5)
    )
  ) { (_, _) =>
    assert(shown == Seq("1A", "1B", "2A", "2B", "3A"))
    assert(states == Seq("normal", "alarm", "fault", "unknown", "lost"))
    assert(words == Seq("normal", "alarm", "line open", "nothing told yet", "lost"))
    val shapes = all(".card[data-state] use").map(_.getDomAttribute("href"))
    assert(shapes == states.map(s => s"#shape-$s"))
    val drawn = states.map(s => script(s"return document.querySelector('#shape-$s').innerHTML").toString)
    assert(drawn.distinct.size == 5, "five shapes")
    val colours = all(".card[data-state] .shape").map(_.getCssValue("fill"))
    assert(
      colours == Seq(
        "rgb(26, 127, 55)",
        "rgb(196, 35, 44)",
        "rgb(138, 90, 0)",
        "rgb(106, 115, 125)",
        "rgb(106, 115, 125)"
      )
    )
    assert(all(".shape").forall(s => s.getSize.width >= 30 && s.isDisplayed), "shapes can be seen")
    assert(
      all(".card.lost").head.getCssValue("background-image").contains("repeating-linear-gradient"),
      "hatched"
    )
    assert(all(".cut").map(_.isDisplayed) == Seq(false, false, false, false, true), "the cut is before 3A")
    assert(one("#alarm").getText.contains("Alarm at 1 detector: 1B"))
    screenshot("states")
    scheme("dark")
    screenshot("states-dark")
  }

  it should "follow what happens without being loaded again" in opened(calm) { (_, master) =>
    script("window.mark = 1")
    assert(states == Seq.fill(5)("normal") && !one("#alarm").isDisplayed)
    def happens(events: Event*)(states2: String*): Unit = {
      master.happen(events: _*)
      master.settle()
      within(states2.mkString(" "))(states == states2)
    }
    happens(told(3, DetectorState.Alarm))("normal", "normal", "normal", "alarm", "normal")
    within("the banner")(one("#alarm").isDisplayed && browser.getTitle.contains("1 alarm"))
    assert(all("#log tr").head.getText.contains("2B") && all("#log tr").head.getText.contains("alarm"))
    assert(one("#news").getDomProperty("textContent") == "2B: alarm", "is read out")
    screenshot("alarm")
    happens(told(3, DetectorState.Normal), told(4, DetectorState.Alarm))(
      "normal",
      "normal",
      "normal",
      "normal",
      "alarm"
    )
    happens(told(4, DetectorState.Normal))(Seq.fill(5)("normal"): _*)
    within("no banner")(!one("#alarm").isDisplayed)
    happens(Event(EventKind.Lost, 2, 3), Event(EventKind.Lost, 3, 4), Event(EventKind.Lost, 4, 5))(
      "normal",
      "normal",
      "lost",
      "lost",
      "lost"
    )
    assert(all(".cut").map(_.isDisplayed) == Seq(false, false, true, false, false))
    val found = (2 to 4).map(i => present(i).copy(kind = EventKind.Found))
    happens(found: _*)(Seq.fill(5)("normal"): _*)
    assert(script("return window.mark") == java.lang.Long.valueOf(1), "not loaded again")
    assert(all("#log tr").size == master.all)
  }

  "SRV-17: the buttons" should "send signed commands, and the page say what became of them" in opened(calm) {
    (_, master) =>
      def pressed(css: String, text: String, code: Int, node: Int): Unit = {
        one(css).click()
        within(s"$text is sent")(
          all(".orders li").lastOption.exists(_.getText == s"$text: sent, waiting for the master")
        )
        master.listen(200)
        assert((master.commands.last.code, master.commands.last.node) == (code, node) && master.refused == 0)
        master.settle()
        within(s"$text is done")(all(".orders li").last.getText == s"$text: done")
      }
      pressed(".clear", "Alarm clear", ServerDatagram.AlarmClear, ServerDatagram.AllNodes)
      assert(one("[data-node='4'] .reset").getDomAttribute("aria-label") == "Reset detector 2B")
      pressed("[data-node='4'] .reset", "Detector reset, ID 4", ServerDatagram.DetectorReset, 4)
      // With the keyboard.
      one(".clear").sendKeys(org.openqa.selenium.Keys.ENTER)
      within("by keyboard") { master.listen(50); master.commands.size == 3 }
      assert(master.commands.map(_.counter) == Seq(1, 2, 3))
  }

  it should "be off without a key, and when the master is silent" in {
    opened(calm, _.copy(key = None))((_, _) => assert(all("button").forall(!_.isEnabled)))
    opened(calm, _.copy(masterTimeoutMs = 2000)) { (_, master) =>
      within("silent")(states == Seq.fill(5)("unknown"))
      assert(all(".card button, .clear").forall(!_.isEnabled))
      assert(one(".notices").getText.contains("does not report"))
      within("heard again") { master.report(); states == Seq.fill(5)("normal") && one(".clear").isEnabled }
    }
  }

  "SRV-15: a phone" should "show everything in its width" in opened(calm :+ told(3, DetectorState.Alarm)) {
    (_, master) =>
      master.happen(
        Event(EventKind.Lost, 4, 5),
        Event(EventKind.Gap, 2, 3, 1),
        Event(EventKind.Command, 2, 12345, 1, 2)
      )
      master.settle()
      within("lost")(states.last == "lost")
      for (width <- Seq(360, 320)) {
        size(width, 740)
        def number(code: String) = script(s"return $code").toString.toDouble
        assert(number("document.documentElement.scrollWidth") <= width)
        for (e <- all("button, .card, table, .banner, h1").filter(_.isDisplayed))
          assert(e.getRect.x >= 0 && e.getRect.x + e.getRect.width <= width, e.getText)
        assert(all("button").forall(b => b.getSize.height >= 40), "buttons for thumbs")
      }
      size(360, 740)
      screenshot("phone")
  }

  "SRV-15: a line of 64 slaves" should "be shown whole, on a screen and on a phone" in opened(
    (0 to 63).map(present) ++ (0 to 63).map(told(_, DetectorState.Normal)) ++ Seq(40, 63).map(
      told(_, DetectorState.Alarm)
    )
  ) { (_, _) =>
    within("all")(states.size == 64 && states.count(_ == "alarm") == 2)
    assert(shown.last == "32B" && one("#alarm").getText.contains("21A, 32B"))
    for (width <- Seq(1100, 360)) {
      size(width, 740)
      assert(script("return document.documentElement.scrollWidth").toString.toInt <= width)
    }
    size(1100, 900)
    screenshot("line-of-64")
  }

  "SRV-15: when the server is gone" should "the page say so, and go on when it is back" in Directory { d =>
    begun = true
    size(1100, 900)
    val first  = start(options(d))
    val config = options(d).copy(httpPort = first.httpPort, udpPort = first.udpPort)
    Using.resource(new ModelMaster(Life(1, 1), first.udpPort, key)) { master =>
      master.happen(calm: _*)
      master.settle()
      browser.get(first.page)
      within("live")(states.nonEmpty && !one("#offline").isDisplayed)
      first.close()
      within("offline")(one("#offline").getText.startsWith("Connection to the server lost"))
      assert(all(".clear, .reset").forall(!_.isEnabled))
      screenshot("offline")
      Using.resource(start(config)) { _ =>
        master.happen(told(0, DetectorState.Alarm))
        master.settle()
        within("live again")(!one("#offline").isDisplayed && states.headOption.contains("alarm"))
        assert(all("#log tr").size == calm.size + 1)
      }
    }
  }

  "SRV-15: the log in the page" should "have the last 200 events, the newest first" in opened(five) {
    (_, master) =>
      for (i <- 1 to 300) master.happen(Event(EventKind.Detector, 0, 1, i, if (i % 2 == 0) 1 else 2, 1))
      master.settle()
      within("the last one")(all("#log tr").headOption.exists(_.getDomAttribute("data-id") == "306"))
      val ids =
        script("return [...document.querySelectorAll('#log tr')].map(r => r.dataset.id).join()").toString
      assert(ids == (306 to 107 by -1).mkString(","))
  }

  "SRV-17: a page of another origin" should "reach nothing in a real browser" in opened(calm) {
    (server, master) =>
      Directory { d =>
        // A page of another origin, with the token known: it still cannot send.
        val evil =
          com.sun.net.httpserver.HttpServer.create(new java.net.InetSocketAddress(ModelMaster.loopback, 0), 0)
        evil.createContext(
          "/",
          exchange => {
            exchange.getResponseHeaders.add("Content-Type", "text/html")
            exchange.sendResponseHeaders(200, 4)
            exchange.getResponseBody.write("evil".getBytes)
            exchange.close()
          }
        )
        evil.start()
        try {
          val token = new PageClient(server).token
          browser.get(s"http://localhost:${evil.getAddress.getPort}/")
          val result = browser.executeAsyncScript(
            """const [page, token, done] = arguments, results = [];
            |const body = JSON.stringify({ master: 1, command: "clear" });
            |const tries = [
            |  () => fetch(page + "api/command", {
            |    method: "POST", headers: { "Content-Type": "application/json", "X-Token": token }, body }),
            |  () => fetch(page + "api/command", {
            |    method: "POST", mode: "no-cors", headers: { "Content-Type": "text/plain" }, body })
            |    .then(r => { if (r.type !== "opaque") return r; throw 0; }),
            |  () => fetch(page + "api/state"),
            |  () => fetch(page),
            |  () => new Promise((yes, no) => {
            |    const s = new EventSource(page + "events"); s.onmessage = yes; s.onerror = no; })
            |];
            |(async () => {
            |  for (const t of tries) {
            |    try { await t(); results.push("reached"); } catch { results.push("refused"); }
            |  }
            |  const form = document.createElement("form");
            |  const frame = document.createElement("iframe");
            |  frame.name = "frame"; form.target = "frame"; form.method = "POST"; form.enctype = "text/plain";
            |  form.action = page + "api/command";
            |  document.body.append(frame, form);
            |  form.submit();
            |  setTimeout(() => done(results.join()), 500);
            |})();""".stripMargin,
            server.page,
            token
          )
          assert(result == Seq.fill(5)("refused").mkString(","))
          master.report()
          master.listen(300)
          assert(master.commands.isEmpty && state(server)("masters")(0)("orders").arr.isEmpty)
        } finally evil.stop(0)
      }
  }
}
