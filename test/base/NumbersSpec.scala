package flyframe

import org.scalatest.flatspec.AnyFlatSpec

class NumbersSpec extends AnyFlatSpec {
  private def parse(arguments: String*) = Numbers.parse(arguments, Seq("FRAMES", "SEED"))

  "Numbers of a long run" should "be taken in their order" in assert(parse("7", "1") == Right(Seq(7L, 1L)))

  they should "be refused in one sentence that names what is wrong" in {
    assert(parse("7") == Left("FRAMES and SEED must be given, but there are 1 arguments."))
    for (text <- Seq("x", "", "0", "-3", "1.5", "99999999999999999999"))
      assert(parse("7", text) == Left(s"SEED must be a whole number from 1 on, but is '$text'."))
  }
}
