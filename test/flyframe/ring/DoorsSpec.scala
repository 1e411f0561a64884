package flyframe.ring

import java.io.{FileInputStream, FileOutputStream, InputStream}
import java.net.{DatagramPacket, DatagramSocket, InetAddress, ServerSocket, Socket}
import java.nio.file.{Files, Path}
import java.util.concurrent.TimeUnit
import org.scalatest.flatspec.AnyFlatSpec
import scala.concurrent.ExecutionContext.Implicits.global
import scala.concurrent.duration._
import scala.concurrent.{Await, Future, blocking}
import scala.jdk.CollectionConverters._
import scala.sys.process._
import scala.util.{Success, Try, Using}
import flyframe.{Directory, Tier}

/** CAN programs that we did not write at the doors of a ring in RTL, and what they make of its recordings:
  * python-can, tshark and sigrok.
  */
class DoorsSpec extends AnyFlatSpec {
  import RingProcess._

  private def relay(nodes: Int) = ujson.Obj(
    "mode"       -> "relay",
    "confirm_us" -> 1000,
    "up_ms"      -> 1,
    "nodes"      -> nodes,
    "each"       -> ujson.Obj("host" -> "can")
  )
  private def bus(kbps: Int) = ujson.Obj(
    "mode"  -> "bus",
    "kbps"  -> kbps,
    "up_ms" -> 1,
    "nodes" -> ujson.Arr(ujson.Obj("home" -> true), ujson.Obj(), ujson.Obj()),
    "each"  -> ujson.Obj("host" -> "can", "preset" -> "ring-bus", "fibre_km" -> 0.01)
  )
  private val StartUs = 6000L // then ports are up, and a new life has been told

  /** One that is free for TCP and UDP: cannelloni has both. */
  private def freePort(): Int = LazyList
    .continually(Using(new ServerSocket(0, 1, InetAddress.getLoopbackAddress)) { tcp =>
      new DatagramSocket(tcp.getLocalPort, InetAddress.getLoopbackAddress).close()
      tcp.getLocalPort
    })
    .collectFirst { case Success(port) => port }
    .get

  /** What a Python program prints; fails with its errors if it does not end well. */
  private def python(arguments: String*): String = {
    val text    = new StringBuilder
    val command = Seq("build/tools/venv/bin/python", "test/flyframe/ring/doors.py") ++ arguments
    val code    = Process(command).!(ProcessLogger(line => text.synchronized(text.append(line).append('\n'))))
    assert(code == 0, text.toString.takeRight(3000))
    text.toString
  }
  private def link(): Path = Directory.lasting("doors").resolve("tty")

  private val tier = Tier("CAN programs at the doors of a ring", "frames each way", test = 250, soak = 40000)
  private val Seed = 1L

  /** @param kind
    *   for `doors.py`
    * @param option
    *   of the simulator, which says what it leads to
    */
  private case class Program(kind: String, option: String, place: () => String)

  private def exchange(part: String, network: ujson.Value, programs: Program*): Unit = {
    val places = programs.map(_.place())
    val options = programs.zip(places).zip(Seq(2, 3)).flatMap { case ((p, place), node) =>
      Seq(s"--${p.option}", s"$node=$place")
    }
    val frames = tier.share(1, 4)
    using(network, options: _*) { ring =>
      ring.run(StartUs)
      val ends = programs.zip(places).flatMap { case (p, place) => Seq(p.kind, place) }
      tier.run(part, frames, Some(Seed))(python(("exchange" +: ends) ++ Seq(s"$frames", s"$Seed"): _*))
      val doors = ring.status()("doors").arr
      assert(doors.size >= 2 && doors.forall(_("dropped").num == 0), doors)
    }
  }
  private val slcan         = Program("slcan", "slcan", () => link().toString)
  private val socketcand    = Program("socketcand", "socketcand", () => freePort().toString)
  private val cannelloni    = Program("cannelloni", "cannelloni", () => freePort().toString)
  private val cannelloniUdp = Program("cannelloni-udp", "cannelloni", () => freePort().toString)

  "TL-01: frames of python-can" should "pass between slcan and socketcand in relay mode" in
    exchange("slcan and socketcand, relay mode", relay(3), slcan, socketcand)

