package flyframe.device

import org.scalatest.flatspec.AnyFlatSpec
import flyframe.params.EscParams

/** Every mistake in a device file gives one clear sentence. */
class DeviceCheckSpec extends AnyFlatSpec {
  import Devices.{device, json, params}

  private def sentences(d: Device, p: EscParams = params, fmmus: Int = 8, sms: Int = 8) =
    DeviceCheck.problems(d, p, fmmus, sms)
  private def entry(pdo: ujson.Value)    = pdo("entries")(0)
  private def copied(value: ujson.Value) = ujson.read(value.render())
  private def ignore(value: Any): Unit   = { val _ = value }

  "The bundled devices" should "fit the smallest preset with process data" in {
    assert(sentences(Devices.io, fmmus = 2, sms = 2) == Nil)
    assert(sentences(Devices.mailbox, fmmus = 2, sms = 4) == Nil)
    assert(sentences(Devices.full, Devices.fullParams) == Nil)
  }

  they should "fit every data bus width" in {
    for (width <- Seq(8, 16, 32); d <- Seq(Devices.io, Devices.mailbox))
      assert(sentences(d, params.copy(dataBusWidth = width)) == Nil)
    for (width <- Seq(8, 16, 32))
      assert(sentences(Devices.digital, Devices.digitalParams.copy(dataBusWidth = width), 2, 5) == Nil)
  }

  "SM-26: a SyncManager for process data" should "be at digital outputs that there are, each of one byte" in {
    def outside(n: Int, last: String) =
      f"SyncManager $n occupies 0x0f0$n%x to $last, three buffers, but the process data RAM is " +
        "0x1000 to 0x13ff."
    def of(outputs: Int)(edit: ujson.Value => Unit) =
      sentences(device("digital-io")(edit), Devices.digitalParams.copy(digitalOutputs = outputs), 2, 5)
    assert(of(4)(_ => ()) == Nil)
    assert(of(3)(_ => ()) == Seq(outside(3, "0x0f05")))
    val wide = of(4) { d => d("rxPdos")(3)("entries")(0)("type") = "UINT" }
    assert(wide == Seq(outside(3, "0x0f08")))
    val twice = of(4) { d => d("syncManagers")(1)("start") = "0x0f00" }
    assert(twice == Seq("SyncManagers 0 (0x0f00 to 0x0f00) and 1 (0x0f00 to 0x0f00) overlap."))
  }

  private val unreadable: Seq[(String, String, ujson.Value => Unit)] = Seq(
    ("no vendor", "device has no 'vendor'.", d => ignore(d.obj.remove("vendor"))),
    ("no index", "rxPdos[0] has no 'index'.", d => ignore(d("rxPdos")(0).obj.remove("index"))),
    (
      "an unknown key",
      "group has the key 'nmae' but may only have type, name.",
      d => d("group")("nmae") = "x"
    ),
    ("a list for an object", "vendor must be an object in braces.", d => d("vendor") = ujson.Arr()),
    ("an object for a list", "fmmus must be a list in brackets.", d => d("fmmus") = ujson.Obj()),
    (
      "a number that is none",
      "rxPdos[0].index is \"0x16g0\" but must be a whole number, 0x0 to 0xffff.",
      d => d("rxPdos")(0)("index") = "0x16g0"
    ),
    (
      "a fraction",
      "rxPdos[0].syncManager is 0.5 but must be a whole number, 0 to 15.",
      d => d("rxPdos")(0)("syncManager") = 0.5
    ),
    (
      "a number too large",
      "vendor.id is 4294967296 but must be a whole number, 0x0 to 0xffffffff.",
      d => d("vendor")("id") = 4294967296.0
    ),
    (
      "a negative number",
      "product.code is -1 but must be a whole number, 0x0 to 0xffffffff.",
      d => d("product")("code") = -1
    ),
    (
      "an empty text",
      "group.type is \"\" but must be 1 to 255 printable ASCII characters.",
      d => d("group")("type") = ""
    ),
    (
      "a text the SII cannot hold",
      "product.name is \"Gerät\" but must be 1 to 255 printable ASCII characters.",
      d => d("product")("name") = "Gerät"
    ),
    (
      "an order number too long",
      s"product.order is \"${"o" * 41}\" but must be 1 to 40 printable ASCII characters.",
      d => d("product")("order") = "o" * 41
    ),
    (
      "an unknown use",
      "syncManagers[1].use is \"input\" but must be one of unused, mailboxOut, mailboxIn, outputs, inputs.",
      d => d("syncManagers")(1)("use") = "input"
    ),
    (
      "an unknown FMMU use",
      "fmmus[0] is 1 but must be one of unused, outputs, inputs, mailboxState.",
      d => d("fmmus")(0) = 1
    ),
    (
      "a length unlike the type's",
      "rxPdos[0].entries[0].bits is 16 but must be a whole number, 32 to 32.",
      d => entry(d("rxPdos")(0))("bits") = 16
    ),
    (
      "an entry without a type",
      "rxPdos[0].entries[0] has no 'type'.",
      d => ignore(entry(d("rxPdos")(0)).obj.remove("type"))
    ),
    (
      "padding of no bits",
      "rxPdos[0].entries[0].bits is 0 but must be a whole number, 1 to 255.",
      d => d("rxPdos")(0)("entries")(0) = ujson.Obj("bits" -> 0)
    ),
    (
      "a flag that is none",
      "mailbox.repeat must be true or false.",
      d => d("mailbox") = ujson.Obj("repeat" -> 1)
    )
  )

