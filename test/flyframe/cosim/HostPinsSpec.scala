package flyframe.cosim

import org.scalatest.flatspec.AnyFlatSpec
import flyframe.{HostPinSets, Numbers, Tier}
import flyframe.params.EscParams

/** Hosts at the pins of every interface, as their buses have them, beside a master's frames: what the driver
  * of the firmware needs, and accesses that a host must not make. `make hosts` takes any number of them.
  */
class HostPinsSpec extends AnyFlatSpec {
  private val sets    = if (Tier.isSoak) HostPinSets.all else HostPinSets.short
  private val harness = new Harness("hosts", sets, "COSIM_OPT=-O1")
  private val tier    = Tier("Hosts at their pins, good and bad", "accesses", test = 2000, soak = 1700000)
  private val Seed    = 1L

  for (p <- sets) {
    val accesses = tier.share(1, sets.size)
    s"B-114 to B-117, ERR-11: ${p.preset}" should s"take $accesses accesses" in {
      val text = tier.run(p.preset, accesses, Some(Seed))(harness.hosts(p, accesses, Seed))
      assert(text.contains(s"conformant; $accesses accesses at random"), text)
    }
  }
}

/** `make hosts`: arguments are the number of accesses, the seed, and the sets, without which all are run. */
object HostPins {
  def main(arguments: Array[String]): Unit = {
    val Seq(accesses, seed) = Numbers.of(arguments.toSeq.take(2), "ACCESSES", "SEED")
    val named               = arguments.drop(2).toSeq
    val sets: Seq[EscParams] =
      if (named.isEmpty) HostPinSets.all else HostPinSets.all.filter(p => named.contains(p.preset))
    if (sets.isEmpty) {
      Console.err.println(s"The sets are ${HostPinSets.all.map(_.preset).mkString(", ")}.")
      sys.exit(2)
    }
    val harness = new Harness("hosts", sets)
    for (p <- sets) print(harness.hosts(p, accesses, seed))
  }
}
