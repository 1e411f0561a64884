package flyframe.device

import org.scalatest.flatspec.AnyFlatSpec
import scala.xml.{Elem, Node, XML}
import flyframe.params.EscParams

/** The ESI file: its structure against the published schema (EtherCATInfo.xsd 1.9), its values against the
  * device and the SII image.
  */
class EsiSpec extends AnyFlatSpec {
  private def esi(d: Device, p: EscParams = Devices.params): Elem =
    XML.loadString(Esi.xml(d, p, 8, 8))
  private val random = {
    val r = new scala.util.Random(4)
    Seq.fill(300)(Devices.random(r))
  }

  /** Devices with their ESI. */
  private lazy val all =
    Seq(Devices.io, Devices.mailbox).map(d => d -> esi(d)) ++ (Devices.full +: random).map(d =>
      d -> esi(d, Devices.fullParams)
    ) :+ (Devices.digital -> esi(Devices.digital, Devices.digitalParams))
  private val io   = esi(Devices.io)
  private val full = esi(Devices.full, Devices.fullParams)

  private def device(e: Elem): Node         = (e \ "Descriptions" \ "Devices" \ "Device").head
  private def texts(n: Node, path: String*) = path.foldLeft(n: scala.xml.NodeSeq)(_ \ _).map(_.text)
  private def number(text: String): Long =
    if (text.startsWith("#x")) java.lang.Long.parseLong(text.drop(2), 16) else text.toLong

  /** Children of each element in the schema's order; ? none or one, * any number, + at least one, else one.
    */
  private val schema: Map[String, Seq[String]] = Map(
    "EtherCATInfo" -> Seq("Vendor", "Descriptions"),
    "Vendor"       -> Seq("Id", "Name+"),
    "Descriptions" -> Seq("Groups", "Devices"),
    "Groups"       -> Seq("Group*"),
    "Group"        -> Seq("Type", "Name+"),
    "Devices"      -> Seq("Device*"),
    "Device" -> Seq(
      "Type",
      "Name+",
      "Info?",
      "GroupType",
      "Fmmu*",
      "Sm*",
      "RxPdo*",
      "TxPdo*",
      "Mailbox?",
      "Dc?",
      "Eeprom?"
    ),
    "Info"               -> Seq("EtherCATController?", "Port*"),
    "EtherCATController" -> Seq("DpramSize?", "SmCount?", "FmmuCount?"),
    "Port"               -> Seq("Type"),
    "RxPdo"              -> Seq("Index", "Name+", "Entry*"),
    "TxPdo"              -> Seq("Index", "Name+", "Entry*"),
    "Entry"              -> Seq("Index", "SubIndex?", "BitLen", "Name*", "DataType?"),
    "Mailbox"            -> Seq("AoE?", "EoE?", "CoE?", "FoE?", "SoE?", "VoE?"),
    "Dc"                 -> Seq("OpMode*"),
    "OpMode" -> Seq(
      "Name",
      "Desc?",
      "AssignActivate",
      "CycleTimeSync0?",
      "ShiftTimeSync0?",
      "CycleTimeSync1?",
      "ShiftTimeSync1?"
    ),
    "Eeprom" -> Seq("ByteSize", "ConfigData", "BootStrap?")
  )

  /** Attributes of each element; those with ! are required. */
  private val attributes: Map[String, Set[String]] = Map(
    "EtherCATInfo"   -> Set("Version", "xsi:noNamespaceSchemaLocation"),
    "Name"           -> Set("LcId"),
    "Device"         -> Set("Physics"),
    "Type"           -> Set("ProductCode", "RevisionNo"),
    "Sm"             -> Set("MinSize", "MaxSize", "DefaultSize", "StartAddress", "ControlByte", "Enable"),
    "RxPdo"          -> Set("Fixed", "Mandatory", "Sm"),
    "TxPdo"          -> Set("Fixed", "Mandatory", "Sm"),
    "Mailbox"        -> Set("DataLinkLayer"),
    "CoE"            -> Set("SdoInfo", "PdoAssign", "PdoConfig", "PdoUpload", "CompleteAccess"),
    "CycleTimeSync0" -> Set("Factor"),
    "CycleTimeSync1" -> Set("Factor")
  )

  private def conforms(n: Node): Unit = {
    val found    = n.child.collect { case e: Elem => e.label }
    val expected = schema.getOrElse(n.label, Nil)
    val shape = expected.map { e =>
      val quantity = e.last.toString
      if ("?*+".contains(quantity)) s"(${e.init};)$quantity" else s"($e;)"
    }.mkString
    assert(found.map(_ + ";").mkString.matches(shape), s"${n.label} has ${found.mkString(" ")}, not $shape")
    val extra = n.attributes.map(_.prefixedKey).toSet -- attributes.getOrElse(n.label, Set.empty)
    assert(extra.isEmpty, s"${n.label} has ${extra.mkString(" ")}")
    n.child.collect { case e: Elem => e }.foreach(conforms)
  }

  "Elements and attributes" should "be those of the schema, in its order" in {
    for ((_, e) <- all) conforms(e)
  }

  "Numbers" should "be written as the schema has them" in {
    val forms = Seq("Id", "Index", "SubIndex", "AssignActivate").map(_ -> "[+-]?[0-9]+|#x[0-9a-fA-F]+") ++
      Seq("BitLen", "ByteSize", "DpramSize", "SmCount", "FmmuCount", "ShiftTimeSync0").map(_ -> "-?[0-9]+") ++
      Seq("ConfigData", "BootStrap").map(_ -> "([0-9A-F]{2})+")
    for ((_, e) <- all; (label, form) <- forms; n <- e \\ label)
      assert(n.text.matches(form), s"$label ${n.text}")
    for (
      e <- Seq(io, full); a <- Seq("ProductCode", "RevisionNo", "StartAddress", "ControlByte", "DefaultSize");
      n <- e \\ s"@$a"
    )
      assert(n.text.matches("[0-9]+|#x[0-9a-f]+"), s"$a ${n.text}")
  }

