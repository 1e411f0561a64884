package flyframe.device

import java.nio.file.{Files, Path}
import scala.util.Random
import flyframe.Recordings
import flyframe.params.{EscParams, Presets}

/** What the tests of this folder share. */
object Devices {

  /** A small controller: two ports, 1 KiB, 16-bit alias. */
  val params: EscParams =
    Presets.named("cyclone4-min").get.params.copy(dataBusWidth = 8, ports = 2, ramKiB = 1, nodeIdWidth = 16)

  /** The JSON of a device file that comes with the generator, changed by `edit`. */
  def json(name: String)(edit: ujson.Value => Unit): String = {
    val value = ujson.read(DeviceFiles.bundled(name))
    edit(value)
    value.render()
  }

  def device(name: String)(edit: ujson.Value => Unit): Device =
    DeviceFile.parse(json(name)(edit)).fold(s => throw new AssertionError(s), identity)

  def io: Device               = device("io")(_ => ())
  def mailbox: Device          = device("mailbox")(_ => ())
  def digital: Device          = device("digital-io")(_ => ())
  val digitalParams: EscParams = Presets.named("digital-io").get.params

  /** A mailbox device with everything a device file can say. */
  def full: Device = device("mailbox") { d =>
    d("product")("serial") = "0xfedcba98"
    d("configuration") = ujson.Obj(
      "pdiControl"               -> "0x0e05",
      "pdiConfiguration"         -> "0x0603",
      "syncPulse"                -> 10000,
      "extendedPdiConfiguration" -> "0x1234",
      "stationAlias"             -> "0x1001",
      "escA5"                    -> "0x0e00",
      "escA6"                    -> 2
    )
    d("fmmus").arr += "mailboxState"
    d("txPdos")(0)("entries").arr ++= Seq[ujson.Value](
      ujson.Obj("index" -> "0x6000", "subIndex" -> 2, "name" -> "Ready", "type" -> "BOOL"),
      ujson.Obj("bits"  -> 7)
    )
    d("syncManagers").arr += ujson.Obj("use" -> "unused")
    d("mailbox") = ujson.Obj(
      "protocols" -> MailboxProtocol.all.map(_.name),
      "coe"       -> Seq("sdoInfo", "completeAccess"),
      "repeat"    -> true,
      "bootstrap" -> ujson.Obj(
        "receive" -> ujson.Obj("start" -> "0x1000", "size" -> 256),
        "send"    -> ujson.Obj("start" -> "0x1100", "size" -> 256)
      )
    )
    d("dcModes") = ujson.Arr(
      ujson.Obj("name" -> "FreeRun", "description" -> "no SYNC", "assignActivate" -> 0),
      ujson.Obj(
        "name"           -> "DC",
        "description"    -> "SYNC0 and SYNC1",
        "assignActivate" -> "0x0700",
        "cycleTime0"     -> 500000,
        "cycleFactor0"   -> -2,
        "shiftTime0"     -> -1000,
        "cycleFactor1"   -> 1,
        "shiftTime1"     -> 2000
      )
    )
  }

  /** A random device that fits [[fullParams]]: up to three SyncManagers per direction, any entries. */
  def random(r: Random): Device = {
    def name() = {
      val middle = Seq.fill(r.nextInt(20))(r.between(0x20, 0x7f).toChar).mkString
      s"a$middle.".replaceAll(" +", " ") // XML readers and writers join spaces
    }
    var address = 0x1000
    var entries = 0
    def entry() = {
      entries += 1
      if (r.nextInt(5) == 0) PdoEntry(0, 0, "", None, r.between(1, 256))
      else {
        val t = DataType.all(r.nextInt(DataType.all.size))
        PdoEntry(0x6000 + entries, r.nextInt(256), name(), Some(t), t.bits)
      }
    }
    def pdos(first: Int, index: Int, managers: Int) = (0 until managers).flatMap { m =>
      Seq.tabulate(r.between(1, 4)) { i =>
        Pdo(index + 16 * m + i, name(), first + m, Seq.fill(r.between(1, 8))(entry()))
      }
    }
    val boxed       = if (r.nextBoolean()) Some(Devices.full.mailbox.get) else None
    val first       = if (boxed.isEmpty) 0 else 2
    val (outs, ins) = (r.nextInt(4), r.nextInt(4))
    val (rx, tx)    = (pdos(first, 0x1600, outs), pdos(first + outs, 0x1a00, ins))
    def manager(use: SmUse, size: Int) = {
      val at = address
      address += use.buffers * ((size + 3) / 4 * 4)
      SyncManager(use, at, size, use.default)
    }
    val boxes = boxed.toSeq.flatMap(_ => Seq(manager(SmUse.MailboxOut, 64), manager(SmUse.MailboxIn, 64)))
    val process = (0 until outs + ins).map { m =>
      val bits = (rx ++ tx).filter(_.syncManager == first + m).map(_.bits).sum
      manager(if (m < outs) SmUse.Outputs else SmUse.Inputs, (bits + 7) / 8)
    }
    val modes = Seq.fill(r.nextInt(3))(
      DcMode(name(), name(), r.nextInt(0x10000), r.nextInt(1 << 30).toLong, -1, -5, 2, 7)
    )
    Device(
      Vendor(r.nextInt().toLong & 0xffffffffL, name()),
      Product(r.nextInt().toLong & 0xffffffffL, r.nextInt().toLong & 0xffffffffL, 1, name(), name()),
      Group(name(), name()),
      Configuration(
        r.nextInt(0x10000),
        r.nextInt(0x10000),
        r.nextInt(0x10000),
        r.nextInt(0x10000),
        r.nextInt(0x10000)
      ),
      8192,
      boxes ++ process,
      Seq(FmmuUse.Outputs, FmmuUse.Inputs, FmmuUse.MailboxState).take(if (boxed.isEmpty) 2 else 3),
      rx,
      tx,
      boxed,
      modes
    )
  }

  /** Controller for [[full]]. */
  val fullParams: EscParams = params.copy(ports = 4, ramKiB = 8, reportedFeatures = 0x00fc)

  /** Names of the images read from real devices. */
  val realImages: Seq[String] = Seq("ek1100", "el2828", "el2889")

  /** The file of such an image; the test is canceled where there are no recordings. */
  def realPath(name: String): Path = Recordings.file(s"sii/$name.bin")

  def real(name: String): Seq[Int] = Files.readAllBytes(realPath(name)).toSeq.map(_ & 0xff)

  /** The data of the first category `code`, found as SOEM and ethercrab do: from byte 0x80, by header and
    * size in words, until the end mark.
    */
  def raw(image: Seq[Int], code: Int): Option[Seq[Int]] = {
    def word(at: Int) = image(at) | image(at + 1) << 8
    def from(at: Int): Option[Seq[Int]] = word(at) match {
      case 0xffff => None
      case `code` => Some(image.slice(at + 4, at + 4 + 2 * word(at + 2)))
      case _      => from(at + 4 + 2 * word(at + 2))
    }
    from(0x80)
  }

  def hex(bytes: Seq[Int]): String = bytes.map(b => f"$b%02x").mkString(" ")
}
