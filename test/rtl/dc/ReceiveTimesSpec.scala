package flyframe.dc

import scala.util.Random
import chisel3._
import chiseltest._
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.SharedSimulation
import flyframe.model.MeanWay

/** The clock and the stamps together, as the unit connects them. */
class ClockAndTimes(val ports: Int, val periodNs: Int, val bytes: Int, val lanes: Int, val means: Boolean)
    extends Module {
  private val local  = Module(new LocalClock(periodNs, bytes, bytes))
  private val stamps = Module(new ReceiveTimes(ports, periodNs, bytes, lanes, means))
  stamps.timeByte := local.timeByte
  stamps.place    := local.place
  stamps.last     := local.last
  local.more      := 0.S
  val begins   = IO(chiselTypeOf(stamps.begins))
  val waited   = IO(chiselTypeOf(stamps.waited))
  val keep     = IO(chiselTypeOf(stamps.keep))
  val absent   = IO(chiselTypeOf(stamps.absent))
  val readWord = IO(chiselTypeOf(stamps.readWord))
  val data     = IO(chiselTypeOf(stamps.data))
  for (
    (inner, outer) <- Seq(
      stamps.begins -> begins,
      stamps.waited -> waited,
      stamps.keep   -> keep,
      stamps.absent -> absent
    )
  )
    inner         := outer
  stamps.readWord := readWord
  data            := stamps.data
}

/** Receive times alone, against the numbers of the cycles in which frames have begun. */
class ReceiveTimesSpec extends AnyFlatSpec with SharedSimulation {
  private class Bench(dut: ClockAndTimes) {
    private val sources = dut.ports + 1
    val unit            = dut.ports
    var cycle           = 0L
    dut.clock.setTimeout(0)
    dut.reset.poke(true.B)
    for (p <- dut.begins ++ dut.keep ++ dut.absent) p.poke(false.B)
    dut.clock.step()
    dut.reset.poke(false.B)

    def step(begins: Set[Int] = Set.empty, keep: Set[Int] = Set.empty): Unit = {
      for (i <- 0 until sources) {
        dut.begins(i).poke(begins(i))
        dut.keep(i).poke(keep(i))
      }
      dut.clock.step()
      cycle += 1
    }
    def idle(cycles: Int): Unit = for (_ <- 1 to cycles) step()

    /** A frame begins at these sources; its time. */
    def begin(at: Int*): BigInt = {
      val now = BigInt(cycle) * dut.periodNs
      if (at.contains(0)) {
        first = Some(cycle)
        ways.foreach(_.begins())
      }
      val late = at.find(port => dut.means && port > 0 && port < dut.ports).fold(BigInt(0))(lateAt)
      step(begins = at.toSet)
      now - late
    }

    private var first = Option.empty[Long]
    private val ways  = Seq.fill(4)(new MeanWay)

    /** By how much a frame comes late to `port` now, ns (B-100). */
    private def lateAt(port: Int): BigInt =
      first.fold(BigInt(0))(since => (BigInt(ways(port).late(cycle - since)) * dut.periodNs) >> 6)
    def noLink(): Unit = {
      for (pin <- dut.absent) pin.poke(true.B)
      step()
      for (pin <- dut.absent) pin.poke(false.B)
      ways.foreach(_.forget())
    }
    def keepAll(): Unit = step(keep = (0 until sources).toSet)
    def read(source: Int): BigInt = {
      val (from, count) = if (source == unit) (0x18, dut.bytes) else (4 * source, 4)
      (0 until count).map { i =>
        dut.readWord.poke((from + i) / dut.lanes)
        step()
        (dut.data.peekInt() >> (8 * ((from + i) % dut.lanes)) & 0xff) << (8 * i)
      }.sum
    }
    def settle(): Unit = idle(8 * dut.bytes)
  }

