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
import flyframe.protocol.{DetectorState, EventKind, Order, ServerDatagram, SlaveStatus}

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

  import SlaveStatus._
  private val Burns                                 = Alarm | Latched | Sounding
  private def calm                                  = Seq.fill(5)(0)
  private def told(i: Int, number: Int, state: Int) = Event(EventKind.Detector, i, i + 1, number, state, 1)
  private def shown: Seq[String]                    = all(".card .label").map(_.getText).tail
  private def states: Seq[String] = all(".card[data-state]").map(_.getDomAttribute("data-state"))
  private def words: Seq[String]  = all(".card[data-state] .state").map(_.getText.toLowerCase)

  /** Server, master whose slaves have these states, and the page opened. */
  private def opened(states0: Seq[Int], change: Options => Options = identity[Options] _)(
      check: (Server.Running, ModelMaster) => Unit
  ): Unit = withServer(change) { server =>
    begun = true
    size(1100, 900)
    scheme("light")
    Using.resource(new ModelMaster(Life(1, 1), server.udpPort, key)) { master =>
      master.line(ModelMaster.line(states0: _*): _*)
      master.settle()
      browser.get(server.page)
      within("the page is live")(one("#connection").getText == "live" && states.size == states0.size)
      check(server, master)
    }
  }

  "SRV-15: the page" should "show each detector by label, word, shape and colour" in opened(
    Seq(0, Burns, Open, Testing, Disabled, Absent)
  ) { (_, _) =>
    assert(shown == Seq("1A", "1B", "2A", "2B", "3A", "3B"))
    assert(states == Seq("normal", "alarm", "fault", "test", "off", "lost"))
    assert(words == Seq("normal", "alarm", "line open", "testing", "disabled", "lost"))
    val shapes = all(".card[data-state] use").map(_.getDomAttribute("href"))
    assert(shapes == states.map(s => s"#shape-$s"))
    val drawn =
      (states :+ "unknown").map(s => script(s"return document.querySelector('#shape-$s').innerHTML").toString)
    assert(drawn.distinct.size == 7, "seven shapes")
    val colours = all(".card[data-state] .shape").map(_.getCssValue("fill"))
    assert(
      colours == Seq(
        "rgb(26, 127, 55)",
        "rgb(196, 35, 44)",
        "rgb(138, 90, 0)",
        "rgb(11, 92, 173)",
        "rgb(11, 92, 173)",
        "rgb(106, 115, 125)"
      )
    )
    assert(all(".shape").forall(s => s.getSize.width >= 30 && s.isDisplayed), "shapes can be seen")
    assert(
      all(".card.lost").head.getCssValue("background-image").contains("repeating-linear-gradient"),
      "hatched"
    )
    assert(all(".cut").map(_.isDisplayed) == Seq.fill(5)(false) :+ true, "the cut is before 3B")
    assert(one("#alarm").getText.startsWith("Fire at 1 detector: 1B since "))
    assert(one(".signs").getText.contains("sounding"))
    screenshot("states")
    scheme("dark")
    screenshot("states-dark")
  }

  it should "follow what happens without being loaded again" in opened(calm) { (_, master) =>
    script("window.mark = 1")
    assert(states == Seq.fill(5)("normal") && !one("#alarm").isDisplayed)
    def happens(states1: Int*)(states2: String*): Unit = {
      master.line(ModelMaster.line(states1: _*): _*)
      master.settle()
      within(states2.mkString(" "))(states == states2)
    }
    master.happen(told(3, 2, DetectorState.Alarm))
    happens(0, 0, 0, Burns, 0)("normal", "normal", "normal", "alarm", "normal")
    within("the banner")(one("#alarm").isDisplayed && browser.getTitle.contains("1 alarm"))
    within("the log")(
      all("#log tr").headOption.exists(r => r.getText.contains("2B") && r.getText.contains("alarm"))
    )
    assert(one("#news").getDomProperty("textContent") == "2B: alarm", "is read out")
    screenshot("alarm")
    happens(0, 0, 0, Latched, Burns)("normal", "normal", "normal", "alarm", "alarm")
    within("both")(one("#alarm").getText.startsWith("Fire at 2 detectors: 2B since "))
    val banner = one("#alarm").getText
    assert(banner.contains("(first alarm), smoke is gone; 3A since ") && banner.contains("(last alarm)."))
    happens(0, 0, 0, 0, 0)(Seq.fill(5)("normal"): _*)
    within("no banner")(!one("#alarm").isDisplayed)
    happens(0, 0, Absent, Absent, Absent)("normal", "normal", "lost", "lost", "lost")
    assert(all(".cut").map(_.isDisplayed) == Seq(false, false, true, false, false))
    happens(calm: _*)(Seq.fill(5)("normal"): _*)
    assert(script("return window.mark") == java.lang.Long.valueOf(1), "not loaded again")
    assert(all("#log tr").size == master.all)
  }

  "SRV-13, SRV-17: the buttons" should "order, and the page say what became of it" in opened(calm) {
    (_, master) =>
      def last = all(".orders li").lastOption.map(_.getText)
      def pressed(css: String, text: String, order: (Int, Int, Int)): Unit = {
        one(css).click()
        within(s"$text waits")(last.contains(s"$text: waits for the master's next report"))
        master.report()
        within(s"$text is sent")(last.contains(s"$text: sent, waiting for the master"))
        val before = master.orders.size
        within(s"$text comes") { master.listen(20); master.orders.size > before }
        val taken = master.orders.last
        assert((taken.order, taken.node, taken.seconds) == order && master.refused == 0)
        within(s"$text is done") { master.settle(); last.contains(s"$text: done") }
      }
      val all0 = ServerDatagram.AllNodes
      pressed("[data-order=silence]", "Silence", (Order.Silence, all0, 0))
      pressed(".buttons [data-order=reset]", "Reset", (Order.Reset, all0, 0))
      pressed("[data-order=acknowledge]", "Acknowledge", (Order.Acknowledge, all0, 0))
      assert(one("[data-node='4'] .reset").getDomAttribute("aria-label") == "Reset detector 2B")
      pressed("[data-node='4'] .reset", "Reset ID 4", (Order.Reset, 4, 0))
      one("[data-node='4'] summary").click()
      pressed("[data-node='4'] [data-order=disable]", "Disable ID 4 for 300 s", (Order.Disable, 4, 300))
      one("[data-node='4'] option[value='60']").click()
      pressed("[data-node='4'] [data-order=test]", "Test ID 4 for 60 s", (Order.Test, 4, 60))
      screenshot("orders")
      pressed("[data-node='4'] [data-order=watch]", "Watch ID 4", (Order.Watch, 4, 0))
      // With the keyboard.
      one("[data-order=silence]").sendKeys(org.openqa.selenium.Keys.ENTER)
      within("by keyboard") { master.report(); master.listen(50); master.orders.size == 8 }
  }

  "SRV-25: the page" should "offer the zones of the list, and say what became of an order for one" in
    Directory { d =>
      val long = "Hall of the west wing, ground floor, behind the stairs"
      val list = Files.writeString(
        d.resolve("list"),
        s"""{"masters": [{"id": 1, "expected": [{"node": 1, "zone": "Kitchen"}, {"node": 2, "zone": "$long"},
          {"node": 3, "zone": "A  <b> & more"}, {"node": 4, "zone": "$long"}, {"node": 5}]}]}"""
      )
      withServer(_.copy(expected = Some(list))) { server =>
        begun = true
        size(1100, 900)
        Using.resource(new ModelMaster(Life(1, 1), server.udpPort)) { master =>
          master.line(ModelMaster.line(calm: _*): _*)
          master.settle()
          browser.get(server.page)
          within("the page is live")(states.size == 5 && one(".zones").isDisplayed)
          one(".zones summary").click()
          val zones = all(".zone option").map(_.getDomAttribute("value"))
          assert(zones == Seq("Kitchen", long, "A  <b> & more"))
          def last = all(".orders li").lastOption.map(_.getText).getOrElse("")
          def ordered(button: String, zone: Int, text: String, wanted: (Int, Int, Int)*): Unit = {
            all(".zone option")(zone).click()
            one(s".zones [data-order=$button]").click()
            within(s"$text waits")(last.startsWith(s"$text: waits for the master's next report, 0 of "))
            master.orders.clear()
            within(s"$text is done") {
              master.report()
              master.listen(20)
              master.settle()
              last == s"$text: done"
            }
            assert(master.orders.map(a => (a.order, a.node, a.seconds)) == wanted)
            assert(all(".zone option")(zone).isSelected, "what is chosen stays")
          }
          one(".zones .time option[value='60']").click()
          ordered("test", 1, s"Test zone $long for 60 s", (Order.Test, 2, 60), (Order.Test, 4, 60))
          ordered("disable", 2, "Disable zone A <b> & more for 60 s", (Order.Disable, 3, 60))
          ordered("watch", 1, s"Watch zone $long", (Order.Watch, 2, 0), (Order.Watch, 4, 0))
          within("the log")(all("#log tr").head.getText.contains(s"watch zone $long: done"))
          assert(all(".zones select").forall(_.getDomAttribute("aria-label").nonEmpty))
          screenshot("zones")
          size(320, 740)
          assert(script("return document.documentElement.scrollWidth").toString.toInt <= 320)
          screenshot("zones-phone")
        }
      }
    }

  it should "offer none without a list" in opened(calm)((_, _) => assert(!one(".zones").isDisplayed))

  "SRV-13, SRV-17: the buttons" should "be off when the master is silent" in
    opened(Seq(0, Burns), _.copy(masterTimeoutMs = 2000)) { (_, master) =>
      within("silent")(states == Seq("unknown", "alarm"))
      assert(all(".card button, .buttons button").forall(!_.isEnabled))
      assert(one(".notices").getText.contains("does not report"))
      within("heard again") {
        master.report()
        states == Seq("normal", "alarm") && one("[data-order=silence]").isEnabled
      }
    }

  "SRV-20: a line that is not as it is to be" should "be shown so, with labels and zones" in Directory { d =>
    val list = Files.writeString(
      d.resolve("list"),
      """{"masters": [{"id": 1, "expected": [{"node": 1, "label": "K1", "zone": "Kitchen"},
        {"node": 3, "label": "H1", "zone": "Hall"}, {"node": 2, "label": "H2", "zone": "Hall"},
        {"node": 9, "label": "C1", "zone": "Cellar"}]}]}"""
    )
    withServer(_.copy(expected = Some(list))) { server =>
      begun = true
      size(1100, 900)
      browser.get(server.page)
      within("silent")(states == Seq.fill(4)("unknown"))
      Using.resource(new ModelMaster(Life(1, 1), server.udpPort)) { master =>
        master.line(ModelMaster.line(Burns, 0, 0): _*)
        master.settle()
        within("wrong")(states == Seq("alarm", "fault", "fault", "lost"))
        assert(shown == Seq("K1", "H1", "H2", "C1"))
        assert(one("#alarm").getText.startsWith("Fire at 1 detector: K1 (Kitchen) since "))
        assert(words(1) == "wrong slave")
        val notes = all(".card[data-state] .notes").map(_.getText)
        assert(notes(1).contains("ID 3 is expected, it is at H2; here is ID 2, which belongs to H2"))
        assert(one(".notices").getText.contains("C1: ID 9 is missing"))
        screenshot("wrong")
        master.line(Reported(0, 1), Reported(0, 3), Reported(0, 2), Reported(0, 9))
        master.settle()
        within("right")(states == Seq.fill(4)("normal") && all(".notices li").isEmpty)
      }
    }
  }

  "SRV-15: a phone" should "show everything in its width" in opened(
    Seq(0, 0, Open | HostDead | Dropped, Burns, 0)
  ) { (_, master) =>
    master.happen(Event(EventKind.Slave, 2, 3, 0xffff), Event(EventKind.Command, 2, 12345, 1, 2))
    master.slave(4, Absent)
    master.settle()
    all(".card summary").take(2).foreach(_.click())
    within("lost")(states.last == "lost")
    for (width <- Seq(360, 320)) {
      size(width, 740)
      def number(code: String) = script(s"return $code").toString.toDouble
      assert(number("document.documentElement.scrollWidth") <= width)
      for (e <- all("button, select, .card, table, .banner, h1").filter(_.isDisplayed))
        assert(e.getRect.x >= 0 && e.getRect.x + e.getRect.width <= width, e.getText)
      assert(all("button").filter(_.isDisplayed).forall(b => b.getSize.height >= 40), "buttons for thumbs")
    }
    size(360, 740)
    screenshot("phone")
  }

  "SRV-15: a line of 64 slaves" should "be shown whole, on a screen and on a phone" in opened(
    Seq.tabulate(64)(i => if (i == 40 || i == 63) Burns else 0)
  ) { (_, _) =>
    within("all")(states.size == 64 && states.count(_ == "alarm") == 2)
    assert(shown.last == "32B")
    assert(one("#alarm").getText.startsWith("Fire at 2 detectors: 21A since "))
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
      master.happen(Seq.tabulate(7)(i => told(0, i + 1, DetectorState.Normal)): _*)
      master.line(ModelMaster.line(calm: _*): _*)
      master.settle()
      browser.get(first.page)
      within("live")(states.nonEmpty && !one("#offline").isDisplayed)
      first.close()
      within("offline")(one("#offline").getText.startsWith("Connection to the server lost"))
      assert(all("main button").forall(!_.isEnabled))
      screenshot("offline")
      Using.resource(start(config)) { _ =>
        master.happen(told(0, 8, DetectorState.Alarm))
        master.slave(0, Burns)
        master.settle()
        within("live again")(!one("#offline").isDisplayed && states.headOption.contains("alarm"))
        within("the log")(all("#log tr").size == 8)
      }
    }
  }

  "SRV-15: the log in the page" should "have the last 200 events, the newest first" in opened(calm) {
    (_, master) =>
      for (i <- 1 to 306) master.happen(told(0, i, if (i % 2 == 0) 1 else 2))
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
          com.sun.net.httpserver.HttpServer
            .create(new java.net.InetSocketAddress(ModelStation.loopback, 0), 0)
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
            |const body = JSON.stringify({ master: 1, command: "silence" });
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
          assert(master.orders.isEmpty && state(server)("masters")(0)("orders").arr.isEmpty)
        } finally evil.stop(0)
      }
  }
}
