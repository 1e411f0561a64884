package flyframe.system

import org.scalatest.flatspec.AnyFlatSpec
import flyframe.Tier

/** Issue 12, must-show 3: days with a fault every minute, and fires. In between, every few hours, all must be
  * normal again by itself, and the log complete or its gaps counted.
  */
class LongRunSpec extends AnyFlatSpec {
  private val tier =
    Tier("faults once a minute and fires at random, in the model", "hours", test = 6, soak = 1440)

  private val Hour = 3600000000L

  private def run(ring: Boolean, hours: Long, seed: Long): Unit = {
    var made = Option.empty[ServerModel]
    val system = new SystemModel(
      24,
      ring,
      seed,
      cycle = 10000,
      makeServer = { (r, changed) =>
        made = Some(new ServerModel(r, changed))
        made.get
      }
    )
    var part  = 0
    var fires = 0L
    while (system.now < hours * Hour) {
      part += 1
      val plan = Fault.storm(system.size, ring, seed * 1000 + part, system.now + 5000000, 3 * Hour)
      fires += plan.acts.count { case (_, a) => PartialFunction.cond(a) { case Act.Smoke(_, true) => true } }
      try {
        system.run(plan)
        system.monitor.lookIsNormal()
        system.monitor.lookAtLog()
      } catch { case v: Monitor.Violation => fail(s"${plan.name}, part $part: ${v.getMessage}") }
      made.get.putAway()
      system.monitor.forget()
    }
    assert(system.monitor.longestToSound <= Monitor.Second)
    info(
      s"$fires fires, ${system.monitor.alarms} alarms, at most ${system.monitor.longestToSound / 1000} ms " +
        s"to the sounder, ${system.worked} of ${system.cycles} cycles gone through, " +
        s"${system.monitor.lostByPower} records lost with the supply of their slave"
    )
  }

  for (ring <- Seq(false, true)) {
    val name = if (ring) "ring" else "line"
    s"A $name with a fault every minute" should "signal every fire, and lose no event uncounted" in {
      val hours = tier.size / 2
      tier.run(name, hours, Some(1))(run(ring, hours, seed = if (ring) 2 else 1))
    }
  }
}
