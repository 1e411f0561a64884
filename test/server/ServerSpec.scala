package flyframe.server

import java.io.{ByteArrayOutputStream, File}
import java.net.{DatagramPacket, InetSocketAddress, ServerSocket}
import java.nio.file.{Files, Path}
import java.util.concurrent.TimeUnit
import scala.jdk.CollectionConverters._
import scala.util.{Random, Using}
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.Directory
import flyframe.protocol.{EventKind, Order, SlaveStatus}
import ServerBench._

/** The whole server, with real sockets and modelled masters. */
class ServerSpec extends AnyFlatSpec {
  private def stored(directory: Path): Seq[LogEntry] =
    Using.resource(EventStore.open(directory.resolve("log.db")).fold(fail(_), identity))(_.after(0, 1000000))
  private def event(i: Int) =
    Event(EventKind.Slave, i % 5, i % 5 + 1, i / 5, 1, slaveTime = i)

  /** The log has events 0 to `count` - 1 of the life, each once and in order. */
  private def complete(log: Seq[LogEntry], life: Life, count: Int, hint: String): Unit = {
    val mine = log.filter(_.life == life)
    assert(mine.map(_.number) == (0 until count), hint)
    assert(mine.map(_.event) == (0 until count).map(event), hint)
  }

  "SRV-05: every event" should "arrive once and in order though datagrams are lost, repeated and late" in {
    for (seed <- 1 to 5) Directory { d =>
      val random = new Random(seed)
      Using.resource(start(options(d))) { server =>
        Using.resource(new ModelMaster(Life(1, 1), server.udpPort, faults = 0.2, random = random)) { master =>
          var i = 0
          while (i < 2000) {
            val some = math.min(random.nextInt(100), 2000 - i)
            master.happen((i until i + some).map(event): _*)
            i += some
            master.report()
            master.listen(random.nextInt(3))
          }
          master.settle(repeatMs = 3)
          assert(master.waiting == 0, s"seed $seed")
        }
      }
      complete(stored(d), Life(1, 1), 2000, s"seed $seed")
    }
  }

  "SRV-08: a server that is down for a while" should "get what happened, once, in order" in Directory { d =>
    Using.resource(ModelStation.socket()) { reserved =>
      // A port that is free now, for both lives of the server.
      val port   = reserved.getLocalPort
      val config = options(d).copy(udpPort = port)
      reserved.close()
      Using.resource(new ModelMaster(Life(1, 1), port, faults = 0.1)) { master =>
        val first = start(config)
        master.happen((0 until 100).map(event): _*)
        master.settle()
        master.happen((100 until 150).map(event): _*)
        master.report()
        first.close()
        master.happen((150 until 400).map(event): _*)
        for (_ <- 1 to 20) { master.report(); master.listen(10) }
        assert(master.waiting >= 250)
        Using.resource(start(config)) { _ =>
          master.settle()
          assert(master.waiting == 0)
        }
      }
      complete(stored(d), Life(1, 1), 400, "")
    }
  }

  "SRV-10: a restarted master" should "have its events in the log beside those of before" in Directory { d =>
    Using.resource(start(options(d))) { server =>
      for (life <- Seq(7L, -7L, 1L << 60)) Using.resource(new ModelMaster(Life(1, life), server.udpPort)) {
        master =>
          master.happen((0 until 70).map(event): _*)
          master.settle()
          assert(master.waiting == 0, s"life $life")
      }
    }
    for (life <- Seq(7L, -7L, 1L << 60)) complete(stored(d), Life(1, life), 70, s"life $life")
  }

  "SRV-13: an order" should "arrive once though datagrams are lost, and be shown as done" in withServer() {
    server =>
      val page = new PageClient(server)
      Using.resource(new ModelMaster(Life(1, 9), server.udpPort, faults = 0.3)) { master =>
        master.settle()
        for (i <- 1 to 10) {
          val body = ujson.Obj("master" -> 1, "command" -> "test", "node" -> i, "seconds" -> 10 * i)
          assert(page.command(body).statusCode == 202)
          eventually(s"order $i is done") {
            master.report()
            master.listen(10)
            state(server)("masters")(0)("orders").arr.last("state").str == "done"
          }
        }
        assert(
          master.orders.map(a => (a.order, a.node, a.seconds)) == (1 to 10).map(i => (Order.Test, i, 10 * i))
        )
        assert(master.orders.map(_.ticket).distinct.size == 10)
      }
  }

