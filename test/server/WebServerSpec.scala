package flyframe.server

import java.io.{BufferedReader, InputStreamReader}
import java.net.{InetSocketAddress, Socket}
import java.nio.charset.StandardCharsets.UTF_8
import java.nio.file.Files
import java.time.Instant
import scala.concurrent.{Await, ExecutionContext, Future}
import scala.concurrent.duration._
import scala.util.Using
import org.scalatest.flatspec.AnyFlatSpec
import ServerBench._
import flyframe.Directory
import flyframe.protocol.{DetectorState, EventKind, Order, ServerDatagram, SlaveStatus}

/** HTTP, byte for byte, since clients do not let one choose the Host header. */
class WebServerSpec extends AnyFlatSpec {
  private case class Answer(status: Int, headers: Map[String, String], body: String)

  /** Sends a request with just these headers. */
  private def ask(server: Server.Running, request: String, headers: (String, String)*)(
      body: String = ""
  ): Answer =
    Using.resource(new Socket(ModelStation.loopback, server.httpPort)) { socket =>
      socket.setSoTimeout(10000)
      val all =
        headers ++ Seq("Content-Length" -> body.getBytes(UTF_8).length.toString, "Connection" -> "close")
      val text =
        all.map { case (name, value) => s"$name: $value\r\n" }.mkString(s"$request HTTP/1.1\r\n", "", "\r\n")
      socket.getOutputStream.write((text + body).getBytes(UTF_8))
      val in     = new BufferedReader(new InputStreamReader(socket.getInputStream, UTF_8))
      val status = in.readLine.split(" ")(1).toInt
      val found = Iterator
        .continually(in.readLine)
        .takeWhile(_.nonEmpty)
        .map(_.split(": ", 2))
        .map(f => f(0).toLowerCase -> f(1))
        .toMap
      // Messages go on and on.
      Answer(
        status,
        found,
        if (request.contains("/events")) ""
        else Iterator.continually(in.read).takeWhile(_ >= 0).map(_.toChar).mkString
      )
    }

  private def host(server: Server.Running) = s"127.0.0.1:${server.httpPort}"
  private val silence                      = """{"master": 1, "command": "silence"}"""

  /** A request as the page makes it, with one thing changed. */
  private def command(
      server: Server.Running,
      body: String = silence,
      change: (String, Option[String]) = "" -> None
  ): Answer = {
    val headers = Map(
      "Host"           -> host(server),
      "Origin"         -> s"http://${host(server)}",
      "Sec-Fetch-Site" -> "same-origin",
      "Content-Type"   -> "application/json",
      "X-Token"        -> new PageClient(server).token
    )
    ask(
      server,
      "POST /api/command",
      headers.updatedWith(change._1)(_ => change._2).filter(_._1.nonEmpty).toSeq: _*
    )(body)
  }

  private def withMaster(check: (Server.Running, ModelMaster) => Unit): Unit = withServer() { server =>
    Using.resource(new ModelMaster(Life(1, 4), server.udpPort, key)) { master =>
      master.settle()
      check(server, master)
    }
  }

  "SRV-17: an order of the page" should "be sent to the master" in withMaster { (server, master) =>
    val orders = Seq(
      silence                                            -> (Order.Silence, ServerDatagram.AllNodes, 0),
      """{"master": 1, "command": "reset", "node": 7}""" -> (Order.Reset, 7, 0),
      """{"master": 1, "command": "disable", "node": 0, "seconds": 60}""" -> (Order.Disable, 0, 60),
      """{"master": 1, "command": "test", "node": 7, "seconds": 65535}""" -> (Order.Test, 7, 65535),
      """{"master": 1, "command": "watch", "node": 7}"""                  -> (Order.Watch, 7, 0),
      """{"master": 1, "command": "acknowledge"}""" -> (Order.Acknowledge, ServerDatagram.AllNodes, 0)
    )
    for (((body, order), i) <- orders.zipWithIndex) {
      val answer = command(server, body)
      assert(answer.status == 202 && answer.body == s"""{"id":${i + 1}}""")
      eventually(body) { master.report(); master.listen(10); master.orders.size == i + 1 }
      master.settle()
      val taken = master.orders.last
      assert((taken.order, taken.node, taken.seconds) == order && master.refused == 0)
    }
  }

