package flyframe.device

import org.scalatest.flatspec.AnyFlatSpec
import flyframe.params.{EscParams, Presets}

/** The object dictionary and its C table, against the device file, ESI and SII image they come with. */
class DictionarySpec extends AnyFlatSpec {
  private val params: EscParams = Presets.named("slave").get.params.copy(preset = "slave-demo")
  private val demo: Device      = Devices.device("slave-demo")(_ => ())

  private def objects(d: Device) = Dictionary.of(d).map(o => o.index -> o).toMap
  private def numbers(d: Device, index: Int): Seq[BigInt] =
    objects(d)(index).entries.flatten.map(_.value).collect { case InitialValue.Number(n) => n }

  private def changed(edit: ujson.Value => Unit): Device = Devices.device("slave-demo")(edit)
  private def refused(edit: ujson.Value => Unit): Seq[String] =
    DeviceFile.parse(Devices.json("slave-demo")(edit)) match {
      case Left(sentence) => Seq(sentence)
      case Right(d)       => DeviceCheck.problems(d, params, 8, 8)
    }

  "The device of the demonstration" should "fit its preset" in
    assert(DeviceCheck.problems(demo, params, params.fmmus, params.syncManagers) == Nil)

  "ST-46: identity" should "be that of the SII" in {
    val sii = DeviceSii.image(demo, 2).header
    assert(numbers(demo, 0x1018) == Seq[BigInt](4, sii.vendor, sii.product, sii.revision, sii.serial))
  }

  "ST-46: mapping and assignment" should "be that of ESI and SII" in {
    for (d <- Seq(demo, changed(_("rxPdos")(0)("entries")(1)("type") = "USINT")); pdo <- d.pdos) {
      val mapped = pdo.entries.map(e => BigInt(e.index) << 16 | e.subIndex << 8 | e.bits)
      assert(numbers(d, pdo.index).slice(1, 1 + mapped.size) == mapped)
      assert(numbers(d, pdo.index).head == mapped.size)
      assert(numbers(d, 0x1c10 + pdo.syncManager).tail.contains(BigInt(pdo.index)))
    }
    assert(numbers(demo, 0x1c00) == Seq[BigInt](4, 1, 2, 3, 4))
  }

  "ST-46: what masters may change" should "be what ESI and SII say" in {
    def access(d: Device, index: Int) = objects(d)(index).entries.head.get.access & 0x38
    assert(access(demo, 0x1600) == 0x08 && access(demo, 0x1c12) == 0x08)
    val fixed = changed(_("mailbox")("coe") = Seq("sdoInfo"))
    assert(access(fixed, 0x1600) == 0 && access(fixed, 0x1c12) == 0)
    assert(objects(fixed)(0x1600).entries.size == 4 && objects(demo)(0x1600).entries.size == 9)
    def pdo(d: Device) = (scala.xml.XML.loadString(Esi.xml(d, params, 8, 8)) \\ "RxPdo").head
    assert(pdo(demo) \@ "Fixed" == "0" && pdo(demo) \@ "Mandatory" == "0")
    assert(pdo(fixed) \@ "Fixed" == "1" && pdo(fixed) \@ "Mandatory" == "1")
  }

  "ST-46: the C table" should "have every object and every value" in {
    val c = DictionaryC.source(demo, "slave-demo", "slave_demo", params.ramBytes)
    val h = DictionaryC.header(demo, "slave-demo", "slave_demo", params.ramBytes)
    for (o <- Dictionary.of(demo)) {
      val row = f"    {0x${o.index}%04x, 0x${o.dataType}%04x, ${o.code}, ${o.entries.size - 1}, "
      assert(c.linesIterator.count(_.startsWith(row)) == 1, row)
      for ((Some(e), sub) <- o.entries.zipWithIndex) {
        val name  = if (o.code == 7) f"object_${o.index}%04x" else f"object_${o.index}%04x_$sub%02x"
        val entry = f"    {0x${e.dataType.code}%04x, ${e.dataType.bits}, 0x${e.access}%04x, AT($name)"
        assert(c.contains(entry) && c.contains(s"    .$name = ") && h.contains(s" $name"), entry)
      }
    }
    assert(c.contains("range_object_8000_03 = {INT64_C(1), INT64_C(100)}"))
    val gap = changed(_("objects")(4)("entries")(7)("subIndex") = 9)
    assert(DictionaryC.source(gap, "x", "x", params.ramBytes).contains("{0, 0, 0, 0, \"\", 0}"))
  }

  it should "have mailboxes and SyncManagers of the SII" in {
    val c          = DictionaryC.source(demo, "slave-demo", "slave_demo", params.ramBytes)
    val sii        = DeviceSii.image(demo, 2).categories.collectFirst { case SiiSyncManagers(all) => all }.get
    def at(i: Int) = f"0x${sii(i).start}%04x"
    assert(c.contains(s".receive = {${at(0)}, ${sii(0).size}, 0x${sii(0).control.toHexString}}"))
    assert(c.contains(s".send = {${at(1)}, ${sii(1).size}, 0x${sii(1).control.toHexString}}"))
    assert(c.contains(s".outputs = {2, 0x${sii(2).control.toHexString}, ${at(2)}, "))
    assert(c.contains(s".inputs = {3, 0x${sii(3).control.toHexString}, ${at(3)}, "))
  }

