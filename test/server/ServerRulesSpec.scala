package flyframe.server

import java.nio.file.{Files, Path}
import org.scalatest.flatspec.AnyFlatSpec
import scala.jdk.CollectionConverters._

class ServerRulesSpec extends AnyFlatSpec {
  private def found(text: String, pattern: String): Set[Int] =
    pattern.r.findAllMatchIn(text).map(_.group(1).toInt).toSet

  "Every rule of the server" should "have a test with its ID in the name" in {
    val rules =
      found(Files.readString(Path.of("docs/behaviour.md")), "(?m)^- \\*\\*SRV-(\\d+)\\*\\*").filter(_ >= 5)
    val tests = Files.list(Path.of("test/server")).iterator.asScala.map(Files.readString(_)).mkString
    assert(rules == (5 to 19).toSet)
    assert(rules -- found(tests, "\"SRV-(\\d+): ") == Set.empty)
  }
}
