package flyframe

import java.nio.file.{Files, Path, Paths}
import org.scalatest.Assertions

/** Recordings of real devices, which are not part of this repository: recorded traffic (`*.pcapng`) and
  * contents of EEPROMs (`sii/`). They are looked for in the folder `captures` of the folder that the
  * environment variable `FLYFRAME_SHARED` names, by default `../shared`.
  */
object Recordings extends Assertions {
  private val folder = Paths.get(sys.env.getOrElse("FLYFRAME_SHARED", "../shared")).resolve("captures")

  /** What is said where they are missing, once for all tests of a process. */
  private lazy val tellThatTheyAreMissing: Unit = println(
    s"There are no recordings of real devices in $folder, so tests that need them are canceled; " +
      "FLYFRAME_SHARED can name the folder that has `captures`."
  )

  /** The file at `path` below `captures`. A test that asks for it is canceled where there are no recordings.
    */
  def file(path: String): Path = {
    if (!Files.isDirectory(folder)) {
      tellThatTheyAreMissing
      cancel("no recordings")
    }
    val found = folder.resolve(path)
    assert(Files.exists(found), s"$folder has no $path")
    found
  }
}
