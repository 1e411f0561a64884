package flyframe.device

import java.nio.charset.StandardCharsets.ISO_8859_1
import scala.util.control.NoStackTrace
import flyframe.registers.SiiRegisters.ChecksumOff

/** SII images to and from bytes (0 to 255 each). Reading and writing again gives the same bytes. */
object SiiCodec {
  private val HeaderBytes = 128

  /** Largest EEPROM, 4 Mbit (SII-16). */
  val MaxBytes: Int = 1 << 19

  private val Reserved = (0x10 to 0x13) ++ (0x1d to 0x3d)

  private def le16(v: Int): Seq[Int]  = Seq(v & 0xff, v >> 8 & 0xff)
  private def le32(v: Long): Seq[Int] = le16((v & 0xffff).toInt) ++ le16((v >> 16 & 0xffff).toInt)

  /** CRC-8 of SII-01 over `bytes`. */
  def checksum(bytes: Seq[Int]): Int = bytes.foldLeft(0xff) { (crc, byte) =>
    (0 until 8).foldLeft(crc ^ byte)((c, _) => (c << 1 ^ (if ((c & 0x80) != 0) 0x07 else 0)) & 0xff)
  }

  // Writing

  private def header(h: SiiHeader): Seq[Int] = {
    val configuration = h.configuration.flatMap(le16)
    val words         = Seq.newBuilder[(Int, Int)]
    def put(address: Int, values: Int*): Unit = words ++= values.zipWithIndex.map { case (v, i) =>
      (address + i, v)
    }
    put(0x07, h.checksum.getOrElse(checksum(configuration)))
    Seq(h.vendor, h.product, h.revision, h.serial).zipWithIndex.foreach { case (v, i) =>
      put(0x08 + 2 * i, (v & 0xffff).toInt, (v >> 16 & 0xffff).toInt)
    }
    put(0x14, h.bootstrap.words: _*)
    put(0x18, h.mailbox.words: _*)
    put(0x1c, h.protocols)
    put(0x3e, h.sizeKbit - 1, h.version)
    val all = words.result().toMap ++ h.others
    configuration ++ (7 until HeaderBytes / 2).flatMap(a => le16(all.getOrElse(a, 0)))
  }

  private def entry(e: SiiPdoEntry): Seq[Int] =
    le16(e.index) ++ Seq(e.subIndex, e.name, e.dataType, e.bits) ++ le16(e.flags)

  private def content(category: SiiCategory): Seq[Int] = category match {
    case SiiStrings(texts, rest) =>
      texts.size +: texts.flatMap { t => t.length +: t.getBytes(ISO_8859_1).toSeq.map(_ & 0xff) } :++ rest
    case g: SiiGeneral =>
      Seq(g.group, g.image, g.order, g.name, g.reserved.head, g.coe, g.foe, g.eoe) ++
        Seq(g.soeChannels, g.ds402Channels, g.sysmanClass, g.flags) ++ le16(g.current) ++
        Seq(g.groupName, g.reserved(1)) ++ le16(g.ports) ++ g.rest
    case SiiFmmus(uses) => uses
    case SiiSyncManagers(managers) =>
      managers.flatMap(s => le16(s.start) ++ le16(s.size) ++ Seq(s.control, s.status, s.enable, s.kind))
    case SiiPdos(_, pdos) =>
      pdos.flatMap { p =>
        le16(p.index) ++ Seq(p.entries.size, p.syncManager, p.dcSync, p.name) ++ le16(p.flags) ++
          p.entries.flatMap(entry)
      }
    case SiiDcModes(modes) =>
      modes.flatMap { m =>
        le32(m.cycleTime0) ++ le32(m.shiftTime0.toLong) ++ le32(m.shiftTime1.toLong) ++ le16(
          m.cycleFactor1
        ) ++
          le16(m.assignActivate) ++ le16(m.cycleFactor0) ++ Seq(m.name, m.description) ++ m.reserved
      }
    case SiiOther(_, bytes) => bytes
  }

  private def category(c: SiiCategory): Seq[Int] = {
    val bytes  = content(c)
    val padded = if (bytes.size % 2 == 1) bytes :+ 0xff else bytes
    le16(c.code) ++ le16(padded.size / 2) ++ padded
  }

  private def filled(image: SiiImage): Seq[Int] =
    header(image.header) ++ image.categories.flatMap(category) ++ le16(SiiCategory.End) ++ image.tail

  /** Bytes that `image` uses of its EEPROM. */
  def used(image: SiiImage): Int = filled(image).size

  /** The bytes of `image`, filled up with 0xFF to the size of the EEPROM. */
  def encode(image: SiiImage): Seq[Int] = filled(image).padTo(image.bytes, 0xff)

  // Reading

  private final class Refused(sentence: String) extends Exception(sentence) with NoStackTrace
  private def refuse(sentence: String): Nothing = throw new Refused(sentence)

  /** The contents of `bytes`, one sentence if they are no SII image: too short or long, a wrong checksum, or
    * a category that goes beyond the image or is broken in itself.
    */
  def decode(bytes: Seq[Int]): Either[String, SiiImage] =
    try Right(image(bytes.toIndexedSeq))
    catch { case e: Refused => Left(e.getMessage) }

