package flyframe.model

import scala.util.Random
import org.scalatest.flatspec.AnyFlatSpec

/** The model's receiver behind its transmitter: what the next controller makes of a bad frame. */
class WireFrameSpec extends AnyFlatSpec {
  private val random = new Random(1)

  "B-04, ERR-08: a bad frame of any length and FCS" should "be marked and counted as such" in {
    for (size <- Seq(0, 1, 2, 7, 59, 60, 200); right <- Seq(false, true); odd <- 0 to 1; _ <- 1 to 20) {
      val bytes   = Seq.fill(size)(random.nextInt(256))
      val fcs     = Fcs.of(bytes).map(f => if (right) f else f ^ (1 + random.nextInt(255)))
      val nibbles = (bytes ++ fcs).flatMap(b => Seq(b & 0xf, b >> 4)) ++ Seq.fill(odd)(random.nextInt(16))
      val sent    = Transmitter.bad(15, hasSfd = true, nibbles.toVector)
      assert(sent.payload.startsWith(nibbles), "what has left stays")
      assert(sent.payload.size % 2 == 1 && !sent.good)
      val again = Receiver.receive(sent.onWire)
      assert(again.verdict == Verdict.Forwarded)
      assert(Transmitter.bad(again.preamble, again.hasSfd, again.payload) == sent, "and stays as it is")
    }
  }
  "B-04: a frame that ends in the preamble" should "be marked by an SFD and a nibble" in {
    for (preamble <- 1 to 20) {
      val received = Receiver.receive(WireFrame(Vector.fill(preamble)(Symbol(5))))
      assert(received.verdict == Verdict.Invalid)
      val sent = Transmitter.bad(received.preamble, received.hasSfd, received.payload)
      assert(sent == SentFrame(preamble, Vector(0)))
      assert(Receiver.receive(sent.onWire).verdict == Verdict.Forwarded)
    }
  }
  "B-04: no byte behind a right FCS" should "leave it right" in {
    val bytes = Seq.fill(60)(random.nextInt(256))
    for (behind <- 0 to 255) assert(!Fcs.good(bytes ++ Fcs.of(bytes) :+ behind))
  }
  "B-02: a faulty first nibble" should "leave as one of preamble" in {
    for (symbol <- Seq(Symbol(0), Symbol(7), Symbol(0xd, error = true), Symbol(5, error = true))) {
      val received = Receiver.receive(WireFrame(symbol +: Vector.fill(20)(Symbol(5))))
      assert(!received.hasSfd && received.preamble == 1 && received.verdict == Verdict.Invalid)
    }
  }
}
