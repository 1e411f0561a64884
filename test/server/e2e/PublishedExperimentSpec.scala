package flyframe.e2e

import java.nio.file.Paths
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.protocol.DetectorState.{Alarm, Normal}
import flyframe.protocol.{EventKind, Order}

/** The experiment as it was published: one master, five slaves; smoke at the fourth, cleared; smoke at the
  * fifth. Through RTL, host programs, UDP, SQLite and a browser.
  *
  * With `FLYFRAME_SCREENSHOT` set the page is kept as that file.
  */
class PublishedExperimentSpec extends AnyFlatSpec {
  private val calm = Seq.fill(5)("normal")

  "ALARM, LM, REP, SRV: smoke at the fourth of five slaves, and at the fifth" should
    "be seen at slave, master, server and page, and be cleared from the page" in {
      val system = new AlarmSystem("published")
      try {
        val browser = new Browser(system.page)
        try {
          def slave(n: Int) = system.status("slaves")(n - 1)
          def sounds: Seq[Int] = // slaves, 0: the master
            (0 to 5).filter { n =>
              (if (n == 0) system.status("master")("sounder") else slave(n)("buzzer")).bool
            }
          def detected = system.log.filter(_.kind == EventKind.Detector).map(e => e.node -> e.state)
          def done     = system.log.filter(e => e.kind == EventKind.Command && e.state == 0).map(_.position)

          system.await("five detectors are normal")(browser.detectors == calm)
          assert(browser.labels == Seq("1A", "1B", "2A", "2B", "3A"))
          assert(sounds.isEmpty && browser.alarm == "")

          system.bench("smoke 4 on")
          system.await("the alarm is seen on the page")(browser.detectors == calm.updated(3, "alarm"))
          assert(browser.alarm.contains("2B"))
          assert(sounds == Seq(0, 4) && slave(4)("lamp").bool && system.status("master")("fire").bool)
          // The state may be on the page before the record is in the log.
          system.await("the record is in the log")(detected.last == 4 -> Alarm)

          browser.order("silence")
          system.await("the master has silenced the alarm")(done == Seq(Order.Silence))
          system.await("all is quiet")(sounds.isEmpty)
          // The fire itself is not over.
          assert(slave(4)("lamp").bool && browser.detectors == calm.updated(3, "alarm"))

          system.bench("smoke 4 off")
          browser.reset(3)
          system.await("the detector is reset")(browser.detectors == calm)
          assert(done == Seq(Order.Silence, Order.Reset))
          system.await("the record is in the log")(detected.takeRight(2) == Seq(4 -> Alarm, 4 -> Normal))

          system.bench("smoke 5 on")
          system.await("the second alarm is seen on the page")(browser.detectors == calm.updated(4, "alarm"))
          assert(browser.alarm.contains("3A"))
          assert(sounds == Seq(0, 5))
          system.await("the record is in the log")(detected.last == 5 -> Alarm)
          assert(detected.size == 5 + 3)
          system.await("the record is on the page")(
            browser.log.exists(entry => entry.contains("3A") && entry.contains("alarm"))
          )
          sys.env.get("FLYFRAME_SCREENSHOT").foreach(file => browser.screenshot(Paths.get(file)))
        } finally browser.close()
      } finally system.close()
    }
}
