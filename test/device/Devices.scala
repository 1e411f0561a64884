package flyframe.device

import java.nio.file.{Files, Path, Paths}
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

  def io: Device      = device("io")(_ => ())
  def mailbox: Device = device("mailbox")(_ => ())

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

  /** Controller for [[full]]. */
  val fullParams: EscParams = params.copy(ports = 4, ramKiB = 8, reportedFeatures = 0x00fc)

  private val images = Paths.get(sys.env.getOrElse("FLYFRAME_SHARED", "../shared")).resolve("captures/sii")

  /** Names of the images read from real devices; empty where they are not at hand. */
  def realImages: Seq[String] = if (Files.isDirectory(images)) Seq("ek1100", "el2828", "el2889") else Nil

  def realPath(name: String): Path = images.resolve(s"$name.bin")

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
