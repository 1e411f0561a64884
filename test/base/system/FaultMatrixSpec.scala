package flyframe.system

import org.scalatest.flatspec.AnyFlatSpec
import scala.util.{Failure, Success, Try}
import flyframe.Tier

/** Issue 12, must-show 2, in the model: every fault alone and every pair of faults, then fire at each
  * position. What must hold at any time stands in [[Monitor]].
  */
class FaultMatrixSpec extends AnyFlatSpec {
  import FaultMatrixSpec._

  private val small =
    Tier("faults and pairs of faults, then fire at each of 5 slaves, in the model", "plans", 108, 6480)
  private val large =
    Tier("faults and pairs of faults, then fire at each of 64 slaves, in the model", "plans", 18, 972)

  private val hectic =
    Tier("cables, supplies, smoke and panel within milliseconds, in the model", "plans", 60, 20000)

  for ((size, tier) <- Seq(5 -> small, 64 -> large))
    "The fault matrix" should s"have no fire that is not signalled, with $size slaves" in {
      val all = plans(size, tier.size.toInt, seed = 1)
      tier.run("all", all.size.toLong, Some(1)) {
        val wrong = all.flatMap(failure(_))
        info(s"${all.size} plans")
        assert(wrong.isEmpty, s"${wrong.size} of ${all.size}:\n" + wrong.take(40).mkString("\n"))
      }
    }

  "What comes at once" should "leave no fire that is not signalled" in
    hectic.run("all", hectic.size, Some(1)) {
      val wrong = FaultMatrixSpec.hectic(hectic.size.toInt).flatMap(failure(_))
      assert(wrong.isEmpty, s"${wrong.size} of ${hectic.size}:\n" + wrong.take(40).mkString("\n"))
    }
}

object FaultMatrixSpec {

  /** So many plans, with as many seeds from this one on as they need; fewer than a matrix are spread over it.
    */
  def plans(size: Int, count: Int, seed: Int): Seq[Plan] = {
    val whole = Fault.matrix(size, seed.toLong)
    if (count < whole.size) whole.indices.by(whole.size / count).map(whole)
    else (0 until count / whole.size).flatMap(i => Fault.matrix(size, (seed + i).toLong))
  }

  /** So many plans in which much comes at once. */
  def hectic(count: Int): Seq[Plan] = {
    val sizes = Seq(2, 5, 24)
    LazyList.range(1, count + 1).map(i => Fault.hectic(sizes(i % sizes.size), i % 2 == 0, i.toLong))
  }

  /** Runs a plan; what was wrong. */
  def failure(
      plan: Plan,
      system: Plan => SystemModel = p => new SystemModel(p.size, p.ring, p.seed)
  ): Option[String] =
    Try {
      val s = system(plan)
      s.run(plan)
      s.monitor.lookIsNormal()
      s.monitor.lookAtLog()
      val shown = s.monitor.faultShownAt - plan.faultFrom
      if (shown > Monitor.FaultTime) throw new Monitor.Violation(s"no fault was shown within 100 s")
    } match {
      case Success(_)                    => None
      case Failure(v: Monitor.Violation) => Some(s"${plan.name}: ${v.getMessage}")
      case Failure(e)                    => throw new Exception(plan.name, e)
    }
}
