package flyframe.ring

import org.scalatest.flatspec.AnyFlatSpec
import java.util.concurrent.CountDownLatch
import scala.sys.process._
import scala.util.Random
import flyframe.{Directory, Tier}

/** A node in Python, written from the rules of the transport alone on top of python-can, and nodes with the
  * host program in C on a ring in RTL.
  */
class PeerSpec extends AnyFlatSpec {
  private val tier     = Tier("A node in Python on a ring in RTL", "messages each way", test = 5, soak = 20)
  private val Messages = tier.size.toInt
  private val Longest  = if (Tier.isSoak) 2048 else 150
  private val Seed     = 1L

  "TP-30: a peer in Python" should "exchange messages with nodes in C through errors and a break" in
    tier.run("errors and a break", tier.size, Some(Seed))(exchange())

  private def exchange(): Unit = {
    val tty = Directory.lasting("peer").resolve("tty")
    val network = ujson.Obj(
      "mode"       -> "relay",
      "confirm_us" -> 1000,
      "up_ms"      -> 1,
      "nodes"      -> ujson.Arr(ujson.Obj(), ujson.Obj("host" -> "can", "address" -> 9), ujson.Obj())
    )
    RingProcess.using(network, "--slcan", s"2=$tty") { ring =>
      ring.await("the nodes know each other", 100000)(
        Seq(1, 3).forall(n => ring.node(n)("members").arr.map(_.num.toInt).exists(Set(1, 3)))
      )
      ring.ask("optics all errors 20000")
      val arguments = Seq("--channel", s"$tty", "--address", "9", "--to", "1")
      val counts =
        Seq("--longest", s"$Longest", "--messages", s"$Messages", "--wanted", s"${2 * Messages}") ++
          Seq("--patience", if (Tier.isSoak) "3000" else "300") // s
      val command    = Seq("build/tools/venv/bin/python", "test/flyframe/ring/peer.py") ++ arguments ++ counts
      val (out, err) = (new StringBuilder, new StringBuilder)
      val mayLeave   = new CountDownLatch(1) // the end of the peer's standard input
      def into(text: StringBuilder) = BasicIO.processFully(l => text.append(l).append('\n'))
      val streams = new ProcessIO(
        in => {
          mayLeave.await()
          in.close()
        },
        into(out),
        into(err),
        daemonizeThreads = true
      )
      val peer = Process(command).run(streams)
      // Both nodes send to it, one of them also what goes as SHORT.
      val random = new Random(Seed)
      val sent =
        for (
          n <- Seq(1, 3); size <- Seq(1, 6, 7, Longest) ++ Seq.fill(Messages - 4)(1 + random.nextInt(Longest))
        )
          yield {
            val data = Seq.fill(size)(random.nextInt(256))
            ring.send(n, 9, data)
            RingProcess.hex(data)
          }
      ring.run(5000)
      ring.ask("cut 1")
      ring.run(if (Tier.isSoak) 20000 else 4000)
      ring.ask("mend 1")
      try
        ring.await("all messages have ended", if (Tier.isSoak) 3000000 else 300000)(
          !peer.isAlive() || Seq(1, 3).forall(ring.ends(_).size == Messages) &&
            ring.messages(1).size == Messages
        )
      finally mayLeave.countDown()
      assert(peer.exitValue() == 0, err.toString)
      val said = ujson.read(out.toString)
      assert(said("received").arr.map(_.str).sorted == sent.sorted)
      val own = said("sent").arr
      assert(own.size == Messages && own.forall(_("outcome").str == "delivered"))
      assert(ring.messages(1).map(_.data).sorted == own.map(_("data").str).sorted)
      for (n <- Seq(1, 3)) assert(ring.ends(n).forall(_.outcome == "delivered"), ring.ends(n))
    }
  }
}
