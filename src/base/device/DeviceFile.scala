package flyframe.device

import scala.util.control.NoStackTrace

/** Reads device files: JSON, numbers also as text ("0x1a00"). Keys that do not exist are refused, so that a
  * slip of the pen is not silently a default.
  */
object DeviceFile {
  private final class Refused(sentence: String) extends Exception(sentence) with NoStackTrace
  private def refuse(sentence: String): Nothing = throw new Refused(sentence)

  private val Whole = "-?(0|[1-9][0-9]{0,17}|0[xX][0-9a-fA-F]{1,15})".r

  /** Text of a device file as a sentence can show it. */
  private def shown(text: String): String = {
    val line = text.map(c => if (c < ' ') '?' else c)
    if (line.length > 80) line.take(77) + "..." else line
  }

  private val U8  = 0xffL
  private val U16 = 0xffffL
  private val U32 = 0xffffffffL

  /** A value and where it stands. */
  private final class Node(val path: String, value: ujson.Value) {

    /** This value as an object with no keys but `allowed`. */
    def fields(allowed: String*): Fields = value match {
      case ujson.Obj(entries) =>
        entries.keys.find(!allowed.contains(_)).foreach { k =>
          refuse(s"$path has the key '${shown(k)}' but may only have ${allowed.mkString(", ")}.")
        }
        new Fields(path, entries.toMap)
      case _ => refuse(s"$path must be an object in braces.")
    }

    def list: Seq[Node] = value match {
      case ujson.Arr(items) => items.toSeq.zipWithIndex.map { case (v, i) => new Node(s"$path[$i]", v) }
      case _                => refuse(s"$path must be a list in brackets.")
    }

    def number(low: Long, high: Long): Long = {
      def wrong() = {
        val range = if (low >= 0 && high > 9999) f"0x$low%x to 0x$high%x" else s"$low to $high"
        refuse(s"$path is ${shown(value.render())} but must be a whole number, $range.")
      }
      val n = value match {
        case ujson.Num(d) if d.isWhole => d.toLong
        case ujson.Str(s @ Whole(_))   => java.lang.Long.decode(s).longValue
        case _                         => wrong()
      }
      if (n < low || n > high) wrong() else n
    }

    /** Printable ASCII: the SII knows nothing else, and masters refuse it. */
    def text(longest: Int): String = value match {
      case ujson.Str(s) if s.nonEmpty && s.length <= longest && s.forall(c => c >= ' ' && c <= '~') => s
      case other =>
        refuse(s"$path is ${shown(other.render())} but must be 1 to $longest printable ASCII characters.")
    }

    /** A text of any kind, if it is one. */
    def string: Option[String] = value.strOpt

    def flag: Boolean = value match {
      case ujson.Bool(b) => b
      case _             => refuse(s"$path must be true or false.")
    }

    def oneOf[A](choices: Seq[A])(name: A => String): A = {
      choices
        .find(c => value == ujson.Str(name(c)))
        .getOrElse(
          refuse(s"$path is ${shown(value.render())} but must be one of ${choices.map(name).mkString(", ")}.")
        )
    }
  }

  private final class Fields(path: String, entries: Map[String, ujson.Value]) {
    def get(key: String): Option[Node] =
      entries.get(key).map(new Node(if (path == "device") key else s"$path.$key", _))
    def apply(key: String): Node     = get(key).getOrElse(refuse(s"$path has no '$key'."))
    def list(key: String): Seq[Node] = get(key).map(_.list).getOrElse(Nil)
    def word(key: String): Int       = get(key).map(_.number(0, U16).toInt).getOrElse(0)
    def signed(key: String): Int     = get(key).map(_.number(Int.MinValue, Int.MaxValue).toInt).getOrElse(0)
    def factor(key: String): Int   = get(key).map(_.number(Short.MinValue, Short.MaxValue).toInt).getOrElse(0)
    def long(key: String): Long    = get(key).map(_.number(0, U32)).getOrElse(0L)
    def flag(key: String): Boolean = get(key).exists(_.flag)
    def text(key: String): String  = apply(key).text(255)
    def number(key: String, high: Long): Int = apply(key).number(0, high).toInt

    /** How many entries are meant, of which the first has subindex `first`. */
    def count(first: Int): Int = get("count").map(_.number(1, 256L - first).toInt).getOrElse(1)
    def numbered(name: String, i: Int): String = if (get("count").isEmpty) name else s"$name ${i + 1}"
  }

  /** The device in `json`, or one sentence that says what is wrong with the text. Whether a controller can be
    * this device is for [[DeviceCheck]] to say.
    */
  def parse(json: String): Either[String, Device] =
    try Right(device(new Node("device", ujson.read(json))))
    catch {
      case e: Refused                      => Left(e.getMessage)
      case e: ujson.ParsingFailedException => Left(s"The text is not JSON: ${e.getMessage}.")
    }

