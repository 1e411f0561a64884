package flyframe.e2e

import java.nio.file.Path
import scala.util.Using
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.Directory
import flyframe.ring.RingProcess
import flyframe.server.{EventStore, Options, PageClient, Server, ServerBench}

/** A ring whose node 1 has the port to the plant network, all nodes in RTL with their host programs, and the
  * server on this computer.
  */
class RingOnServerSpec extends AnyFlatSpec {
  import ServerBench.{eventually, start, state}
  private val network = ujson.Obj(
    "nodes" -> ujson.Arr(
      ujson.Obj("preset" -> "ring-server", "host" -> "server"),
      ujson.Obj(),
      ujson.Obj(),
      ujson.Obj()
    ),
    "hello_ms"   -> 5,
    "up_ms"      -> 1,
    "confirm_us" -> 2000
  )
  private val Patience = 240000 // real time, ms

  private class Bench(directory: Path) {
    private val first = ServerBench.options(directory)

    /** Of the server, whose ports stay. */
    var options: Options       = first
    var server: Server.Running = start(first)
    options = first.copy(udpPort = server.udpPort)
    val ring = new RingProcess(network, "--server-port", s"${server.udpPort}", "--key", s"${first.key.get}")

    def stop(): Unit  = server.close()
    def again(): Unit = server = start(options)

    def picture: ujson.Value = state(server)("rings")(0)
    def nodes: Map[Int, String] =
      picture("nodes").arr.map(n => n("address").num.toInt -> n("text").str).toMap
    def ends: Seq[Int] = picture("ends").arrOpt.fold(Seq.empty[Int])(_.map(_.num.toInt).toSeq)
    def isWhole: Boolean =
      state(server)("rings").arr.nonEmpty && picture("whole").bool && picture("present").num == 4 &&
        nodes.values.forall(_ == "normal")

    /** All messages that the log has. */
    def logged: Seq[Seq[Int]] =
      Using.resource(EventStore.open(options.database).fold(fail(_), identity))(
        _.messages(1, 0, 1000000).map(_._2.toSeq.map(_ & 0xff))
      )

    def send(node: Int, data: Seq[Int], urgent: Boolean = false): Int = ring.send(node, 1, data, urgent)
    def outcome(node: Int, tag: Int): Option[String] = ring.ends(node).find(_.tag == tag).map(_.outcome)
    def awaitDelivered(node: Int, tag: Int): Unit =
      eventually(s"message $tag of node $node is delivered", Patience)(
        outcome(node, tag).contains("delivered")
      )

    /** Of a node whose host has started anew, and its tags with it. */
    def sendAnew(node: Int, data: Seq[Int]): Unit = {
      val before = ring.ends(node).size
      send(node, data)
      eventually(s"another message of node $node ends", Patience)(ring.ends(node).size > before)
      assert(ring.ends(node).last.outcome == "delivered")
    }
  }

  "GW-04 to GW-07, GWB-01: a ring under the server" should
    "lose no message and double none, whatever restarts, and show its breaks" in Directory { directory =>
      val bench = new Bench(directory)
      import bench._
      try {
        eventually("the ring is whole in the page", Patience)(isWhole)
        assert(picture("nodes").arr.map(_("address").num.toInt).toSet == Set(1, 2, 3, 4))

        val short = Seq(1, 2, 3)
        val long  = Seq.tabulate(2048)(i => i * 7 & 0xff)
        val fire  = "fire".map(_.toInt)
        val tags  = Seq(2 -> send(2, short), 3 -> send(3, long), 4 -> send(4, fire, urgent = true))
        for ((node, tag) <- tags) awaitDelivered(node, tag)
        assert(logged.toSet == Set(short, long, fire) && logged.size == 3)

        // GW-05: while the server is down nothing is delivered, and nothing is lost.
        stop()
        val waits = send(2, Seq(4, 5, 6))
        ring.run(15000)
        assert(outcome(2, waits).isEmpty)
        again()
        awaitDelivered(2, waits)
        assert(logged.count(_ == Seq(4, 5, 6)) == 1)

        // The gateway's host dies with a message that the server may have.
        val through = send(3, long.reverse)
        ring.run(2000)
        ring.ask("host 1 stop")
        ring.run(1000)
        ring.ask("host 1 start")
        awaitDelivered(3, through)
        assert(logged.count(_ == long.reverse) == 1 && logged.size == 5)

        // The whole gateway loses its power, with another one under way.
        val dark = send(2, long.drop(1000))
        ring.run(1000)
        ring.ask("off 1")
        ring.run(1000)
        ring.ask("on 1")
        awaitDelivered(2, dark)
        assert(logged.count(_ == long.drop(1000)) == 1 && logged.size == 6)
        eventually("the ring is whole behind it", Patience)(isWhole)

        // TP-13: a sender dies in the middle of a message, and sends it again when it is back.
        val half = long.drop(1500)
        send(3, half)
        ring.run(2000)
        ring.ask("host 3 stop")
        ring.run(1000)
        ring.ask("host 3 start")
        assert(logged.size == 6)
        sendAnew(3, half)
        assert(logged.count(_ == half) == 1)

        // One loses its power that is in the log, whether or not it has heard so.
        val heard = long.drop(1600)
        send(2, heard)
        eventually("the log has the message", Patience)(logged.contains(heard))
        ring.ask("off 2")
        ring.run(1000)
        ring.ask("on 2")
        eventually("the ring is whole behind it, too", Patience)(isWhole)
        sendAnew(2, Seq(7, 8, 9))
        assert(logged.count(_ == heard) == 1 && logged.size == 9)

        // GW-06
        val page = new PageClient(server)
        val answer =
          page.post("api/ring", """{"ring": 1, "node": 3, "text": "stop the pump", "urgent": true}""")
        assert(answer.statusCode == 202, answer.body)
        eventually("the node has the message", Patience) {
          ring.messages(3).exists(m => m.data == RingProcess.hex("stop the pump".map(_.toInt)) && m.urgent)
        }
        eventually("its result is told", Patience)(picture("orders")(0)("state").str == "delivered")
        assert(ring.messages(3).size == 1)

        // GW-07
        ring.ask("cut 2")
        eventually("the break is shown", Patience) {
          ends == Seq(2, 3) && nodes(2) == "port 2 down" && nodes(3) == "port 1 down"
        }
        ring.ask("mend 2")
        eventually("the ring is whole again", Patience)(isWhole)
        ring.ask("off 4")
        eventually("a dead node is lost", Patience)(
          nodes(4) == "lost" && nodes(3) == "port 2 down" && ends == Seq(3, 1)
        )
        // The picture does not wait for the log.
        for (
          text <- Seq(
            "urgent message of node 4, may be a repeat: “fire”",
            "ring broken between node 2 and node 3",
            "node 4: lost"
          )
        ) eventually(s"the log has '$text'")(ServerBench.get(server, "log.csv").body.contains(text))
      } finally {
        ring.close()
        server.close()
      }
    }
}
