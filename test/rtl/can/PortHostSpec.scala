package flyframe.can

import chisel3._
import chiseltest._
import flyframe.params.CanParams
import flyframe.registers.CanRegisters
import org.scalatest.flatspec.AnyFlatSpec
import scala.collection.mutable
import scala.util.Random

/** The registers of a port, beside a memory that takes its time. */
class PortHostSpec extends AnyFlatSpec with ChiselScalatestTester {
  private val p     = CanParams()
  private val start = CanRegisters.PortStarts(0)

  private class Host(dut: PortHost, random: Random) {
    private val words = mutable.Map.empty[Int, Long].withDefaultValue(0L)

    /** Slots as they were appended; pulses of orders, and whether they came with the acknowledgement. */
    val appended = mutable.ArrayBuffer.empty[Int]
    val orders   = mutable.ArrayBuffer.empty[String]

    private val pulses = Seq(
      "recover"  -> dut.orders.recover,
      "counters" -> dut.orders.clearCounters,
      "release"  -> dut.orders.release,
      "asked"    -> dut.orders.requested
    )
    private val maps =
      Seq("abort" -> dut.orders.abort, "sent" -> dut.orders.clearSent, "failed" -> dut.orders.clearFailed)
    for (pin <- Seq(dut.host.req, dut.host.write, dut.done, dut.appended, dut.waits, dut.counting))
      pin.poke(false)
    dut.status.pending.poke(0)

    /** A job, as [[PortMemory]] does it. */
    private def work() = {
      val job    = dut.job.bits
      val source = words(job.source.peekInt().toInt)
      dut.data.poke(source)
      if (job.write.peekBoolean()) {
        val bytes = job.bytes.peekInt().toInt
        val data  = job.data.peekInt().toLong
        val mask  = (0 to 3).filter(i => (bytes >> i & 1) == 1).map(i => 0xffL << 8 * i).sum
        words(job.target.peekInt().toInt) = source & ~mask | data & mask
      }
    }

    private def access(address: Int, write: Boolean, data: Long, be: Int): Long = {
      dut.host.req.poke(true)
      dut.host.write.poke(write)
      dut.host.addr.poke(address)
      dut.host.wdata.poke(data)
      dut.host.be.poke(be)
      var read   = Option.empty[Long]
      var cycles = 0
      while (read.isEmpty) {
        val isDone = dut.job.valid.peekBoolean() && random.nextInt(3) == 0
        if (isDone) work()
        dut.done.poke(isDone)
        val isAppended = dut.append.valid.peekBoolean() && random.nextBoolean()
        if (isAppended) appended += dut.append.bits.peekInt().toInt
        dut.appended.poke(isAppended)
        val acks = dut.host.ack.peekBoolean()
        for ((name, pin) <- pulses if pin.peekBoolean()) orders += s"$name ${if (acks) "" else "early"}".trim
        for ((name, pin) <- maps if pin.peekInt() != 0) orders += f"$name ${pin.peekInt().toInt}%04x"
        if (acks) read = Some(dut.host.rdata.peekInt().toLong)
        cycles += 1
        assert(cycles < 500, "no acknowledgement")
        dut.clock.step()
      }
      dut.host.req.poke(false)
      dut.done.poke(false)
      dut.appended.poke(false)
      dut.clock.step()
      read.get
    }
    def write(address: Int, data: Long, be: Int = 15): Unit = access(address, write = true, data, be)
    def read(address: Int, be: Int = 15): Long              = access(address, write = false, 0, be)
  }

  private def host(body: (PortHost, Host) => Unit): Unit = hostOf(p)(body)
  private def hostOf(p: CanParams)(body: (PortHost, Host) => Unit): Unit =
    test(new PortHost(p, 0))(dut => body(dut, new Host(dut, new Random(1))))

  "CB-12: a request of some slots" should "append each that is not pending, the first one first, and once" in
    host { (dut, host) =>
      dut.status.pending.poke(0x0014)
      host.write(start + CanRegisters.Requests, 0x8035, be = 3)
      assert(host.appended == Seq(0, 5, 15) && host.orders == Seq("asked"))
      assert(host.read(start + CanRegisters.Requests) == 0x0014)
      // Only the high byte is written.
      host.write(start + CanRegisters.Requests, 0x4001, be = 2)
      assert(host.appended == Seq(0, 5, 15, 14))
      // All are pending, and an order to abort beside: one access may do both.
      host.orders.clear()
      dut.status.pending.poke(0xffff)
      host.write(start + CanRegisters.Requests, 0x00810003L)
      assert(host.appended == Seq(0, 5, 15, 14) && host.orders == Seq("abort 0081"))
    }