  "SRV-11: 10,000 datagrams of each kind of nonsense" should "be counted; all else goes on" in Directory {
    d =>
      val random = new Random(11)
      val config = options(d).copy(masters = Map(1 -> ModelStation.loopback, 2 -> ModelStation.loopback))
      Using.resource(start(config)) { server =>
        val to       = new InetSocketAddress(ModelStation.loopback, server.udpPort)
        val attacker = ModelStation.socket()
        val master   = new ModelMaster(Life(1, 5), server.udpPort)
        val page     = new PageClient(server)
        val feed     = page.messages()
        // The attacker has heard a report of master 2, and knows the server's life from its answer.
        def heard(life: Long) =
          Protocol.encode(Report(Life(2, 8), life, 3, 0, Vector.fill(3)(event(1)), time = 1000), key)
        def send(bytes: Array[Byte]): Unit = attacker.send(new DatagramPacket(bytes, bytes.length, to))
        val answer                         = new DatagramPacket(new Array[Byte](2048), 2048)
        send(heard(0))
        attacker.receive(answer)
        val life    = Protocol.answer(answer.getData.take(answer.getLength), key).get.server
        val genuine = heard(life)
        try {
          send(genuine)
          eventually("master 2 is known")(state(server)("masters").arr.nonEmpty)
          var alive = 0
          def flood(why: Refusal)(datagram: Int => Array[Byte]): Unit = {
            val before = refused(server, why)
            for (i <- 0 until 10000) {
              send(datagram(i))
              // As much as the receive buffer holds; what the system drops is not counted.
              if (i % 50 == 49) eventually(s"${why.name} $i")(refused(server, why) >= before + i + 1)
              if (i % 1000 == 0) {
                alive += 1
                master.happen(event(alive - 1))
                master.settle()
                assert(master.waiting == 0, s"event during ${why.name}")
              }
            }
            // The master itself has to learn the server's life once.
            assert((before + 10000 to before + 10001).contains(refused(server, why)), why.name)
          }
          def report(life: Life, key: Array[Byte]) = Protocol.encode(
            Report(
              life,
              random.nextLong(),
              random.nextInt().toLong.abs,
              random.nextInt(100).toLong,
              Vector.fill(random.nextInt(4))(Event(EventKind.Line, 0)),
              Vector.fill(random.nextInt(4))(Reported(random.nextInt(0x10000), 1)),
              time = random.nextInt().abs.toLong
            ),
            key
          )
          flood(Refusal.Malformed) { i =>
            // Random bytes, and good reports cut off or with a wrong head.
            val good = report(Life(1, 5), key)
            i % 3 match {
              case 0 => random.nextBytes(1 + random.nextInt(199)).updated(0, 0.toByte)
              case 1 => good.take(random.nextInt(good.length))
              case 2 => good.updated(random.nextInt(4), 0x55.toByte)
            }
          }
          flood(Refusal.Oversized) { i =>
            new Array[Byte](if (i % 100 == 0) 65507 else Protocol.MostReportBytes + 1 + i * 7 % 2000)
          }
          flood(Refusal.Forged)(_ => report(Life(1, 5), random.nextBytes(16)))
          flood(Refusal.Foreign)(_ => report(Life(3 + random.nextInt(1000), random.nextLong()), key))
          flood(Refusal.Replayed)(_ => genuine)
          flood(Refusal.Unproven)(_ => heard(life + 1))

          assert(get(server, "").statusCode == 200)
          assert(page.command(ujson.Obj("master" -> 1, "command" -> "silence")).statusCode == 202)
          eventually("the order") { master.report(); master.listen(10); master.orders.nonEmpty }
          master.settle()
          eventually("the page has been told everything")(
            feed.lines.map(_("log").arr.count(_("master").num == 1)).sum == alive + 1
          )
          val masters = state(server)("masters").arr.map(m => (m("id").num.toInt, m("life").str))
          assert(masters == Seq((1, "0000000000000005"), (2, "0000000000000008")))
        } finally {
          feed.close()
          Seq(master, attacker).foreach(_.close())
        }
      }
      val log = stored(d)
      assert(
        log.count(_.life == Life(2, 8)) == 3 && log.forall(e => e.life == Life(1, 5) || e.life == Life(2, 8))
      )
      assert(log.filter(_.life == Life(1, 5)).map(_.number) == (0 to 60))
  }

  "SRV-22: a database that is deleted" should "not keep a fire from the page" in Directory { d =>
    Using.resource(start(options(d))) { server =>
      Using.resource(new ModelMaster(Life(1, 5), server.udpPort)) { master =>
        master.happen(event(0))
        master.line(ModelMaster.line(0, 0): _*)
        master.settle()
        Files.delete(d.resolve("log.db"))
        master.happen(event(1))
        master.slave(1, SlaveStatus.Alarm | SlaveStatus.Latched)
        eventually("the fire and the fault") {
          master.report()
          master.listen(10)
          val json = state(server)
          json("masters")(0)("fire") != ujson.Null && json("broken") != ujson.Null
        }
        eventually("it is answered") { master.listen(10); master.isProven }
        assert(master.waiting == 1, "not acknowledged")
      }
    }
  }