  it should "pass between cannelloni and slcan" in
    exchange("cannelloni and slcan, relay mode", relay(3), cannelloni, slcan)

  it should "pass between slcan and socketcand in bus mode" in
    exchange("slcan and socketcand, bus mode", bus(250), slcan, socketcand)

  "TL-01: frames of cannelloni over UDP" should "pass to slcan and back, in order" in
    exchange("cannelloni over UDP and slcan, relay mode", relay(3), cannelloniUdp, slcan)

  "TL-01: clients of cannelloni that are silent, leave and lie" should
    "take nobody's place, and lose nothing" in {
      val (tty, tcp, other) = (link(), freePort(), freePort())
      using(relay(2), "--cannelloni", s"1=$tcp", "--socketcand", s"1=$other", "--slcan", s"2=$tty") { ring =>
        ring.run(StartUs)
        python("streams", s"$tcp", s"$other", s"$tty")
        val malformed = ring.status()("doors").arr.map(d => d("door").str -> d("malformed").num).toMap
        assert(malformed("cannelloni tcp") == 1, malformed)
      }
    }

  "TL-01: programs that lie, flood, leave and do not read" should "be refused, and stop nobody" in {
    val (tty, tcp, udp) = (link(), freePort(), freePort())
    using(relay(2), "--slcan", s"1=$tty", "--socketcand", s"2=$tcp", "--cannelloni", s"1=$udp") { ring =>
      ring.run(StartUs)
      python("hostile", s"$tty", s"$tcp", s"$udp", if (Tier.isSoak) "1000" else "20", "1")
      val malformed = ring.status()("doors").arr.map(d => d("door").str -> d("malformed").num).toMap
      for (kind <- Seq("slcan", "socketcand", "cannelloni", "cannelloni tcp"))
        assert(malformed(kind) > 5, malformed)
    }
  }

  "TL-01: programs that never stop writing" should "not stop the ring, nor the socket that ends it" in {
    val (tty, udp) = (link(), freePort())
    using(relay(2), "--slcan", s"1=$tty", "--cannelloni", s"2=$udp") { ring =>
      ring.run(StartUs)
      // Commands that are answered, and as many frames as a datagram holds.
      val line                      = ("t1230\r" * 1000).getBytes
      val head                      = Array[Byte](2, 0, 0, (13000 >> 8).toByte, 13000.toByte)
      val all                       = head ++ Array.fill(13000)(Array[Byte](0, 0, 0, 1, 0)).flatten
      @volatile var isOver          = false
      def floods(write: () => Unit) = Future(blocking(while (!isOver) Try(write())))
      val terminal                  = new FileOutputStream(tty.toFile)
      val socket                    = new DatagramSocket()
      val packet                    = new DatagramPacket(all, all.length, InetAddress.getLoopbackAddress, udp)
      val writers = Seq(floods(() => terminal.write(line)), floods(() => socket.send(packet)))
      try Await.result(Future(blocking(ring.run(1000))), 240.seconds)
      finally {
        isOver = true
        socket.close()
      }
      ring.ask("status")
      for (w <- writers) Await.ready(w, 60.seconds)
      terminal.close()
    }
  }

  /** Reads a terminal until what it has said ends so. */
  private def heard(terminal: InputStream, end: String): String = {
    val text = new StringBuilder
    while (!text.endsWith(end)) {
      val c = terminal.read()
      assert(c >= 0, text)
      text += c.toChar
    }
    text.toString
  }

  "TL-01: a program of slcan with more frames than the port holds" should "wait, and lose none" in {
    val (tty, log) = (link(), Directory.lasting("doors").resolve("ring.log"))
    using(relay(2), "--slcan", s"1=$tty", "--candump", s"2=$log") { ring =>
      ring.run(StartUs)
      val frames = (0 until 1050).map(n => f"t1232$n%04X\r")
      Using.resources(new FileOutputStream(tty.toFile), new FileInputStream(tty.toFile)) { (out, in) =>
        out.write("O\r".getBytes)
        heard(in, "\r")
        val writer = Future(blocking(out.write(frames.mkString.getBytes)))
        for (_ <- frames) assert(heard(in, "\r").takeRight(2) == "z\r")
        Await.ready(writer, 60.seconds)
      }
      ring.await("the last frame comes", 1000000)(Files.readString(log).contains(f"123#${1049}%04X"))
      val door = ring.status()("doors")(0)
      assert(Seq("dropped", "malformed").forall(door(_).num == 0), door)
    }
    val came = Files.readAllLines(log).asScala.toSeq.map(_.split(' ').last).filter(_.startsWith("123#"))
    assert(came == (0 until 1050).map(n => f"123#$n%04X"))
  }