  for (
    (ports, period, bytes, lanes, means) <- Seq(
      (2, 10, 8, 1, true),
      (4, 8, 8, 4, false),
      (3, 40, 4, 2, true),
      (1, 20, 4, 1, false)
    )
  )
    together(
      s"$ports ports, $period ns, $bytes bytes, words of $lanes" + (if (means) ", means" else ""),
      new ClockAndTimes(ports, period, bytes, lanes, means)
    )(
      "DC-07: what begins at the same time in all places has the same time, at any phase" -> { dut =>
        val b = new Bench(dut)
        for (_ <- 1 to 40) {
          b.idle(b.cycle.toInt * 7 % 23)
          val time = b.begin(0 to ports: _*)
          b.settle()
          b.keepAll()
          b.idle(4)
          for (i <- 0 to ports) assert(b.read(i) == time, s"source $i")
        }
      },
      "DC-08, B-80: at a port before the frame ends or behind it, and nothing of other frames" -> { dut =>
        val b      = new Bench(dut)
        val random = new Random(1)
        for (_ <- 1 to 100) {
          b.begin(random.nextInt(ports)) // of another frame
          b.idle(100)
          val start = b.begin(0, b.unit)
          b.idle(random.nextInt(20))
          val early = (1 until ports).filter(_ => random.nextBoolean())
          val times = scala.collection.mutable.Map(0 -> start, b.unit -> start)
          for (y <- early) {
            times(y) = b.begin(y)
            b.idle(random.nextInt(20))
          }
          b.keepAll() // a time may still be on its way
          b.idle(random.nextInt(200))
          for (y <- 1 until ports if !early.contains(y)) {
            times(y) = b.begin(y)
            b.idle(random.nextInt(3))
          }
          b.settle()
          b.begin(0, b.unit) // not kept
          for (y <- 1 until ports) b.begin(y)
          b.settle()
          for ((source, time) <- times) assert(b.read(source) == time, s"source $source")
        }
      },
      "B-100: what frames wait on their way is averaged; few others do not matter" -> { dut =>
        val b      = new Bench(dut)
        val random = new Random(2)
        def exchange(port: Int, way: Int): BigInt = {
          b.begin(0, b.unit)
          b.keepAll()
          b.idle(way - 2)
          b.begin(port)
          b.settle()
          (b.read(port) - b.read(0)) & 0xffffffffL
        }

        /** The same of the second frame at a port. */
        def second(port: Int, way: Int): BigInt = {
          b.begin(0)
          b.idle(9)
          b.begin(port)
          b.idle(89)
          b.begin(b.unit)
          b.keepAll()
          b.idle(way - 102)
          b.begin(port)
          b.settle()
          (b.read(port) - b.read(b.unit) + 100 * period) & 0xffffffffL
        }
        for (port <- 1 until ports if means) {
          def isMean(parts: Int): Unit = {
            val way = exchange(port, 200 + random.nextInt(5))
            assert((way - 202 * period).abs * parts < period, s"$way ns")
          }
          for (_ <- 1 to 600) exchange(port, 200 + random.nextInt(5))
          for (_ <- 1 to 40) isMean(parts = 2)
          for (_ <- 1 to 10) {
            assert(exchange(port, 100) == 100 * period, "it comes as it is")
            for (_ <- 1 to 4) isMean(parts = 1)
          }
          for (_ <- 1 to 60) isMean(parts = 1)
          for (_ <- 1 to 15) assert(exchange(port, 212) < 204 * period, "late, but not for long")
          assert(exchange(port, 212) == 212 * period, "the sixteenth in succession has another way")
          for (_ <- 1 to 3) assert(exchange(port, 213) == 213 * period, "of which not enough is known")
          exchange(port, 212)
          assert(exchange(port, 216) < 213 * period, "but of four frames")
          for (_ <- 1 to 20) {
            exchange(port, 212 + 9)
            exchange(port, 212 - 9)
          }
          assert((exchange(port, 212) - 212 * period).abs < period, "early and late are no change")
          for (_ <- 1 to 6) assert(exchange(port, 130) == 130 * period)
          for (_ <- 1 to 8) exchange(port, 130)
          assert(exchange(port, 134) == 130 * period, "another way counts behind some frames")
          assert(second(port, 131) == 131 * period, "one that comes behind another is not on its way back")
          exchange(port, 131)
          b.noLink()
          assert(exchange(port, 133) == 133 * period, "nothing is known of the way of another cable")
        }
      },
      "B-82: nothing is kept of a port without link, nor after a reset" -> { dut =>
        val b = new Bench(dut)
        b.begin(b.unit)
        b.keepAll()
        b.noLink()
        for (y <- 0 until ports) b.begin(y)
        b.settle()
        for (y <- 0 until ports) assert(b.read(y) == 0)
      }
    )
}
