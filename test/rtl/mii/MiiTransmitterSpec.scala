package flyframe.mii

import chiseltest._
import flyframe.Simulation
import org.scalatest.flatspec.AnyFlatSpec

/** The transmitter alone: how it ends frames (B-04). */
class MiiTransmitterSpec extends AnyFlatSpec with ChiselScalatestTester {
  private val preamble = Seq(5, 5, 5, 0xd)
  private val data     = Seq(1, 2, 3, 4, 5, 6, 7)

  /** What leaves for a frame of `nibbles`, of which those behind the first `start` are payload; ticks come
    * every third cycle.
    *
    * @param sfd
    *   the last of those `start` is that of the SFD
    */
  private def send(
      nibbles: Seq[Int],
      start: Int,
      bad: Boolean,
      odd: Boolean,
      crcGood: Boolean,
      sfd: Boolean = true
  ): Seq[Int] = {
    var sent = Vector.empty[Int]
    test(new MiiTransmitter).withAnnotations(Simulation.annotations(this, "transmitter")) { dut =>
      dut.txEn.expect(false)
      for ((nibble, i) <- (nibbles.map(Option(_)) ++ Seq.fill(6)(None)).zipWithIndex) {
        val end = i == nibbles.size
        dut.in.valid.poke(nibble.isDefined)
        dut.in.payload.poke(if (end) sfd else nibble.isDefined && i >= start)
        dut.in.data.poke(nibble.getOrElse(0xa))
        dut.in.end.poke(end)
        // Without `end` these mean nothing.
        dut.in.bad.poke(if (end) bad else i % 2 == 0)
        dut.in.odd.poke(if (end) odd else i % 3 == 0)
        dut.in.crcGood.poke(if (end) crcGood else i % 5 < 2)
        for (tick <- Seq(false, true, false)) {
          val before = (dut.txEn.peekBoolean(), dut.txd.peekInt())
          dut.tick.poke(tick)
          dut.clock.step()
          val now = (dut.txEn.peekBoolean(), dut.txd.peekInt())
          if (!tick) assert(now == before, "pins change with the tick only")
          else if (now._1) {
            assert(sent.size == i, "no gap, and no delay beyond the tick")
            sent :+= now._2.toInt
          }
        }
      }
      dut.txEn.expect(false)
    }
    sent
  }
  private def frame(payload: Seq[Int], bad: Boolean, crcGood: Boolean) =
    send(preamble ++ payload, preamble.size, bad, payload.size % 2 == 1, crcGood)

  "PHY-02: a good frame" should "leave as it is" in
    assert(frame(data.take(6), bad = false, crcGood = true) == preamble ++ data.take(6))
  "OP-10: a dribble nibble of a good frame" should "leave, too" in
    assert(frame(data, bad = false, crcGood = true) == preamble ++ data)

  "B-04, ERR-07: a bad frame" should "get the extra nibble" in
    assert(frame(data.take(6), bad = true, crcGood = false) == preamble ++ data.take(6) :+ 0)
  "B-04, ERR-06: a bad frame whose FCS is right" should "get a byte behind it and the extra nibble" in
    assert(frame(data.take(6), bad = true, crcGood = true) == preamble ++ data.take(6) ++ Seq(0, 0, 0))
  "B-04, ERR-09: a bad frame with an odd nibble" should "leave as it is: it is marked already" in
    assert(frame(data, bad = true, crcGood = false) == preamble ++ data)
  "B-04: a bad frame with an odd nibble behind a right FCS" should "get two nibbles" in
    assert(frame(data, bad = true, crcGood = true) == preamble ++ data ++ Seq(0, 0))
  "B-04: a bad frame that ends with the SFD" should "get one nibble" in
    assert(frame(Nil, bad = true, crcGood = false) == preamble :+ 0)
  "B-04: a bad frame that ends in the preamble" should "get an SFD and one nibble" in {
    for (start <- 1 to 3; crcGood <- Seq(false, true); odd <- Seq(false, true)) {
      val sent = send(Seq.fill(start)(5), start, bad = true, odd, crcGood, sfd = false)
      assert(sent == Seq.fill(start)(5) ++ Seq(0xd, 0))
    }
  }
}
