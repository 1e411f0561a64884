package flyframe.server

import java.nio.file.{Files, Path}
import java.util.HexFormat
import scala.util.Try
import flyframe.protocol.ServerDatagram

/** The keys that the server shares with its masters (SRV-12).
  *
  * @param common
  *   of every master that has none of its own
  * @param own
  *   by master ID
  */
final class Keys(common: Option[Array[Byte]], own: Map[Int, Array[Byte]] = Map.empty) {

  /** The key of a master, 16 bytes; None: nothing of it can be checked. */
  def of(master: Int): Option[Array[Byte]] = own.get(master).orElse(common)
}

object Keys {
  private val Digits = 2 * ServerDatagram.KeyBytes
  private val Common = s"([0-9a-fA-F]{$Digits})".r
  private val Own    = s"(\\d{1,5})\\s+([0-9a-fA-F]{$Digits})".r

  /** The keys in a file; Left: what is wrong with it. Never shows any. The file holds one key for all masters
    * in a single line, or lines with master ID and key.
    */
  def read(path: Path): Either[String, Keys] = for {
    text <- Try(Files.readString(path)).toEither.left.map(_ => s"The key file $path cannot be read.")
    keys <- parse(text.linesIterator.toSeq).toRight(
      s"The key file $path must hold $Digits hexadecimal digits in one line, or a master ID and as many " +
        "digits in each line, and nothing else."
    )
  } yield keys

  private def parse(lines: Seq[String]): Option[Keys] = lines match {
    case Seq(Common(key)) => Some(new Keys(Some(HexFormat.of.parseHex(key))))
    case _ =>
      val own = lines.collect { case Own(id, key) if id.toInt <= 0xffff => id.toInt -> key }.toMap
      Option.when(own.nonEmpty && own.size == lines.size)(
        new Keys(None, own.map { case (id, key) => id -> HexFormat.of.parseHex(key) })
      )
  }
}