  "SRV-25: an order for a zone" should "be sent to each of its slaves" in Directory { d =>
    val list = Files.writeString(
      d.resolve("list"),
      """{"masters": [{"id": 1, "expected": [{"node": 7, "zone": "Hall"}, {"node": 3, "zone": "A & <b>"},
        {"node": 5, "zone": "Hall"}]}]}"""
    )
    withServer(_.copy(expected = Some(list))) { server =>
      Using.resource(new ModelMaster(Life(1, 4), server.udpPort, key)) { master =>
        master.line(Seq(7, 3, 5).map(Reported(0, _)): _*)
        master.settle()
        val orders = Seq(
          """{"master": 1, "command": "disable", "zone": "Hall", "seconds": 60}""" ->
            Seq((Order.Disable, 7, 60), (Order.Disable, 5, 60)),
          """{"master": 1, "command": "test", "zone": "A & <b>", "seconds": 9}""" ->
            Seq((Order.Test, 3, 9)),
          """{"master": 1, "command": "watch", "zone": "Hall"}""" ->
            Seq((Order.Watch, 7, 0), (Order.Watch, 5, 0))
        )
        for (((body, wanted), i) <- orders.zipWithIndex) {
          val answer = command(server, body)
          assert(answer.status == 202 && answer.body == s"""{"id":${i + 1}}""")
          eventually(body) { master.report(); master.listen(10); master.orders.size == wanted.size }
          master.settle()
          assert(master.orders.map(a => (a.order, a.node, a.seconds)) == wanted)
          master.orders.clear()
          def orders = state(server)("masters")(0)("orders").arr
          assert(orders.size == i + 1 && orders.last("state").str == "done")
        }
        eventually("the log")(get(server, "log.csv").body.contains("watch zone Hall: done"))
        val unknown = command(server, """{"master": 1, "command": "watch", "zone": "<Attic>"}""")
        assert(unknown.status == 409 && unknown.body == "Master 1 has no zone '<Attic>'.")
        assert(unknown.headers("content-type").startsWith("text/plain"))
      }
    }
  }

  "SRV-17: a command of another origin, or without the token" should "be refused" in withMaster {
    (server, master) =>
      val port                                 = server.httpPort
      def status(name: String, value: String*) = command(server, change = name -> value.headOption).status
      for (
        origin <- Seq(
          "http://evil.example",
          s"http://localhost:$port",
          s"ftp://127.0.0.1:$port",
          "http://127.0.0.1:1",
          "null"
        )
      )
        assert(status("Origin", origin) == 403, origin)
      assert(status("Origin") == 403, "no origin")
      for (
        name <- Seq(
          "evil.example",
          s"evil.example:$port",
          "127.0.0.1.evil.example",
          s"localhost.evil.example:$port",
          ""
        )
      )
        assert(status("Host", name) >= 400, name)
      for (site  <- Seq("cross-site", "same-site")) assert(status("Sec-Fetch-Site", site) == 403, site)
      for (token <- Seq("", "0" * 64, "x")) assert(status("X-Token", token) == 403, token)
      assert(status("X-Token") == 403, "no token")
      for (kind <- Seq("text/plain", "application/x-www-form-urlencoded", "multipart/form-data", ""))
        assert(status("Content-Type", kind) == 415, kind)
      assert(status("Content-Type") == 415, "no content type")
      master.report()
      master.listen(300)
      assert(master.orders.isEmpty && state(server)("masters")(0)("orders").arr.isEmpty)
  }

  "SRV-17: a name that a DNS server could turn into this address" should "be refused for every path" in
    withServer(_.copy(hosts = Seq("alarm.plant.example"))) { server =>
      def status(path: String, host: String) = ask(server, s"GET $path", "Host" -> host)().status
      for (path <- Seq("/", "/page.js", "/events", "/api/state", "/log.csv")) {
        assert(status(path, "rebound.example") == 403, path)
        for (
          host <- Seq(
            "localhost",
            s"localhost:${server.httpPort}",
            "127.0.0.1",
            "[::1]:80",
            "Alarm.Plant.example:8080"
          )
        )
          assert(status(path, host) == 200, s"$path $host")
      }
    }

