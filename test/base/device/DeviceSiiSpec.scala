package flyframe.device

import org.scalatest.flatspec.AnyFlatSpec

/** The bytes a device's image has, found as masters find them and compared with what they expect. */
class DeviceSiiSpec extends AnyFlatSpec {
  import Devices.{hex, raw}

  private def bytes(d: Device, ports: Int = 2) = SiiCodec.encode(DeviceSii.image(d, ports))
  private val io                               = bytes(Devices.io)
  private val full                             = bytes(Devices.full, 4)
  private def word(image: Seq[Int], at: Int)   = image(2 * at) | image(2 * at + 1) << 8
  private def text(image: Seq[Int], n: Int): String = {
    def skip(s: Seq[Int], i: Int): Seq[Int] = if (i == 1) s else skip(s.drop(1 + s.head), i - 1)
    val s                                   = skip(raw(image, 10).get.tail, n)
    s.slice(1, 1 + s.head).map(_.toChar).mkString
  }

  "Words 0 to 6" should "be the device file's configuration" in {
    assert(hex(io.take(14)) == "80 01" + " 00" * 12)
    assert(hex(full.take(14)) == "05 0e 03 06 10 27 34 12 01 10 00 0e 02 00")
  }

  "The identity" should "be in words 0x08 to 0x0F" in
    assert(hex(full.slice(16, 32)) == "00 00 00 00 02 00 00 00 01 00 00 00 98 ba dc fe")

  "The mailbox words" should "be those of SyncManagers 0 and 1 and the bootstrap areas" in {
    assert((0x14 to 0x17).map(word(full, _)) == Seq(0x1000, 256, 0x1100, 256))
    assert((0x18 to 0x1c).map(word(full, _)) == Seq(0x1000, 128, 0x1080, 128, 0x3f))
    assert((0x18 to 0x1c).map(word(bytes(Devices.mailbox), _)) == Seq(0x1000, 128, 0x1080, 128, 0))
    assert((0x14 to 0x1c).forall(word(io, _) == 0))
  }

  "SII-04: the reserved words" should "be 0" in {
    for (image <- Seq(io, full); a <- (0x10 to 0x13) ++ (0x1d to 0x3d))
      assert(word(image, a) == 0, s"word $a")
  }

  "Words 0x3E and 0x3F" should "be the size in Kbit less one and version 1" in {
    assert(word(io, 0x3e) == 15 && word(io, 0x3f) == 1)
    val large = bytes(Devices.device("io")(_("eepromBytes") = 4096))
    assert(large.size == 4096 && word(large, 0x3e) == 31)
  }

  "Text 1" should "be the order number, as SOEM and ethercrab show text 1" in
    assert(text(io, 1) == "flyframe-io" && text(full, 1) == "flyframe-mailbox")

  "The general category" should "have 32 bytes, the texts, protocols and ports" in {
    assert(hex(raw(io, 30).get) == "02 00 01 04 00 00 00 00 00 00 00 00 00 00 03 00 11 00" + " 00" * 14)
    assert(hex(raw(full, 30).get) == "02 00 01 04 00 23 01 01 01 00 00 04 00 00 03 00 11 11" + " 00" * 14)
    assert(text(io, 2) == "flyframe" && text(io, 3) == "flyframe examples")
    assert(text(io, 4) == "flyframe, 4 bytes out, 4 bytes in")
  }

  "The FMMU category" should "have a byte per FMMU and 0xFF as padding" in {
    assert(hex(raw(io, 40).get) == "01 02")
    assert(hex(raw(full, 40).get) == "01 02 03 ff")
  }

  "The SyncManager category" should "have eight bytes per SyncManager, ready for the registers" in {
    assert(hex(raw(io, 41).get) == "00 10 04 00 64 00 01 03 00 11 04 00 20 00 01 04")
    assert(
      hex(raw(full, 41).get) == "00 10 80 00 26 00 01 01 80 10 80 00 22 00 01 02 " +
        "00 11 04 00 64 00 01 03 80 11 05 00 20 00 01 04 00 00 00 00 00 00 00 00"
    )
  }

  "The PDO categories" should "have the PDOs with their entries" in {
    assert(hex(raw(io, 51).get) == "00 16 01 00 00 05 11 00 00 70 01 06 07 20 00 00")
    assert(hex(raw(io, 50).get) == "00 1a 01 01 00 07 11 00 00 60 01 08 07 20 00 00")
    assert(text(io, 5) == "Outputs" && text(io, 6) == "Outputs 0 to 31")
    assert(text(io, 7) == "Inputs" && text(io, 8) == "Inputs 0 to 31")
  }

  "A padding entry" should "have no index, name and type" in
    assert(hex(raw(full, 50).get.takeRight(16)) == "00 60 02 09 01 01 00 00 00 00 00 00 00 07 00 00")

  "The DC category" should "have 24 bytes per mode" in {
    val dc = raw(full, 60).get
    assert(dc.size == 48 && hex(dc.slice(14, 16)) == "00 00")
    assert(
      hex(dc.drop(24)) == "20 a1 07 00 18 fc ff ff d0 07 00 00 01 00 00 07 fe ff " +
        f"0c 0d 00 00 00 00"
    )
    assert(text(full, 12) == "DC" && text(full, 13) == "SYNC0 and SYNC1")
    assert(raw(io, 60).isEmpty)
  }

  "The categories" should "come in the order of the real images" in
    assert(
      DeviceSii.image(Devices.full, 4).categories.map(_.code) == Seq(10, 30, 40, 41, 50, 51, 60)
    )

