package flyframe.model

import org.scalatest.flatspec.AnyFlatSpec
import flyframe.params.EscParams

class LineModelSpec extends AnyFlatSpec {
  private def refused(slaves: EscModel*): String =
    intercept[IllegalArgumentException](new LineModel(slaves)).getMessage

  "A line" should "have slaves, each with two ports and more" in {
    assert(refused().endsWith("A line has 0 slaves but must have 1 or more."))
    val (two, one) = (new EscModel(EscParams()), new EscModel(EscParams(ports = 1)))
    assert(refused(two, one).endsWith("ports is 1 but must be 2 to 4 for a slave of a line."))
    new LineModel(Seq(two))
  }
}