  "TL-01: a program of slcan that leaves in the midst of all" should "leave nothing to the next one" in {
    val tty = link()
    using(relay(2), "--slcan", s"1=$tty") { ring =>
      ring.run(StartUs)
      // Answers that it has not read, more than the terminal holds, and half a line.
      val last = new FileOutputStream(tty.toFile)
      last.write(("O\r" + "V\r" * 2000 + "t1231").getBytes)
      ring.run(5000)
      last.close()
      ring.run(5000)
      Using.resources(new FileOutputStream(tty.toFile), new FileInputStream(tty.toFile)) { (out, in) =>
        // The line is its own, and the channel is closed: F is refused.
        out.write("V\rF\rO\rF\r".getBytes)
        assert(heard(in, "F00\r") == "V1010\r\u0007\rF00\r")
      }
      // Frames that it has left at the port are others' for the next one.
      Using.resource(new FileOutputStream(tty.toFile))(
        _.write(("O\r" + (0 until 200).map(n => f"t1231$n%02X\r").mkString).getBytes)
      )
      ring.run(1000)
      Using.resources(new FileOutputStream(tty.toFile), new FileInputStream(tty.toFile)) { (out, in) =>
        out.write("O\r".getBytes)
        heard(in, "t1231C7\r")
      }
    }
  }

  // Time passes slowly here.
  if (Tier.isSoak) "TL-01: frames of slcan for a port that is stuck" should "be refused after a second" in {
    val tty = link()
    using(relay(2), "--slcan", s"1=$tty") { ring =>
      ring.run(StartUs)
      ring.ask("host 1 slow 10000")
      Using.resources(new FileOutputStream(tty.toFile), new FileInputStream(tty.toFile)) { (out, in) =>
        val writer = Future(blocking(out.write(("O\r" + "t1230\r" * 1100 + "C\r").getBytes)))
        heard(in, "\u0007")
        // All others at once, and the channel is closed: F is refused.
        val refused = 1 + heard(in, "\r").stripSuffix("\r").ensuring(_.forall(_ == '\u0007')).length
        out.write("F\r".getBytes)
        assert(in.read() == '\u0007')
        val door = ring.status()("doors")(0)
        assert(door("dropped").num == refused && door("malformed").num == 1, door)
        Await.ready(writer, 60.seconds)
      }
    }
  }

  "TL-01: frames of a client of socketcand that has left" should "be seen by the next one" in {
    val tcp = freePort()
    using(relay(2), "--socketcand", s"2=$tcp") { ring =>
      ring.run(StartUs)
      val sends = (1 to 40).map(n => f"< send 123 1 $n%02x >").mkString
      client(tcp, s"< open can0 >$sends< echo >", waitsFor = "< echo >") // all have been taken then
      client(tcp, "< open can0 >< rawmode >", waitsFor = " 28 >")
    }
  }

  /** Says something to socketcand, and hears what it waits for: all that came until then. */
  private def client(port: Int, commands: String, waitsFor: String): String =
    Using.resource(new Socket(InetAddress.getLoopbackAddress, port)) { socket =>
      socket.setSoTimeout(120000)
      socket.getOutputStream.write(commands.getBytes)
      val heard = new StringBuilder
      while (heard.indexOf(waitsFor) < 0) {
        val c = socket.getInputStream.read()
        assert(c >= 0, heard)
        heard += c.toChar
      }
      heard.toString
    }

  "TL-01: a send of socketcand that is malformed" should "be counted, and not be answered" in {
    val tcp = freePort()
    using(relay(2), "--socketcand", s"2=$tcp") { ring =>
      ring.run(StartUs)
      // A remote frame of python-can, which takes an answer for an error frame.
      val said = client(tcp, "< open can0 >< rawmode >< send 123 4  >< echo >", waitsFor = "< echo >")
      assert(said == "< hi >< ok >< ok >< echo >")
      assert(ring.status()("doors")(0)("malformed").num == 1)
    }
  }

