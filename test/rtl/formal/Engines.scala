package chiseltest.formal.backends

import firrtl2.annotations.NoTargetAnnotation
import scala.sys.process._
import scala.util.Try

/** Boolector 3 decides our problems in seconds where z3 takes hours: chiseltest writes them for z3 with
  * uninterpreted functions. chiseltest supports it, but keeps the name to its own package; hence the package
  * of this file.
  */
object Engines {
  val boolector: NoTargetAnnotation = BoolectorEngineAnnotation

  /** Boolector 3 is on the PATH (`make test` sees to it). */
  lazy val present: Boolean =
    Try(Process(Seq("boolector", "--version")).!!(ProcessLogger(_ => ())).trim.startsWith("3"))
      .getOrElse(false)

  val missing = "no Boolector 3 on the PATH: run the tests by `make test`"
}
