package flyframe.ring

import java.net.{DatagramPacket, DatagramSocket, InetAddress}
import java.nio.file.{Files, Path}
import flyframe.Directory
import org.scalatest.flatspec.AnyFlatSpec
import scala.concurrent.ExecutionContext.Implicits.global
import scala.concurrent.duration._
import scala.concurrent.{Await, Future}
import scala.util.{Random, Using}

/** Rings of nodes in RTL with their host programs in C, in the simulator: what a user of a node gets while
  * fibres break, light is bad, and nodes, controllers and hosts come and go.
  */
class RingSimulatorSpec extends AnyFlatSpec {
  import RingProcess._

  /** A ring in relay mode that starts and repeats soon. */
  private def relay(nodes: Int, more: (String, ujson.Value)*): ujson.Obj = {
    val times = Seq[(String, ujson.Value)]("confirm_us" -> 1000, "up_ms" -> 1, "pd_ms" -> 3)
    val all = Seq[(String, ujson.Value)]("mode" -> "relay", "kbps" -> 2000, "nodes" -> nodes) ++ times ++ more
    ujson.Obj.from(all)
  }
  private val random             = new Random(1)
  private def bytes(length: Int) = Seq.fill(length)(random.nextInt(256))
  private val StartUs            = 100000L

  /** Sends a message of each length, and waits until all have been told delivered; each came once. */
  private def exchange(ring: RingProcess, node: Int, to: Int, address: Int, lengths: Seq[Int]): Unit = {
    val messages = lengths.map(bytes)
    val before   = ring.messages(to).size
    val over     = ring.ends(node).size
    val tags     = messages.map(ring.send(node, address, _))
    def ends     = ring.ends(node).drop(over)
    ring.await(s"messages of node $node to $address end", 400000)(tags.forall(t => ends.exists(_.tag == t)))
    assert(ends.map(_.outcome).toSet == Set("delivered"))
    val came = ring.messages(to).drop(before).map(_.data)
    assert(came.sorted == messages.map(hex).sorted)
  }

  "TP-30: host programs on a ring in RTL" should
    "deliver messages once through breaks, resets, restarts and bad light" in
    using(relay(4)) { ring =>
      ring.awaitWhole(StartUs)
      exchange(ring, 1, 3, 3, Seq(1, 6, 7, 100, 2048))

      // To all (TP-31), and an urgent one.
      val toAll  = ring.send(2, 0, Seq(1, 2, 3))
      val urgent = ring.send(4, 1, Seq(0xff), urgent = true)
      ring.await("the message to all ends", 100000)(ring.ends(2).exists(_.tag == toAll))
      ring.await("the urgent one ends", 100000)(ring.ends(4).exists(_.tag == urgent))
      assert(ring.ends(2).find(_.tag == toAll).get.unconfirmed.isEmpty)
      for (n <- Seq(1, 3, 4)) assert(ring.messages(n).count(_.toAll) == 1)
      assert(ring.messages(1).count(m => m.urgent && m.source == 4) == 1)

      // A cut between nodes 2 and 3 while messages are on their way (FR-63), and where it is.
      val tag = ring.send(2, 3, bytes(1500))
      ring.run(1000)
      ring.ask("cut 2")
      ring.await("the message through the break ends", 200000)(ring.ends(2).exists(_.tag == tag))
      assert(ring.ends(2).find(_.tag == tag).get.outcome == "delivered")
      def mode(n: Int) = ring.node(n)("state").num.toInt & 3
      ring.await("the neighbours of the break know", 20000)(mode(2) == 2 && mode(3) == 3)
      assert(mode(1) == 1 && mode(4) == 1)
      exchange(ring, 3, 2, 2, Seq(5, 300))
      ring.ask("mend 2")
      ring.await("the ring is whole", 50000)((1 to 4).forall(mode(_) == 1))
      exchange(ring, 2, 3, 3, Seq(300))

      // The controller of a node is reset; its host sets it up anew, and its messages go on.
      val through = ring.send(1, 4, bytes(1000))
      ring.run(500)
      ring.ask("reset 1")
      ring.await("the message through the reset ends", 400000)(ring.ends(1).exists(_.tag == through))
      assert(ring.ends(1).find(_.tag == through).get.outcome == "delivered")
      assert(ring.node(1)("starts").num == 2)

      // A host program that starts anew is another life, and the first message to it may be a repeat.
      val life = ring.node(3)("life").num
      ring.ask("host 3 stop")
      ring.ask("host 3 start")
      ring.await("the host has started", 50000)(
        ring.node(3)("fault").str == "good" && ring.node(3)("life").num > life
      )
      exchange(ring, 2, 3, 3, Seq(20))
      assert(ring.messages(3).last.repeat)
      exchange(ring, 3, 1, 1, Seq(20, 200))

      // Light at the limits does no harm, bit errors cost time.
      ring.ask("optics all jitter 2")
      ring.ask("optics all duty 40")
      exchange(ring, 1, 3, 3, Seq(500))
      ring.ask("optics all duty 60")
      ring.ask("optics all errors 5000")
      exchange(ring, 3, 1, 1, Seq(500, 500))
      val fibres = ring.status()("fibres").arr
      assert(fibres.map(f => f("there")("bits_wrong").num + f("back")("bits_wrong").num).sum > 10)
      ring.ask("optics all errors 0")

      // Light that fades on one way takes both ends down (FR-13), a module that is stuck likewise (FR-10).
      ring.ask("optics 4 attenuation 40")
      ring.await("the link without light is down", 20000)(mode(4) == 2 && mode(1) == 3)
      exchange(ring, 4, 1, 1, Seq(100))
      ring.ask("optics 4 attenuation 0")
      ring.await("the ring is whole again", 50000)((1 to 4).forall(mode(_) == 1))
      ring.ask("stuck 1 there dominant")
      ring.await("the link behind the stuck module is down", 20000)(mode(1) == 2 && mode(2) == 3)
      exchange(ring, 1, 2, 2, Seq(100))
    }

