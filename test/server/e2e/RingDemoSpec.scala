package flyframe.e2e

import java.io.{BufferedReader, InputStreamReader}
import java.net.URI
import java.net.http.{HttpClient, HttpRequest, HttpResponse}
import java.nio.file.{Files, Path}
import java.util.concurrent.TimeUnit
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.Tier
import flyframe.ring.RingProcess
import flyframe.server.ServerBench.eventually

/** `make demo-ring`, but for the building: the program that it calls, driven as somebody at the terminal
  * does.
  */
class RingDemoSpec extends AnyFlatSpec {
  private val nodes  = if (Tier.isSoak) 12 else 4
  private val folder = Path.of("build", "demo-ring")

  /** Real time until a break is shown, ms: with two processors for the demonstration alone. */
  private val patience = if (Tier.isSoak) 10000 else 120000

  "The demonstration of the ring" should "show a break where it is, and that nothing is lost" in {
    Files.createDirectories(folder)
    Files.writeString(folder.resolve("classpath"), sys.props("java.class.path"))
    val arguments = Seq("--http-port", "0", "--nodes", s"$nodes", "--simulator", RingProcess.program)
    val process = new ProcessBuilder(("python3" +: "demo/ring.py" +: arguments): _*)
      .redirectError(ProcessBuilder.Redirect.INHERIT)
      .start()
    try {
      val out = new BufferedReader(new InputStreamReader(process.getInputStream))
      val in  = process.outputWriter()
      val greeting =
        Iterator.continually(out.readLine()).takeWhile(_ != null).takeWhile(!_.contains("Try: cut")).toSeq
      val page = greeting.collectFirst { case s"page: $address" => address }.get
      for (door <- Seq("slcan on", "socketcand on", "cannelloni 2 on", "ring.pcap", "plant.pcap"))
        assert(greeting.exists(_.contains(door)), greeting.mkString("\n"))
      val client = HttpClient.newHttpClient
      def get(path: String) = client
        .send(HttpRequest.newBuilder(URI.create(page + path)).build, HttpResponse.BodyHandlers.ofString)
        .body
      def rings = ujson.read(get("api/state"))("rings").arr
      def type0(line: String): Unit = {
        in.write(s"$line\n")
        in.flush()
      }
      // The last node has CAN programs in the place of its host.
      eventually("the ring is whole", 240000)(
        rings.exists(r => r("whole").bool && r("present").num == nodes - 1)
      )
      type0("cut 2")
      eventually("the break is shown", patience) {
        rings.head("ends").arrOpt.exists(_.map(_.num.toInt) == Seq(2, 3))
      }
      type0("send 2 hello out there")
      eventually("the message is in the log", 240000)(get("log.csv").contains("“hello out there”"))
      type0("quit")
      assert(process.waitFor(60, TimeUnit.SECONDS) && process.exitValue == 0)
    } finally {
      // It ends its own programs.
      process.destroy()
      process.waitFor(60, TimeUnit.SECONDS)
    }
  }
}
