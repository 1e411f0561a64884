package flyframe

import java.nio.file.{Files, Path}
import java.util.Comparator
import scala.util.{Try, Using}

/** A directory of its own for a test. */
object Directory {
  def apply[A](check: Path => A): A = {
    val directory = Files.createTempDirectory("flyframe")
    try check(directory)
    finally delete(directory)
  }

  /** One that is there until the tests have ended. */
  def lasting(prefix: String = "flyframe"): Path = {
    val directory = Files.createTempDirectory(prefix)
    sys.addShutdownHook(Try(delete(directory)))
    directory
  }

  private def delete(directory: Path): Unit =
    Using.resource(Files.walk(directory))(_.sorted(Comparator.reverseOrder[Path]).forEach(Files.delete(_)))
}