  "TP-50: process data of a ring in RTL" should "come, change, and become old with their node" in
    using(relay(3)) { ring =>
      ring.awaitWhole(StartUs)
      ring.ask("watch 1 2 7")
      ring.ask("object 2 1 7 1122")
      def value = ring.node(1)("values")(0)
      ring.await("the value comes", 20000)(value("data").str == "1122" && !value("old").bool)
      ring.ask("object 2 1 7 3344")
      ring.await("it changes", 20000)(value("data").str == "3344")
      ring.ask("object 2 1 7")
      ring.await("it is not valid", 20000)(value("data").str.isEmpty && !value("old").bool)
      ring.ask("off 2")
      ring.await("it is old", 30000)(value("old").bool)
      ring.ask("on 2")
      ring.await("the node is back", StartUs)(ring.node(2).obj.get("fault").exists(_.str == "good"))
      ring.ask("object 2 1 7 55")
      ring.await("its value is, too", StartUs)(value("data").str == "55" && !value("old").bool)
    }

  "TP-02: a host whose memory fails" should "say so, take a life ahead of the last one, and go on" in
    using(relay(3)) { ring =>
      ring.awaitWhole(StartUs)
      ring.ask("storage 2 fail")
      ring.ask("host 2 stop")
      ring.ask("host 2 start")
      ring.await("the host tells of its memory", 50000)(ring.node(2)("fault").str == "store")
      assert(ring.node(2)("life").num == 3, "two ahead of the last, which the controller still has")
      exchange(ring, 2, 1, 1, Seq(30))
    }

  "TP-24: a host that does not take its messages" should "hold them back, and lose none" in
    using(relay(3)) { ring =>
      ring.awaitWhole(StartUs)
      ring.ask("takes 3 none")
      val tags = Seq.fill(6)(ring.send(1, 3, bytes(40)))
      ring.run(40000)
      assert(ring.ends(1).isEmpty && ring.messages(3).isEmpty)
      ring.ask("takes 3 all")
      ring.await("all end", 400000)(tags.forall(t => ring.ends(1).exists(_.tag == t)))
      assert(ring.ends(1).forall(_.outcome == "delivered") && ring.messages(3).size == 6)
      ring.ask("takes 3 refuses")
      val refused = ring.send(2, 3, bytes(40))
      ring.await("the refused one ends", 100000)(ring.ends(2).exists(_.tag == refused))
      assert(ring.ends(2).last.outcome == "refused")
    }

