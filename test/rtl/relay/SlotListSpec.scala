package flyframe.relay

import chiseltest._
import flyframe.Simulation
import flyframe.can.SlotOrder
import flyframe.params.CanParams
import flyframe.ram.RamContents
import org.scalatest.flatspec.AnyFlatSpec
import scala.collection.mutable
import scala.util.Random

class SlotListSpec extends AnyFlatSpec with ChiselScalatestTester {
  private val p = CanParams()

  /** An entry as it should be in the list. */
  private case class Listed(slot: Int, key: Long)

  private class Bench(dut: SlotList, schedule: Schedule, random: Random) {
    val ram  = new RamContents(dut.ram, SlotOrder.words(p))
    var list = Vector.empty[Listed]
    for (pin <- Seq(dut.walk, dut.keeps, dut.append.valid, dut.ready)) pin.poke(false)
    dut.on.poke(true)

    def cycle(): Unit = ram.step(dut.clock)

    /** A slot is to become pending; its key is read. */
    def append(slot: Int, key: Long): Unit = {
      dut.append.valid.poke(true)
      dut.append.bits.poke(slot)
      cycle()
      dut.read.valid.expect(true, s"of slot $slot no key is read")
      dut.read.bits.expect(slot)
      while (random.nextBoolean()) cycle()
      dut.ready.poke(true)
      cycle()
      dut.ready.poke(false)
      dut.key.poke(key)
      cycle()
      dut.key.poke(random.nextLong(1L << 32))
      dut.read.valid.expect(false)
    }

    /** A walk, in which these slots are kept, and a new one gets its place. */
    def walk(kept: Int => Boolean, fresh: Option[Listed]): Unit = {
      var seen     = Vector.empty[(Int, Int, Boolean)]
      var appended = 0
      val keeps    = mutable.Queue.fill(schedule.recordCycles)(random.nextBoolean())
      dut.walk.poke(true)
      for (n <- 1 to SlotList.walkCycles(p, schedule)) {
        var keep = random.nextBoolean()
        if (dut.entry.valid.peekBoolean()) {
          val entry = dut.entry.bits.peek()
          val slot  = entry.slot.litValue.toInt
          seen :+= ((slot, entry.place.litValue.toInt, entry.sameAsNext.litToBoolean))
          keep = kept(slot)
        }
        keeps.enqueue(keep)
        dut.keeps.poke(keeps.dequeue())
        if (dut.appended.peekBoolean()) appended += 1
        cycle()
        if (n == 1) dut.walk.poke(false)
      }
      dut.append.valid.poke(false)
      assert(seen.map(_._1) == list.map(_.slot))
      assert(appended == fresh.size)
      def same(a: Listed, b: Listed) = ((a.key ^ b.key) & ~(1L << 20 | 1)) == 0
      for ((entry, i) <- seen.zipWithIndex) {
        assert(entry._3 == list.lift(i + 1).exists(same(list(i), _)), s"entry $i of $list")
        dut.look.poke(entry._2)
        cycle()
        dut.looked.expect(list(i).key, s"key of entry $i")
      }
      val stay            = list.filter(e => kept(e.slot))
      val (before, after) = stay.span(e => fresh.forall(e.key <= _.key))
      list = before ++ fresh ++ after
    }
  }

  for (isLong <- Seq(false, true)) {
    val schedule = Schedule(isLong)
    s"FR-55: the list, $schedule" should "have the slots in CAN order, older ones first, and lose none" in
      lists(schedule)
    s"RB-25: in bus mode the list, $schedule" should "forget all, also a slot that is being appended" in
      forgets(schedule)
  }

  private def lists(schedule: Schedule): Unit =
    test(new SlotList(p, schedule)).withAnnotations(Simulation.annotations(this, s"list $schedule")) { dut =>
      dut.clock.setTimeout(0)
      val random = new Random(1)
      val b      = new Bench(dut, schedule, random)
      for (_ <- 1 to 300) {
        val free = (0 until p.slots).filterNot(b.list.map(_.slot).contains)
        val fresh = Option.when(free.nonEmpty && random.nextInt(3) > 0)(
          Listed(free(random.nextInt(free.size)), random.nextInt(4).toLong << 20 | random.nextInt(2))
        )
        fresh.foreach(f => b.append(f.slot, f.key))
        val gone = (0 until p.slots).filter(_ => random.nextInt(8) == 0).toSet
        b.walk(!gone(_), fresh)
      }
    }

  private def forgets(schedule: Schedule): Unit =
    test(new SlotList(p, schedule)).withAnnotations(Simulation.annotations(this, s"list $schedule")) { dut =>
      dut.clock.setTimeout(0)
      val b = new Bench(dut, schedule, new Random(2))
      // Off for some cycles, in each cycle of a walk, in which all are kept.
      for (cycle <- 0 to SlotList.walkCycles(p, schedule); off <- 1 to 4) {
        for (slot <- 0 to 2) {
          b.append(slot, slot)
          b.walk(_ => true, Some(Listed(slot, slot)))
        }
        b.append(3, 3)
        dut.keeps.poke(true)
        for (n <- 0 until cycle + off) {
          dut.walk.poke(n == 0 && cycle > 0)
          dut.on.poke(n < cycle)
          if (n >= cycle) dut.append.valid.poke(false)
          b.cycle()
        }
        dut.on.poke(true)
        for (at <- b.ram.words.indices) b.ram.words(at) = at % p.slots
        b.list = Vector.empty
        for (_ <- 1 to SlotList.walkCycles(p, schedule)) b.cycle()
        b.append(4, 9)
        b.walk(_ => true, Some(Listed(4, 9)))
        b.walk(_ => false, None)
      }
    }
}