  "TL-01: a client of socketcand that floods" should "leave others their turns" in {
    val (tcp, other) = (freePort(), freePort())
    using(relay(2), "--socketcand", s"2=$tcp", "--socketcand", s"2=$other") { ring =>
      ring.run(StartUs)
      Using.resource(new Socket(InetAddress.getLoopbackAddress, tcp)) { flood =>
        flood.getOutputStream.write("< open can0 >".getBytes)
        val frames = ("< send 123 0 >" * 1000).getBytes
        val writer = Future(blocking(while (true) flood.getOutputStream.write(frames)))
        ring.await("the port is full", 100000)(ring.node(2)("backlog").num >= 1000)
        // Whose frame has found a place, of the same door and of another one.
        for (port <- Seq(tcp, other))
          client(port, "< open can0 >< send 124 0 >< echo >", waitsFor = "< echo >")
        flood.close()
        Await.ready(writer, 60.seconds)
      }
    }
  }

  "TL-01: a frame of CAN FD in a datagram of cannelloni" should "be dropped alone" in {
    val udp = freePort()
    val log = Directory.lasting("doors").resolve("ring.log")
    using(relay(2), "--cannelloni", s"1=$udp", "--candump", s"2=$log") { ring =>
      ring.run(StartUs)
      def frame(id: Int, length: Int, data: Int*) =
        (Seq(0, 0, id >> 8, id & 0xff, length) ++ data).map(_.toByte)
      def datagram(number: Int, count: Int, frames: Seq[Byte]*) =
        Seq[Byte](2, 0, number.toByte, 0, count.toByte) ++ frames.flatten
      val fd = frame(0x124, 0x80 | 12, Seq.fill(1 + 12)(0x55): _*)
      Using.resource(new DatagramSocket()) { socket =>
        for (
          d <- Seq(
            datagram(7, 3, frame(0x123, 1, 0xaa), fd, frame(0x125, 1, 0xbb)),
            datagram(8, 2, frame(0x126, 0)), // is refused, but has come
            datagram(9, 1, frame(0x127, 0))
          )
        ) socket.send(new DatagramPacket(d.toArray, d.size, InetAddress.getLoopbackAddress, udp))
        ring.await("the last frame comes", 10000)(Files.readString(log).contains("127#"))
      }
      val came = Files.readAllLines(log).asScala.toSeq.map(_.split(' ').last)
      assert(came.filter(_.matches("12\\d#.*")) == Seq("123#AA", "125#BB", "127#"))
      val door = ring.status()("doors")(0)
      assert(Seq("dropped", "malformed", "gaps").map(door(_).num) == Seq(1, 1, 0), door)
    }
  }

  "TL-01: doors that cannot be" should "be told in one sentence" in {
    val file  = Files.writeString(Directory.lasting("ring").resolve("ring.json"), ujson.write(relay(2)))
    val plain = Files.writeString(Directory.lasting("ring").resolve("ring.json"), """{"nodes": 2}""")
    val taken = new ServerSocket(0, 1, InetAddress.getLoopbackAddress)
    val wrong = Seq(
      file  -> Seq("--slcan", "3=/tmp/none")                   -> "there are nodes 1 to 2",
      file  -> Seq("--slcan", "1")                             -> "must be a node, =, and where it is",
      file  -> Seq("--slcan", s"1=$file")                      -> "is there already and is no link",
      file  -> Seq("--socketcand", "1=0")                      -> "'0' is no port from 1 to 65535",
      file  -> Seq("--socketcand", s"1=${taken.getLocalPort}") -> "cannot be had",
      file  -> Seq("--cannelloni", "1=70000")                  -> "'70000' is no port",
      file  -> Seq("--record", "1=/nowhere/x.pcap")            -> "cannot write the capture",
      file  -> Seq("--candump", "1=/nowhere/x.log")            -> "cannot write the log",
      file  -> Seq("--vcd", "/nowhere/x.vcd")                  -> "cannot write the levels",
      plain -> Seq("--slcan", "1=/tmp/none")                   -> "whose host is 'node', but must be 'can'"
    )
    for (((network, arguments), sentence) <- wrong) {
      val (text, code) = outputOf(Seq("--network", s"$network", "--end-ms", "0.1") ++ arguments: _*)
      assert(code == 2 && text.contains(sentence) && text.count(_ == '\n') == 1, text)
    }
    taken.close()
  }

