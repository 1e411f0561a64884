package flyframe.relay

import flyframe.Tier
import flyframe.can.CanFrame
import flyframe.params.CanParams
import flyframe.registers.{CanRegisters, RingRegisters}
import org.scalatest.flatspec.AnyFlatSpec
import scala.collection.mutable
import scala.collection.mutable.ArrayBuffer
import scala.util.Random

/** A node in RTL beside the model, with links full of frames of others, of which many come twice, late, with
  * gaps, from new lives, broken, or with the node's own address. OwnFramesSpec has its own frames.
  */
class RelayAgainstModelSpec extends AnyFlatSpec {
  private val tier =
    Tier("Relay mode in RTL against the model", "core cycles", test = 200000, soak = 20000000)
  private val Own  = 23
  private val Run  = 200000
  private val port = CanRegisters.PortStarts(0)

  /** What comes in at a port. */
  private class Traffic(random: Random, bit: Int, newest: mutable.Map[Int, Int]) {
    private val levels = mutable.Queue.empty[Boolean]
    private var level  = true
    private var left   = 0.0
    private val ppm    = random.nextInt(1001) - 500

    private def header() = {
      val source = if (random.nextInt(8) == 0) random.nextInt(128) else 1 + random.nextInt(6)
      val behind = random.nextInt(6) match {
        case 0 => random.nextInt(1 << 14)
        case 1 => random.nextInt(40)
        case _ => random.nextInt(4)
      }
      newest(source) = newest.getOrElse(source, random.nextInt(1 << 14)) +
        (if (random.nextInt(4) == 0) random.nextInt(40) else random.nextInt(3)) & 0x3fff
      val kind     = if (random.nextInt(40) == 0) 1 else if (random.nextInt(30) == 0) random.nextInt(4) else 0
      val sequence = if (kind == 1) random.nextInt(3) else newest(source) - behind & 0x3fff
      val hops     = if (random.nextInt(20) == 0) random.nextInt(2) else random.nextInt(256)
      LinkHeader(kind, random.nextInt(2), source, sequence, hops)
    }

    private def frame() = {
      val extended = random.nextBoolean()
      val remote   = random.nextInt(6) == 0
      val dlc      = random.nextInt(16)
      val id       = if (extended) random.nextInt(1 << 29) else random.nextInt(1 << 11)
      CanFrame(id, extended, remote, dlc, Seq.fill(if (remote) 0 else dlc min 8)(random.nextInt(256)))
    }

    def next(): Boolean = {
      if (left < 1) {
        if (levels.isEmpty) {
          val h    = header()
          val good = LinkFrame.levels(h, LinkBody.of(h, frame())).toSeq
          levels ++= (random.nextInt(25) match {
            case 0 => good.updated(random.nextInt(good.size), random.nextBoolean())
            case 1 => good.take(random.nextInt(good.size)) ++ Seq.fill(7)(false)
            case _ => good
          })
          levels ++= Seq.fill(7 + random.nextInt(if (random.nextBoolean()) 2 else 400))(true)
        }
        level = levels.dequeue()
        left += bit * (1 + ppm / 1e6)
      }
      left -= 1
      level
    }
  }

  "FR-45 to FR-62, RB-06, RB-17, RB-23, RB-26: a node in RTL" should
    "send and receive what the model does, under any traffic" in {
      val seen = mutable.Map.empty[String, Long].withDefaultValue(0L)
      tier.run("all", tier.size, Some(1L)) {
        for (run <- 0L until tier.size by Run) {
          val p = CanParams(coreClockMhz = if (run / Run % 2 == 0) 50 else 100)
          RelaySimulation(rtl => new Pair(rtl, p, new Random(run + 1)).run(run, seen), p)
        }
      }
      println(seen.toSeq.sorted.mkString("Relay mode: ", ", ", "."))
      for (what <- Seq("received", "doubles", "filtered")) assert(seen(what) > 0, what)
    }

  private class Pair(rtl: RelayUnderTest, p: CanParams, random: Random) {
    private val bit     = LinkTiming.least(p.coreClockMhz) // which one out of reset has (RB-26)
    private val model   = new RelayModel(p)
    private val newest  = mutable.Map.empty[Int, Int]
    private val traffic = Seq.fill(2)(new Traffic(random, bit, newest))
    private val up      = Array(true, true)
    private var isFull  = false                            // traffic comes
    private val frames  = Seq.fill(2)(ArrayBuffer.empty[Seq[Int]])
    private var run     = 0L
    rtl.passes = () => cycle()

    private def cycle(): Unit = {
      if (isFull) for (q <- 0 to 1) if (random.nextInt(if (up(q)) 60000 else 3000) == 0) up(q) = !up(q)
      val heard = traffic.map(t => !isFull || t.next())
      for (q <- 0 to 1)
        assert(rtl.level(q) == model.level(q), s"cycle ${rtl.cycle} of run $run, port $q")
      rtl.step((heard(0), heard(1)), (up(0), up(1)))
      model.step((heard(0), heard(1)), (up(0), up(1)))
    }

    private def write(address: Int, bytes: Int*): Unit = {
      rtl.write(address, bytes)
      model.write(address, bytes)
    }

    /** All that has been received. */
    private def drain(): Unit = for ((node, to) <- Seq(rtl, model).zip(frames))
      while (node.read(port + CanRegisters.RxLevel, 1).head > 0) {
        to += node.read(port + CanRegisters.RxFrame, 16)
        node.write(port + CanRegisters.RxRelease, Seq(0))
      }

    private def setUp(): Unit = {
      write(RingRegisters.Address, Own)
      write(RingRegisters.Confirm, 12, 0, 1, RingRegisters.UpMsReset, random.nextInt(128))
      for (entry <- 0 until 16 if entry < 4) {
        val mask  = Seq.fill(4)(random.nextInt(256) & random.nextInt(256) & (if (entry == 3) 0 else 0xff))
        val value = Seq.fill(4)(random.nextInt(256)).updated(3, random.nextInt(256) | 0x20)
        write(CanRegisters.FilterStarts(0) + 8 * entry, value ++ mask.updated(3, mask(3) & 0xdf): _*)
      }
      while (rtl.cycle % bit != 8) cycle() // whoever is switched on between two ends of bits
      write(RingRegisters.Control, 1 << RingRegisters.Relay)
    }

    def run(number: Long, seen: mutable.Map[String, Long]): Unit = {
      run = number
      setUp()
      isFull = true
      for (i <- 0 until Run) {
        cycle()
        if (i % 5000 == 0) drain()
      }
      isFull = false
      for (_ <- 0 until 20000) cycle()
      drain()
      assert(frames(0) == frames(1), s"frames received in run $number")
      for (
        (from, count) <- Seq(0x20 -> 32, RingRegisters.Distances -> 256, port + CanRegisters.Counters -> 8)
      )
        assert(
          rtl.read(from, count) == model.read(from, count),
          f"registers from 0x$from%04x on, run $number"
        )
      assert(
        (rtl.read(RingRegisters.State, 1).head & 0x1b) == (model.read(RingRegisters.State, 1).head & 0x1b)
      )
      seen("received") += frames(0).size
      seen("filtered") += frames(0).count(_(5) != 3)
      seen("doubles") += model.node.counters(RelayCounter.Doubles)
    }
  }
}
