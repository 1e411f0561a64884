package flyframe.can

import chiseltest._
import flyframe.Simulation
import flyframe.params.CanParams
import flyframe.ram.RamContents
import org.scalatest.flatspec.AnyFlatSpec
import scala.util.Random

class SlotOrderSpec extends AnyFlatSpec with ChiselScalatestTester {
  private val p = CanParams()

  "CAN-41, CB-08: the order" should "offer the first one by its key, of equal keys the oldest, in time" in
    test(new SlotOrder(p)).withAnnotations(Simulation.annotations(this, "order")) { dut =>
      val random  = new Random(1)
      val keys    = Array.fill(p.slots)(0L)
      var pending = Vector.empty[Int] // by age
      val ram     = new RamContents(dut.ram, SlotOrder.words(p))
      for (s <- Seq(dut.changedNow, dut.changedLate, dut.mayChange, dut.append.valid, dut.rests))
        s.poke(false)

      /** A cycle, in which a key is read, unless it must wait. */
      def cycle(): Unit = {
        val ready = random.nextInt(4) > 0
        dut.ready.poke(ready)
        val read = dut.read.valid.peekBoolean() && ready
        val slot = dut.read.bits.peekInt().toInt
        ram.step(dut.clock)
        dut.key.poke(if (read) keys(slot) else random.nextLong(1L << 32))
      }
      def show(): Unit = for (map <- Seq(dut.pending, dut.mayBegin)) map.poke(pending.map(1 << _).sum)
      def change(): Unit = {
        show()
        for (s <- Seq(dut.changedNow, dut.mayChange)) s.poke(true)
        cycle()
        for (s <- Seq(dut.changedNow, dut.mayChange)) s.poke(false)
      }
      show()
      for (round <- 1 to 600) {
        // In relay mode the memory is that of another list; none of its slots comes back.
        if (round % 50 == 0) {
          pending = Vector.empty
          show()
          dut.rests.poke(true)
          for (_  <- 0 to random.nextInt(8)) cycle()
          for (at <- ram.words.indices) ram.words(at) = random.nextInt(p.slots)
          dut.rests.poke(false)
          pending = random.shuffle((0 until p.slots).toVector).take(3)
          show()
          change()
          for (_ <- 1 to p.offerCycles) cycle()
          dut.offer.valid.expect(false)
          pending = Vector.empty
          show()
        }
        if (pending.size < p.slots && random.nextInt(5) < 3) {
          val free = (0 until p.slots).filterNot(pending.contains)
          for (slot <- random.shuffle(free).take(1 + random.nextInt(2))) {
            keys(slot) = random.nextInt(4).toLong << 30 | random.nextInt(2)
            dut.append.valid.poke(true)
            dut.append.bits.poke(slot)
            while (random.nextInt(4) == 0) { // another one might have been given up
              dut.mayChange.poke(true)
              dut.appended.expect(false)
              cycle()
            }
            dut.mayChange.poke(false)
            while (!dut.appended.peekBoolean()) cycle()
            cycle()
            dut.append.valid.poke(false)
            pending :+= slot
            show()
          }
        } else pending = pending.patch(random.nextInt(pending.size max 1), Nil, 1)
        change()
        // Some walks are broken off by the next change.
        if (random.nextInt(3) > 0) {
          for (_ <- 1 until p.offerCycles) cycle()
          val wanted = pending.minByOption(s => (keys(s), pending.indexOf(s)))
          cycle()
          dut.offer.valid.expect(wanted.nonEmpty, s"$pending")
          for (slot <- wanted) {
            dut.offer.slot.expect(slot, s"of $pending with keys ${pending.map(keys(_))}")
            dut.offer.firstBit.expect((keys(slot) >> 31 & 1) == 1)
          }
        } else for (_ <- 1 to random.nextInt(p.offerCycles)) cycle()
      }
    }

  it should "withdraw an offer in the cycle in which its slot may no longer begin" in
    test(new SlotOrder(p)).withAnnotations(Simulation.annotations(this, "order")) { dut =>
      val ram = new RamContents(dut.ram, SlotOrder.words(p))
      for (s <- Seq(dut.changedNow, dut.changedLate, dut.mayChange, dut.append.valid, dut.rests))
        s.poke(false)
      dut.ready.poke(true)
      dut.append.valid.poke(true)
      dut.append.bits.poke(3)
      ram.step(dut.clock)
      dut.append.valid.poke(false)
      dut.pending.poke(8)
      dut.mayBegin.poke(8)
      for (s <- Seq(dut.changedNow, dut.mayChange)) s.poke(true)
      ram.step(dut.clock)
      for (s <- Seq(dut.changedNow, dut.mayChange)) s.poke(false)
      for (_ <- 1 to p.offerCycles) ram.step(dut.clock)
      dut.offer.valid.expect(true)
      dut.offer.slot.expect(3)
      dut.mayBegin.poke(0)
      dut.offer.valid.expect(false)
      dut.mayBegin.poke(8)
      dut.offer.valid.expect(true)
    }
}