  "TL-01: what another simulator has, or what is not ours" should "be left alone" in {
    val folder = Directory.lasting("ring")
    val file   = Files.writeString(folder.resolve("ring.json"), ujson.write(relay(2)))
    def refuses(option: String, value: String, sentence: String) = {
      val (text, code) = outputOf("--network", s"$file", "--end-ms", "0.1", option, value)
      assert(code == 2 && text.contains(sentence) && text.count(_ == '\n') == 1, text)
    }
    val (tty, other) = (folder.resolve("tty"), folder.resolve("other"))
    // A link that a simulator has left is replaced.
    Files.createSymbolicLink(tty, Path.of("/dev/pts/99999"))
    using(relay(2), "--slcan", s"1=$tty", "--slcan", s"2=$other") { ring =>
      val terminal = Files.readSymbolicLink(tty)
      refuses("--slcan", s"1=$tty", "another program has the terminal")
      assert(Files.readSymbolicLink(tty) == terminal && Files.exists(tty))
      val control = ring.folder.resolve("control")
      refuses("--control", s"$control", "another program listens")
      assert(Files.exists(control))
      ring.us()
      // While it runs, something else takes their places.
      for (path <- Seq(other, control)) {
        Files.delete(path)
        Files.createSymbolicLink(path, file)
      }
    }
    assert(!Files.isSymbolicLink(tty) && Files.isSymbolicLink(other))
    refuses("--slcan", s"1=$other", "is no link to a pseudo-terminal")
    refuses("--control", s"$other", "is no socket")
    assert(Files.isSymbolicLink(other))
  }

  "TL-02: times of frames" should "be right with a slow host" in {
    // A pass of the host has them all, and stamps begin anew each 65.536 ms.
    val sent  = (10000L to 90000L by 20000L).map(us => us -> f"123#${us / 10000}%02X")
    val lines = (StartUs -> "host 1 slow 100") +: sent.map { case (us, frame) => us -> s"frame 2 $frame" }
    val came  = script(relay(2), lines, endUs = 120000, logged = Seq(1))(1)
    assert(came.map(_.frame) == sent.map(_._2), came)
    for ((Logged(us, _), (asked, _)) <- came.zip(sent)) assert(us >= asked && us < asked + 200, came)
  }

  "CAN-46: the frames that a slow host loses" should "all be counted, beyond what the register holds" in {
    val log = Directory.lasting("doors").resolve("ring.log")
    using(relay(2), "--candump", s"1=$log") { ring =>
      ring.run(StartUs)
      // Passes with more frames than the FIFO holds, and less than 255 that are lost.
      ring.ask("host 1 slow 20")
      for (_ <- 1 to 600) ring.ask("frame 2 123#")
      ring.await("all frames have left", 200000)(ring.node(2)("backlog").num == 0)
      ring.ask("host 1 slow 0")
      ring.run(22000)
      val came = Files.readAllLines(log).asScala.count(_.contains(" 123#"))
      val lost = ring.node(1)("overruns").num
      assert(lost > 255 && came + lost == 600, s"$came have come, $lost were lost")
    }
  }

  /** What tshark shows of a capture, a line of fields for each packet. */
  private def tshark(file: Path, arguments: String*): Seq[String] =
    (Seq("tshark", "-r", s"$file") ++ arguments).!!(ProcessLogger(_ => ())).linesIterator.toSeq