  "SRV-18: wrong arguments and what cannot be opened" should "give a sentence and exit code 2" in Directory {
    d =>
      def refusal(args: String*): String = {
        val (out, err) = (new ByteArrayOutputStream, new ByteArrayOutputStream)
        val code       = Console.withOut(out)(Console.withErr(err)(Server.run(args)))
        assert(code == 2 && out.size == 0, args)
        val text = err.toString
        assert(text.endsWith(".\n") && text.count(_ == '\n') == 1, text)
        text
      }
      def key(text: String) = {
        val file = Files.createTempFile(d, "key", "")
        Files.writeString(file, text).toString
      }
      val database = Seq("--database", d.resolve("log.db").toString)
      assert(refusal("--listen", "example.org").contains("listen"))
      assert(refusal("--http-port", "70000").contains("http-port"))
      assert(refusal("--udp-port", "x").contains("udp-port"))
      assert(refusal("--masters", "1=10.0.0.1,2").contains("'2'"))
      assert(refusal("--masters", "70000=10.0.0.1").contains("masters"))
      assert(refusal("--master-timeout-ms", "0").contains("master-timeout-ms"))
      assert(refusal("--order-timeout-ms", "-1").contains("order-timeout-ms"))
      refusal("--no-such-option")
      refusal("argument")
      assert(refusal("--key", d.resolve("none").toString).contains("cannot be read"))
      assert(refusal("--key", key("00" * 15)).contains("32 hexadecimal digits"))
      assert(refusal(database: _*).contains("--key"), "without a key")
      val good = Seq("--key", key("00" * 16))
      assert(refusal(good ++ Seq("--expected", d.resolve("none").toString): _*).contains("cannot be read"))
      assert(refusal(good ++ Seq("--expected", key("{}")): _*).contains("must be"))
      assert(refusal(good ++ Seq("--database", d.toString): _*).contains(d.toString))
      Using.resource(new ServerSocket(0, 1, ModelStation.loopback)) { taken =>
        val port = taken.getLocalPort.toString
        assert(refusal(good ++ database ++ Seq("--udp-port", "0", "--http-port", port): _*).contains(port))
      }
      Using.resource(ModelStation.socket()) { taken =>
        val port = taken.getLocalPort.toString
        assert(refusal(good ++ database ++ Seq("--udp-port", port, "--http-port", "0"): _*).contains(port))
      }
      // What was opened before is closed again.
      Using.resource(start(options(d)))(server => assert(get(server, "").statusCode == 200))
  }

  /** The server as a program, which writes to `out`. */
  private def program(d: Path, more: String*): Process = {
    val java  = Path.of(System.getProperty("java.home"), "bin", "java").toString
    val start = Seq(java, "-cp", System.getProperty("java.class.path"), "flyframe.server.Server")
    val files = Seq("--key", s"${options(d).key.get}", "--database", s"${d.resolve("log.db")}")
    val ports = Seq("--http-port", "0", "--udp-port", "0")
    new ProcessBuilder((start ++ files ++ ports ++ more).asJava)
      .redirectErrorStream(true)
      .redirectOutput(d.resolve("out").toFile)
      .start()
  }

  "SRV-18: the program" should "say where it listens, only on loopback, and end when told to" in Directory {
    d =>
      val process = program(d)
      try {
        def out = Files.readString(d.resolve("out"))
        eventually("both lines")(out.count(_ == '\n') == 2)
        val said        = "page: http://127\\.0\\.0\\.1:(\\d+)/\nreports: udp 127\\.0\\.0\\.1:(\\d+)\n".r
        val (http, udp) = out match { case said(http, udp) => (http.toInt, udp.toInt) }
        Using.resource(new ModelMaster(Life(1, 1), udp)) { master =>
          master.happen(event(0))
          master.settle()
          assert(master.waiting == 0)
        }
        assert(
          listening(http, tcp = true) == Seq("127.0.0.1") && listening(udp, tcp = false) == Seq("127.0.0.1")
        )
        process.destroy() // SIGTERM
        assert(process.waitFor(60, TimeUnit.SECONDS) && process.exitValue == 143)
        assert(out.count(_ == '\n') == 2, out)
      } finally process.destroyForcibly()
      assert(!new File(s"${d.resolve("log.db")}-wal").exists, "the database was closed")
      assert(stored(d).size == 1)
  }

  it should "end with its standard input, if it is told to" in Directory { d =>
    val process = program(d, "--with-input")
    try {
      eventually("both lines")(Files.readString(d.resolve("out")).count(_ == '\n') == 2)
      process.getOutputStream.close()
      assert(process.waitFor(60, TimeUnit.SECONDS) && process.exitValue == 0)
    } finally process.destroyForcibly()
    assert(!new File(s"${d.resolve("log.db")}-wal").exists, "the database was closed")
  }

  /** Addresses at which something listens on a port, IPv4 and IPv6. */
  private def listening(port: Int, tcp: Boolean): Seq[String] = {
    val name = if (tcp) "tcp" else "udp"
    for {
      file <- Seq(name, s"${name}6")
      line <- Files.readString(Path.of("/proc/net", file)).linesIterator.drop(1).toSeq
      fields  = line.trim.split("\\s+")
      address = fields(1).split(":")
      if Integer.parseInt(address(1), 16) == port && (!tcp || fields(3) == "0A")
    } yield address(0).takeRight(8).grouped(2).map(Integer.parseInt(_, 16)).toSeq.reverse.mkString(".")
  }
}