  private final class Reader(bytes: IndexedSeq[Int], what: String) {
    private var position = 0
    def left: Int        = bytes.size - position
    def take(n: Int): IndexedSeq[Int] = {
      if (n > left)
        refuse(s"$what is broken: it ends ${n - left} ${if (n - left == 1) "byte" else "bytes"} too early.")
      position += n
      bytes.slice(position - n, position)
    }
    def u8(): Int               = take(1).head
    def u16(): Int              = u8() | u8() << 8
    def s16(): Int              = u16().toShort.toInt
    def u32(): Long             = u16().toLong | u16().toLong << 16
    def s32(): Int              = u32().toInt
    def rest(): IndexedSeq[Int] = take(left)
    def all[A](item: => A): Seq[A] = {
      val items = Seq.newBuilder[A]
      while (left > 0) items += item
      items.result()
    }
  }

  private def image(bytes: IndexedSeq[Int]): SiiImage = {
    if (bytes.size < HeaderBytes + 2)
      refuse(s"The image has ${bytes.size} bytes but an SII image has at least ${HeaderBytes + 2}.")
    if (bytes.size > MaxBytes)
      refuse(s"The image has ${bytes.size} bytes but an SII EEPROM has at most $MaxBytes.")
    val head     = readHeader(bytes)
    var position = HeaderBytes
    def word(): Int = {
      if (position + 2 > bytes.size)
        refuse(
          f"The image is cut off: it ends at byte 0x${bytes.size}%04x, where a category header should be."
        )
      position += 2
      bytes(position - 2) | bytes(position - 1) << 8
    }
    val categories = Seq.newBuilder[SiiCategory]
    var code       = word()
    while (code != SiiCategory.End) {
      val start = position - 2
      val name  = f"Category ${SiiCategory.name(code)} at byte 0x$start%04x"
      val size  = 2 * word()
      if (position + size > bytes.size) refuse(s"$name has $size bytes and goes beyond the end of the image.")
      categories += readCategory(code, bytes.slice(position, position + size), name)
      position += size
      code = word()
    }
    val tail = bytes.drop(position)
    SiiImage(head, categories.result(), bytes.size, tail.take(tail.lastIndexWhere(_ != 0xff) + 1))
  }

  private def readHeader(bytes: IndexedSeq[Int]): SiiHeader = {
    def word(a: Int): Int    = bytes(2 * a) | bytes(2 * a + 1) << 8
    def double(a: Int): Long = word(a).toLong | word(a + 1).toLong << 16
    def mailbox(a: Int)      = SiiMailbox(word(a), word(a + 1), word(a + 2), word(a + 3))
    val good                 = checksum(bytes.take(14))
    val stored               = word(7)
    if (stored != ChecksumOff && (stored & 0xff) != good)
      refuse(
        f"The checksum is 0x${stored & 0xff}%02x but must be 0x$good%02x: " +
          "this is no SII image, or a damaged one."
      )
    SiiHeader(
      (0 to 6).map(word),
      Option.when(stored != good)(stored),
      double(0x08),
      double(0x0a),
      double(0x0c),
      double(0x0e),
      mailbox(0x14),
      mailbox(0x18),
      word(0x1c),
      Reserved.map(a => a -> word(a)).filter(_._2 != 0).toMap,
      word(0x3e) + 1,
      word(0x3f)
    )
  }

  private def readCategory(code: Int, bytes: IndexedSeq[Int], name: String): SiiCategory = {
    val r = new Reader(bytes, name)
    code match {
      case SiiCategory.Strings =>
        val count = if (r.left > 0) r.u8() else 0
        val texts = Seq.fill(count)(new String(r.take(r.u8()).map(_.toByte).toArray, ISO_8859_1))
        val rest  = r.rest()
        SiiStrings(texts, if (rest == Seq(0xff)) Nil else rest)
      case SiiCategory.General =>
        val Seq(group, image, order, text, reserved, coe, foe, eoe, soe, ds402, sysman, flags) = r.take(12)
        val current                                                                            = r.s16()
        val groupName                                                                          = r.u8()
        val reserved2                                                                          = r.u8()
        val ports                                                                              = r.u16()
        SiiGeneral(
          group,
          image,
          order,
          text,
          coe,
          foe,
          eoe,
          soe,
          ds402,
          sysman,
          flags,
          current,
          groupName,
          ports,
          Seq(reserved, reserved2),
          r.rest()
        )
      case SiiCategory.Fmmu => SiiFmmus(r.rest())
      case SiiCategory.SyncManager =>
        SiiSyncManagers(r.all(SiiSyncManager(r.u16(), r.u16(), r.u8(), r.u8(), r.u8(), r.u8())))
      case SiiCategory.TxPdo | SiiCategory.RxPdo =>
        SiiPdos(
          code == SiiCategory.TxPdo,
          r.all {
            val index                                 = r.u16()
            val Seq(count, syncManager, dcSync, text) = r.take(4)
            val flags                                 = r.u16()
            SiiPdo(
              index,
              syncManager,
              dcSync,
              text,
              flags,
              Seq.fill(count)(SiiPdoEntry(r.u16(), r.u8(), r.u8(), r.u8(), r.u8(), r.u16()))
            )
          }
        )
      case SiiCategory.Dc =>
        SiiDcModes(
          r.all(
            SiiDcMode(
              r.u32(),
              r.s32(),
              r.s32(),
              r.s16(),
              r.u16(),
              r.s16(),
              r.u8(),
              r.u8(),
              r.take(4)
            )
          )
        )
      case other => SiiOther(other, bytes)
    }
  }
}
