package flyframe.ethernet

import scala.util.Random
import chiseltest._
import flyframe.SharedSimulation
import flyframe.model.Fcs
import org.scalatest.flatspec.AnyFlatSpec

class EthernetSenderSpec extends AnyFlatSpec with SharedSimulation {

  /** What leaves: nibbles, payload nibbles, ended bad; and the slots since the end of the one before. */
  private case class Sent(preamble: Vector[Int], payload: Vector[Int], bad: Boolean, gap: Int)

  /** Gives the frames' bytes, one after the other; `missing`: from this byte on the last frame has no more
    * for a while.
    */
  private def send(
      dut: EthernetSender,
      frames: Seq[Seq[Int]],
      missing: Option[(Int, Int)] = None
  ): Seq[Sent] = {
    var sent     = Vector.empty[Sent]
    var preamble = Vector.empty[Int]
    var payload  = Vector.empty[Int]
    var gap      = 0
    var frame    = 0
    var byte     = 0
    var idle     = 0
    while (idle < 200) {
      val stopped = missing.exists { case (f, b) => f == frame && byte == b && idle < 30 }
      val gives   = frame < frames.size && !stopped
      dut.bytes.valid.poke(gives)
      if (gives) {
        dut.bytes.bits.data.poke(frames(frame)(byte))
        dut.bytes.bits.last.poke(byte == frames(frame).size - 1)
      }
      dut.step.poke(true)
      if (gives && dut.bytes.ready.peekBoolean()) {
        byte += 1
        if (byte == frames(frame).size) {
          byte = 0
          frame += 1
        }
      }
      dut.clock.step()
      dut.step.poke(false)
      dut.bytes.valid.poke(false)
      dut.clock.step(2)
      if (dut.out.valid.peekBoolean()) {
        idle = 0
        val data = dut.out.data.peekInt().toInt
        assert(!dut.out.end.peekBoolean())
        if (dut.out.payload.peekBoolean()) payload :+= data else preamble :+= data
      } else if (dut.out.end.peekBoolean()) {
        assert(dut.out.payload.peekBoolean() && preamble.nonEmpty)
        sent :+= Sent(preamble, payload, dut.out.bad.peekBoolean(), gap)
        assert(dut.out.odd.peekBoolean() == (payload.size % 2 == 1))
        preamble = Vector.empty
        payload = Vector.empty
        gap = 1
      } else {
        assert(preamble.isEmpty, "no hole in a frame")
        gap += 1
        idle += 1
      }
    }
    assert(frame == frames.size)
    sent
  }
  private def wire(bytes: Seq[Int]) = {
    val padded = bytes.padTo(60, 0)
    (padded ++ Fcs.of(padded)).flatMap(b => Seq(b & 0xf, b >> 4))
  }

  together("a slot every third cycle", new EthernetSender)(
    "MST-01: frames of any length leave with preamble, padding, FCS and the minimum gap" -> { dut =>
      val random = new Random(1)
      val frames = Seq(1, 59, 60, 61, 64, 200, 14, 1514, 60).map(n => Seq.fill(n)(random.nextInt(256)))
      val sent   = send(dut, frames)
      assert(sent.size == frames.size && sent.forall(!_.bad))
      for ((s, f) <- sent.zip(frames)) assert(s.preamble == Vector.fill(15)(5) :+ 0xd && s.payload == wire(f))
      for (s      <- sent.tail) assert(s.gap >= 24 && s.gap <= 26)
    },
    "MST-01: a frame whose bytes come too late leaves bad, the next one is good" -> { dut =>
      val frames = Seq(Seq.tabulate(80)(_ & 0xff), Seq.tabulate(70)(i => 255 - i))
      for (at <- Seq(1, 20, 61, 79)) {
        val Seq(cut, good) = send(dut, frames, Some(0 -> at))
        assert(cut.bad && cut.payload.size == 2 * at + 1)
        assert(!good.bad && good.payload == wire(frames(1)))
      }
    }
  )
}
