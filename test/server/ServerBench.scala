package flyframe.server

import java.net.URI
import java.net.http.{HttpClient, HttpRequest, HttpResponse}
import java.nio.file.{Files, Path}
import java.util.HexFormat
import scala.util.Using
import org.scalatest.Assertions._
import flyframe.Directory

/** A whole server on loopback, on free ports. */
object ServerBench {
  val key: Array[Byte] = Array.tabulate[Byte](16)(i => (200 - 5 * i).toByte)

  def options(directory: Path): Options = {
    val file = directory.resolve("key")
    Files.writeString(file, HexFormat.of.formatHex(key) + "\n")
    // Patient, since tests may run on a machine that is busy.
    Options(
      httpPort = 0,
      udpPort = 0,
      database = directory.resolve("log.db"),
      key = Some(file),
      masterTimeoutMs = 60000,
      orderTimeoutMs = 60000
    )
  }

  def start(options: Options): Server.Running = Server.start(options).fold(fail(_), identity)

  def withServer[A](change: Options => Options = identity[Options] _)(check: Server.Running => A): A =
    Directory(d => Using.resource(start(change(options(d))))(check))

  private val client = HttpClient.newHttpClient

  def get(server: Server.Running, path: String): HttpResponse[String] = client.send(
    HttpRequest.newBuilder(URI.create(server.page + path)).build,
    HttpResponse.BodyHandlers.ofString
  )

  def state(server: Server.Running): ujson.Value = ujson.read(get(server, "api/state").body)

  def refused(server: Server.Running, why: Refusal): Int = state(server)("refused")(why.name).num.toInt

  /** Waits until it holds. */
  def eventually(what: String, ms: Int = 240000)(holds: => Boolean): Unit = {
    val end = System.nanoTime() + ms * 1000000L
    while (!holds) {
      if (System.nanoTime() > end) fail(s"not within $ms ms: $what")
      Thread.sleep(5)
    }
  }
}
