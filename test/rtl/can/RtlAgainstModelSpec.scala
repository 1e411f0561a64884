package flyframe.can

import flyframe.{Numbers, Tier}
import org.scalatest.flatspec.AnyFlatSpec

/** A port in RTL against the golden model on random buses. */
class RtlAgainstModelSpec extends AnyFlatSpec {
  private val tier = Tier("CAN RTL against the model", "frames", test = 50000, soak = 1000000)

  "CAN-01 to CAN-46: the RTL" should "do what the model does, in each cycle" in
    tier.run("all", tier.size, Some(1L)) {
      val (frames, buses, wrong) = RandomPort.run(tier.size, first = 1)
      info(s"$frames frames on $buses buses")
      assert(wrong.isEmpty)
    }
}

/** `make can-fuzz`: how many frames, and the seed of the first bus. */
object CanFuzz {
  def main(arguments: Array[String]): Unit = {
    val Seq(wanted, first)     = Numbers.of(arguments.toSeq, "FRAMES", "SEED")
    val (frames, buses, wrong) = RandomPort.run(wanted, first)
    println(s"$frames frames on $buses buses, seeds from $first; ${wrong.size} buses wrong")
    wrong.foreach(println(_))
    sys.exit(if (wrong.isEmpty) 0 else 1)
  }
}
