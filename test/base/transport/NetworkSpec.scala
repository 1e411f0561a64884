package flyframe.transport

import flyframe.{Numbers, Tier}
import org.scalatest.flatspec.AnyFlatSpec
import scala.concurrent.duration.Duration
import scala.concurrent.ExecutionContext.Implicits.global
import scala.concurrent.{Await, Future}
import scala.util.Random

/** Sixteen nodes on a bus on which much goes wrong; `make transport-campaign` does it for longer. */
class NetworkSpec extends AnyFlatSpec {
  private val tier =
    Tier("Transport of a bus with faults, model and C mixed", "messages", test = 300, soak = 100000)
  private val all = Faults(lost = 0.3, doubled = 0.1, late = 0.1, restarts = 0.01, breaks = 0.01)

  private val mixes = Seq[(String, Int => Boolean)](
    ("C and model mixed", _ % 2 == 0),
    ("the model", _ => false),
    ("C", _ => true)
  )
  private val part = tier.share(1, mixes.size.toLong)

  for (((name, inC), seed) <- mixes.zip(1L to 3L))
    s"TP-30, TP-13: $name" should "deliver each message exactly once, or say that it is not confirmed" in
      info(tier.run(name, part, Some(seed)) {
        val text = new Network(16, seed, all, inC).run(part.toInt)
        if (Tier.isSoak) assert(text.contains(s"; ${Sizes.ProcessData} pipes in use"), text)
        text
      })

  "TP-30, TB-28 to TB-30: on a slow ring each message" should "be delivered once, or be not confirmed" in
    info(new Network(16, 6, all, _ % 2 == 0, kbps = 20).run(100))

  "TP-05, TP-30: without faults all messages" should "be delivered, urgent ones faster" in {
    val text = new Network(16, 4, Faults(), _ % 2 == 0).run(100)
    assert(text.contains(" 0 not confirmed, 0 lost by a restart, 0 repeats"), text)
    info(text)
  }

  "TP-04: C" should "understand the model, and the model C" in {
    for (first <- 0 to 1) new Network(2, 5, Faults(lost = 0.1), _ == first).run(50)
  }
}

/** `make transport-campaign`: messages on a bus of 16 nodes, C and model mixed. */
object TransportCampaign {
  private val Part = 2500L

  def main(args: Array[String]): Unit = {
    val Seq(messages, seed) = Numbers.of(args.toSeq, "MESSAGES", "SEED")
    val random              = new Random(seed)
    val start               = System.nanoTime
    // In parts, so that a fault is found again quickly by the seed of its part.
    val parts = for (from <- 0L until messages by Part) yield {
      def chance(most: Double) = random.nextDouble() * most
      val faults               = Faults(chance(0.3), chance(0.3), chance(0.3), chance(0.01), chance(0.01))
      Future {
        val size = messages - from min Part
        val text = new Network(16, seed + from / Part, faults, _ % 2 == 0).run(size.toInt)
        println(s"$size messages from $from on, $faults: $text")
      }
    }
    Await.result(Future.sequence(parts), Duration.Inf)
    println(s"$messages messages, seeds from $seed, in ${(System.nanoTime - start) / 1000000000} s")
    sys.exit()
  }
}