  "FR-62: two nodes with one address" should "find out, harm nobody else, and go on when told" in {
    val nodes = Seq(1, 5, 2, 5).map(a => ujson.Obj("address" -> a))
    using(relay(4, "nodes" -> nodes)) { ring =>
      def conflict(n: Int) = (ring.node(n)("state").num.toInt & 16) != 0
      ring.await("the others know each other", StartUs)(
        ring.node(1)("members").arr.exists(_.num == 2) && ring.node(3)("members").arr.exists(_.num == 1)
      )
      // As long as both have sent as many frames in the same life, nothing tells them apart.
      ring.send(2, 1, bytes(60))
      ring.await("one of them knows", 50000)(conflict(2) || conflict(4))
      exchange(ring, 1, 3, 2, Seq(3, 90))
      exchange(ring, 3, 1, 1, Seq(3, 90))
      def life = ring.node(2)("link_life").num.toInt
      var last = life
      // The second time it goes on in the life that it began with, which the others know.
      for (_ <- 1 to 2) {
        ring.ask("off 4")
        ring.ask("on 4") // and tells another life
        ring.await("it knows", StartUs)(conflict(2))
        ring.ask("off 4")
        ring.ask("conflict 2 clear")
        ring.await("the conflict is over", 20000)(!conflict(2))
        assert(life != last) // RB-13: of the old one others would take nothing
        last = life
        exchange(ring, 2, 1, 1, Seq(40))
        exchange(ring, 1, 2, 5, Seq(40))
      }
    }
  }

  "FR-03: nodes of 50 MHz" should "work beside those of 100 MHz" in {
    val nodes = Seq("ring-node-50", "ring-node", "ring-node-50").map(p => ujson.Obj("preset" -> p))
    using(relay(3, "nodes" -> nodes)) { ring =>
      ring.awaitWhole(StartUs)
      ring.ask("optics all jitter 2")
      for ((from, to) <- Seq(1 -> 2, 2 -> 3, 3 -> 1)) exchange(ring, from, to, to, Seq(6, 100))
      ring.ask("cut 1")
      for ((from, to) <- Seq(1 -> 2, 2 -> 3, 3 -> 1)) exchange(ring, from, to, to, Seq(6, 100))
    }
  }

  "FR-48: a node that babbles" should "delay others, and harm nobody" in {
    val nodes = Seq("node", "can", "node").map(h => ujson.Obj("host" -> h))
    using(relay(3, "nodes" -> nodes)) { ring =>
      ring.await("the others know each other", StartUs)(ring.node(1)("members").arr.exists(_.num == 3))
      // The first in CAN order, each another one, as fast as the node takes them, beside messages.
      val tags = Seq(300, 4, 60).map(n => ring.send(1, 3, bytes(n)))
      for (n <- 0 until 300) ring.ask(f"frame 2 $n%03X#${random.nextLong()}%016X")
      ring.run(5000)
      assert(ring.node(2)("backlog").num > 100, "it still babbles")
      ring.await("it has nothing left", 100000)(ring.node(2)("backlog").num == 0)
      ring.await("the messages end", 400000)(tags.forall(t => ring.ends(1).exists(_.tag == t)))
      assert(ring.ends(1).forall(_.outcome == "delivered") && ring.messages(3).size == 3)
      exchange(ring, 3, 1, 1, Seq(5, 50))
    }
  }

  "FR-31: host programs on a ring in bus mode" should "deliver through a break and its mend" in {
    val network = ujson.Obj(
      "mode"  -> "bus",
      "kbps"  -> 250,
      "up_ms" -> 1,
      "each"  -> ujson.Obj("preset" -> "ring-bus", "fibre_km" -> 0.01),
      "nodes" -> ujson.Arr(ujson.Obj("home" -> true), ujson.Obj(), ujson.Obj())
    )
    using(network) { ring =>
      ring.awaitWhole(StartUs)
      def state(n: Int) = ring.node(n)("state").num.toInt
      assert((state(1) & 4) != 0 && (state(2) & 4) == 0, "home is guard")
      exchange(ring, 2, 3, 3, Seq(4, 50))
      ring.ask("cut 2")
      ring.await("the neighbours know", 20000)((state(2) & 3) == 2 && (state(3) & 3) == 3)
      exchange(ring, 2, 3, 3, Seq(60))
      ring.ask("mend 2")
      ring.await("the ring is whole", 50000)((state(2) & 3) == 2 && (state(3) & 3) == 1)
      exchange(ring, 3, 2, 2, Seq(60))
    }
  }

  private def wrong(network: String): (String, Int) = {
    val folder = Directory.lasting("ring")
    val file   = Files.writeString(folder.resolve("network.json"), network)
    outputOf("--network", s"$file", "--end-ms", "0.1", "--state", s"${folder.resolve("state")}")
  }

