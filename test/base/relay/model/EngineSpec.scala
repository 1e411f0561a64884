package flyframe.relay.model

import flyframe.can.CanFrame
import flyframe.registers.{CanRegisters, RingRegisters}
import flyframe.relay._
import org.scalatest.flatspec.AnyFlatSpec
import scala.collection.mutable.ArrayBuffer
import scala.util.Random

/** The engine, against the same ring of golden models, core cycle by core cycle. */
class EngineSpec extends AnyFlatSpec {
  private val UsLong = 1000000L

  /** What happens in a ring to which random things happen: every frame delivered, with node and cycle, and
    * the registers of all nodes in between.
    */
  private def story(
      make: RelayRingSetting => RelayRing,
      seed: Long,
      us: Int,
      isQuiet: Boolean
  ): Seq[String] = {
    val random = new Random(seed)
    val count  = 2 + random.nextInt(4)
    val setting = RelayRingSetting(
      IndexedSeq.fill(count)(40000L + random.nextInt(if (random.nextInt(4) == 0) 50000000 else 2000000)),
      IndexedSeq.fill(count)(19990L + random.nextInt(21)),
      linkBit = 25 + random.nextInt(10)
    )
    val ring = make(setting)
    val log  = ArrayBuffer.empty[String]
    for (n <- 0 until count) {
      ring.node(n).delivers = (header, frame) => log += s"$n ${ring.node(n).cycleNow} $header $frame"
      RingHost.start(ring, n, address = n + 1, confirmUs = 300 + random.nextInt(300))
      for (port <- 0 to 1) ring.at(random.nextInt(20) * UsLong)(ring.setUp(n, port, isUp = true))
    }
    def any(at: Long): Unit = {
      val n    = random.nextInt(count)
      val port = random.nextInt(2)
      random.nextInt(if (isQuiet) 30 else 60) match {
        case 0 | 1 =>
          ring.at(at)(ring.setUp(n, port, isUp = false))
          ring.at(at + (1 + random.nextInt(500)) * UsLong)(ring.setUp(n, port, isUp = true))
        case 2 =>
          ring.at(at)(ring.setDark(n, port, isDark = true))
          ring.at(at + random.nextInt(300) * UsLong)(ring.setDark(n, port, isDark = false))
        case 3 | 4 | 5 => ring.at(at)(ring.flip(n, port))
        case 6         => ring.at(at)(ring.access(n)(RingHost.restart(_, random.nextInt(128))))
        case _ =>
          val slot  = random.nextInt(16)
          val frame = RandomFrames.next(random)
          ring.at(at)(ring.access(n) { h =>
            if ((RingHost.map(h, CanRegisters.Requests) >> slot & 1) == 0) RingHost.request(h, slot, frame)
          })
      }
    }
    for (_ <- 0 until us / (if (isQuiet) 40 else 8))
      any(random.nextInt(us) * UsLong + random.nextInt(1000000))
    for (part <- 1 to 20) {
      ring.runTo(us * UsLong * part / 20)
      for (n <- 0 until count) ring.access(n) { h =>
        log += s"$part $n ${h.read(RingRegisters.State, 2)} ${h.read(0x20, 32)} ${h.read(0x118, 0x28)} " +
          s"${h.read(RingRegisters.Distances, 16)} ${ring.node(n).transits.map(_.most)}"
      }
    }
    log.toSeq
  }

  private def compare(seed: Long, us: Int, isQuiet: Boolean) = {
    val exact  = story(new RelayBitRing(_), seed, us, isQuiet)
    val engine = story(new RelayEngine(_), seed, us, isQuiet)
    val wrong  = exact.zipAll(engine, "-", "-").indexWhere(p => p._1 != p._2)
    assert(
      wrong < 0,
      s"seed $seed, line $wrong:\n" +
        Seq(exact, engine).map(_.slice(wrong - 3, wrong + 3).mkString("\n")).mkString("\n---\n")
    )
    exact.size
  }

  "The engine" should "do the same in the same cycles as the ring bit by bit, at any load" in {
    val lines = for (seed <- 1 to 8) yield compare(seed, us = 4000, isQuiet = false)
    assert(lines.sum > 700)
    info(s"${lines.sum} frames and states")
  }

  it should "do the same with time between what happens" in {
    for (seed <- 101 to 104) compare(seed, us = 6000, isQuiet = true)
  }
}

/** Random frames. */
object RandomFrames {
  def next(random: Random): CanFrame = {
    val extended = random.nextBoolean()
    val remote   = random.nextInt(6) == 0
    val dlc      = random.nextInt(10)
    // Some are full of stuff bits.
    val fill = random.nextInt(4) match {
      case 0 => 0
      case 1 => 0xff
      case _ => -1
    }
    val data = Seq.fill(CanFrame.size(dlc, remote))(if (fill < 0) random.nextInt(256) else fill)
    CanFrame(random.nextInt(1 << (if (extended) 29 else 11)), extended, remote, dlc, data)
  }
}
