package flyframe.firmware

import java.nio.file.{Files, Paths}
import org.scalatest.flatspec.AnyFlatSpec
import scala.sys.process._
import flyframe.Tier

/** The slave stack (src/firmware/slave): its tests against a fake controller in C++, and its size. */
class StackSpec extends AnyFlatSpec {
  private val tier =
    Tier("Mutated mailbox messages into the slave stack", "messages", test = 5000, soak = 1000000)
  private val Seed = 1L

  private def run(command: String*): (Int, String) = {
    val text = new StringBuilder
    val code = Process(command).!(ProcessLogger(line => text.synchronized(text.append(line).append('\n'))))
    (code, text.toString)
  }

  "ST-45: the stack" should "pass its tests and take mutated messages, under ASan and UBSan" in {
    val (code, text) = tier.run("all states", tier.size, Some(Seed)) {
      run("make", "-s", "-f", "test/sim/test.mk", "stack-test", s"MESSAGES=${tier.size}", s"SEED=$Seed")
    }
    assert(code == 0, text.linesIterator.filterNot(_.startsWith("ok ")).mkString("\n"))
    // Half of them with acknowledge by write.
    assert(s"ST-45: ${tier.size / 2} mutated messages".r.findAllIn(text).size == 2, text)
  }

  /** What a Cortex-M3 needs; no library is linked, but what the compiler calls is not counted either. */
  "ST-47: driver and stack" should "have at most 16 KiB of code and 2 KiB of data" in {
    val out = Files.createDirectories(Paths.get("build/stack-size"))
    val sources = Seq("driver", "slave").flatMap { folder =>
      Paths.get("src/firmware", folder).toFile.listFiles.map(_.getPath).filter(_.endsWith(".c")).sorted
    }
    val slave = out.resolve("slave.c")
    Files.writeString(slave, "#include \"slave_stack.h\"\nstruct slave one;\n")
    val objects = (sources :+ slave.toString).map { source =>
      val target = out.resolve(s"${source.replace('/', '-')}.o").toString
      val flags = "-mcpu=cortex-m3 -mthumb -Os -std=c99 -ffreestanding -Wall -Wextra -Werror".split(' ').toSeq
      val (code, text) = run(
        (("arm-none-eabi-gcc" +: flags) ++
          Seq("-Igenerated", "-Isrc/firmware/slave", "-c", source, "-o", target)): _*
      )
      assert(code == 0, text)
      target
    }
    val (code, text) = run("arm-none-eabi-size" +: "-t" +: objects: _*)
    assert(code == 0, text)
    val Seq(codeBytes, data, zeroed) =
      text.linesIterator.toSeq.last.trim.split("\\s+").take(3).map(_.toInt).toSeq
    info(s"$codeBytes bytes of code and constants, ${data + zeroed} of data")
    assert(codeBytes <= 16 * 1024 && codeBytes > 1000, text)
    assert(data + zeroed <= 2 * 1024 && zeroed > 100, text)
  }
}