  "The simulator" should "answer a mistake with one sentence and exit code 2" in {
    val mistakes = Seq(
      "{"                                -> "is not valid JSON",
      "[]"                               -> "must be an object with 'nodes'",
      """{"nodes": 1}"""                 -> "has nodes 1, but it must be a whole number from 2 to 125",
      """{"nodes": [{}]}"""              -> "has 1 nodes",
      """{"nodes": 2, "mode": "star"}""" -> "has the mode 'star'; known: bus, relay",
      """{"nodes": 2, "kbps": 300}"""    -> "has kbps 300, but it must be a whole number from 400 to 2000",
      """{"nodes": 2, "kbps": 1999}"""   -> "cannot have 1999 kbit/s",
      """{"nodes": 2, "colour": 1}"""    -> "has the unknown key 'colour'",
      """{"nodes": [{"address": 126}, {}]}"""       -> "has address 126, but it must be a whole number",
      """{"nodes": [{"host": "dog"}, {}]}"""        -> "has the host 'dog'; known: node, can, none",
      """{"nodes": [{"preset": "ring-bus"}, {}]}""" -> "has preset 'ring-bus', which has no relay mode",
      """{"nodes": [{"preset": "slave"}, {}]}"""    -> "preset 'slave' is not built into this program"
    ) ++ Seq("can", "none").map(h =>
      s"""{"nodes": [{"preset": "$pairNode", "pair": "a", "bridge": true, "host": "$h"}, {}]}""" ->
        s"has a bridge, but the host '$h'"
    )
    for ((network, sentence) <- mistakes) {
      val (text, code) = wrong(network)
      assert(code == 2 && text.contains(sentence) && text.count(_ == '\n') == 1, s"$network: $text")
    }
    for (arguments <- Seq(Seq("--network", "nowhere.json"), Seq("--seed", "x"), Nil)) {
      val (text, code) = outputOf(arguments: _*)
      assert(code == 2 && text.count(_ == '\n') == 1, text)
    }
    val ring = Files.writeString(Directory.lasting("ring").resolve("network.json"), """{"nodes": 2}""")
    val numbers = Seq(
      "--gateway-id"       -> Seq("0", "65536"),
      "--report-repeat-ms" -> Seq("0", "10001"),
      "--heartbeat-ms"     -> Seq("0", "10001"),
      "--server-port"      -> Seq("0", "65536"),
      "--processors"       -> Seq("0", "65"),
      "--time-scale"       -> Seq("-1", "1.1", "nan"),
      "--seed"             -> Seq("-1", "1000000000000000001"),
      "--end-ms"           -> Seq("-1", "1000001", "nan")
    )
    for ((option, values) <- numbers; value <- values) {
      val files        = Seq("--network", s"$ring", "--state", s"${ring.resolveSibling("state")}")
      val end          = if (option == "--end-ms") Nil else Seq("--end-ms", "0.1")
      val (text, code) = outputOf(files ++ end ++ Seq(option, value): _*)
      assert(code == 2 && text.contains(option) && text.count(_ == '\n') == 1, s"$option $value: $text")
    }
  }

  it should "give whoever reads late all answers, and each of them whole" in using(relay(2)) { ring =>
    // More than a socket holds.
    val all = Await.result(Future(ring.answers("status", 1000)), 240.seconds)
    assert(all.map(_.length).sum > 500000)
    for (text <- all) assert(text.startsWith("ok ") && ujson.read(text.drop(3)).obj.contains("nodes"))
    assert(ring.answer("send 1 2 " + "0" * 70000).startsWith("error: "))
    ring.us()
  }

  it should "have no bit wrong where errors are as rare as can be" in using(relay(2)) { ring =>
    ring.ask("optics all errors 1000000000000")
    ring.run(2000)
    for (f <- ring.status()("fibres").arr; way <- Seq("there", "back")) assert(f(way)("bits_wrong").num == 0)
  }

