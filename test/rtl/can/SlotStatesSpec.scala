package flyframe.can

import chiseltest._
import flyframe.params.CanParams
import org.scalatest.flatspec.AnyFlatSpec
import scala.util.Random

class SlotStatesSpec extends AnyFlatSpec with ChiselScalatestTester {
  private val p = CanParams(bridge = true)

  "CAN-40, CB-04, CB-12: a slot" should
    "be pending until it is sent, fails, or is aborted while not on the wire" in
    test(new SlotStates(p)) { dut =>
      val random                  = new Random(7)
      var (pending, sent, failed) = (Set.empty[Int], Set.empty[Int], Set.empty[Int])
      var onWire                  = Option.empty[Int]
      var aborts                  = false          // what is on the wire
      var leaving                 = Set.empty[Int] // orders of the cycle before, of host or bridge
      var before                  = Set.empty[Int] // what was pending in it
      var over                 = Option.empty[(Int, Boolean)] // the attempt that was over then, well or not
      def map(slots: Set[Int]) = slots.foldLeft(BigInt(0))((m, s) => m.setBit(s))
      def some(rarely: Int)    = (0 until p.slots).filter(_ => random.nextInt(rarely) == 0).toSet
      for (cycle <- 0 until 20000) {
        val oneShot = random.nextInt(8) == 0
        val request = Option.when(random.nextInt(3) == 0)(random.nextInt(p.slots)).filterNot(pending)
        val abort   = if (random.nextInt(6) == 0) some(8) else Set.empty[Int]
        val evicts  = if (random.nextInt(6) == 0) some(4) & CanParams.BridgeSlots.toSet else Set.empty[Int]
        val clears  = Seq.fill(2)(if (random.nextInt(6) == 0) some(3) else Set.empty[Int])
        val mayGo   = (pending & before) -- leaving -- over.map(_._1)
        val takes =
          if (onWire.isEmpty && random.nextInt(3) == 0) random.shuffle(mayGo.toSeq).headOption else None
        val ends   = onWire.nonEmpty && random.nextInt(4) == 0
        val isSent = ends && random.nextBoolean()
        val gone   = (leaving & pending) -- onWire -- over.map(_._1)
        dut.oneShot.poke(oneShot)
        dut.request.valid.poke(request.nonEmpty)
        dut.request.bits.poke(request.getOrElse(0))
        dut.abort.poke(map(abort))
        dut.evict.get.poke(map(evicts) >> CanParams.BridgeSlots.start)
        dut.clearSent.poke(map(clears(0)))
        dut.clearFailed.poke(map(clears(1)))
        dut.takes.valid.poke(takes.nonEmpty)
        dut.takes.bits.poke(takes.getOrElse(random.nextInt(p.slots)))
        dut.ends.poke(ends)
        dut.sent.poke(isSent)
        dut.mayBegin.expect(map((pending & before) -- leaving))
        dut.aborted.expect(gone.nonEmpty)
        dut.ended.expect(over.nonEmpty)
        dut.clock.step()

        // The host first: what it clears was there before.
        before = pending
        pending = pending -- gone -- over.map(_._1) ++ request
        sent = sent -- clears(0) -- request ++ over.collect { case (slot, true) => slot }
        failed = failed -- clears(1) -- request ++ gone ++ over.collect { case (slot, false) => slot }
        val held = onWire.orElse(takes)
        aborts = (aborts && takes.isEmpty) || held.exists(abort)
        over = held.filter(_ => ends && (isSent || oneShot || aborts)).map(_ -> isSent)
        onWire = held.filterNot(_ => ends)
        aborts &&= !ends
        leaving = abort ++ evicts
        dut.pending.expect(map(pending), s"cycle $cycle")
        dut.sentAll.expect(map(sent), s"cycle $cycle")
        dut.failedAll.expect(map(failed), s"cycle $cycle")
        for (slot <- held) dut.current.expect(slot)
      }
    }
}