  for ((what, sentence, edit) <- unreadable)
    s"A device file with $what" should "be refused" in
      assert(DeviceFile.parse(json("io")(edit)) == Left(sentence))

  "A number that C would take for octal" should "be refused" in
    assert(
      DeviceFile.parse(json("io")(_("product")("code") = "010")) ==
        Left("product.code is \"010\" but must be a whole number, 0x0 to 0xffffffff.")
    )

  "10000 damaged device files" should "give a device or one sentence" in {
    val r     = new scala.util.Random(3)
    val texts = Seq("io", "mailbox", "digital-io").map(DeviceFiles.bundled)
    val bits  = "{}[]\",:0123456789xae-.\\ \n\u00e4"
    var read  = 0
    for (i <- 1 to 10000) {
      val text = new StringBuilder(texts(i % texts.size))
      for (_ <- 0 to r.nextInt(3)) r.nextInt(3) match {
        case 0 => text.setCharAt(r.nextInt(text.length), bits(r.nextInt(bits.length)))
        case 1 => text.deleteCharAt(r.nextInt(text.length))
        case _ => text.insert(r.nextInt(text.length), bits(r.nextInt(bits.length)))
      }
      DeviceFile.parse(text.toString) match {
        case Left(sentence) => assert(sentence.endsWith(".") && !sentence.contains("\n"), text)
        case Right(d) =>
          read += 1
          sentences(d).foreach(s => assert(s.endsWith(".") && !s.contains("\n"), text))
      }
    }
    assert(read > 500 && read < 9500)
  }

  "Text that is not JSON" should "be refused with the place" in {
    for (text <- Seq("", "{", "{\"vendor\": }", "vendor: 1")) {
      val sentence = DeviceFile.parse(text).swap.getOrElse(fail(text))
      assert(sentence.startsWith("The text is not JSON: ") && !sentence.contains("\n"), sentence)
    }
  }

  /** Mistakes in the bundled device `base`, on the controller `p`. */
  private case class Mistake(
      what: String,
      sentence: String,
      base: String = "io",
      p: EscParams = params,
      fmmus: Int = 8,
      sms: Int = 8
  )(val edit: ujson.Value => Unit)