  "SRV-17: other pages" should "read nothing, neither from other origins nor by frames" in withServer() {
    server =>
      for (path <- Seq("/events", "/api/state", "/log.csv", "/page.js")) {
        val own = "Host" -> host(server)
        assert(ask(server, s"GET $path", own, "Origin" -> "http://evil.example")().status == 403, path)
        assert(ask(server, s"GET $path", own, "Sec-Fetch-Site" -> "cross-site")().status == 403, path)
        val answer = ask(server, s"GET $path", own)()
        assert(answer.status == 200 && !answer.headers.contains("access-control-allow-origin"), path)
      }
      val page = ask(server, "GET /", "Host" -> host(server), "Sec-Fetch-Site" -> "cross-site")()
      assert(page.status == 200, "a link to the page may stand anywhere")
      assert(page.headers("content-security-policy").contains("default-src 'none'"))
      assert(page.headers("content-security-policy").contains("frame-ancestors 'none'"))
      assert(page.headers("cache-control") == "no-store")
      assert(
        ask(
          server,
          "OPTIONS /api/command",
          "Host"   -> host(server),
          "Origin" -> "http://evil.example"
        )().status == 403
      )
  }

  "SRV-17: a request that makes no sense" should "get an error code, and the server go on" in withMaster {
    (server, _) =>
      val bad = Seq(
        "",
        "x",
        "[]",
        "{}",
        """{"master": 1}""",
        """{"master": 1, "command": "reboot"}""",
        """{"master": 1.5, "command": "silence"}""",
        """{"master": 65536, "command": "silence"}""",
        """{"master": 1, "command": "silence", "seconds": 5}""",
        """{"master": 1, "command": "disable", "node": 5}""",
        """{"master": 1, "command": "test", "seconds": 5}""",
        """{"master": 1, "command": "test", "node": 5, "seconds": 0}""",
        """{"master": 1, "command": "test", "node": 5, "seconds": 65536}""",
        """{"master": 1, "command": "reset", "node": 65535}""",
        """{"master": 1, "command": "reset", "node": -1}""",
        """{"master": "1", "command": "silence"}""",
        """{"master": 1, "command": "silence", "zone": "Hall"}""",
        """{"master": 1, "command": "reset", "zone": "Hall"}""",
        """{"master": 1, "command": "acknowledge", "zone": "Hall"}""",
        """{"master": 1, "command": "test", "zone": "Hall"}""",
        """{"master": 1, "command": "watch", "zone": 5}""",
        """{"master": 1, "command": "watch", "zone": "Hall", "node": 5}""",
        """{"master": 1, "command": "watch", "zone": "Hall", "seconds": 5}""",
        "[" * 4000
      )
      for (body <- bad) assert(command(server, body).status == 400, body)
      assert(command(server, " " * 5000).status == 413)
      assert(command(server, """{"master": 2, "command": "silence"}""").status == 409)
      assert(ask(server, "GET /api/command", "Host" -> host(server))().status == 405)
      assert(ask(server, "GET /nothing", "Host" -> host(server))().status == 404)
      assert(ask(server, "GET /../build.sbt", "Host" -> host(server))().status >= 400)
      assert(get(server, "").statusCode == 200)
  }

  "SRV-15: pages" should "be told of an event at once, and of the state when they are opened" in withMaster {
    (server, master) =>
      val page = new PageClient(server)
      master.happen(Event(EventKind.Slave, 0, 1), Event(EventKind.Detector, 0, 1, 1, DetectorState.Normal))
      master.line(ModelMaster.line(0): _*)
      master.settle()
      Using.resource(page.messages()) { feed =>
        eventually("the first message")(feed.lines.nonEmpty)
        assert(feed.lines.head("fresh").bool && feed.lines.head("log").arr.size == 2)
        assert(feed.lines.head("state")("masters")(0)("slaves")(0)("state").str == "normal")
        // Without push the page would wait for the next message that only says that the server lives: 5 s
        // each, and so 50.
        val begin = System.nanoTime()
        for (i <- 2 to 11) {
          master.happen(Event(EventKind.Detector, 0, 1, i, DetectorState.Alarm))
          master.slave(0, SlaveStatus.Alarm)
          master.settle()
          eventually("the alarm")(feed.lines.exists(_("log").arr.exists(_("id").num == i + 1)))
        }
        assert(System.nanoTime() - begin < 25000000000L)
        assert(feed.lines.last("state")("masters")(0)("slaves")(0)("state").str == "alarm")
        assert(feed.lines.tail.forall(!_("fresh").bool))
      }
  }