  private def device(node: Node): Device = {
    val f = node.fields(
      "vendor",
      "product",
      "group",
      "configuration",
      "eepromBytes",
      "syncManagers",
      "fmmus",
      "rxPdos",
      "txPdos",
      "mailbox",
      "dcModes",
      "objects",
      "minimumCycleNs"
    )
    val rx = f.list("rxPdos").map(pdo)
    val tx = f.list("txPdos").map(pdo)
    Device(
      vendor = vendor(f("vendor")),
      product = product(f("product")),
      group = group(f("group")),
      configuration = f.get("configuration").map(configuration).getOrElse(Configuration()),
      eepromBytes = f.get("eepromBytes").map(_.number(0, 1 << 19).toInt).getOrElse(2048),
      syncManagers = f.list("syncManagers").zipWithIndex.map { case (n, i) =>
        syncManager(n, (rx ++ tx).filter(_.syncManager == i))
      },
      fmmus = f.list("fmmus").map(_.oneOf(FmmuUse.all)(_.name)),
      rxPdos = rx,
      txPdos = tx,
      mailbox = f.get("mailbox").map(mailbox),
      dcModes = f.list("dcModes").map(dcMode),
      objects = f.list("objects").map(addedObject),
      minimumCycleNs = f.long("minimumCycleNs")
    )
  }

  private def vendor(node: Node): Vendor = {
    val f = node.fields("id", "name")
    Vendor(f("id").number(0, U32), f.text("name"))
  }

  private def product(node: Node): Product = {
    val f = node.fields("code", "revision", "serial", "order", "name")
    // SOEM cuts the name it shows after 40 characters.
    Product(
      f("code").number(0, U32),
      f("revision").number(0, U32),
      f.long("serial"),
      f("order").text(40),
      f.text("name")
    )
  }

  private def group(node: Node): Group = {
    val f = node.fields("type", "name")
    Group(f.text("type"), f.text("name"))
  }

  private def configuration(node: Node): Configuration = {
    val f = node.fields(
      "pdiControl",
      "pdiConfiguration",
      "syncPulse",
      "extendedPdiConfiguration",
      "stationAlias",
      "escA5",
      "escA6"
    )
    Configuration(
      f.word("pdiControl"),
      f.word("pdiConfiguration"),
      f.word("syncPulse"),
      f.word("extendedPdiConfiguration"),
      f.word("stationAlias"),
      f.word("escA5"),
      f.word("escA6")
    )
  }

  /** A size that is not given is what the PDOs need. */
  private def syncManager(node: Node, pdos: Seq[Pdo]): SyncManager = {
    val f      = node.fields("use", "start", "size", "control")
    val use    = f("use").oneOf(SmUse.all)(_.name)
    val needed = if (use.process) (pdos.map(_.bits).sum + 7) / 8 else 0
    SyncManager(
      use,
      if (use == SmUse.Unused) f.word("start") else f.number("start", U16),
      if (use.mailbox) f.number("size", U16) else f.get("size").map(_.number(0, U16).toInt).getOrElse(needed),
      f.get("control").map(_.number(0, U8).toInt).getOrElse(use.default)
    )
  }

  private def pdo(node: Node): Pdo = {
    val f = node.fields("index", "name", "syncManager", "entries")
    Pdo(
      f.number("index", U16),
      f.text("name"),
      f.number("syncManager", 15),
      f("entries").list.flatMap(entries)
    )
  }

  /** An entry, or `count` of them with the subindexes from its own on, whose names get numbers from 1 on. */
  private def entries(node: Node): Seq[PdoEntry] = {
    val f = node.fields("index", "subIndex", "name", "type", "bits", "count")
    f.get("type").map(_.oneOf(DataType.all)(_.name)) match {
      case None =>
        for (key <- Seq("index", "name", "count"); _ <- f.get(key)) refuse(s"${node.path} has no 'type'.")
        Seq(PdoEntry(0, 0, "", None, f("bits").number(1, U8).toInt))
      case Some(t) =>
        f.get("bits").foreach(_.number(t.bits, t.bits))
        val (index, first, name) = (f.number("index", U16), f.number("subIndex", U8), f.text("name"))
        for (i <- 0 until f.count(first))
          yield PdoEntry(index, first + i, f.numbered(name, i), Some(t), t.bits)
    }
  }

  private def area(node: Node): MailboxArea = {
    val f = node.fields("start", "size")
    MailboxArea(f.number("start", U16), f.number("size", U16))
  }

