package flyframe.server

import java.nio.file.Files
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.Directory

class ExpectedSpec extends AnyFlatSpec {
  private def read(text: String): Either[String, Expected] =
    Directory(d => Expected.read(Files.writeString(d.resolve("list"), text)))
  private def slave(rest: String) = s"""{"masters": [{"id": 1, "expected": [$rest]}]}"""

  "SRV-20: a list of slaves" should "give node IDs, labels and zones" in {
    val text = """{"masters": [
      {"id": 1, "expected": [{"node": 7, "label": "K1", "zone": "Kitchen"}, {"node": 3}]},
      {"id": 2, "expected": []}]}"""
    val list = read(text).fold(fail(_), identity)
    assert(
      list.masters == Map(
        1 -> Vector(ExpectedSlave(7, "K1", "Kitchen"), ExpectedSlave(3, "1B", "")),
        2 -> Vector()
      )
    )
    assert(read(slave("""{"node": 0}, {"node": 5}, {"node": 0}""")).isRight, "ordinary slaves")
    assert((0 to 2).map(list.label(1, _)) == Seq("K1", "1B", "2A") && list.label(9, 3) == "2B")
  }

  "SRV-09: labels without a list" should "count pairs" in {
    assert((0 to 5).map(Expected.label) == Seq("1A", "1B", "2A", "2B", "3A", "3B"))
    assert(Expected.label(63) == "32B")
  }

  "SRV-18: a list that is wrong" should "be refused in one sentence" in {
    val wrong = Seq(
      ""                                                                        -> "not JSON",
      "[]"                                                                      -> "must be",
      "{}"                                                                      -> "must be",
      """{"masters": [{"id": 1}]}"""                                            -> "must be",
      """{"masters": [{"id": 70000, "expected": []}]}"""                        -> "id is 70000",
      """{"masters": [{"id": 1.5, "expected": []}]}"""                          -> "id is 1.5",
      """{"masters": [{"id": 1, "expected": []}, {"id": 1, "expected": []}]}""" -> "master 1 is there twice",
      s"""{"masters": [${(1 to 9)
          .map(i => s"""{"id": $i, "expected": []}""")
          .mkString(",")}]}"""                                      -> "more than 8",
      slave("""{"label": "x"}""")                                   -> "must be",
      slave("""{"node": -1}""")                                     -> "node is -1",
      slave("""{"node": 65535}""")                                  -> "node is 65535",
      slave("""{"node": 1, "lable": "x"}""")                        -> "unknown field 'lable'",
      slave("""{"node": 1}, {"node": 1}""")                         -> "the node 1 twice",
      slave("""{"node": 1, "label": "1B"}, {"node": 2}""")          -> "the label 1B twice",
      slave((1 to 256).map(i => s"""{"node": $i}""").mkString(",")) -> "more than 255"
    )
    for ((text, says) <- wrong) {
      val sentence = read(text).fold(identity, _ => fail(s"$text was taken"))
      assert(sentence.endsWith(".") && !sentence.contains('\n') && sentence.contains(says), sentence)
    }
  }
}