  it should "get every entry once, also those who read slowly" in withMaster { (server, master) =>
    Using.resource(new PageClient(server).messages()) { feed =>
      for (i <- 0 until 3000) master.happen(Event(EventKind.Detector, 0, 1, i & 0xffff, DetectorState.Normal))
      master.settle()
      def ids = feed.lines.flatMap(_("log").arr.map(_("id").num.toInt))
      eventually("all entries")(ids.lastOption.contains(3000))
      // The first message may have come with the last entries only.
      assert(ids == (ids.head to 3000))
    }
  }

  it should "be opened only so often at a time" in withServer() { server =>
    val page  = new PageClient(server)
    val feeds = Seq.fill(PageFeed.MostClients)(page.messages())
    try {
      eventually("all are open")(feeds.forall(_.lines.nonEmpty))
      Using.resource(page.messages()) { more =>
        Thread.sleep(300)
        assert(more.lines.isEmpty)
      }
    } finally feeds.foreach(_.close())
    eventually("there is room again") {
      Using.resource(page.messages()) { feed => Thread.sleep(100); feed.lines.nonEmpty }
    }
  }

  "SRV-16: the log" should "be had as CSV, all of it" in withMaster { (server, master) =>
    for (i <- 0 until 2500) master.happen(Event(EventKind.Detector, 0, 1, i, DetectorState.Normal))
    master.settle()
    val answer = get(server, "log.csv")
    assert(answer.headers.firstValue("content-type").get == "text/csv; charset=utf-8")
    assert(answer.headers.firstValue("content-disposition").get.contains("flyframe-log.csv"))
    val lines = answer.body.split("\r\n").toSeq
    assert(lines.size == 2501)
    assert(lines.tail.map(_.split(",")(3).toInt) == (0 until 2500))
  }

  "SRV-27: clients that stop in the middle" should "hold up no order, no download and no page" in Directory {
    d =>
      val given = options(d)
      Using.resource(EventStore.open(given.database).fold(fail(_), identity)) { store =>
        store.note(
          Seq.tabulate(60000)(i =>
            LogEntry(
              0,
              Instant.EPOCH,
              Life(1, 1),
              i.toLong,
              Event(LogEntry.ZoneOrder),
              note = Some("x" * 200)
            )
          )
        )
      }
      Using.resource(start(given)) { server =>
        def begin(request: String, headers: String*)(body: String): Socket = {
          val socket = new Socket()
          socket.setReceiveBufferSize(4096)
          socket.connect(new InetSocketAddress(ModelStation.loopback, server.httpPort))
          val lines = s"$request HTTP/1.1" +: s"Host: ${host(server)}" +: headers :+ "" :+ body
          socket.getOutputStream.write(lines.mkString("\r\n").getBytes(UTF_8))
          socket
        }
        val page = new PageClient(server)
        Using.resource(page.messages()) { feed =>
          eventually("the page is open")(feed.lines.nonEmpty)
          val halves = Seq.fill(100)(
            begin(
              "POST /api/command",
              s"Origin: http://${host(server)}",
              s"X-Token: ${page.token}",
              "Content-Type: application/json",
              "Content-Length: 100"
            )("{")
          )
          val stalled = Seq.fill(4)(begin("GET /log.csv")(""))
          try {
            Thread.sleep(1000) // they are where they stop
            assert(command(server, """{"master": 2, "command": "silence"}""").status == 409)
            for (s <- halves) {
              s.setSoTimeout(30000)
              assert(s.getInputStream.read() == -1)
            }
            // As many as may be under way at once do not go on.
            val all = Future(get(server, "log.csv").body.linesIterator.size)(ExecutionContext.global)
            assert(Await.result(all, 90.seconds) == 60001)
            val told = feed.lines.size
            eventually("the page is still told", 20000)(feed.lines.size > told)
          } finally (halves ++ stalled).foreach(_.close())
        }
      }
  }
}
