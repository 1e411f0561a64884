package flyframe.matrix

import org.scalatest.flatspec.AnyFlatSpec
import flyframe.{Directory, Tier}
import flyframe.server.LostFrames
import flyframe.system.{Fault, FaultMatrixSpec, Plan, Report, ServerModel, SystemModel}

/** Issue 12, must-show 2, with the real server and its log: the plans of [[flyframe.system.FaultMatrixSpec]].
  */
class ServerMatrixSpec extends AnyFlatSpec {
  private val tier =
    Tier("faults and pairs of faults, then fire at each of 5 slaves, real server", "plans", 18, 648)

  /** @param seen
    *   takes the notices after each report
    */
  private def failure(plan: Plan, seen: Option[Set[String] => Unit] = None): Option[String] = Directory { d =>
    var made = Option.empty[RealServer]
    try
      FaultMatrixSpec.failure(
        plan,
        p =>
          new SystemModel(
            p.size,
            p.ring,
            p.seed,
            makeServer = { (random, changed) =>
              made = Some(new RealServer(d, random, changed) {
                override def report(r: Report, genuine: Boolean, at: Long): Unit = {
                  super.report(r, genuine, at)
                  seen.foreach(_(notices))
                }
              })
              made.get
            },
            ticks = true
          )
      )
    finally made.foreach(_.close())
  }

  "SRV-26: the server of the model" should "take as many lost frames for too many" in
    assert(ServerModel.LostMost == LostFrames.TooMany && ServerModel.LostTime == LostFrames.WithinMs * 1000)

  "SRV-26: bit errors alone" should "show as lost frames within 100 s, and not any more when they end" in {
    val plans = Fault.matrix(5, 3).filter(_.name.startsWith("bit errors 1 in 10,000, "))
    assert(plans.nonEmpty)
    for (plan <- plans) {
      var shown = false
      assert(failure(plan, Some(notices => shown |= notices("frames lost"))).isEmpty && shown, plan.name)
    }
  }

  "The real server" should "show every fire, and log it once, whatever has failed" in {
    val plans = FaultMatrixSpec.plans(5, tier.size.toInt, seed = 3)
    tier.run("all", plans.size.toLong, Some(3)) {
      val wrong = plans.flatMap(failure(_))
      info(s"${plans.size} plans")
      assert(wrong.isEmpty, s"${wrong.size} of ${plans.size}:\n" + wrong.take(40).mkString("\n"))
    }
  }
}
