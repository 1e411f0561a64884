package flyframe.e2e

import java.net.URI
import java.net.http.{HttpClient, HttpRequest, HttpResponse}
import java.nio.file.Path
import java.util.concurrent.TimeUnit
import org.scalatest.flatspec.AnyFlatSpec
import scala.util.Using
import flyframe.Tier
import flyframe.ring.RingProcess
import flyframe.server.ServerBench.eventually

/** `make demo-ring`, see [[DemoProcess]]. */
class RingDemoSpec extends AnyFlatSpec {
  private val tier  = Tier("A break in the demonstration of the ring, shown in time", "nodes", 4, 12)
  private val nodes = tier.size
  private def demo() = new DemoProcess(
    "ring.py",
    Path.of("build", "demo-ring"),
    Path.of(RingProcess.program).toAbsolutePath.toString,
    "--nodes",
    s"$nodes"
  )

  /** Real time until a break is shown, ms: with two processors for the demonstration alone. */
  private val patience = if (Tier.isSoak) 10000 else 120000

  "The demonstration of the ring" should "show a break where it is, and that nothing is lost" in
    tier.run("all", nodes)(Using.resource(demo()) { demo =>
      val greeting = demo.greeting
      val page     = greeting.collectFirst { case s"page: $address" => address }.get
      for (door <- Seq("slcan on", "socketcand on", "cannelloni on", "ring.pcap", "plant.pcap"))
        assert(greeting.exists(_.contains(door)), greeting.mkString("\n"))
      val client = HttpClient.newHttpClient
      def get(path: String) = client
        .send(HttpRequest.newBuilder(URI.create(page + path)).build, HttpResponse.BodyHandlers.ofString)
        .body
      def rings = ujson.read(get("api/state"))("rings").arr
      // The last node has CAN programs in the place of its host.
      eventually("the ring is whole", 240000)(
        rings.exists(r => r("whole").bool && r("present").num == nodes - 1)
      )
      demo.write("cut 2")
      val cutAt = System.nanoTime
      eventually("the break is shown", patience) {
        rings.head("ends").arrOpt.exists(_.map(_.num.toInt) == Seq(2, 3))
      }
      info(f"the break was shown after ${(System.nanoTime - cutAt) / 1e9}%.1f s")
      demo.write("send 2 hello out there")
      eventually("the message is in the log", 240000)(get("log.csv").contains("“hello out there”"))
      demo.write("quit")
      assert(demo.process.waitFor(60, TimeUnit.SECONDS) && demo.process.exitValue == 0)
    })

  it should "take its programs with it, however it ends" in {
    // What it does in Python is what AlarmDemoSpec sees; its simulator is another one.
    val signals = if (Tier.isSoak) DemoProcess.signals else DemoProcess.signals.takeRight(1)
    for ((signal, code) <- signals) Using.resource(demo())(_.endsBy(signal, code))
  }

  it should "answer a mistake with one sentence and exit code 2" in {
    DemoProcess.refuses("ring.py", "--http-port", "99999", "-1", "x")
    DemoProcess.refuses("ring.py", "--nodes", "2", "33")
  }
}