  "The identity" should "be the device file's" in {
    assert(number((full \ "Vendor" \ "Id").text) == Devices.full.vendor.id)
    val kind = (device(full) \ "Type").head
    assert(
      kind.text == "flyframe-mailbox" && kind \@ "ProductCode" == "#x00000002" &&
        kind \@ "RevisionNo" == "#x00000001"
    )
    assert(texts(device(full), "Name") == Seq("flyframe, mailbox, 4 bytes out, 4 bytes in"))
    assert(texts(device(full), "GroupType") == texts(full, "Descriptions", "Groups", "Group", "Type"))
  }

  "The controller" should "be described by its parameters" in {
    assert(device(io) \@ "Physics" == "YY" && device(full) \@ "Physics" == "YYYY")
    assert(texts(device(io), "Info", "Port", "Type") == Seq("MII", "MII"))
    val c = (device(io) \ "Info" \ "EtherCATController").head
    assert(c.child.collect { case e: Elem => e.text } == Seq("1024", "8", "8"))
  }

  "FMMUs and SyncManagers" should "be those of the SII image" in {
    for ((d, e) <- all) {
      val image = DeviceSii.image(d, 2)
      val uses  = image.categories.collectFirst { case SiiFmmus(u) => u }.getOrElse(Nil)
      assert(
        texts(device(e), "Fmmu").map(t => FmmuUse.all.find(_.esi == t).get.code) == uses.filter(_ != 0xff)
      )
      val managers = image.categories.collectFirst { case SiiSyncManagers(m) => m }.getOrElse(Nil)
      val shown    = device(e) \ "Sm"
      assert(shown.size == managers.size)
      for ((s, m) <- shown.zip(managers)) {
        assert(number(s \@ "Enable") == m.enable && SmUse.all.find(_.esi == s.text).get.code == m.kind)
        if (m.enable == 1) {
          assert(number(s \@ "StartAddress") == m.start && number(s \@ "ControlByte") == m.control)
          for (a <- Seq("DefaultSize", "MinSize", "MaxSize")) assert(number(s \@ a) == m.size)
        }
      }
    }
  }

  "PDOs" should "be those of the SII image" in {
    for ((d, e) <- all) {
      val image = DeviceSii.image(d, 2)
      for (SiiPdos(tx, pdos) <- image.categories) {
        val shown = device(e) \ (if (tx) "TxPdo" else "RxPdo")
        assert(shown.map(p => number((p \ "Index").text)) == pdos.map(_.index.toLong))
        for ((s, p) <- shown.zip(pdos)) {
          assert(s \@ "Sm" == p.syncManager.toString && s \@ "Fixed" == "1" && s \@ "Mandatory" == "1")
          assert((s \ "Name").text == image.text(p.name))
          val entries = (s \ "Entry").map { n =>
            SiiPdoEntry(
              number((n \ "Index").text).toInt,
              (n \ "SubIndex").headOption.map(x => number(x.text).toInt).getOrElse(0),
              image.categories.collectFirst { case SiiStrings(t, _) => t.indexOf((n \ "Name").text) + 1 }.get,
              DataType.all.find(_.name == (n \ "DataType").text).map(_.code).getOrElse(0),
              (n \ "BitLen").text.toInt,
              0
            )
          }
          assert(entries == p.entries)
        }
      }
    }
  }

  "The mailbox" should "list the protocols, or none" in {
    val m = (device(full) \ "Mailbox").head
    assert(m.child.collect { case e: Elem => e.label } == Seq("AoE", "EoE", "CoE", "FoE", "SoE", "VoE"))
    val coe = (m \ "CoE").head
    assert(coe \@ "SdoInfo" == "1" && coe \@ "PdoAssign" == "0" && coe \@ "CompleteAccess" == "1")
    assert((device(io) \ "Mailbox").isEmpty)
    assert((device(esi(Devices.mailbox)) \ "Mailbox").head.child.collect { case e: Elem => e }.isEmpty)
  }

  "DC modes" should "have their times and factors" in {
    val mode = (device(full) \ "Dc" \ "OpMode")(1)
    assert((mode \ "AssignActivate").text == "#x0700" && (mode \ "CycleTimeSync0").text == "500000")
    assert((mode \ "CycleTimeSync0").head \@ "Factor" == "-2" && (mode \ "ShiftTimeSync0").text == "-1000")
    assert((device(io) \ "Dc").isEmpty)
  }

  "The EEPROM data" should "be words 0 to 6 and the bootstrap words of the SII image" in {
    val image                              = SiiCodec.encode(DeviceSii.image(Devices.full, 4))
    def hexadecimal(from: Int, until: Int) = image.slice(from, until).map(b => f"$b%02X").mkString
    val e                                  = (device(full) \ "Eeprom").head
    assert((e \ "ByteSize").text == "2048" && (e \ "ConfigData").text == hexadecimal(0, 14))
    assert((e \ "BootStrap").text == hexadecimal(0x28, 0x30))
  }

  "Characters with a meaning in XML" should "come through" in {
    val name = "A & B < C > \"D\" 'E'"
    assert(texts(device(esi(Devices.device("io")(_("product")("name") = name))), "Name") == Seq(name))
  }
}
