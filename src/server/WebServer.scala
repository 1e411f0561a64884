package flyframe.server

import java.io.{BufferedWriter, IOException, OutputStreamWriter}
import java.net.{BindException, InetSocketAddress}
import java.nio.charset.StandardCharsets.UTF_8
import java.security.{MessageDigest, SecureRandom}
import java.util.HexFormat
import java.util.concurrent.TimeUnit
import scala.util.Try
import io.undertow.{Handlers, Undertow, UndertowOptions}
import io.undertow.server.{HttpHandler, HttpServerExchange}
import io.undertow.server.handlers.{BlockingHandler, RequestLimitingHandler}
import io.undertow.util.{Headers, HttpString}
import org.xnio.{Options => XnioOptions}
import flyframe.protocol.{Order, ServerDatagram}

/** The page, its messages, the log as CSV, and orders from the page (SRV-15 to SRV-18). A page of another
  * origin can neither read anything nor send a command: the Host header must name this server (DNS
  * rebinding), an Origin header must be that of the page, and a command must carry the token that stands in
  * the page.
  */
final class WebServer(
    options: Options,
    supervisor: Supervisor,
    store: EventStore,
    feed: PageFeed,
    expected: Expected
) extends AutoCloseable {
  import WebServer._

  private val token = {
    val bytes = new Array[Byte](32)
    new SecureRandom().nextBytes(bytes)
    HexFormat.of.formatHex(bytes)
  }

  private val routes = Handlers
    .routing()
    .get("/", text("text/html", resource("page.html").replace("{{token}}", token)))
    .get("/page.css", text("text/css", resource("page.css")))
    .get("/page.js", text("text/javascript", resource("page.js")))
    .get("/icon.svg", text("image/svg+xml", resource("icon.svg")))
    .get("/events", Handlers.serverSentEvents((connection, _) => feed.add(connection)))
    .get("/api/state", e => answer(e, 200, "application/json", supervisor.picture.json.render()))
    .get(
      "/log.csv",
      new RequestLimitingHandler(MostDownloads, 2 * MostDownloads, new BlockingHandler(csv(_)))
    )
    .post("/api/command", posted(_)(command))
    .post("/api/ring", posted(_)(toRing))

  private val server = Undertow.builder
    .addHttpListener(options.httpPort, options.listen.getHostAddress)
    .setServerOption[java.lang.Long](UndertowOptions.MAX_ENTITY_SIZE, MostBodyBytes.toLong)
    .setServerOption[Integer](UndertowOptions.MAX_HEADER_SIZE, 16384)
    .setServerOption[Integer](UndertowOptions.REQUEST_PARSE_TIMEOUT, 10000)
    .setServerOption[Integer](UndertowOptions.NO_REQUEST_TIMEOUT, NoRequestMs)
    // Not for reading: pages that are told what happens send nothing any more.
    .setSocketOption[Integer](XnioOptions.WRITE_TIMEOUT, StalledMs)
    .setHandler(guarded(routes))
    .build

  /** Binds the port and serves. */
  private def start(): Unit = server.start()

  def port: Int = server.getListenerInfo.get(0).getAddress.asInstanceOf[InetSocketAddress].getPort

  def close(): Unit = server.stop()

  /** Whom to answer at all. */
  private def guarded(next: HttpHandler): HttpHandler = exchange => {
    val headers = exchange.getRequestHeaders
    val host    = Option(headers.getFirst(Headers.HOST))
    val origin  = Option(headers.getFirst(Headers.ORIGIN))
    val site    = Option(headers.getFirst("Sec-Fetch-Site"))
    val isPage  = exchange.getRequestPath == "/"
    SecurityHeaders.foreach { case (name, value) => exchange.getResponseHeaders.put(name, value) }
    if (!host.exists(isOurs)) refuse(exchange, 403, "This is not the name of this server.")
    else if (origin.exists(_.replaceFirst("^https?://", "") != host.get))
      refuse(exchange, 403, "Other pages have no access.")
    else if (!isPage && site.exists(s => s != "same-origin" && s != "none"))
      refuse(exchange, 403, "Other pages have no access.")
    else next.handleRequest(exchange)
  }

  /** The name is localhost, one given at the start, or an IP address: which no DNS server can turn into ours.
    */
  private def isOurs(host: String): Boolean = {
    val name = host.replaceFirst(":\\d+$", "").toLowerCase
    name == "localhost" || options.hosts.contains(name) || name.matches(
      """\d+\.\d+\.\d+\.\d+|\[[0-9a-f:.]+\]"""
    )
  }

  /** A request of the page that changes something. */
  private def posted(exchange: HttpServerExchange)(take: (HttpServerExchange, String) => Unit): Unit = {
    val headers = exchange.getRequestHeaders
    val sent    = Option(headers.getFirst("X-Token")).getOrElse("")
    val type0   = Option(headers.getFirst(Headers.CONTENT_TYPE)).getOrElse("").takeWhile(_ != ';').trim
    if (!headers.contains(Headers.ORIGIN)) refuse(exchange, 403, "Only the page may send commands.")
    else if (!MessageDigest.isEqual(sent.getBytes(UTF_8), token.getBytes(UTF_8)))
      refuse(exchange, 403, "The page is not of this start of the server: reload it.")
    else if (!type0.equalsIgnoreCase("application/json"))
      refuse(exchange, 415, "Commands are application/json.")
    else if (exchange.getRequestContentLength > MostBodyBytes) refuse(exchange, 413, "That is too long.")
    else receive(exchange)(take(exchange, _))
  }

  /** The body of a request, of which a client may send only a part: so no thread waits for it, and it must be
    * there soon.
    */
  private def receive(exchange: HttpServerExchange)(take: String => Unit): Unit = {
    val close: Runnable = () => exchange.getConnection.close()
    val late            = exchange.getIoThread.executeAfter(close, BodyMs, TimeUnit.MILLISECONDS)
    exchange.getRequestReceiver.receiveFullBytes(
      (_: HttpServerExchange, bytes: Array[Byte]) => {
        late.remove()
        val whole: HttpHandler = _ => take(new String(bytes, UTF_8))
        exchange.dispatch(whole)
        ()
      },
      (_: HttpServerExchange, _: IOException) => {
        late.remove()
        refuse(exchange, 413, "That is too long.")
      }
    )
  }

  private def command(exchange: HttpServerExchange, body: String): Unit = order(body) match {
    case None =>
      refuse(
        exchange,
        400,
        """A command is {"master": ID, "command": "silence", "reset", "acknowledge" or "watch", """ +
          """"node": ID}, or "disable" or "test" with "node" and "seconds"; "disable", "test" and """ +
          """"watch" may have "zone": NAME instead of "node"."""
      )
    case Some(give) => taken(exchange, give().map(_.id))
  }

  private def taken(exchange: HttpServerExchange, result: Either[String, Int]): Unit = result match {
    case Left(why) => refuse(exchange, 409, why)
    case Right(id) => answer(exchange, 202, "application/json", ujson.Obj("id" -> id).render())
  }

  /** A message for a node of a ring (GW-06). */
  private def toRing(exchange: HttpServerExchange, body: String): Unit = Try {
    val json = ujson.read(body).obj
    def number(name: String, most: Int) = {
      val n = json(name).num
      require(n.isWhole && n >= 0 && n <= most, s"$name is $n but must be 0 to $most.")
      n.toInt
    }
    val data = (json.get("text"), json.get("hex")) match {
      case (Some(text), None) => text.str.getBytes(UTF_8)
      case (None, Some(hex))  => HexFormat.of.parseHex(hex.str)
      case _                  => throw new IllegalArgumentException("text or hex")
    }
    (number("ring", 0xffff), number("node", 125), json.get("urgent").exists(_.bool), data.toVector)
  }.toOption match {
    case None =>
      refuse(
        exchange,
        400,
        """A message is {"ring": ID, "node": ADDRESS, or 0 for all, "text": TEXT or "hex": DIGITS, """ +
          s""""urgent": true or false}, of 1 to ${RingProtocol.MostSendBytes} bytes."""
      )
    case Some((_, _, _, data)) if data.isEmpty || data.size > RingProtocol.MostSendBytes =>
      refuse(
        exchange,
        400,
        s"The message has ${data.size} bytes, but must have 1 to ${RingProtocol.MostSendBytes}."
      )
    case Some((ring, node, urgent, data)) =>
      taken(exchange, supervisor.sendToRing(ring, node, urgent, data).map(_.id))
  }

  /** The order that a request asks for; neither node nor zone: for all. Detectors are disabled or tested one
    * by one or by zones, and for a time; silence and reset are not for zones.
    */
  private def order(body: String): Option[() => Either[String, Request]] = Try {
    val json = ujson.read(body).obj
    def number(name: String, range: Range) = json.get(name).map { v =>
      val n = v.num
      require(
        n.isWhole && range.contains(n.toInt),
        s"$name is $n but must be ${range.start} to ${range.end}."
      )
      n.toInt
    }
    val node    = number("node", 0 until ServerDatagram.AllNodes)
    val seconds = number("seconds", 1 to 0xffff)
    val code    = Codes(json("command").str)
    val zone    = json.get("zone").map(_.str)
    val isTimed = code == Order.Disable || code == Order.Test
    require(
      isTimed == seconds.nonEmpty && (node.nonEmpty || zone.nonEmpty || !isTimed),
      "node, zone and seconds do not fit."
    )
    require(zone.isEmpty || node.isEmpty && (isTimed || code == Order.Watch), "This is not for a zone.")
    val shown  = json.get("shown").map(_.arr.map(_.num.toInt).toSet)
    val whom   = node.getOrElse(ServerDatagram.AllNodes)
    val master = number("master", 0 to 0xffff).get
    val time   = seconds.getOrElse(0)
    () =>
      zone.fold(supervisor.order(master, code, whom, time, shown))(
        supervisor.orderZone(master, code, _, time)
      )
  }.toOption

  private def csv(exchange: HttpServerExchange): Unit = {
    exchange.getResponseHeaders.put(Headers.CONTENT_TYPE, "text/csv; charset=utf-8")
    exchange.getResponseHeaders.put(Headers.CONTENT_DISPOSITION, "attachment; filename=\"flyframe-log.csv\"")
    val out = new BufferedWriter(new OutputStreamWriter(exchange.getOutputStream, UTF_8))
    LogCsv.write(out, expected, store.after(_, 1000))
    out.close()
  }
}

