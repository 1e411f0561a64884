package flyframe.e2e

import java.nio.file.Path
import java.util.concurrent.TimeUnit
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

  it should "answer a mistake with one sentence and exit code 2" in {
    DemoProcess.refuses("demo.py", "--http-port", "99999", "-1", "x")
    DemoProcess.refuses("demo.py", "--slaves", "0", "65")
  }

  it should "answer a line that is no text, and go on with the next one" in
    Using.resource(demo()) { demo =>
      demo.write(Array(0xff.toByte, '\n'.toByte) ++ "time\nquit\n".getBytes)
      val said = demo.rest()
      assert(said.contains("no text in UTF-8") && said.contains(" ns"))
      assert(demo.process.waitFor(60, TimeUnit.SECONDS) && demo.process.exitValue == 0)
    }
}