  "The C sources" should "be there for what the stack can be" in {
    def names(d: Device) = DeviceFiles.make(d, params, 8, 8).fold(s => fail(s), _.map(_._1)).toSet
    val sources          = Set("slave-demo.objects.c", "slave-demo.objects.h")
    assert(sources.subsetOf(names(demo)))
    val two = changed { d =>
      d("syncManagers").arr += ujson.Obj("use" -> "inputs", "start" -> "0x1800")
      d("txPdos")(1)("syncManager") = 4
    }
    assert(names(two).intersect(sources).isEmpty && names(Devices.io).intersect(sources).isEmpty)
  }

  "Texts" should "be safe in C" in {
    val d = changed { j =>
      j("product")("name") = "a\"b\\c'd??/ */"
      j("objects")(0)("name") = "a\"b\\c'd??/ */"
    }
    val c = DictionaryC.source(d, "x", "x", params.ramBytes)
    assert(c.contains("\"a\\\"b\\\\c'd\\?\\?/ */\"") && c.contains("'\\\\', 'c', '\\'', 'd'"))
    assert(DictionaryC.header(d, "x", "x", params.ramBytes).contains("/* a\"b\\c'd??/ * / */"))
  }

  for (
    (what, sentence, edit) <- Seq[(String, String, ujson.Value => Unit)](
      (
        "an index of the protocol",
        "objects[0].index is \"0x1fff\" but must be a whole number, 0x2000 to 0xffff.",
        _("objects")(0)("index") = "0x1fff"
      ),
      ("an index twice", "The object 0x2000 exists twice.", _("objects")(1)("index") = "0x2000"),
      ("an index of a PDO's entry", "The object 0x7000 exists twice.", _("objects")(1)("index") = "0x7000"),
      (
        "an unknown access",
        "objects[0].access is \"wo\" but must be one of ro, rw, rwPreop.",
        _("objects")(0)("access") = "wo"
      ),
      (
        "a value beyond the range",
        "objects[4].entries[2].value is 101 but must be a whole number, 1 to 100.",
        _("objects")(4)("entries")(2)("value") = 101
      ),
      (
        "a range without 0 and no value",
        "objects[4].entries[3] has no 'value' but 0 is outside its range.",
        _("objects")(4)("entries")(3)("minimum") = 1
      ),
      (
        "a text that is mappable",
        "objects[0] is mappable but a text cannot be process data.",
        _("objects")(0)("mappable") = true
      ),
      (
        "a range of a text",
        "objects[0] has a range but STRING(300) has none.",
        _("objects")(0)("minimum") = 1
      ),
      ("entries and a type", "objects[4] has 'entries' and 'type'.", _("objects")(4)("type") = "UINT"),
      (
        "entries out of order",
        "The object 0x8000 has its entries out of order.",
        _("objects")(4)("entries")(0)("subIndex") = 9
      ),
      (
        "a text behind bits",
        "The object 0x8000 has a text behind bits that are no whole byte.",
        _("objects")(4)("entries")(6)("type") = "STRING(3)"
      ),
      (
        "no CoE",
        "The device has objects but mailbox.protocols lacks CoE.",
        { d =>
          d("mailbox")("protocols") = Seq("FoE"); d("mailbox")("coe") = ujson.Arr()
        }
      ),
      (
        "a mailbox too short for CoE",
        "SyncManager 1 has 31 bytes but a mailbox with CoE has at least 32.",
        _("syncManagers")(1)("size") = 31
      )
    )
  )
    s"A device file with $what" should "be refused" in assert(refused(edit).headOption.contains(sentence))

  "GW-02: the device of a gateway" should "have the bytes of the rule, and slots that are counted" in {
    val d = Devices.device("ring-gateway")(_ => ())
    val p = Presets.gateway
    assert(DeviceCheck.problems(d, p, p.fmmus, p.syncManagers) == Nil)
    assert(d.rxPdos.map(_.bits).sum == 8 * (4 + 64 * 8) && d.txPdos.map(_.bits).sum == 8 * (28 + 64 * 8))
    val slots = d.txPdos(1).entries
    assert(
      slots.map(_.subIndex) == (1 to 64) && slots(63).name == "Slot 64" && slots.forall(_.index == 0x6010)
    )
    for (table <- Seq(0x8010, 0x8020))
      assert(numbers(d, table) == BigInt(64) +: (2 to 65).map(node => BigInt(node << 8)))
  }

  it should "be refused if its slots are none" in {
    def sentence(edit: ujson.Value => Unit) =
      DeviceFile.parse(Devices.json("ring-gateway")(edit)).swap.toOption
    def first(d: ujson.Value) = d("objects")(0)("entries")(0)
    val of                    = "objects[0].entries[0]"
    assert(
      sentence(first(_)("count") = 256).contains(s"$of.count is 256 but must be a whole number, 1 to 255.")
    )
    assert(
      sentence(first(_)("step") = 2048)
        .contains(s"$of.step leads to the value 66048, which its type or range does not have.")
    )
    assert(sentence { d => first(d).obj.remove("value"); () }
      .contains(s"$of has a 'step' but no number as 'value'."))
    assert(
      sentence(_("rxPdos")(0)("entries")(1)("count") = 2).contains("rxPdos[0].entries[1] has no 'type'.")
    )
    assert(
      Devices
        .device("ring-gateway")(first(_).obj.remove("step"): Unit)
        .objects(0)
        .entries
        .map(_.value)
        .distinct
        .size == 1
    )
  }
}