  "TL-02: recordings" should "show tshark and python-can frames, and errors by their classes" in {
    val (tty, tcp)  = (link(), freePort())
    val folder      = Directory.lasting("recordings")
    val (pcap, log) = (folder.resolve("ring.pcap"), folder.resolve("ring.log"))
    val options =
      Seq("--slcan", s"2=$tty", "--socketcand", s"3=$tcp", "--record", s"1=$pcap", "--candump", s"1=$log")
    using(bus(250), options: _*) { ring =>
      ring.run(StartUs)
      python("exchange", "slcan", s"$tty", "socketcand", s"$tcp", "60", "2")
      // Then with bad light: frames are repeated, and come.
      ring.ask("optics all errors 1000")
      python("exchange", "slcan", s"$tty", "socketcand", s"$tcp", "60", "3", "doubles")
      ring.ask("optics all errors 0")
      ring.run(2000)
    }
    assert(tshark(pcap, "-Y", "_ws.malformed").isEmpty)
    val fields = Seq("can.flags.err", "can.id", "can.flags.xtd", "can.flags.rtr", "can.len", "data.data")
    val shown =
      tshark(pcap, Seq("-T", "fields") ++ fields.flatMap(Seq("-e", _)): _*).map(_.split("\t", -1).toSeq)
    val (errors, frames) = shown.partition(f => Set("1", "True")(f.head))
    assert(frames.size >= 240, "frames of both exchanges, those that were repeated may be there twice")

    // The log holds the same, as another program reads it; it knows errors of the bus, not changes of state.
    val (changes, others) = Files.readAllLines(log).asScala.toSeq.partition(_.matches(".* 200002(04|40)#.*"))
    val plain             = Files.writeString(folder.resolve("plain.log"), others.mkString("", "\n", "\n"))
    val lines             = python("log", s"$plain").linesIterator.toSeq.map(_.split(" ", -1))
    assert(lines.size + changes.size == shown.size && changes.nonEmpty)
    assert(lines.count(_(3) == "error") + changes.size == errors.size && errors.size > 5)
    val logged = lines.filter(_(3) != "error").map(l => (Integer.parseInt(l(1), 16), l(2) == "1", l(4)))
    val seen   = frames.map(f => (f(1).toInt, Set("1", "True")(f(2)), f(5).replace(":", "")))
    assert(logged == seen)

    // Each is a bus error with a class, or a change of state; Linux has no place for errors behind flags.
    val errorFields = Seq("buserror", "ctrl", "busoff", "ack", "prot", "prot.type.tx", "prot.location")
    val told = tshark(pcap, Seq("-T", "fields") ++ errorFields.flatMap(f => Seq("-e", s"can.err.$f")): _*)
      .map(_.split("\t", -1).map(f => if (f == "True") "1" else if (f == "False") "0" else f).toSeq)
      .filter(_.head.nonEmpty)
    assert(told.size == errors.size)
    for (Seq(busError, controller, busOff, ack, protocol, _, _) <- told) {
      assert(Seq(busError, controller, busOff).count(_ == "1") == 1, told)
      assert(busError == "0" || (ack == "1") != (protocol == "1"), told)
    }
    // A receiver never tells of sending.
    assert(told.count(t => t(4) == "1" && t(6).toInt > 0) > 5 && told.forall(t => Set("", "0")(t(5))), told)
  }

  "TL-02: error passive and bus-off" should "be told behind the bus errors that lead there" in {
    val onPair = ujson.Obj("preset" -> pairNode, "pair" -> "a")
    val network = ujson.Obj(
      "nodes"       -> 2,
      "each"        -> ujson.Obj("host" -> "none"),
      "controllers" -> Seq(onPair, onPair)
    )
    val lines = Seq(
      // What node 4 finds on the pair is not what it has seen last.
      1200L -> "pair a dominant",
      1210L -> "off 4",
      1300L -> "pair a free",
      1400L -> "on 4",
      3000L -> "frame 3 123#01",
      // It loses its power as soon as it has the frame: the log has it, too. Nobody acknowledges then, and
      // the pair fails within a frame.
      3075L -> "off 4",
      3250L -> "frame 3 124#0000000000000000",
      5600L -> "pair a dominant",
      5800L -> "pair a free",
      6000L -> "on 4"
    )
    val came          = scriptWithErrors(network, lines, endUs = 8500, logged = Seq(3, 4))
    val (first, rest) = came(3).map(_.frame).filterNot(_.startsWith("20000288")).span(_ != "123#01")
    assert(first.forall(_.startsWith("20000204")), s"node 4 has acknowledged: $came")
    val states = rest.filterNot(_.startsWith("200002A0")).map(_.takeWhile(_ != '#'))
    assert(states == Seq("123", "20000204", "20000240", "20000204", "124"), came)
    val passive = rest.indexWhere(_.startsWith("20000204#002"))
    assert(passive > 0 && rest(passive - 1).startsWith("200002A0"), came)
    assert(came(4).map(_.frame).filterNot(_.startsWith("2000")) == Seq("123#01", "124#0000000000000000"))
  }