  private val mistakes = Seq(
    Mistake(
      "more SyncManagers than there are",
      "The device has 2 SyncManagers but the controller has 1.",
      sms = 1
    )(_ => ()),
    Mistake("more FMMUs than there are", "The device uses 2 FMMUs but the controller has 1.", fmmus = 1)(_ =>
      ()
    ),
    Mistake("reserved bits in A5", "configuration.escA5 is 0x0001 but the reserved bits 0xf0b1 must be 0.")(
      _("configuration")("escA5") = 1
    ),
    Mistake("area B, which is not written", "configuration.escA6 is 0x0001 but may only have bit 1 set.")(
      _("configuration")("escA6") = 1
    ),
    Mistake(
      "an alias too wide",
      "configuration.stationAlias is 0x0100 but the controller has an alias of 8 bits.",
      p = params.copy(nodeIdWidth = 8)
    )(_("configuration")("stationAlias") = 256),
    Mistake(
      "a SyncManager in the registers",
      "SyncManager 0 occupies 0x0f00 to 0x0f0b, three buffers, but the process data RAM is 0x1000 to 0x13ff."
    )(_("syncManagers")(0)("start") = 0x0f00),
    Mistake(
      "a third buffer beyond the RAM",
      "SyncManager 1 occupies 0x13f5 to 0x1400, three buffers, but the process data RAM is 0x1000 to 0x13ff."
    )(_("syncManagers")(1)("start") = 0x13f5),
    Mistake(
      "word rounding beyond the RAM",
      "SyncManager 1 occupies 0x13f0 to 0x1407, three buffers, but the process data RAM is 0x1000 to 0x13ff.",
      p = params.copy(dataBusWidth = 16)
    )(_("syncManagers")(1)("start") = 0x13f1),
    Mistake(
      "overlapping buffers",
      "SyncManagers 0 (0x1000 to 0x100b) and 1 (0x100b to 0x1016) overlap."
    )(_("syncManagers")(1)("start") = 0x100b),
    Mistake(
      "two SyncManagers in one 32-bit word",
      "SyncManagers 0 (0x1000 to 0x1017) and 1 (0x1014 to 0x102b) overlap.",
      p = params.copy(dataBusWidth = 32)
    ) { d =>
      d("syncManagers")(0)("start") = 0x1002
      d("syncManagers")(1)("start") = 0x1016
    },
    Mistake(
      "control against its use",
      "SyncManager 1 has control 0x24 but its use, inputs, needs the low digit 0x0."
    )(_("syncManagers")(1)("control") = 0x24),
    Mistake(
      "a size unlike the PDOs'",
      "SyncManager 0 has 3 bytes but its PDOs have 32 bits and need 4 bytes."
    )(_("syncManagers")(0)("size") = 3),
    Mistake("an index out of range", "RxPDO 0x1a00 must have an index of 0x1600 to 0x17ff.")(
      _("rxPdos")(0)("index") = "0x1a00"
    ),
    Mistake("no entries", "TxPDO 0x1a00 has no entries.") { d =>
      d("txPdos")(0)("entries") = ujson.Arr()
    },
    Mistake("a PDO twice", "RxPDO 0x1600 exists twice.") { d =>
      val second = copied(d("rxPdos")(0))
      entry(second)("subIndex") = 2
      ignore(d("rxPdos").arr += second)
    },
    Mistake("an entry twice", "The entry 0x7000:01 is mapped twice.") { d =>
      ignore(d("rxPdos")(0)("entries").arr += copied(entry(d("rxPdos")(0))))
    },
    Mistake("an entry in both directions", "The entry 0x7000:01 is mapped twice.") { d =>
      entry(d("txPdos")(0))("index") = "0x7000"
    },
    Mistake(
      "no FMMU for a direction",
      "The device has TxPDOs but no FMMU used for inputs."
    )(d => d("fmmus") = ujson.Arr("outputs")),
    Mistake(
      "DC on a controller without",
      "The device has dcModes but the controller has no distributed clocks.",
      p = params.copy(reportedFeatures = 0x0080)
    ) { d =>
      d("dcModes") =
        ujson.Arr(ujson.Obj("name" -> "DC", "description" -> "SYNC0", "assignActivate" -> "0x300"))
    },
    Mistake(
      "DC on a controller whose host has the time",
      "The device has dcModes but timeByPdi is 1: no master can bring its time to that of others.",
      p = params.copy(clocks = 2, latchSignals = 1, timeByPdi = 1)
    ) { d =>
      d("dcModes") =
        ujson.Arr(ujson.Obj("name" -> "DC", "description" -> "SYNC0", "assignActivate" -> "0x300"))
    },
    Mistake("an odd EEPROM", "eepromBytes is 2000 but must be a multiple of 128 from 256 to 524288.")(
      _("eepromBytes") = 2000
    ),
    Mistake("an EEPROM too small", "The SII needs 356 bytes but the EEPROM has 256 (eepromBytes).")(
      _("eepromBytes") = 256
    ),
    Mistake(
      "mailbox SyncManagers without a mailbox",
      "SyncManager 0 is used for mailboxOut but the device has no mailbox.",
      base = "mailbox"
    )(d => ignore(d.obj.remove("mailbox"))),
    Mistake(
      "a mailbox not at SyncManager 1",
      "A mailbox needs SyncManager 1, and no other, used for mailboxIn: masters expect it there.",
      base = "mailbox"
    ) { d =>
      val in = copied(d("syncManagers")(1))
      d("syncManagers")(1) = ujson.Obj("use" -> "unused")
      ignore(d("syncManagers").arr += in)
    },
    Mistake(
      "a mailbox too short",
      "SyncManager 0 has 15 bytes but a mailbox has 16 to 1486.",
      base = "mailbox"
    )(_("syncManagers")(0)("size") = 15),
    Mistake(
      "CoE features without CoE",
      "mailbox.coe is given but mailbox.protocols lacks CoE.",
      base = "mailbox"
    )(_("mailbox")("coe") = ujson.Arr("sdoInfo")),
    Mistake(
      "a bootstrap mailbox beyond the RAM",
      "mailbox.bootstrap.send occupies 0x13f0 to 0x140f, beyond the process data RAM.",
      base = "mailbox"
    )(
      _("mailbox")("bootstrap") = ujson.Obj(
        "receive" -> ujson.Obj("start" -> 0x1000, "size" -> 32),
        "send"    -> ujson.Obj("start" -> 0x13f0, "size" -> 32)
      )
    ),
    Mistake(
      "overlapping bootstrap mailboxes",
      "mailbox.bootstrap.receive and mailbox.bootstrap.send overlap.",
      base = "mailbox"
    )(
      _("mailbox")("bootstrap") = ujson.Obj(
        "receive" -> ujson.Obj("start" -> 0x1000, "size" -> 32),
        "send"    -> ujson.Obj("start" -> 0x101f, "size" -> 32)
      )
    )
  )

