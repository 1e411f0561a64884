package flyframe.server

import java.nio.file.Files
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.Directory

class KeysSpec extends AnyFlatSpec {
  private val (one, two) = ("00ff" * 6 + "80Ab0102", "1234" * 8) // 16 bytes each
  private def read(text: String): Either[String, Keys] =
    Directory(d => Keys.read(Files.writeString(d.resolve("key"), text)))
  private def last(keys: Keys, master: Int) = keys.of(master).map(_.toSeq.takeRight(4))

  "SRV-12: a key file with one key" should "be for all masters, with or without an end of line" in {
    for (end <- Seq("", "\n", "\r\n"); master <- Seq(0, 1, 0xffff)) {
      val keys = read(one + end).fold(fail(_), identity)
      assert(last(keys, master).contains(Seq(0x80, 0xab, 1, 2).map(_.toByte)))
      assert(keys.of(master).map(_.length).contains(16))
    }
  }

  "SRV-12: a key file with masters" should "have no key for others" in {
    val keys = read(s"1 $one\n65535\t$two\n").fold(fail(_), identity)
    assert(last(keys, 1).contains(Seq(0x80, 0xab, 1, 2).map(_.toByte)))
    assert(last(keys, 65535).contains(Seq(0x12, 0x34, 0x12, 0x34).map(_.toByte)))
    assert(keys.of(2).isEmpty && keys.of(0).isEmpty)
  }

  "SRV-18: a key file that is wrong" should "be refused in one sentence that does not show it" in {
    val wrong = Seq(
      "",
      "00" * 15,
      "00" * 17,
      "0g" * 16,
      s"$one\n$two",
      s" $one",
      s"70000 $one",
      s"1 $one\n1 $two",
      s"1 $one\n$two",
      s"-1 $one"
    )
    for (text <- wrong) {
      val sentence = read(text).fold(identity, _ => fail(s"'$text' was taken"))
      assert(sentence.endsWith(".") && sentence.contains("32 hexadecimal digits"))
      for (secret <- Seq(one, two, "0g0g", "0000")) assert(!sentence.contains(secret), "shows the key")
    }
  }
}
