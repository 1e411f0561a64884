package flyframe.relay

import chisel3._
import chiseltest._
import org.scalatest.flatspec.AnyFlatSpec
import scala.collection.immutable.ListMap
import scala.util.Random

class TransitListSpec extends AnyFlatSpec with ChiselScalatestTester {
  "FR-48, RB-08: frames that wait" should "leave in the model's order" in test(new TransitList) { dut =>
    val random = new Random(4)
    val model  = new TransitModel
    var frames = ListMap.empty[Incoming, Int] // those that wait, older ones first, and their slots
    var most   = 0
    def order(pin: Bool): Unit = {
      pin.poke(true)
      dut.clock.step()
      pin.poke(false)
    }
    for (pin  <- Seq(dut.put, dut.remove, dut.take, dut.drop, dut.ranks.valid)) pin.poke(false)
    for (step <- 0 until 20000) {
      dut.size.expect(model.size, s"step $step")
      def known = frames.keys.filter(_.order.nonEmpty).toSeq
      random.nextInt(7) match {
        case 0 | 1 =>
          val f = new Incoming(0, LinkHeader(0, 0, 1, 0, 9), new LinkBody, 0)
          if (model.put(f)) {
            val slot = dut.fresh.peekInt().toInt
            assert(!frames.values.exists(_ == slot), "a slot in use")
            frames += f -> slot
            order(dut.put)
          }
        case 2 | 3 =>
          for (f <- frames.keys.find(_.order.isEmpty)) { // they came one behind the other
            val key   = random.nextInt(6).toLong
            val place = known.count(_.order.get <= key)
            f.order = Some(key)
            dut.slot.poke(frames(f))
            dut.ranks.bits.poke(place)
            order(dut.ranks.valid)
          }
        case 4 if random.nextBoolean() =>
          for (f <- random.shuffle(frames.keys.toSeq).headOption) {
            dut.slot.poke(frames(f))
            dut.waits.expect(true)
            order(dut.remove)
            dut.waits.expect(false)
            model.remove(f)
            frames -= f
          }
        case 5 | 6 =>
          for (f <- model.first) {
            dut.known.expect(known.size)
            dut.slots(0).expect(frames(f), s"step $step")
            model.remove(f)
            order(dut.take)
            dut.leaving.expect(frames(f))
            frames -= f
          }
        case _ =>
          if (random.nextInt(40) == 0) {
            model.drop()
            frames = ListMap.empty
            order(dut.drop)
          }
      }
      most = most max model.size
    }
    assert(most == TransitList.Most)
  }
}