  "A device file of the EL2889" should "give its texts and RxPDOs byte for byte" in {
    val json = ujson.Obj(
      "vendor" -> ujson.Obj("id" -> 2, "name" -> "Beckhoff"),
      "product" -> ujson.Obj(
        "code"     -> "0x0b493052",
        "revision" -> "0x00110000",
        "order"    -> "EL2889",
        "name"     -> "EL2889 16K. Dig. Ausgang 24V, 0.5A, negativ"
      ),
      "group"         -> ujson.Obj("type" -> "DigOut", "name" -> "Digitale Ausgangklemmen (EL2xxx)"),
      "configuration" -> ujson.Obj("pdiControl" -> "0x0104", "extendedPdiConfiguration" -> "0x00ff"),
      "syncManagers" -> ujson.Arr(
        ujson.Obj("use" -> "outputs", "start" -> "0x0f00", "control" -> "0x44"),
        ujson.Obj("use" -> "outputs", "start" -> "0x0f01", "control" -> "0x44")
      ),
      "fmmus" -> ujson.Arr("outputs"),
      "rxPdos" -> (0 until 16).map { i =>
        ujson.Obj(
          "index"       -> (0x1600 + i),
          "name"        -> s"Channel ${i + 1}",
          "syncManager" -> i / 8,
          "entries" -> ujson.Arr(
            ujson.Obj("index" -> (0x7000 + 16 * i), "subIndex" -> 1, "name" -> "Output", "type" -> "BOOL")
          )
        )
      }
    )
    val ours = bytes(DeviceFile.parse(json.render()).fold(s => fail(s), identity))
    val real = Devices.real("el2889")
    assert(ours.take(16) == real.take(16), "configuration and checksum")
    assert(ours.slice(16, 32) == real.slice(16, 32), "identity")
    for (code <- Seq(10, 40, 51)) assert(raw(ours, code) == raw(real, code), s"category $code")
    // The enable byte differs: the terminal asks for "in Op only".
    assert(
      raw(ours, 41).map(_.grouped(8).map(_.patch(6, Nil, 1)).toSeq) ==
        raw(real, 41).map(_.grouped(8).map(_.patch(6, Nil, 1)).toSeq)
    )
  }

  /** What SOEM and ethercrab make of the categories: SyncManagers and FMMUs per direction with their bytes.
    */
  private case class Mapping(sm: Int, start: Int, bytes: Int, fmmu: Int)
  private def mapping(image: Seq[Int], pdoCategory: Int, smType: Int, fmmuUse: Int): Seq[Mapping] = {
    def pdos(b: Seq[Int]): Seq[(Int, Int)] =
      if (b.isEmpty) Nil
      else (b(3) -> b.drop(8).grouped(8).take(b(2)).map(_(5)).sum) +: pdos(b.drop(8 + 8 * b(2)))
    val bits = pdos(raw(image, pdoCategory).getOrElse(Nil)).groupMapReduce(_._1)(_._2)(_ + _)
    raw(image, 41).getOrElse(Nil).grouped(8).toSeq.zipWithIndex.collect {
      case (s, i) if s(7) == smType =>
        Mapping(i, s(0) | s(1) << 8, (bits.getOrElse(i, 0) + 7) / 8, raw(image, 40).get.indexOf(fmmuUse))
    }
  }

  "A master's mapping" should "be one SyncManager and FMMU per direction, of the same length" in {
    for ((image, out, in) <- Seq((io, 0x1000, 0x1100), (bytes(Devices.mailbox), 0x1100, 0x1180))) {
      val sm = if (out == 0x1000) 0 else 2
      assert(mapping(image, 51, 3, 1) == Seq(Mapping(sm, out, 4, 0)))
      assert(mapping(image, 50, 4, 2) == Seq(Mapping(sm + 1, in, 4, 1)))
    }
  }

  it should "be the device's, for 300 random devices" in {
    val r = new scala.util.Random(5)
    for (i <- 1 to 300) {
      val d = Devices.random(r)
      assert(DeviceCheck.problems(d, Devices.fullParams, 3, 8) == Nil, s"device $i")
      val image = bytes(d, 4)
      def expected(use: SmUse, fmmu: FmmuUse) = d.syncManagers.zipWithIndex.collect {
        case (s, n) if s.use == use => Mapping(n, s.start, s.size, d.fmmus.indexOf(fmmu))
      }
      assert(mapping(image, 51, 3, 1) == expected(SmUse.Outputs, FmmuUse.Outputs), s"device $i")
      assert(mapping(image, 50, 4, 2) == expected(SmUse.Inputs, FmmuUse.Inputs), s"device $i")
      assert(SiiCodec.decode(image) == Right(DeviceSii.image(d, 4)), s"device $i")
    }
  }

  "The printed image" should "show what the device file says" in {
    val shown = SiiText.print(DeviceSii.image(Devices.full, 4))
    for (
      line <- Seq(
        "SII image, 2048 bytes, checksum good",
        "  0x1001  station alias",
        "  vendor 0x00000000, product 0x00000002, revision 0x00000001, serial 0xfedcba98",
        "  bootstrap: receive 0x1000, 256 bytes; send 0x1100, 256 bytes",
        "  protocols: AoE, EoE, CoE, FoE, SoE, VoE",
        "  FMMU 2: mailboxState",
        "  SyncManager 2: outputs, 0x1100, 4 bytes, control 0x64, enable 0x01",
        "  TxPDO 0x1a00 \"Inputs\", SyncManager 3, flags 0x0011",
        "    0x6000:02 1 bit BOOL \"Ready\"",
        "    7 bit padding",
        "  DC \"SYNC0 and SYNC1\": AssignActivate 0x0700, SYNC0 cycle 500000 ns, " +
          "factor -2, shift -1000 ns, SYNC1 factor 1, shift 2000 ns"
      )
    ) assert(shown.linesIterator.contains(line), line)
  }
}