  for (m <- mistakes)
    s"A device with ${m.what}" should "be refused" in
      assert(sentences(device(m.base)(m.edit), m.p, m.fmmus, m.sms) == Seq(m.sentence))

  "A PDO on a SyncManager that does not exist" should "be refused" in {
    val all = sentences(device("io")(_("rxPdos")(0)("syncManager") = 5))
    assert(all.head == "RxPDO 0x1600 is on SyncManager 5, which the device does not have.")
    assert(all.tail == Seq("SyncManager 0 is used for outputs but carries no PDO."))
  }

  "A PDO on a SyncManager of the other direction" should "be refused" in
    assert(
      sentences(device("io")(_("rxPdos")(0)("syncManager") = 1)).head ==
        "RxPDO 0x1600 is on SyncManager 1, which is used for inputs, not for outputs."
    )

  "A device on a controller without process data RAM" should "be refused" in
    assert(
      sentences(Devices.io, params.copy(ramKiB = 0)).head ==
        "SyncManager 0 occupies 0x1000 to 0x100b, three buffers, but the controller has no process data RAM."
    )

  "More names than an SII holds" should "be refused" in {
    val many = device("io") { d =>
      d("eepromBytes") = 16384
      d("rxPdos")(0)("entries") = (1 to 250).map { i =>
        ujson.Obj("index" -> 0x7000, "subIndex" -> i, "name" -> s"Output $i", "type" -> "BOOL")
      }
    }
    assert(sentences(many) == Seq("The device has 257 different names but the SII holds 255."))
  }

  "Sizes that are not given" should "be those of the PDOs, in whole bytes" in {
    val d = device("io") { v =>
      ignore(
        v("rxPdos")(0)("entries").arr += ujson.Obj(
          "index"    -> 0x7000,
          "subIndex" -> 2,
          "name"     -> "x",
          "type"     -> "BIT3"
        )
      )
    }
    assert(d.syncManagers.map(_.size) == Seq(5, 4) && sentences(d) == Nil)
  }
}
