package flyframe.server

import java.net.URI
import java.net.http.{HttpClient, HttpRequest, HttpResponse}
import java.net.http.HttpRequest.BodyPublishers
import java.net.http.HttpResponse.BodyHandlers
import java.util.concurrent.ConcurrentLinkedQueue
import scala.jdk.CollectionConverters._

/** What a browser with the page does, without a browser. */
final class PageClient(server: Server.Running) {
  private val client = HttpClient.newHttpClient
  private val origin = server.page.stripSuffix("/")

  /** The token that stands in the page. */
  lazy val token: String = "name=\"token\" content=\"([0-9a-f]{64})\"".r
    .findFirstMatchIn(ServerBench.get(server, "").body)
    .get
    .group(1)

  def command(body: ujson.Value): HttpResponse[String] = post("api/command", body.render())

  /** What the page sends when somebody asks it to change something. */
  def post(path: String, body: String): HttpResponse[String] = client.send(
    HttpRequest
      .newBuilder(URI.create(server.page + path))
      .header("Origin", origin)
      .header("X-Token", token)
      .header("Content-Type", "application/json")
      .POST(BodyPublishers.ofString(body))
      .build,
    BodyHandlers.ofString
  )

  /** The messages of the server, as they come. */
  def messages(): Messages = new Messages

  final class Messages extends AutoCloseable {
    private val got = new ConcurrentLinkedQueue[ujson.Value]
    private val in = client
      .send(HttpRequest.newBuilder(URI.create(server.page + "events")).build, BodyHandlers.ofInputStream)
      .body
    private val reader = new Thread(() =>
      try
        scala.io.Source
          .fromInputStream(in, "UTF-8")
          .getLines()
          .filter(_.startsWith("data:"))
          .foreach(line => got.add(ujson.read(line.drop(5))))
      catch { case _: java.io.IOException => () }
    )
    reader.setDaemon(true)
    reader.start()

    def lines: Seq[ujson.Value] = got.asScala.toSeq
    def close(): Unit           = in.close()
  }
}
