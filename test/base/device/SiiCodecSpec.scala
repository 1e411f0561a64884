package flyframe.device

import org.scalatest.flatspec.AnyFlatSpec
import scala.util.Random
import flyframe.registers.SiiRegisters

/** SII images to and from bytes, against images of real devices and random ones. */
class SiiCodecSpec extends AnyFlatSpec {
  private def decoded(bytes: Seq[Int]) = SiiCodec.decode(bytes).fold(s => fail(s), identity)
  private def refused(bytes: Seq[Int]) = SiiCodec.decode(bytes).swap.getOrElse(fail("was not refused"))
  private def zeros(n: Int)            = Seq.fill(n)(0)
  private val io                       = SiiCodec.encode(DeviceSii.image(Devices.io, 2))
  private val full                     = SiiCodec.encode(DeviceSii.image(Devices.full, 4))

  "SII-01, SII-02: the checksum" should "be that of the published vectors" in {
    val vectors = Seq(
      (Seq(0x00, 0x0d) ++ zeros(12))                              -> 0x46,
      (Seq(0x04, 0x01, 0, 0, 0, 0, 0x0f) ++ zeros(7))             -> 0xd8,
      (Seq(0x80, 0x03, 0x00, 0x6e, 0xff, 0x00, 0xff) ++ zeros(7)) -> 0x22,
      (Seq(0x05, 0x0e, 0x03, 0x06, 0x10, 0x27) ++ zeros(8))       -> 0xd7,
      zeros(14)                                                   -> 0x30,
      Seq.fill(14)(0xff)                                          -> 0xa3
    )
    for ((bytes, sum) <- vectors) assert(SiiCodec.checksum(bytes) == sum, Devices.hex(bytes))
  }

  it should "be in the low byte of word 7, the high byte 0" in {
    for (image <- Seq(io, full)) assert(image(14) == SiiCodec.checksum(image.take(14)) && image(15) == 0)
  }

  it should "refuse every change of one byte of words 0 to 7" in {
    for (at <- 0 to 14; change <- 1 to 255)
      assert(
        refused(io.updated(at, io(at) ^ change)).startsWith("The checksum is 0x"),
        s"byte $at, xor $change"
      )
  }

  it should "name both values when it is wrong" in
    assert(
      refused(io.updated(14, io(14) ^ 1)) ==
        f"The checksum is 0x${io(14) ^ 1}%02x but must be 0x${io(14)}%02x: " +
        "this is no SII image, or a damaged one."
    )

  "SII-02: all zeros and all ones" should "be refused" in {
    for (byte <- Seq(0, 0xff)) assert(refused(Seq.fill(2048)(byte)).startsWith("The checksum is"))
  }

  "SII-03: the checksum word 0x88A4" should "switch the check off and be kept" in {
    val image = io.updated(0, 0x55).updated(14, 0xa4).updated(15, 0x88)
    assert(decoded(image).header.checksum.contains(SiiRegisters.ChecksumOff))
    assert(SiiCodec.encode(decoded(image)) == image)
    assert(SiiText.print(decoded(image)).startsWith("SII image, 2048 bytes, check switched off\n"))
  }

  "An image of a real device" should "read, and write back equal, byte for byte" in {
    for (name <- Devices.realImages)
      assert(SiiCodec.encode(decoded(Devices.real(name))) == Devices.real(name), name)
  }

  it should "read as what is known of it" in {
    val coupler = decoded(Devices.real("ek1100"))
    assert(coupler.header.vendor == 2 && coupler.header.product == 0x044c2c52L)
    assert(coupler.header.revision == 0x00120000L && coupler.header.sizeKbit == 16)
    val general = coupler.categories.collectFirst { case g: SiiGeneral => g }.get
    assert(general.current == -2000 && general.ports == 0x0131)
    assert(coupler.text(general.order) == "EK1100")

    val outputs = decoded(Devices.real("el2889"))
    val pdos    = outputs.categories.collectFirst { case p: SiiPdos => p }.get
    assert(!pdos.tx && pdos.pdos.size == 16 && pdos.pdos.flatMap(_.entries).map(_.bits).sum == 16)
    assert(pdos.pdos.map(p => outputs.text(p.name)) == (1 to 16).map(i => s"Channel $i"))
    val managers = outputs.categories.collectFirst { case SiiSyncManagers(m) => m }.get
    assert(managers.map(_.start) == Seq(0x0f00, 0x0f01) && managers.forall(_.kind == SmUse.Outputs.code))
    assert(decoded(Devices.real("el2828")).categories.map(_.code) == Seq(3, 10, 30, 40, 41, 43, 51))
  }

  "A device's image" should "read back as it was written" in {
    for ((d, ports) <- Seq(Devices.io -> 2, Devices.mailbox -> 2, Devices.digital -> 2, Devices.full -> 4)) {
      val image = DeviceSii.image(d, ports)
      assert(decoded(SiiCodec.encode(image)) == image, d.product.order)
    }
  }

  it should "be as long as the EEPROM and end in 0xFF" in {
    assert(io.size == 2048 && io.drop(SiiCodec.used(DeviceSii.image(Devices.io, 2))).forall(_ == 0xff))
  }

