package flyframe.report

import java.nio.charset.StandardCharsets.UTF_8
import java.security.MessageDigest

/** Names contents. */
object Hash {

  /** SHA-256 of `texts`, as hexadecimal digits. */
  def of(texts: Seq[String]): String = {
    val digest = MessageDigest.getInstance("SHA-256")
    // The length first, so that no two lists of texts are the same bytes.
    texts.map(_.getBytes(UTF_8)).foreach { bytes =>
      digest.update(s"${bytes.length} ".getBytes(UTF_8))
      digest.update(bytes)
    }
    digest.digest.map(b => f"$b%02x").mkString
  }
}
