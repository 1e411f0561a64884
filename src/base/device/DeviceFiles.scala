package flyframe.device

import java.io.IOException
import java.nio.charset.StandardCharsets.UTF_8
import java.nio.file.{Files, Path}
import flyframe.params.EscParams

/** Files on disk: reads device files and SII images, and makes the ESI and SII files of a controller. */
object DeviceFiles {

  /** Text of the device file `name` that comes with the generator (src/base/resources/devices). */
  def bundled(name: String): String = {
    val stream = getClass.getResourceAsStream(s"/devices/$name.json")
    try new String(stream.readAllBytes(), UTF_8)
    finally stream.close()
  }

  /** The device of the file `path`, or one sentence. */
  def device(path: Path): Either[String, Device] =
    bytes(path, 1 << 20).flatMap(b => DeviceFile.parse(new String(b, UTF_8))).left.map(s => s"$path: $s")

  /** The SII image in the file `path`, or one sentence. */
  def sii(path: Path): Either[String, SiiImage] =
    bytes(path, SiiCodec.MaxBytes)
      .flatMap(b => SiiCodec.decode(b.toSeq.map(_ & 0xff)))
      .left
      .map(s => s"$path: $s")

  private def bytes(path: Path, most: Int): Either[String, Array[Byte]] =
    try
      if (!Files.isRegularFile(path)) Left("There is no such file.")
      else if (Files.size(path) > most)
        Left(s"The file has ${Files.size(path)} bytes; more than $most are not read.")
      else Right(Files.readAllBytes(path))
    catch { case e: IOException => Left(s"The file cannot be read (${e.getClass.getSimpleName}).") }

  /** ESI (`NAME.xml`), SII image (`NAME.sii.bin`) and, with CoE, the C sources of the slave stack's
    * dictionary (`NAME.objects.c`, `NAME.objects.h`) of device `d` on a controller with parameters `p`, or
    * why it cannot be that device. `fmmus` and `syncManagers`: how many the controller has.
    */
  def make(
      d: Device,
      p: EscParams,
      fmmus: Int,
      syncManagers: Int
  ): Either[String, Seq[(String, Array[Byte])]] =
    DeviceCheck.check(d, p, fmmus, syncManagers).map { device =>
      Seq(
        s"${p.preset}.xml"     -> Esi.xml(device, p, fmmus, syncManagers).getBytes(UTF_8),
        s"${p.preset}.sii.bin" -> SiiCodec.encode(DeviceSii.image(device, p.ports)).map(_.toByte).toArray
      ) ++ (if (DictionaryC.fits(device)) objects(device, p) else Nil)
    }

  private def objects(d: Device, p: EscParams) = Seq(
    s"${p.preset}.objects.h" -> DictionaryC.header(d, p.preset, p.topName, p.ramBytes).getBytes(UTF_8),
    s"${p.preset}.objects.c" -> DictionaryC.source(d, p.preset, p.topName, p.ramBytes).getBytes(UTF_8)
  )

  /** The files of [[make]] for the device the user chose; without one for the bundled `io`, `digital-io`
    * where there is no host, or `ring-gateway` where there is a ring, or none if the controller lacks what
    * that needs.
    */
  def of(p: EscParams, chosen: Option[Device]): Either[String, Seq[(String, Array[Byte])]] = chosen match {
    case Some(d) if p.role == 0 => make(d, p, p.fmmus, p.syncManagers)
    case Some(_)                => Left("device must not be given if role is 1.")
    case None if p.role != 0    => Right(Nil)
    case None =>
      val name = if (p.isDigitalIo) "digital-io" else if (p.hasRing) "ring-gateway" else "io"
      Right(DeviceFile.parse(bundled(name)).flatMap(make(_, p, p.fmmus, p.syncManagers)).getOrElse(Nil))
  }
}