  /** A random image whose parts all fit their fields. */
  private def random(r: Random): SiiImage = {
    def u8()                                   = r.nextInt(0x100)
    def u16()                                  = r.nextInt(0x10000)
    def s16()                                  = r.nextInt(0x10000) - 0x8000
    def u32()                                  = r.nextInt().toLong & 0xffffffffL
    def some[A](most: Int)(item: => A): Seq[A] = Seq.fill(r.nextInt(most + 1))(item)
    def text()                                 = Seq.fill(r.nextInt(r.between(1, 256)))(u8().toChar).mkString
    def mailbox()                              = SiiMailbox(u16(), u16(), u16(), u16())
    def category(): SiiCategory = r.nextInt(8) match {
      case 0 => SiiStrings(some(20)(text()))
      case 1 =>
        SiiGeneral(
          u8(),
          u8(),
          u8(),
          u8(),
          u8(),
          u8(),
          u8(),
          u8(),
          u8(),
          u8(),
          u8(),
          s16(),
          u8(),
          u16(),
          Seq(u8(), u8()),
          Seq.fill(14)(u8())
        )
      case 2 => SiiFmmus(Seq.fill(2 * r.nextInt(9))(u8()))
      case 3 => SiiSyncManagers(some(16)(SiiSyncManager(u16(), u16(), u8(), u8(), u8(), u8())))
      case 4 | 5 =>
        SiiPdos(
          r.nextBoolean(),
          some(20)(
            SiiPdo(
              u16(),
              u8(),
              u8(),
              u8(),
              u16(),
              some(30)(SiiPdoEntry(u16(), u8(), u8(), u8(), u8(), u16()))
            )
          )
        )
      case 6 =>
        SiiDcModes(
          some(4)(
            SiiDcMode(u32(), r.nextInt(), r.nextInt(), s16(), u16(), s16(), u8(), u8(), Seq.fill(4)(u8()))
          )
        )
      case _ => SiiOther(0x1000 + r.nextInt(0x1000), Seq.fill(2 * r.nextInt(50))(u8()))
    }
    val header = SiiHeader(
      Seq.fill(7)(u16()),
      None,
      u32(),
      u32(),
      u32(),
      u32(),
      mailbox(),
      mailbox(),
      u16(),
      some(3)(r.between(0x1d, 0x3e) -> r.between(1, 0x10000)).toMap,
      1 + u16(),
      u16()
    )
    val image = SiiImage(header, some(12)(category()), 0, some(8)(u8()) :+ 0)
    image.copy(bytes = SiiCodec.used(image) + r.nextInt(100))
  }

  "2000 random images" should "read back as they were written" in {
    val r = new Random(1)
    for (i <- 1 to 2000) {
      val image = random(r)
      assert(decoded(SiiCodec.encode(image)) == image, s"image $i")
    }
  }

  they should "never make the reader or the printer fail when damaged behind the header" in {
    val r = new Random(2)
    for (i <- 1 to 2000) {
      val bytes = SiiCodec.encode(random(r)).toArray
      for (_ <- 0 to r.nextInt(8)) bytes(r.between(16, bytes.length)) = r.nextInt(0x100)
      SiiCodec.decode(bytes.toSeq) match {
        case Right(image) => assert(SiiCodec.encode(image) == bytes.toSeq, s"image $i"); SiiText.print(image)
        case Left(sentence) => assert(sentence.endsWith(".") && !sentence.contains("\n"), s"image $i")
      }
    }
  }

  "A truncated image" should "be refused at every length before its end mark" in {
    for (
      bytes <- Seq(
        io   -> SiiCodec.used(DeviceSii.image(Devices.io, 2)),
        full -> SiiCodec.used(DeviceSii.image(Devices.full, 4))
      )
    )
      for (n <- 0 until bytes._2) {
        val sentence = refused(bytes._1.take(n))
        assert(sentence.endsWith(".") && (n < 130 || sentence.contains("image")), s"$n bytes: $sentence")
      }
  }

  it should "say where it ends" in {
    assert(refused(io.take(100)) == "The image has 100 bytes but an SII image has at least 130.")
    assert(
      refused(
        io.take(150)
      ) == "Category STRINGS at byte 0x0080 has 120 bytes and goes beyond the end of the image."
    )
    assert(
      refused(
        io.take(252)
      ) == "The image is cut off: it ends at byte 0x00fc, where a category header should be."
    )
  }

  "An image longer than any EEPROM" should "be refused" in
    assert(refused(io ++ zeros(1 << 19)).endsWith("but an SII EEPROM has at most 524288."))

  "A category that is broken in itself" should "be named" in {
    def broken(code: Int, bytes: Int*) =
      refused(SiiCodec.encode(DeviceSii.image(Devices.io, 2).copy(categories = Seq(SiiOther(code, bytes)))))
    assert(
      broken(10, 2, 1, 'a', 9) == "Category STRINGS at byte 0x0080 is broken: it ends 9 bytes too early."
    )
    assert(broken(30, zeros(14): _*).startsWith("Category GENERAL at byte 0x0080 is broken"))
    assert(broken(41, zeros(10): _*).startsWith("Category SYNCM at byte 0x0080 is broken"))
    assert(broken(50, 0, 0x1a, 1, 0, 0, 0, 0, 0).startsWith("Category TXPDO at byte 0x0080 is broken"))
    assert(broken(51, 0, 0x16, 1, 0, 0, 0, 0, 0).startsWith("Category RXPDO at byte 0x0080 is broken"))
    assert(broken(60, zeros(20): _*).startsWith("Category DC at byte 0x0080 is broken"))
  }
}