object WebServer {
  private val MostBodyBytes = 4096
  private val MostDownloads = 4

  /** A connection without a request is closed; one whose client takes nothing, which Undertow also finds with
    * what it writes after a pause that is longer; one that has sent a part of a body. Milliseconds.
    */
  private val NoRequestMs = 20000
  private val StalledMs   = 30000
  private val BodyMs      = 10000L

  /** Orders by the names that the page has for them. */
  private val Codes = Map(
    "silence"     -> Order.Silence,
    "reset"       -> Order.Reset,
    "disable"     -> Order.Disable,
    "test"        -> Order.Test,
    "watch"       -> Order.Watch,
    "acknowledge" -> Order.Acknowledge
  )

  private val SecurityHeaders = Seq(
    "Content-Security-Policy" -> ("default-src 'none'; script-src 'self'; style-src 'self'; " +
      "img-src 'self'; connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"),
    "Cross-Origin-Resource-Policy" -> "same-origin",
    "Cross-Origin-Opener-Policy"   -> "same-origin",
    "X-Content-Type-Options"       -> "nosniff",
    "Referrer-Policy"              -> "no-referrer",
    "Cache-Control"                -> "no-store"
  ).map { case (name, value) => new HttpString(name) -> value }

  /** Starts; Left: why that is not possible. */
  def start(
      options: Options,
      supervisor: Supervisor,
      store: EventStore,
      feed: PageFeed,
      expected: Expected
  ): Either[String, WebServer] = {
    val web = new WebServer(options, supervisor, store, feed, expected)
    try {
      web.start()
      Right(web)
    } catch {
      // Undertow wraps it.
      case e: Exception if e.isInstanceOf[BindException] || e.getCause.isInstanceOf[java.io.IOException] =>
        val why = Option(e.getCause).getOrElse(e).getMessage
        Left(s"Port ${options.httpPort} at ${options.listen.getHostAddress} cannot be used ($why).")
    }
  }

  private def resource(name: String): String = {
    val in = getClass.getResourceAsStream(s"/server/$name")
    try new String(in.readAllBytes, UTF_8)
    finally in.close()
  }

  private def text(mediaType: String, content: String): HttpHandler = answer(_, 200, mediaType, content)

  private def answer(exchange: HttpServerExchange, status: Int, mediaType: String, content: String): Unit = {
    exchange.setStatusCode(status)
    exchange.getResponseHeaders.put(Headers.CONTENT_TYPE, s"$mediaType; charset=utf-8")
    exchange.getResponseSender.send(content)
  }

  private def refuse(exchange: HttpServerExchange, status: Int, sentence: String): Unit =
    answer(exchange, status, "text/plain", sentence)
}
