package flyframe.can.model

import flyframe.can._
import flyframe.params.CanParams
import flyframe.registers.CanRegisters
import org.scalatest.flatspec.AnyFlatSpec
import scala.util.Random

/** The small parts of the golden model, each alone. */
class CanUnitsSpec extends AnyFlatSpec {
  private def bits(text: String) = text.map(_ == '1')

  "CAN-09: the CRC" should "have the check value of its polynomial" in {
    val text = "123456789".flatMap(c => Wire.binary(c.toLong, 8))
    assert(Crc15.of(bits(text)) == 0x059e)
    assert(Wire.remainder(text) == 0x059e)
  }

  it should "be the remainder of the division, for any bits" in {
    val random = new Random(9)
    for (n <- 0 to 100) {
      val text = Seq.fill(n)(if (random.nextBoolean()) '1' else '0').mkString
      assert(Crc15.of(bits(text)) == Wire.remainder(text))
    }
  }

  "CAN-09: stuffing" should "put a bit behind five equal ones, stuff bits included" in {
    def stuffed(text: String): String = {
      val stuffing = new StuffingModel
      stuffing.begin()
      text.flatMap { level =>
        stuffing.take(level == '1')
        val more = if (stuffing.awaits) Some(stuffing.stuffBit) else None
        more.foreach(stuffing.take)
        level.toString + more.fold("")(b => if (b) "1" else "0")
      }
    }
    assert(stuffed("0101") == "0101")
    assert(stuffed("00000") == "000001")
    assert(stuffed("0000011110") == "00000" + "1" + "1111" + "0" + "0")
    assert(stuffed("1111100000") == "11111" + "0" + "0000" + "1" + "0")
  }

  /** Bits that a timing unit finds, and where it begins them. */
  private class Found(hard: Boolean, drives: Boolean) extends BitStream {
    var begun: Vector[Int]    = Vector.empty
    var sampled: Vector[Int]  = Vector.empty
    var now: Int              = 0
    def begins(): Unit        = begun :+= now
    def samples(bit: Boolean) = sampled :+= now
    def isHard                = hard
    def hardSynchronises()    = ()
    def level                 = drives
  }

  /** Runs quanta, and returns those in which a sample was taken, and those behind which a bit began. */
  private def run(setting: BitSetting, heard: String, hard: Boolean = false, drives: Boolean = true) = {
    val found  = new Found(hard, drives)
    val timing = new BitTimingModel(setting, found)
    for ((level, i) <- heard.zipWithIndex) {
      found.now = i
      timing.quantum(level == '1')
    }
    (found.sampled, found.begun)
  }

  private val setting = BitSetting(tseg1 = 6, tseg2 = 3, sjw = 2)

  "CAN-02: without edges" should "be a sample a bit, behind TSEG1" in {
    assert(run(setting, "1" * 30) == ((Vector(6, 16, 26), Vector(9, 19, 29))))
  }

  // Quantum of the edge, in the second bit: the sample and the end of that bit, or of the next one.
  for (
    (quantum, sample, end) <- Seq(
      (10, 16, 19),
      (11, 17, 20),
      (12, 18, 21),
      (13, 18, 21),
      (16, 18, 21),
      (9, 15, 18), // of the first bit, early by 1: quantum 9 is the first one of the second bit
      (8, 14, 17),
      (7, 14, 17) // by 3: the bit ends two early
    )
  ) s"CAN-04: an edge in quantum $quantum" should s"move the sample to $sample" in {
    val (samples, begun) = run(setting, "1" * quantum + "0" * (30 - quantum))
    assert(samples(1) == sample && begun(1) == end)
  }

  "CAN-03: an edge that synchronises hard" should "be the first quantum of a bit" in {
    for (quantum <- 0 until 30) {
      val (samples, _) = run(setting, "1" * quantum + "0" * 30, hard = true)
      assert(samples.find(_ >= quantum).contains(quantum + 6), quantum)
    }
  }

  "CAN-06: a late edge" should "have no effect when dominant is sent" in {
    for (quantum <- 11 to 16)
      assert(run(setting, "1" * quantum + "0" * (30 - quantum), drives = false)._1 == Vector(6, 16, 26))
  }

  "CB-08: an offer" should "be replaced when a change is 40 cycles old, and end with its slot" in {
    val frames = Seq(0x300, 0x200, 0x100).map(id => CanFrame(id, extended = false, remote = false, 0, Nil))
    val slots  = new CanSlotsModel(3, frames, 40)
    def offers(cycles: Int) = {
      slots.pass(cycles)
      slots.offer
    }
    slots.request(1)
    assert(offers(39).isEmpty && offers(1).contains(0))
    slots.request(2)
    assert(offers(39).contains(0))
    slots.request(4) // a further change
    assert(offers(39).contains(0) && offers(1).contains(2))
    slots.abort(4)
    assert(slots.offer.isEmpty && offers(39).isEmpty && offers(1).contains(1))
    slots.begins()
    slots.abort(2) // on the wire
    assert(slots.offer.contains(1))
    slots.fails(oneShot = false)
    assert(slots.offer.isEmpty && offers(40).contains(0))
    slots.begins()
    slots.succeeds()
    assert((slots.sent, slots.failed, slots.pending) == (1, 6, 0))
    assert(offers(40).isEmpty)
  }

  "A frame" should "come back out of its bytes" in {
    val random = new Random(5)
    for (_ <- 1 to 500) {
      val extended = random.nextBoolean()
      val remote   = random.nextBoolean()
      val dlc      = random.nextInt(16)
      val id       = random.nextInt() & (if (extended) 0x1fffffff else 0x7ff)
      val data     = Seq.fill(CanFrame.size(dlc, remote))(random.nextInt(256))
      val frame    = CanFrame(id, extended, remote, dlc, data)
      assert(CanFrame.of(frame.bytes(filter = 9, time = 0x1234)) == frame)
    }
  }

  "CAN order" should "be that of the levels in the arbitration" in {
    val random = new Random(6)
    def any = {
      val extended = random.nextBoolean()
      val id       = if (extended) random.nextInt(4) << 18 | random.nextInt(4) else random.nextInt(4)
      CanFrame(id, extended, random.nextBoolean(), 0, Nil)
    }
    def arbitration(f: CanFrame) =
      Wire(f).bits.filterNot(_.isStuff).takeWhile(b => b.part != "dlc").map(_.level).mkString
    for (_ <- 1 to 2000) {
      val (a, b) = (any, any)
      if (a.order != b.order) assert((a.order < b.order) == (arbitration(a) < arbitration(b)), (a, b))
      else assert(a == b)
    }
  }

  "CB-16: TEC" should "be that of one moment for a host that reads it byte by byte" in {
    val port = new CanPortModel(CanParams(hostBytes = 1))
    val at   = CanRegisters.PortStarts.head
    val tec  = at + CanRegisters.ErrorCounters
    def low  = port.read(tec, 1).head
    port.write(at + CanRegisters.Timing, Seq(0, 0, 5, 0x12))
    port.write(at + CanRegisters.Control, Seq(1))
    port.write(at + CanRegisters.Requests, Seq(1))
    // It hears nothing of what it sends: each SOF, and each bit of a flag, is an error.
    while (low < 248) port.step(true)
    for (_ <- 0 until 1000) port.step(true)
    assert(port.read(tec + 1, 1) == Seq(0), "of a TEC that was 248")
    assert(port.read(tec, 1) ++ port.read(tec + 1, 1) == Seq(0, 1))
    assert(port.read(tec, 2) == Seq(0, 1))
  }
}
