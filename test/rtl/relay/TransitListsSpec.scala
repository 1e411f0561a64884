package flyframe.relay

import chisel3._
import chiseltest._
import flyframe.Simulation
import org.scalatest.flatspec.AnyFlatSpec
import scala.collection.immutable.ListMap
import scala.util.Random

class TransitListsSpec extends AnyFlatSpec {
  private val half = 1L << 31

  for (isLong <- Seq(false, true))
    s"FR-48, RB-08, RB-28: frames that wait at two outputs, ${Schedule(isLong)}" should
      "leave in the model's order" in leave(Schedule(isLong), isFull = false)

  for (isLong <- Seq(false, true))
    s"FR-47, FR-48: a frame removed as soon as the last of eight has its place, ${Schedule(isLong)}" should
      "leave the list whole" in leave(Schedule(isLong), isFull = true)

  /** @param isFull
    *   nothing leaves but lists of eight frames with their places
    */
  private def leave(schedule: Schedule, isFull: Boolean): Unit = {
    val design = Simulation.annotations(this, s"transit lists ${schedule.isLong} $isFull")
    RawTester.test(new TransitLists(schedule), design) { dut =>
      val random = new Random(4)
      val models = Seq.fill(2)(new TransitModel)
      val frames =
        Array.fill(2)(ListMap.empty[Incoming, Int]) // those that wait, older ones first; their slots
      val most = Array(0, 0)
      var full = 0 // frames that were removed right behind the longest walk there is
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

      def known(out: Int)    = frames(out).keys.filter(_.order.nonEmpty).toSeq
      def mayLeave(out: Int) = !isFull || known(out).size == TransitLists.Most

      /** Waits until a cycle before an entry is there. */
      def answers(): Unit = for (_ <- 1 until schedule.entryCycles) dut.clock.step()

      /** The first one, which may leave then; in the last cycle of a walk at the earliest. */
      def look(out: Int): Unit = {
        dut.looks.bits.poke(out)
        val order = random.nextInt(9) match {
          case 7 => half // of the second half: as TransitLists.inTransit has it
          case 8 => half - 1
          case n => n.toLong << 21
        }
        dut.order.poke(order)
        pulse(dut.looks.valid)
        answers()
        dut.out.poke(out)
        dut.clock.step()
        dut.out.poke(random.nextInt(2))
        for (f <- models(out).first) {
          dut.first.expect(frames(out)(f))
          for (its <- f.order) dut.isBefore.expect(order < (its min half))
          if (random.nextBoolean() && mayLeave(out)) {
            models(out).remove(f)
            pulse(dut.take)
            dut.leaving(out).expect(frames(out)(f))
            frames(out) -= f
          }
        }
      }

      /** One that waits, if there is one. */
      def remove(out: Int): Boolean = {
        val it = random.shuffle(frames(out).keys.toSeq).headOption.filter(_ => mayLeave(out))
        for (f <- it) {
          val slot = frames(out)(f)
          models(out).remove(f)
          frames(out) -= f
          dut.out.poke(out)
          walk(out, slot, dut.removes)
        }
        it.nonEmpty
      }

      /** A walk, which a drop may meet, or behind it a look, or another walk. */
      def walk(out: Int, slot: Int, order: Bool): Unit = {
        dut.it.poke(slot)
        pulse(order)
        val met = if (random.nextInt(40) == 0) random.nextInt(schedule.walkCycles - 2) else -1
        for (cycle <- 1 until schedule.walkCycles) if (cycle == met) drop(out) else dut.clock.step()
        random.nextInt(4) match {
          case 0 => look(random.nextInt(2))
          case 1 =>
            val other  = random.nextInt(2)
            val isLong = order == dut.ranks && other == out && known(out).size == TransitLists.Most
            if (!remove(other)) dut.clock.step() else if (isLong) full += 1
          case _ => dut.clock.step()
        }
      }
      for (step <- 0 until 12000) {
        val out   = random.nextInt(2)
        val model = models(out)
        dut.out.poke(out)
        dut.size.expect(model.size, s"step $step")
        dut.known.expect(known(out).size, s"step $step")
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
            val unknown = frames(out).keys.filter(_.order.isEmpty).toSeq
            for (f <- if (random.nextInt(4) == 0) unknown.lastOption else unknown.headOption) {
              val id   = random.nextInt(6) + (if (random.nextInt(3) == 0) 0x7f8 else 0) // many are equal
              val port = random.nextInt(2)
              f.order = Some(LinkFrame.order(id))
              f.turn = step
              dut.port.poke(port)
              dut.names(port).valid.poke(true)
              dut.names(port).bits.identifier.poke(id)
              while (!dut.taken(port).peekBoolean()) dut.clock.step()
              dut.clock.step()
              dut.names(port).valid.poke(false)
              walk(out, frames(out)(f), dut.ranks)
            }
          case 4 if random.nextBoolean() => remove(out)
          case 5 | 6                     => look(out)
          case _                         => if (random.nextInt(40) == 0) drop(out)
        }
        most(out) = most(out) max model.size
      }
      assert(most.toSeq == Seq.fill(2)(TransitLists.Most))
      if (isFull) assert(full > 100)
    }
  }
}