  "CAN-42, CB-12: orders" should "come once, with the acknowledgement" in host { (_, host) =>
    host.write(start, 0x0700, be = 2)
    assert(host.orders == Seq("recover", "counters", "abort ffff"))
    host.orders.clear()
    host.write(start, 0x0700, be = 1) // the command is not written
    host.write(start + CanRegisters.RxLevel, 0, be = 4)
    host.write(start + CanRegisters.Sent, 0x00020001)
    host.read(start + CanRegisters.Sent)
    assert(host.orders == Seq("release", "sent 0001", "failed 0002"))
  }

  "CB-04: the bit timing" should "not change while the port runs" in host { (dut, host) =>
    def timing = {
      val t = dut.timing
      Seq(t.prescaler, t.tseg1, t.tseg2, t.sjw).map(_.peekInt().toInt)
    }
    host.write(start + CanRegisters.Timing, 0x4bd50312L)
    assert(timing == Seq(0x312, 0x15, 0xb, 0x4))
    host.write(start + CanRegisters.Timing, 0x21000000L, be = 8)
    assert(timing == Seq(0x312, 0x15, 0x1, 0x2))
    host.write(start, 0x01, be = 1)
    assert(dut.control.run.peekBoolean())
    host.write(start + CanRegisters.Timing, 0x11111111L)
    assert(timing == Seq(0x312, 0x15, 0x1, 0x2))
    assert(host.read(start + CanRegisters.Timing) == 0x21150312L, "bits that are none are 0")
    host.write(start, 0x00, be = 1)
    host.write(start + CanRegisters.Timing, 0x00000001L, be = 3)
    assert(timing == Seq(1, 0x15, 0x1, 0x2))
  }

  "CB-12: a slot" should "take what is written unless it is pending, but for its time stamp" in
    host { (dut, host) =>
      val slot = CanRegisters.SlotStarts(0) + 3 * CanRegisters.FrameBytes
      host.write(slot, 0xffffffffL)
      assert(host.read(slot) == 0xdfffffffL, "bit 29 of the identifier word is 0")
      host.write(slot + 4, 0x1234567aL)
      assert(host.read(slot + 4) == 0x0000000aL)
      host.write(slot + 8, 0xaabbccddL, be = 6)
      assert(host.read(slot + 8) == 0x00bbcc00L)
      dut.status.pending.poke(1 << 3)
      host.write(slot + 8, 0x11111111L)
      assert(host.read(slot + 8) == 0x00bbcc00L)
    }

  "CB-11: an entry of the filters" should "be in force when its last byte is written, all of it" in
    host { (_, host) =>
      val entry = CanRegisters.FilterStarts(0) + 2 * CanRegisters.FilterBytes
      host.write(entry, 0x12345678L)
      assert(host.read(entry) == 0)
      host.write(entry + 4, 0x00aabbccL, be = 7)
      assert(host.read(entry) == 0 && host.read(entry + 4) == 0)
      host.write(entry + 4, 0xdf000000L, be = 8)
      assert(host.read(entry) == 0x12345678L && host.read(entry + 4) == 0xdfaabbccL)
    }

  "CB-16: TEC" should "be that of one moment for a host that reads it byte by byte" in
    hostOf(p.copy(hostBytes = 1)) { (dut, host) =>
      val at = start + CanRegisters.ErrorCounters
      for (first <- Seq(248, 256); behind <- Seq(0, 255, 256)) {
        dut.status.tec.poke(first)
        val low = host.read(at, be = 1) & 0xff
        dut.status.tec.poke(behind)
        host.read(at, be = 4)
        host.read(start, be = 1)
        host.write(at, 0, be = 1)
        assert((host.read(at, be = 2) & 0xff00 | low) == first)
      }
    }

  it should "be that of now for a host that reads it at once" in
    hostOf(p.copy(hostBytes = 2)) { (dut, host) =>
      for (tec <- Seq(256, 248, 256)) {
        dut.status.tec.poke(tec)
        assert((host.read(start + CanRegisters.ErrorCounters, be = 3) & 0xffff) == tec)
      }
    }

  "CAN-46: what is nobody's" should "read 0, and take nothing" in host { (_, host) =>
    for (
      address <- Seq(start + 0x40, CanRegisters.PortStarts(1), CanRegisters.FilterStarts(0) + 8 * p.filters)
    ) {
      host.write(address, 0xffffffffL)
      assert(host.read(address) == 0, f"0x$address%04x")
    }
    assert(host.orders.isEmpty && host.appended.isEmpty)
  }
}
