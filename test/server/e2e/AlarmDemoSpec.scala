package flyframe.e2e

import java.nio.file.Path
import org.scalatest.flatspec.AnyFlatSpec
import scala.util.Using

/** `make demo`, see [[DemoProcess]]. */
class AlarmDemoSpec extends AnyFlatSpec {
  private def demo() = new DemoProcess(
    "demo.py",
    Path.of("build", "demo"),
    s"${AlarmSystem.program.toAbsolutePath}",
    "--slaves",
    "1"
  )

  "The demonstration of the alarm system" should "take its programs with it, however it ends" in
    // Each finds nothing of the one before.
    DemoProcess.signals.foreach { case (signal, code) =>
      Using.resource(demo())(_.endsBy(signal, code))
    }
}