  /** Node 2 sends a frame each millisecond, from the time on when it can. */
  private def sending(folder: Path): Seq[String] = {
    val lines = (StartUs to 20000L by 1000L).map(us => s"$us frame 2 123#\n").mkString
    Seq(
      "--network",
      s"${Files.writeString(folder.resolve("ring.json"), ujson.write(relay(2)))}",
      "--script",
      s"${Files.writeString(folder.resolve("script"), lines)}",
      "--state",
      s"${folder.resolve("state")}",
      "--processors",
      "1"
    )
  }

  "TL-02: recordings that cannot be written" should "end the simulator with one sentence" in {
    val folder = Directory.lasting("full")
    def ends(recorder: Seq[String], sentence: String) = {
      val (text, code) = outputOf(sending(folder) ++ recorder ++ Seq("--end-ms", "20"): _*)
      assert(code == 2 && text.linesIterator.toSeq.last == s"flyframe-ring: cannot write $sentence.", text)
    }
    val full = "'/dev/full': No space left on device"
    ends(Seq("--candump", "1=/dev/full"), s"the log $full")
    ends(Seq("--record", "1=/dev/full"), s"the capture $full")
    ends(Seq("--vcd", "/dev/full"), s"the levels $full")
    // And while it runs: a reader takes the header only, and leaves.
    val pipe = folder.resolve("pipe")
    assert(Seq("mkfifo", s"$pipe").! == 0)
    val reader = Seq("head", "-c", "24", s"$pipe").run(ProcessLogger(_ => ()))
    ends(Seq("--record", s"1=$pipe"), s"the capture '$pipe': Broken pipe")
    assert(reader.exitValue() == 0)
  }

  "TL-02: recordings of a simulator that runs" should "be whole, also when it is hung up" in {
    val folder  = Directory.lasting("hung-up")
    val pcap    = folder.resolve("ring.pcap")
    val options = Seq("--record", s"1=$pcap", "--slcan", s"2=${folder.resolve("tty")}")
    // Where nohup has started the tests a program would go on.
    val command = Seq("env", "--default-signal=HUP", program) ++ sending(folder) ++ options
    val process = new java.lang.ProcessBuilder(command.asJava)
      .redirectError(folder.resolve("errors").toFile)
      .start()
    try {
      val deadline = 120.seconds.fromNow
      while (!Files.exists(pcap) || Files.size(pcap) < 24 + 15 * (16 + 16)) {
        assert(deadline.hasTimeLeft() && process.isAlive, Files.readString(folder.resolve("errors")))
        Thread.sleep(10)
      }
      assert(tshark(pcap).size == 15)
      assert(Seq("kill", "-HUP", s"${process.pid}").! == 0)
      assert(process.waitFor(60, TimeUnit.SECONDS) && process.exitValue == 0)
      assert(!Files.isSymbolicLink(folder.resolve("tty")))
    } finally process.destroyForcibly()
  }

  "TL-03: levels of a node" should "show sigrok's decoder the frames on the ring" in {
    val (tty, tcp) = (link(), freePort())
    val folder     = Directory.lasting("levels")
    val (vcd, log) = (folder.resolve("ring.vcd"), folder.resolve("ring.log"))
    using(
      bus(250),
      "--slcan",
      s"2=$tty",
      "--socketcand",
      s"3=$tcp",
      "--candump",
      s"1=$log",
      "--vcd",
      s"$vcd"
    ) { ring =>
      ring.run(StartUs)
      python("exchange", "slcan", s"$tty", "socketcand", s"$tcp", "20", "4")
      ring.run(2000)
    }
    val text = Files.readString(vcd)
    for (level <- Seq("bus", "drive", "R1", "R2", "T1", "T2"))
      assert(text.split(s" $level \\$$end", -1).length == 4)
    // Only what node 3 hears is left: sigrok takes names without their scopes.
    val sign  = "(?s)module node3 .*?\\$var wire 1 (\\S+) bus".r.findFirstMatchIn(text).get.group(1)
    val plain = folder.resolve("bus.vcd")
    val changes = text.linesIterator
      .dropWhile(_ != "$enddefinitions $end")
      .drop(1)
      .filter(l => l.startsWith("#") || l.drop(1) == sign)
    val header = Seq("$timescale 1ns $end", s"$$var wire 1 $sign bus $$end", "$enddefinitions $end")
    Files.writeString(plain, (header ++ changes).mkString("", "\n", "\n"))
    val decoder = Seq("-P", "can:nominal_bitrate=250000:can_rx=bus", "-A", "can=id:full-id:data:dlc")
    val decoded = (Seq("sigrok-cli", "-I", "vcd:downsample=100", "-i", s"$plain") ++ decoder)
      .!!(ProcessLogger(_ => ()))
      .linesIterator
      .toSeq
    val dlcs   = decoded.count(_.contains("Data length code"))
    val logged = Files.readString(log).linesIterator.toSeq.filterNot(_.contains(" 2000"))
    assert(dlcs == logged.size && dlcs >= 40, decoded.take(20).mkString("\n"))
    def ids = decoded.collect { case l if l.contains("Identifier: ") => l }
    assert(ids.size >= dlcs)
  }