  it should "end when a script says so, and take no time that it cannot count to" in {
    def start(script: Path) = {
      val folder = Directory.lasting("ring")
      val file   = Files.writeString(folder.resolve("network.json"), """{"nodes": 2}""")
      val files  = Seq("--network", s"$file", "--state", s"${folder.resolve("state")}")
      outputOf(files ++ Seq("--script", s"$script", "--end-ms", "1"): _*)
    }
    def run(script: String) = start(scriptOf(script))
    assert(run("# a comment\n  # another one\n\n5 cut 1\n10 quit\n")._2 == 0)
    for (
      ((text, code), sentence) <- Seq(
        run("10000000000 cut 1\n")       -> "is no time in us up to",
        start(Directory.lasting("ring")) -> "cannot read the script"
      )
    ) assert(code == 2 && text.contains(sentence) && text.count(_ == '\n') == 1, text)
  }

  private def scriptOf(lines: String): Path =
    Files.writeString(Directory.lasting("ring").resolve("script"), lines)

  it should "start a host at power-on or not, as it was told last" in {
    val lines = "20 off 1\n40 on 1\n40 host 1 stop\n60 off 2\n80 on 2\n80 host 2 stop\n80 host 2 start\n"
    using(relay(2), "--script", s"${scriptOf(lines)}") { ring =>
      ring.run(100)
      assert(Seq(1, 2).map(ring.node(_)("runs").bool) == Seq(false, true))
    }
  }

  it should "make each pass of a slow host longer" in using(relay(2)) { ring =>
    ring.awaitWhole(StartUs)
    ring.ask("host 1 slow 5")
    exchange(ring, 1, 2, 2, Seq(2))
    // It is taken in one pass, sent by the next one, and by a third one it is over.
    val before = ring.us()
    exchange(ring, 1, 2, 2, Seq(2))
    assert(ring.us() - before > 12500)
  }

  it should "lose what is on the cable of a node that loses its power" in
    Using.resource(new DatagramSocket(0, InetAddress.getLoopbackAddress)) { server =>
      val key     = Files.writeString(Directory.lasting("ring").resolve("key"), "00" * 16)
      val options = Seq("--server-port", s"${server.getLocalPort}", "--key", s"$key")
      val nodes   = Seq(ujson.Obj("preset" -> "ring-server", "host" -> "server"), ujson.Obj("host" -> "none"))
      using(relay(2, "nodes" -> nodes), options: _*) { ring =>
        val report = new DatagramPacket(new Array(2000), 2000)
        server.setSoTimeout(60000)
        server.receive(report)
        // More than the cable carries until all have come there, beside frames of ARP.
        val before = ring.node(1)("to_node").num
        for (_ <- 1 to 40) server.send(new DatagramPacket(new Array(1000), 1000, report.getSocketAddress))
        ring.await("all are on the cable", 10000)(ring.node(1)("to_node").num >= before + 40)
        assert(ring.node(1)("refused").num < 30)
        ring.ask("off 1")
        ring.ask("on 1")
        ring.run(3000)
        assert(ring.node(1)("fault").str == "good" && ring.node(1)("refused").num < 5)
      }
    }

  it should "be the same each time, also where a host draws its life" in {
    def lives() =
      using(relay(3), "--script", s"${scriptOf((1 to 3).map(n => s"0 storage $n fail\n").mkString)}") {
        ring =>
          val nodes = 1 to 3
          ring.await("all have begun", 10000)(
            nodes.forall(ring.node(_).obj.get("fault").exists(_.str == "store"))
          )
          nodes.map(ring.node(_)("life").num.toInt)
      }
    val first = lives()
    assert(lives() == first && first.distinct.size == 3)
  }

  it should "answer a wrong line with a sentence, and do nothing" in using(relay(2)) { ring =>
    // As many values as a node sends and follows, each of them twice.
    for (_ <- 1 to 2; n <- 0 until 64; line <- Seq(s"object 1 2 $n 00", s"watch 1 2 $n")) ring.ask(line)
    val wrong = Seq(
      "object 1 2 64 00",
      "watch 1 2 64",
      "cut 3",
      "cut",
      "cut 1 sideways",
      "optics 1 errors -1",
      "optics 1 jitter 11",
      "optics 1 taste 3",
      "stuck 1 there odd",
      "send 1 1 00",
      "send 1 2 0",
      "send 1 126 00",
      s"send 1 2 ${"00" * 2049}",
      "object 1 2 256 00",
      "object 1 2 1 112233445566778899",
      "messages 3",
      "dance",
      ""
    )
    for (line <- wrong) assert(ring.answer(line).startsWith("error: "), line)
    assert(ring.status()("fibres").arr.forall(f => f("there")("whole").bool && f("back")("whole").bool))
  }
}
