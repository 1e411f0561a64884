package flyframe.e2e

import java.nio.file.Paths
import org.scalatest.flatspec.AnyFlatSpec

/** The measurement `make page-latency`, short. */
class PageLatencySpec extends AnyFlatSpec {
  "SRV-15: every event" should "be shown by the page, in much less than a second" in {
    val events = 30
    val times  = PageLatency.measure(events, AlarmSystem.emptyFolder(Paths.get("build/page-latency-test")))
    info(times.json)
    assert(times.document.size == events && times.document.forall(_ > 0))
    assert(times.document.zip(times.screen).forall { case (document, screen) => screen >= document })
    assert(math.abs(times.clockError) < 20, "the page measures by the clock of the computer")
    // Generous: this machine may have much else to do.
    assert(times.screen.sorted.apply(events / 2) < 500 && times.screen.max < 3000)
  }
}
