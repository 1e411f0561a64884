package flyframe.registers

import scala.util.Random
import chisel3._
import chiseltest._
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.SharedSimulation

/** Counters alone, against a list of numbers: two ports' counters and one that is alone in its group, at
  * every number of cycles in a nibble slot.
  */
class EventCountersSpec extends AnyFlatSpec with SharedSimulation {
  private val rx       = Seq(0x300, 0x301, 0x302, 0x303, 0x308, 0x309).map(_ -> "rx")
  private val others   = Seq(0x30c -> "epu", 0x310 -> "lost_link", 0x311 -> "lost_link", 0x442 -> "watchdog")
  private val counters = rx ++ others
  private def delay    = EventCounters.delay(counters.size)

  private class Bench(dut: EventCounters, lanes: Int) {
    for (e <- dut.event) e.poke(false)
    for (c <- dut.clear) c.poke(false)
    def step(events: Set[Int] = Set.empty, cleared: Set[String] = Set.empty): Unit = {
      for ((e, i) <- dut.event.zipWithIndex) e.poke(events(i))
      for ((c, g) <- dut.clear.zip(dut.groups)) c.poke(cleared(g))
      dut.clock.step()
    }

    /** What is read of counter `i`, with these events and clears in the cycle of the read. */
    def read(i: Int, events: Set[Int] = Set.empty): Int = {
      val (address, group) = counters(i)
      dut.readAddress.poke(address / lanes % (1 << dut.readAddress.getWidth))
      val valid            = dut.valid(dut.groups.indexOf(group)).peekBoolean()
      step(events)
      if (valid) (dut.data.peekInt() >> (8 * (address % lanes)) & 0xff).toInt else 0
    }
    def reset(): Unit = {
      dut.reset.poke(true.B)
      step()
      dut.reset.poke(false.B)
    }
    def settle(): Unit = for (_ <- 1 to delay) step()
  }

  for ((lanes, slot) <- Seq(1 -> 4, 4 -> 1, 2 -> 5)) {
    def cell(check: Bench => Unit): EventCounters => Unit = dut => check(new Bench(dut, lanes))
    together(s"$lanes-byte words, $slot cycles a slot", new EventCounters(counters, lanes, slot))(
      "ERR-10: all are 0 after a reset" -> cell { b =>
        for (i <- counters.indices) assert(b.read(i) == 0)
        b.settle()
        for (i <- counters.indices) assert(b.read(i) == 0)
      },
      "ERR-10: an event in every slot at all of them: none is lost, they stop at 0xff" -> cell { b =>
        val all = counters.indices.toSet
        for (_ <- 1 to 200) {
          b.step(all)
          for (_ <- 1 until slot) b.step()
        }
        b.settle()
        for (i <- counters.indices) assert(b.read(i) == 200, s"counter $i")
        for (_ <- 1 to 100) {
          b.step(all)
          for (_ <- 1 until slot) b.step()
        }
        b.settle()
        for (i <- counters.indices) assert(b.read(i) == 255, s"counter $i")
        b.reset()
        for (i <- counters.indices) assert(b.read(i) == 0, s"counter $i after a reset")
        b.settle()
        for (i <- counters.indices) assert(b.read(i) == 0, s"counter $i after a reset")
      },
      "ERR-10, B-70: a clear is seen at once, an event a bounded time later" -> cell { b =>
        val random = new Random(lanes)
        // The last events of each counter with their age, and what came before these.
        val sure  = Array.fill(counters.size)(0)
        val fresh = Array.fill(counters.size)(List.empty[Int])
        val since = Array.fill(counters.size)(slot)
        var seen  = 0
        for (cycle <- 1 to 20000) {
          val busy   = random.nextInt(3) == 0 || cycle / 300 % 3 == 0
          val events = counters.indices.filter(i => since(i) >= slot && busy && random.nextInt(4) > 0).toSet
          val clears = Option.when(random.nextInt(150) == 0)(counters(random.nextInt(counters.size))._2).toSet
          for (i <- counters.indices) {
            since(i) = if (events(i)) 1 else since(i) + 1
            fresh(i) = fresh(i).map(_ + 1)
            sure(i) = (sure(i) + fresh(i).count(_ > delay)) min 255
            fresh(i) = fresh(i).filter(_ <= delay)
          }
          if (clears.isEmpty) {
            val i    = random.nextInt(counters.size)
            val read = b.read(i, events)
            val most = (sure(i) + fresh(i).size) min 255
            assert(read >= sure(i) && read <= most, s"counter $i, cycle $cycle")
            if (read > 0) seen += 1
          } else b.step(events, clears)
          for (i <- counters.indices) {
            if (clears(counters(i)._2)) {
              sure(i) = 0
              fresh(i) = Nil
            }
            if (events(i)) fresh(i) = 0 :: fresh(i)
          }
        }
        assert(seen > 5000, "reads that saw something")
      }
    )
  }
}