  private def mailbox(node: Node): Mailbox = {
    val f = node.fields("protocols", "coe", "repeat", "bootstrap")
    Mailbox(
      f.list("protocols").map(_.oneOf(MailboxProtocol.all)(_.name)).toSet,
      f.list("coe").map(_.oneOf(CoeFeature.all)(_.name)).toSet,
      f.flag("repeat"),
      f.get("bootstrap").map { b =>
        val g = b.fields("receive", "send")
        Bootstrap(area(g("receive")), area(g("send")))
      }
    )
  }

  private def dcMode(node: Node): DcMode = {
    val f = node.fields(
      "name",
      "description",
      "assignActivate",
      "cycleTime0",
      "cycleFactor0",
      "shiftTime0",
      "cycleFactor1",
      "shiftTime1"
    )
    DcMode(
      f.text("name"),
      f.text("description"),
      f.number("assignActivate", U16),
      f.long("cycleTime0"),
      f.factor("cycleFactor0"),
      f.signed("shiftTime0"),
      f.factor("cycleFactor1"),
      f.signed("shiftTime1")
    )
  }

  private val EntryKeys = Seq("type", "access", "value", "minimum", "maximum", "mappable")

  /** A variable has the keys of its entry itself. */
  private def addedObject(node: Node): AddedObject = {
    val f       = node.fields(Seq("index", "name", "entries") ++ EntryKeys: _*)
    val index   = f("index").number(Dictionary.Added.head, Dictionary.Added.last).toInt
    val name    = f.text("name")
    val entries = f.list("entries")
    if (entries.isEmpty) AddedObject(index, name, Seq(addedEntry(node.path, f, 0, name)))
    else {
      EntryKeys.find(f.get(_).nonEmpty).foreach(k => refuse(s"${node.path} has 'entries' and '$k'."))
      AddedObject(
        index,
        name,
        entries.flatMap { n =>
          val own   = n.fields(Seq("subIndex", "name", "count", "step") ++ EntryKeys: _*)
          val first = own("subIndex").number(1, U8).toInt
          val entry = addedEntry(n.path, own, first, own.text("name"))
          for (i <- 0 until own.count(first))
            yield entry.copy(
              subIndex = first + i,
              name = own.numbered(entry.name, i),
              value = stepped(n.path, entry, own.signed("step").toLong * i)
            )
        }
      )
    }
  }

  /** The initial value of a later one of several entries. */
  private def stepped(path: String, e: AddedEntry, by: Long): Option[InitialValue] =
    if (by == 0) e.value
    else
      e.value match {
        case Some(InitialValue.Number(n)) =>
          val (low, high) = e.range.getOrElse(rangeOf(e.dataType))
          if (n + by < low || n + by > high)
            refuse(s"$path.step leads to the value ${n + by}, which its type or range does not have.")
          Some(InitialValue.Number(n + by))
        case _ => refuse(s"$path has a 'step' but no number as 'value'.")
      }

  private val Text = "STRING\\(([1-9][0-9]{0,3})\\)".r

  /** What a number of a type can be, as far as a device file can say it. */
  private def rangeOf(dataType: DataType): (Long, Long) =
    dataType.range.map { case (a, b) => (a.toLong, b.min(Long.MaxValue).toLong) }.getOrElse((-U32, U32))

  private def addedEntry(path: String, f: Fields, subIndex: Int, name: String): AddedEntry = {
    val dataType = f("type").string match {
      case Some(Text(n)) if n.toInt <= 1024 => DataType.string(n.toInt)
      case _                                => f("type").oneOf(DataType.all)(_.name)
    }
    val (low, high) = rangeOf(dataType)
    val minimum     = f.get("minimum").map(_.number(low, high))
    val maximum     = f.get("maximum").map(_.number(minimum.getOrElse(low), high))
    val range = Option.when(minimum.nonEmpty || maximum.nonEmpty)(
      (minimum.getOrElse(low), maximum.getOrElse(high))
    )
    if (range.nonEmpty && dataType.range.isEmpty)
      refuse(s"$path has a range but ${dataType.name} has none.")
    val value = f.get("value").map { n =>
      if (dataType.isText) InitialValue.Text(n.text(dataType.bits / 8))
      else {
        val (least, most) = range.getOrElse((low, high))
        InitialValue.Number(n.number(least, most))
      }
    }
    val mappable = f.flag("mappable")
    if (mappable && dataType.isText) refuse(s"$path is mappable but a text cannot be process data.")
    if (value.isEmpty && range.exists { case (a, b) => a > 0 || b < 0 })
      refuse(s"$path has no 'value' but 0 is outside its range.")
    AddedEntry(
      subIndex,
      name,
      dataType,
      f("access").oneOf(ObjectAccess.all)(_.name),
      value,
      range,
      mappable
    )
  }
}
