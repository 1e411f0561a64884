package flyframe.relay

import chiseltest._
import flyframe.Simulation
import flyframe.can.CanFrame
import org.scalatest.flatspec.AnyFlatSpec
import scala.collection.mutable.ArrayBuffer
import scala.util.Random

class LinkReceiverSpec extends AnyFlatSpec with ChiselScalatestTester {

  /** What the model tells with a bit, in the order of the RTL's events. */
  private class Told extends LinkListener {
    var what           = Set.empty[String]
    var body           = new LinkBody
    var last           = LinkHeader(0, 0, 0, 0, 0)
    def starts(): Unit = what += "starts"
    def header(header: LinkHeader, body: LinkBody): Unit = {
      what += "header"
      last = header
      this.body = body
    }
    def identified(): Unit           = what += "identified"
    def ended(isGood: Boolean): Unit = what += (if (isGood) "good" else "bad")
    def badHeader(): Unit            = what += "badHeader"
    def badFrame(): Unit             = what += "badFrame"
  }

  /** Frames at random, of which many are cut, changed, or aborted; and noise. */
  private def levels(random: Random): Seq[Boolean] = {
    val extended = random.nextBoolean()
    val remote   = random.nextInt(4) == 0
    val dlc      = random.nextInt(16)
    val id       = random.nextInt(1 << (if (extended) 29 else 11))
    val data = Seq.fill(if (remote) 0 else dlc min 8)(if (random.nextInt(4) == 0) 0 else random.nextInt(256))
    val header =
      LinkHeader(
        random.nextInt(4),
        random.nextInt(2),
        random.nextInt(128),
        random.nextInt(1 << 14),
        random.nextInt(256)
      )
    val good = LinkFrame.levels(header, LinkBody.of(header, CanFrame(id, extended, remote, dlc, data))).toSeq
    val sent = random.nextInt(8) match {
      case 0 => good.updated(random.nextInt(good.size), random.nextBoolean())
      case 1 => good.take(random.nextInt(good.size)) ++ Seq.fill(7)(false)
      case 2 => Seq.fill(random.nextInt(400))(false)
      case 3 => Seq.fill(random.nextInt(60))(random.nextBoolean())
      case _ => good
    }
    val end = Seq.fill(7 + random.nextInt(4))(true)
    sent ++ (if (random.nextInt(10) == 0) end.updated(random.nextInt(end.size), false) else end)
  }

  "FR-41 to FR-43, FR-45, RB-01 to RB-04: a receiver" should "tell with each bit what the model tells" in
    test(new LinkReceiver).withAnnotations(Simulation.annotations(this, "receiver")) { dut =>
      val random = new Random(1)
      val told   = new Told
      val model  = new LinkReceiverModel(told)
      val seen   = ArrayBuffer.empty[String]
      var bytes  = Map.empty[Int, Int]
      dut.address.poke(23)
      dut.restart.poke(true)
      dut.clock.step()
      dut.restart.poke(false)
      val e = dut.events
      val all = Seq(
        "starts"     -> e.starts,
        "header"     -> e.header,
        "identified" -> e.identified,
        "good"       -> e.good,
        "bad"        -> e.bad,
        "badHeader"  -> e.badHeader,
        "badFrame"   -> e.badFrame
      )
      for (number <- 0 until 600) {
        val sent = levels(random)
        for ((bit, i) <- sent.zipWithIndex) {
          told.what = Set.empty
          dut.idle.expect(model.isIdle)
          dut.stuck.expect(model.isStuck)
          model.take(bit)
          dut.sample.valid.poke(true)
          dut.sample.bits.poke(bit)
          for ((name, event) <- all) event.expect(told.what(name), s"$name at bit $i of frame $number")
          val isByte = e.byte.peekBoolean()
          dut.clock.step()
          dut.sample.valid.poke(false)
          if (isByte)
            bytes += dut.index.peekInt().toInt -> (dut.word.peekInt() & 0xff).toInt
          if (told.what("header")) dut.isOwn.expect(told.last.source == 23)
          if (told.what("good")) {
            val header = told.last
            val word   = header.word.toLong << 8 | header.hops
            val body = (0 until told.body.total / 8).map(n =>
              (0 until 8).foldLeft(0)((b, k) => b << 1 | (if (told.body(8 * n + k)) 1 else 0))
            )
            val expected = (3 to 0 by -1).map(n => (word >> 8 * n & 0xff).toInt) ++ body
            assert(expected.indices.map(bytes) == expected, s"frame $number")
          }
          if (random.nextInt(3) == 0) dut.clock.step()
          if (random.nextInt(20000) == 0) {
            model.restart()
            dut.restart.poke(true)
            dut.clock.step()
            dut.restart.poke(false)
          }
          seen ++= told.what
        }
      }
      for ((name, _) <- all) assert(seen.count(_ == name) > 5, name)
    }
}
