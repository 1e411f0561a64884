package flyframe.relay

import flyframe.can.CanFrame
import flyframe.registers.{CanRegisters, RingRegisters}
import org.scalatest.flatspec.AnyFlatSpec
import scala.util.Random

/** Slots in both modes, one behind the other: the lists of either mode lie in the same block RAM. In bus mode
  * the port hears itself, in relay mode all copies come home.
  */
class ModeSwitchSpec extends AnyFlatSpec {
  private val port = CanRegisters.PortStarts(0)
  private val Run  = 1 | 4 // and loop back
  private val bit  = Seq(0, 0, 36 - 1, 12 - 1 | 3 << 4)

  "CAN-40, FR-55, RB-25: slots" should "go once and in order, or fail, whenever the mode is switched" in
    RelaySimulation { node =>
      val random = new Random(7)
      val b      = new RelayBench(node)
      var ended  = (0, 0)
      b.write(port + CanRegisters.Timing, bit: _*)
      b.start(7, confirmUs = 40)
      b.isLooped = true
      for (round <- 1 to 30) {
        val isRelay = round % 2 == 0
        b.write(port + CanRegisters.Control, 0)
        b.write(RingRegisters.Control, if (isRelay) 1 << RingRegisters.Relay else 0)
        b.write(port + CanRegisters.Control, Run)
        b.write(port + CanRegisters.Sent, 0xff, 0xff)
        b.write(port + CanRegisters.Failed, 0xff, 0xff)
        b.received()
        if (isRelay) b.run(700) // the life is told
        assert(b.map(CanRegisters.Requests) == 0)

        val first = b.now
        val slots = random.shuffle((0 until 16).toList).take(1 + random.nextInt(6))
        val ids   = slots.map(s => round << 8 | random.nextInt(8) << 4 | s)
        for ((slot, id) <- slots.zip(ids)) {
          val frame = CanFrame(id, extended = true, remote = false, 1, Seq(round))
          node.write(CanRegisters.SlotStarts(0) + slot * CanRegisters.FrameBytes, frame.bytes())
        }
        val all = slots.map(1 << _).sum
        b.write(port + CanRegisters.Requests, all & 0xff, all >> 8)
        val isWhole = random.nextBoolean()
        b.run(if (isWhole) slots.size * 300 + 100 else random.nextInt(slots.size * 260))

        // Whatever is not over is by the switch that the next round begins with.
        if (!isWhole) {
          b.write(RingRegisters.Control, if (isRelay) 0 else 1 << RingRegisters.Relay)
          b.run(2)
        }
        val sent   = b.map(CanRegisters.Sent)
        val failed = b.map(CanRegisters.Failed)
        assert(b.map(CanRegisters.Requests) == 0 && (sent | failed) == all && (sent & failed) == 0)
        if (isWhole) assert(failed == 0)
        ended = (ended._1 + Integer.bitCount(sent), ended._2 + Integer.bitCount(failed))
        val well = slots.zip(ids).collect { case (slot, id) if (sent >> slot & 1) == 1 => id }
        if (isRelay) {
          val left = b.frames(0, first).filter(f => f.isGood && f.header.kind == LinkKind.Data)
          val seen = left.map(_.body.slice(3, 32).foldLeft(0)((n, x) => n << 1 | (if (x) 1 else 0)))
          assert(well.forall(seen.contains), s"${well.map(_.toHexString)} of ${seen.map(_.toHexString)}")
          assert(seen.forall(ids.contains) && seen.distinct == seen)
        } else assert(b.received().map(_.id) == well.sorted)
      }
      info(s"${ended._1} were sent, ${ended._2} failed")
      assert(ended._1 > 25 && ended._2 > 8)
    }

  "CAN-45, RB-17, RB-25: a switch of the mode while a time stamp is written" should "change no slot" in
    RelaySimulation { node =>
      val b               = new RelayBench(node)
      val (inBus, inRing) = (3, 5)
      def at(slot: Int)   = CanRegisters.SlotStarts(0) + slot * CanRegisters.FrameBytes
      val frames =
        Map(inBus -> 8, inRing -> 1).map { case (slot, dlc) =>
          slot -> CanFrame(slot, extended = true, remote = false, dlc, Seq.fill(dlc)(slot))
        }
      def request(slot: Int): Unit = b.write(port + CanRegisters.Requests, 1 << slot, 0)
      def filled(): Unit           = for ((slot, frame) <- frames) b.node.write(at(slot), frame.bytes())

      /** A slot is sent in either mode. Cycles from the request on, in relay mode, to the start bit; or the
        * mode is switched so long behind it.
        */
      def once(switch: Option[Int]): Int = {
        b.write(RingRegisters.Control, 0)
        b.write(port + CanRegisters.Control, 0)
        filled()
        b.write(port + CanRegisters.Timing, bit: _*)
        b.write(port + CanRegisters.Control, Run)
        b.run(30)
        request(inBus)
        b.run(300)
        assert((b.map(CanRegisters.Sent) >> inBus & 1) == 1)
        b.write(port + CanRegisters.Sent, 0xff, 0xff)
        b.write(port + CanRegisters.Control, 0)
        b.start(7, confirmUs = 40)
        b.run(40)
        while (node.cycle % b.bit != 5) b.cycle()
        request(inRing)
        val first = node.cycle
        switch match {
          case None => while (node.level(0)) b.cycle()
          case Some(cycles) =>
            while (node.cycle < first + cycles) b.cycle()
            b.write(RingRegisters.Control, 0)
        }
        val took = (node.cycle - first).toInt
        b.run(20)
        for ((slot, frame) <- frames) {
          val stands = b.node.read(at(slot), CanRegisters.FrameBytes)
          assert(CanFrame.of(stands) == frame, s"slot $slot, switched behind $switch cycles")
        }
        took
      }
      val begins = once(None)
      assert(begins < 5 * b.bit)
      for (cycles <- begins - 6 to begins + 8) once(Some(cycles))
    }
}
