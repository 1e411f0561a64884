package flyframe.relay

import chisel3._
import chiseltest._
import flyframe.Simulation
import org.scalatest.flatspec.AnyFlatSpec
import scala.collection.immutable.ListMap
import scala.util.Random

class TransitListsSpec extends AnyFlatSpec {
  for (isLong <- Seq(false, true))
    s"FR-48, RB-08: frames that wait at two outputs, ${Schedule(isLong)}" should
      "leave in the model's order" in leave(Schedule(isLong))

  private def leave(schedule: Schedule): Unit = {
    val design = Simulation.annotations(this, s"transit lists ${schedule.isLong}")
    RawTester.test(new TransitLists(schedule), design) { dut =>
      val random = new Random(4)
      val models = Seq.fill(2)(new TransitModel)
      val frames =
        Array.fill(2)(ListMap.empty[Incoming, Int]) // those that wait, older ones first; their slots
      val most = Array(0, 0)
      for (
        pin <- Seq(dut.asks, dut.put, dut.ranks, dut.removes, dut.looks.valid, dut.take) ++ dut.drop ++
          dut.names.map(_.valid)
      )
        pin.poke(false)
      for (name <- dut.names) {
        name.bits.isExtended.poke(false)
        name.bits.isRemote.poke(false)
      }
      dut.clock.step(40)

      def pulse(pin: Bool): Unit = {
        pin.poke(true)
        dut.clock.step()
        pin.poke(false)
      }
      def drop(out: Int): Unit = {
        models(out).drop()
        frames(out) = ListMap.empty
        pulse(dut.drop(out))
      }

      /** Waits until a cycle before an entry is there. */
      def answers(): Unit = for (_ <- 1 until schedule.entryCycles) dut.clock.step()

      /** The first one, which may leave then; in the last cycle of a walk at the earliest. */
      def look(out: Int): Unit = {
        dut.looks.bits.poke(out)
        val order = random.nextInt(7).toLong << 21
        dut.order.poke(order)
        pulse(dut.looks.valid)
        answers()
        dut.out.poke(out)
        dut.clock.step()
        dut.out.poke(random.nextInt(2))
        for (f <- models(out).first) {
          dut.first.expect(frames(out)(f))
          for (its <- f.order) dut.isBefore.expect(order < its)
          if (random.nextBoolean()) {
            models(out).remove(f)
            pulse(dut.take)
            dut.leaving(out).expect(frames(out)(f))
            frames(out) -= f
          }
        }
      }

      /** A walk, which a drop may meet, or a look behind it. */
      def walk(out: Int, slot: Int, order: Bool): Unit = {
        dut.it.poke(slot)
        pulse(order)
        val met = if (random.nextInt(40) == 0) random.nextInt(schedule.walkCycles - 2) else -1
        for (cycle <- 1 until schedule.walkCycles) if (cycle == met) drop(out) else dut.clock.step()
        if (random.nextBoolean()) dut.clock.step() else look(random.nextInt(2))
      }
      for (step <- 0 until 12000) {
        val out   = random.nextInt(2)
        val model = models(out)
        def known = frames(out).keys.filter(_.order.nonEmpty).toSeq
        dut.out.poke(out)
        dut.size.expect(model.size, s"step $step")
        dut.known.expect(known.size, s"step $step")
        random.nextInt(7) match {
          case 0 | 1 =>
            val f = new Incoming(0, LinkHeader(0, 0, 1, 0, 9), new LinkBody, 0)
            if (model.put(f)) {
              pulse(dut.asks)
              answers()
              val slot = dut.slot.peekInt().toInt
              assert(!frames(out).values.exists(_ == slot), "a slot in use")
              assert(dut.leaving(out).peekInt() != slot, "a slot that leaves")
              frames(out) += f -> slot
              pulse(dut.put)
            }
          case 2 | 3 =>
            // Mostly the oldest one; of equal ones the first that was told is first, too.
            val unknown = frames(out).keys.filter(_.order.isEmpty).toSeq
            for (f <- if (random.nextInt(4) == 0) unknown.lastOption else unknown.headOption) {
              val id   = if (f == unknown.head) random.nextInt(6) else 6 + random.nextInt(2000)
              val port = random.nextInt(2)
              f.order = Some(LinkFrame.order(id))
              dut.port.poke(port)
              dut.names(port).valid.poke(true)
              dut.names(port).bits.identifier.poke(id)
              while (!dut.taken(port).peekBoolean()) dut.clock.step()
              dut.clock.step()
              dut.names(port).valid.poke(false)
              walk(out, frames(out)(f), dut.ranks)
            }
          case 4 if random.nextBoolean() =>
            for (f <- random.shuffle(frames(out).keys.toSeq).headOption) {
              val slot = frames(out)(f)
              model.remove(f)
              frames(out) -= f
              walk(out, slot, dut.removes)
            }
          case 5 | 6 => look(out)
          case _     => if (random.nextInt(40) == 0) drop(out)
        }
        most(out) = most(out) max model.size
      }
      assert(most.toSeq == Seq.fill(2)(TransitLists.Most))
    }
  }
}
