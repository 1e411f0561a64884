package flyframe.server

import java.net.InetAddress
import java.nio.file.{Path, Paths}
import scala.util.Try
import scopt.{OParser, OParserBuilder}
import flyframe.BuildInfo

/** How the server is started.
  *
  * @param listen
  *   address for page and reports
  * @param httpPort
  *   of the page; 0: any free one
  * @param udpPort
  *   of the reports; 0: any free one
  * @param database
  *   SQLite file of the log
  * @param key
  *   file with the keys shared with the masters, see [[Keys.read]]; the server does not start without
  * @param expected
  *   file with the slaves that are to be there, see [[Expected.read]]; None: any may be
  * @param hosts
  *   names under which a browser may ask for the page, besides localhost and IP addresses
  * @param masters
  *   masters that may report, with their addresses; empty: any
  * @param masterTimeoutMs
  *   a master that has not reported for so long is silent, 1 to 86,400,000
  * @param orderTimeoutMs
  *   an order has failed when no result has come for so long, 1 to 86,400,000
  * @param withInput
  *   it ends with its standard input
  */
final case class Options(
    listen: InetAddress = InetAddress.getByAddress("127.0.0.1", Array[Byte](127, 0, 0, 1)),
    httpPort: Int = 8080,
    udpPort: Int = Options.ReportPort,
    database: Path = Paths.get("flyframe-log.db"),
    key: Option[Path] = None,
    expected: Option[Path] = None,
    hosts: Seq[String] = Nil,
    masters: Map[Int, InetAddress] = Map.empty,
    masterTimeoutMs: Int = 5000,
    orderTimeoutMs: Int = 10000,
    withInput: Boolean = false
)

object Options {

  /** UDP port of the server: the magic number of the datagrams. */
  val ReportPort = 0x4641

  /** What the command line asks for: text to be shown (help), or options; Left: one sentence. */
  def parse(args: Seq[String]): Either[String, Either[String, Options]] =
    OParser.runParser(parser, args, Options()) match {
      case (parsed, effects) =>
        val errors = effects.collect { case scopt.OEffect.ReportError(text) => text }
        val shown  = effects.collect { case scopt.OEffect.DisplayToOut(text) => text }
        if (errors.nonEmpty) Left(errors.head + (if (errors.head.endsWith(".")) "" else "."))
        else if (shown.nonEmpty) Right(Left(shown.mkString("\n")))
        else parsed.toRight("The arguments could not be read; --help lists them.").map(Right(_))
    }

  private val AddressText = """\d{1,3}(?:\.\d{1,3}){3}|[0-9a-fA-F:.]*:[0-9a-fA-F:.]*"""

  /** An IP address; names are not looked up. */
  private def address(text: String): Option[InetAddress] =
    Option.when(text.matches(AddressText))(text).flatMap(t => Try(InetAddress.getByName(t)).toOption)

  private def master(text: String): Option[(Int, InetAddress)] = text.split("=", -1) match {
    case Array(id, ip) => id.toIntOption.filter(i => i >= 0 && i <= 0xffff).zip(address(ip))
    case _             => None
  }

  private val parser: OParser[_, Options] = {
    val builder: OParserBuilder[Options] = OParser.builder[Options]
    import builder._
    // Read as text, so that what is wrong is said in one sentence.
    def number(name: String, range: Range, text: String)(set: (Int, Options) => Options) =
      opt[String](name)
        .valueName("<n>")
        .text(s"$text; ${range.start} to ${range.end}")
        .validate(v =>
          if (v.toIntOption.exists(range.contains)) success
          else failure(s"$name is '$v' but must be a whole number from ${range.start} to ${range.end}.")
        )
        .action((v, o) => set(v.toInt, o))
    def path(name: String, text: String)(set: (Path, Options) => Options) =
      opt[String](name)
        .valueName("<file>")
        .text(text)
        .validate(v =>
          if (v.nonEmpty && Try(Paths.get(v)).isSuccess) success
          else failure(s"$name is '$v' but must be a file.")
        )
        .action((v, o) => set(Paths.get(v), o))
    val day      = 24 * 60 * 60 * 1000
    val defaults = Options()
    OParser.sequence(
      programName("flyframe-server"),
      head("flyframe", BuildInfo.version, "- server of alarm systems and fibre rings"),
      help("help").text("this text"),
      opt[String]("listen")
        .valueName("<address>")
        .text("IP address for page and reports; default 127.0.0.1, this machine only")
        .validate(v =>
          if (address(v).nonEmpty) success else failure(s"listen is '$v' but must be an IP address.")
        )
        .action((v, o) => o.copy(listen = address(v).get)),
      number("http-port", 0 to 65535, s"port of the page, 0: a free one; default ${defaults.httpPort}")(
        (v, o) => o.copy(httpPort = v)
      ),
      number("udp-port", 0 to 65535, s"port of the reports, 0: a free one; default ${defaults.udpPort}")(
        (v, o) => o.copy(udpPort = v)
      ),
      path("database", s"SQLite file of the log; default ${defaults.database}")((v, o) =>
        o.copy(database = v)
      ),
      path(
        "key",
        "file with the key of all masters, 32 hexadecimal digits, or with lines of ID and key; needed"
      )((v, o) => o.copy(key = Some(v))),
      path(
        "expected",
        "JSON file with the slaves that are to be there; without it none is missed from the start"
      )((v, o) => o.copy(expected = Some(v))),
      opt[Seq[String]]("hosts")
        .valueName("<name>,...")
        .text("names under which the page may be asked for, besides localhost and IP addresses")
        .action((v, o) => o.copy(hosts = v.map(_.toLowerCase))),
      opt[Seq[String]]("masters")
        .valueName("<ID>=<address>,...")
        .text("masters that may report, and their IP addresses; default: any")
        .validate(_.find(master(_).isEmpty) match {
          case Some(v) => failure(s"masters has '$v' but must be a list of ID=address.")
          case None    => success
        })
        .action((v, o) => o.copy(masters = v.flatMap(master).toMap)),
      number("master-timeout-ms", 1 to day, s"a master is silent after; default ${defaults.masterTimeoutMs}")(
        (v, o) => o.copy(masterTimeoutMs = v)
      ),
      number("order-timeout-ms", 1 to day, s"an order has failed after; default ${defaults.orderTimeoutMs}")(
        (v, o) => o.copy(orderTimeoutMs = v)
      ),
      opt[Unit]("with-input")
        .text("ends when its standard input ends, as it does with a program that holds the other end")
        .action((_, o) => o.copy(withInput = true))
    )
  }
}
