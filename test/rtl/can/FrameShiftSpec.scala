package flyframe.can

import chisel3._
import chiseltest._
import flyframe.Simulation
import org.scalatest.flatspec.AnyFlatSpec
import scala.util.Random

/** The shift register alone, with an engine that takes a bit every few cycles. */
class FrameShiftSpec extends AnyFlatSpec with ChiselScalatestTester {
  private def frame(random: Random): CanFrame = {
    val extended = random.nextBoolean()
    val remote   = random.nextInt(4) == 0
    val dlc      = random.nextInt(16)
    val data     = Seq.fill(CanFrame.size(dlc, remote))(random.nextInt(256))
    CanFrame(random.nextInt(if (extended) 1 << 29 else 1 << 11), extended, remote, dlc, data)
  }

  /** From the identifier to IDE, or to RTR behind the extension. */
  private def arbitration(f: CanFrame): Seq[Boolean] = {
    val bits = if (f.extended) 32 else 13
    (31 until 31 - bits by -1).map(i => (f.order >> i & 1) == 1)
  }
  private def dataBits(f: CanFrame) = f.data.flatMap(byte => (7 to 0 by -1).map(i => (byte >> i & 1) == 1))
  private def words(f: CanFrame) =
    f.bytes().grouped(4).map(_.zipWithIndex.map { case (b, i) => b.toLong << 8 * i }.sum).toVector

  private class Engine(dut: FrameShift, random: Random) {
    private var slot   = Vector.fill(4)(0L)
    private var stored = Vector.fill(4)(0L)
    for (s <- Seq(dut.begins, dut.bits.shifts, dut.bits.identifierEnds, dut.bits.wordEnds)) s.poke(false)
    dut.bits.sends.poke(false)
    dut.bits.passes.poke(false)

    var ownDlc = Option.empty[Int]

    /** A cycle; the memory answers in the next one. */
    def cycle(): Unit = {
      val load  = dut.load.valid.peekBoolean()
      val which = dut.load.bits.peekInt().toInt
      if (dut.store.valid.peekBoolean())
        stored = stored.updated(dut.store.bits.peekInt().toInt, dut.word.peekInt().toLong)
      if (dut.ownDlc.valid.peekBoolean()) ownDlc = Some(dut.ownDlc.bits.peekInt().toInt)
      dut.clock.step()
      dut.data.poke(if (load) slot(which) else random.nextLong(1L << 32))
    }
    private def rest(least: Int = 8): Unit = for (_ <- 1 to least + random.nextInt(4)) cycle()

    /** A bit is heard; `also` is true with it. */
    private def bit(level: Boolean, also: Option[Bool]): Unit = {
      dut.bits.shifts.poke(true)
      dut.bits.bit.poke(level)
      also.foreach(_.poke(true))
      cycle()
      dut.bits.shifts.poke(false)
      also.foreach(_.poke(false))
    }

    /** The frame `heard` passes; `own` is the one that this node has begun.
      *
      * @return
      *   what of it was stored
      */
    def pass(heard: CanFrame, own: Option[CanFrame]): Seq[Long] = {
      var sends = own.nonEmpty
      ownDlc = None
      for (f <- own) {
        slot = words(f)
        dut.begins.poke(true)
        cycle()
        dut.begins.poke(false)
      }
      dut.bits.isExtended.poke(heard.extended)
      dut.bits.isRemote.poke(heard.remote)
      dut.bits.dlc.poke(heard.dlc)
      val bits = arbitration(heard)
      for ((level, i) <- bits.zipWithIndex) {
        rest(if (i == 0) 2 else 8) // behind `begins`: at once
        if (sends) {
          val all    = arbitration(own.get)
          val driven = all(i)
          dut.ownBit.expect(driven, s"bit $i of ${own.get}")
          // While that is on the wire, the one behind it is known.
          dut.bits.passes.poke(true)
          if (i + 1 < all.size) dut.ownBit.expect(all(i + 1), s"bit ${i + 1} of ${own.get}")
          dut.bits.passes.poke(false)
          if (driven != level) sends = false
        }
        dut.bits.sends.poke(sends)
        bit(level, Option.when(i == bits.size - 1)(dut.bits.identifierEnds))
      }
      for (_ <- 1 to 4) rest() // the bits of the DLC
      if (sends) assert(ownDlc.contains(heard.dlc))
      val data = dataBits(heard)
      for ((level, i) <- data.zipWithIndex) {
        rest()
        if (sends) (if (i == 32) dut.ownAhead else dut.ownBit).expect(level, s"data bit $i of $heard")
        val isLast = i == data.size - 1
        dut.bits.byte.poke(i / 8)
        dut.bits.dataEnds.poke(i / 8 == data.size / 8 - 1)
        bit(level, Option.when(isLast || i == 31)(dut.bits.wordEnds))
      }
      for (_ <- 1 to 5) rest()
      for (_ <- 1 to 32) cycle()
      stored
    }
  }

  private def check(heard: CanFrame, stored: Seq[Long]): Unit = {
    val all = words(heard)
    for (i <- Seq(0, 2, 3)) assert(stored(i) == all(i), f"word $i is 0x${stored(i)}%08x, of $heard")
  }

  "CAN-07, CAN-11: frames" should "leave bit by bit, and be stored as they were heard" in
    test(new FrameShift).withAnnotations(Simulation.annotations(this, "shift")) { dut =>
      val random = new Random(1)
      val engine = new Engine(dut, random)
      for (_ <- 1 to 150) {
        val heard = frame(random)
        check(heard, engine.pass(heard, Option.when(random.nextBoolean())(heard)))
      }
    }

  it should "be stored whole by a node that has lost the arbitration in any bit" in
    test(new FrameShift).withAnnotations(Simulation.annotations(this, "shift")) { dut =>
      val random = new Random(2)
      val engine = new Engine(dut, random)
      for (lost <- 0 until 32) {
        // The other has the same bits up to the one in which it is dominant.
        val own   = CanFrame(0x1fffffff, extended = true, remote = true, 0, Nil)
        val place = if (lost < 11) Some(28 - lost) else if (lost > 12 && lost < 31) Some(30 - lost) else None
        val heard = place match {
          case Some(bit)       => frame(random).copy(id = own.id & ~(1 << bit), extended = true)
          case _ if lost == 31 => CanFrame(own.id, extended = true, remote = false, 3, Seq(1, 2, 3))
          case _               => frame(random).copy(id = own.id >> 18, extended = false)
        }
        check(heard, engine.pass(heard, Some(own)))
      }
    }
}
