package flyframe.relay

import chisel3._
import chiseltest._
import flyframe.can.CanFrame
import org.scalatest.flatspec.AnyFlatSpec
import scala.util.Random

class LinkSenderSpec extends AnyFlatSpec with ChiselScalatestTester {
  "FR-41 to FR-43, FR-47: a sender" should "send what the model sends" in test(new LinkSender) { dut =>
    val random = new Random(2)
    val model  = new LinkSenderModel
    var bytes  = IndexedSeq.empty[Int]
    var aborts = 0
    for (order <- Seq(dut.begin, dut.own, dut.abort, dut.silence, dut.step, dut.byte.valid)) order.poke(false)
    dut.clock.step()

    /** A cycle with an order, and then the bytes that are asked for. */
    def order(pins: Bool*): Unit = {
      pins.foreach(_.poke(true))
      dut.clock.step()
      pins.foreach(_.poke(false))
    }
    def serve(): Unit = if (dut.fetch.valid.peekBoolean()) {
      for (_ <- 0 until random.nextInt(3)) dut.clock.step()
      dut.byte.bits.poke(bytes(dut.fetch.bits.peekInt().toInt))
      order(dut.byte.valid)
      dut.fetch.valid.expect(false)
    }
    for (bit <- 0 until 40000) {
      dut.quiet.expect(model.quiet min 31, s"bit $bit")
      if (model.quiet >= 7 && random.nextInt(4) == 0) {
        val isOwn    = random.nextBoolean()
        val extended = random.nextBoolean()
        val remote   = random.nextInt(4) == 0
        val dlc      = random.nextInt(16)
        val data =
          Seq.fill(if (remote) 0 else dlc min 8)(if (random.nextBoolean()) 255 else random.nextInt(256))
        val frame =
          CanFrame(random.nextInt(1 << (if (extended) 29 else 11)), extended, remote, dlc, data)
        val hops = if (isOwn) 255 else random.nextInt(255)
        val header =
          LinkHeader(random.nextInt(4), random.nextInt(2), random.nextInt(128), random.nextInt(1 << 14), hops)
        val body = LinkBody.of(header, frame)
        val word = header.word.toLong << 8 | hops
        bytes = (3 to 0 by -1).map(n => (word >> 8 * n & 0xff).toInt) ++ (0 until body.total / 8).map(n =>
          (0 until 8).foldLeft(0)((b, k) => b << 1 | (if (body(8 * n + k)) 1 else 0))
        )
        // Of an own frame the sender makes hops and CRC.
        if (isOwn)
          bytes = bytes.updated(3, random.nextInt(256)).dropRight(4) ++ Seq.fill(4)(random.nextInt(256))
        model.begin(header, body)
        dut.own.poke(isOwn)
        order(dut.begin)
        dut.own.poke(false)
      } else if (random.nextInt(400) == 0) {
        if (dut.busy.peekBoolean()) aborts += 1
        model.abort()
        order(dut.abort)
      } else if (random.nextInt(2000) == 0) {
        model.silence()
        order(dut.silence)
      }
      serve()
      val level = model.send()
      order(dut.step)
      dut.level.expect(level, s"bit $bit")
      serve()
    }
    assert(aborts > 20)
  }
}
