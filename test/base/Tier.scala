package flyframe

import java.nio.file.{Files, Path, Paths, StandardOpenOption}
import scala.util.Try
import flyframe.params.EscParams

/** How much of a check is done: `make test` does a sample, `make soak` does far more, and keeps what it has
  * done.
  *
  * @param check
  *   what is checked, in words
  * @param unit
  *   what its size counts
  * @param test
  *   size in `make test`
  * @param soak
  *   size in `make soak`
  */
final case class Tier(check: String, unit: String, test: Long, soak: Long) {

  /** The size in this run. */
  val size: Long = if (Tier.isSoak) soak else test

  /** The size in this run of one of several parts of the check.
    *
    * @param weight
    *   of the part
    * @param all
    *   the weights of all parts together
    */
  def share(weight: Long, all: Long): Long = (size * weight + all - 1) / all

  /** Runs a part of the check, and prints how it went; `make soak` keeps that too, as a JSON object a line.
    *
    * @param part
    *   its name among those of the check
    * @param size
    *   of the part
    * @param seed
    *   of its random choices, if it makes any
    */
  def run[A](part: String, size: Long, seed: Option[Long] = None)(body: => A): A = {
    val start   = System.nanoTime
    val outcome = Try(body)
    val seconds = math.round((System.nanoTime - start) / 1e8) / 10.0
    println(s"$check, $part: $size $unit${seed.fold("")(s => s", seed $s")}, $seconds s")
    if (Tier.isSoak) {
      val line = ujson.Obj(
        "check"   -> check,
        "unit"    -> unit,
        "soak"    -> soak.toDouble,
        "part"    -> part,
        "size"    -> size.toDouble,
        "seed"    -> seed.fold[ujson.Value](ujson.Null)(s => ujson.Str(s.toString)),
        "seconds" -> seconds,
        "passed"  -> outcome.isSuccess
      )
      Tier.keep(ujson.write(line))
    }
    outcome.get
  }
}

object Tier {

  /** `make soak` sets FLYFRAME_TIER=soak. */
  val isSoak: Boolean = sys.env.get("FLYFRAME_TIER").contains("soak")

  /** A set that a test simulates for long: in `make test` with the slowest core clock that it may have, which
    * takes the fewest cycles for the same time on the wire; in `make soak` as it is.
    */
  def slowest(p: EscParams): EscParams =
    if (isSoak) p
    else
      (25 until p.coreClockMhz by 25)
        .map(mhz => p.copy(coreClockMhz = mhz))
        .find(EscParams.problems(_).isEmpty)
        .getOrElse(p)

  /** Where `make soak` wants the results, from suites of several processes. */
  private val results: Option[Path] = sys.env.get("FLYFRAME_RESULTS").map(Paths.get(_))
  private def keep(line: String): Unit = synchronized {
    results.foreach(Files.writeString(_, line + "\n", StandardOpenOption.CREATE, StandardOpenOption.APPEND))
  }
}
