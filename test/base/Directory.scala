package flyframe

import java.nio.file.{Files, Path}

/** A directory of its own for a test. */
object Directory {
  def apply[A](check: Path => A): A = {
    val directory = Files.createTempDirectory("flyframe")
    try check(directory)
    finally Files.walk(directory).sorted(java.util.Comparator.reverseOrder[Path]).forEach(Files.delete(_))
  }
}