  "TL-03: levels of a node without power" should "be unknown" in {
    val folder  = Directory.lasting("levels")
    val vcd     = folder.resolve("ring.vcd")
    val network = Files.writeString(folder.resolve("ring.json"), ujson.write(relay(2)))
    val script  = Files.writeString(folder.resolve("script"), "50 off 1\n100 on 1\n")
    val files =
      Seq("--network", s"$network", "--script", s"$script", "--state", s"${folder.resolve("state")}")
    val (text, code) = outputOf(files ++ Seq("--vcd", s"$vcd", "--end-ms", "0.2"): _*)
    assert(code == 0, text)
    val lines = Files.readAllLines(vcd).asScala.toSeq
    val signs = lines.collect { case s"$$var wire 1 $sign $_ $$end" => sign }
    def changes(fromNs: Int, toNs: Int) = {
      val behind = lines.dropWhile(l => !l.startsWith("#") || l.drop(1).toInt < fromNs)
      behind.takeWhile(l => !l.startsWith("#") || l.drop(1).toInt < toNs)
    }
    val off = changes(50000, 100000).filter(l => signs.take(6).contains(l.drop(1)))
    assert(off == signs.take(6).map("x" + _))
    val on = changes(100000, 101000).filter(l => signs.take(6).contains(l.drop(1)))
    assert(on.size >= 6 && !on.exists(_.startsWith("x")), on)
    assert(lines.count(_.startsWith("x")) == 6)
  }

  "TL-05: a CAN interface that always has another frame" should "not stop a ring whose port has no host" in {
    val folder  = Directory.lasting("flooded")
    val library = folder.resolve("flooded_can.so")
    val source  = "test/flyframe/ring/flooded_can.c"
    assert(Seq("cc", "-shared", "-fPIC", "-o", s"$library", source, "-ldl").! == 0)
    val network = Files.writeString(folder.resolve("ring.json"), ujson.write(relay(2)))
    val script  = Files.writeString(folder.resolve("script"), "1000 host 1 stop\n2000 quit\n")
    val files =
      Seq("--network", s"$network", "--script", s"$script", "--state", s"${folder.resolve("state")}")
    val options = Seq("--socketcan", "1=vcan0", "--processors", "1", "--with-parent")
    val command = Seq("env", s"LD_PRELOAD=$library", program) ++ files ++ options
    val process = new java.lang.ProcessBuilder(command.asJava).inheritIO().start()
    try assert(process.waitFor(120, TimeUnit.SECONDS) && process.exitValue == 0)
    finally process.destroyForcibly()
  }

  "TL-05: the doors of Linux" should "pass the same frames where the kernel has AF_CAN" in {
    val probe = "import socket; socket.socket(29, socket.SOCK_RAW, 1)"
    val has   = Seq("python3", "-c", probe).!(ProcessLogger(_ => ())) == 0
    if (!has) cancel("this kernel has no AF_CAN")
    val interface = sys.env.getOrElse("FLYFRAME_VCAN", cancel("FLYFRAME_VCAN names no vcan interface"))
    exchange(
      "AF_CAN and slcan, relay mode",
      relay(3),
      Program("socketcan", "socketcan", () => interface),
      slcan
    )
  }
}
