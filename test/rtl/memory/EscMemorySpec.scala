package flyframe.memory

import chisel3.Bool
import chiseltest._
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.SharedSimulation
import flyframe.params.EscParams

/** Frame processor and host at the same memory at the same time. */
class EscMemorySpec extends AnyFlatSpec with SharedSimulation {
  private val first = 0x0f80 // user RAM and process data RAM are one range of bytes
  private val end   = 0x1000 + 1024

  for (lanes <- Seq(1, 2, 4))
    together(s"$lanes-byte words", new EscMemory(EscParams(dataBusWidth = 8 * lanes)))(
      "PDI-06: host and frames in one RAM at the same time lose no write, " +
        "and the host waits for a bounded time" ->
        (bothSides(_, lanes)),
      "FP-31, B-18: process data RAM is absent while closed, user RAM not, and addresses do not wrap" ->
        (absence(_, lanes)),
      "FP-32: a host that writes a register waits for the log, and comes last" -> (hostAfterLog(_, lanes))
    )

  private def is(signal: Bool): Boolean = signal.peek().litToBoolean

  private def bothSides(dut: EscMemory, lanes: Int): Unit = {
    dut.ramOpen.poke(true)
    val random  = new scala.util.Random(lanes)
    val all     = (1 << lanes) - 1
    val content = Array.fill(0x10000)(-1) // unknown until written

    // Each side writes bytes of its own: the frames' are even. For words of several bytes they share words.
    def owned(side: Int, word: Int) =
      (0 until lanes).filter(l => (word + l) % 2 == side).map(1 << _).sum
    def word(side: Int): Int = {
      val candidate = (first + random.nextInt(end - first)) / lanes * lanes
      if (owned(side, candidate) == 0) word(side) else candidate
    }
    def note(address: Int, mask: Int, data: BigInt): Unit =
      for (l <- 0 until lanes if (mask >> l & 1) == 1) content(address + l) = (data >> 8 * l & 0xff).toInt
    def check(side: Int, address: Int, data: BigInt): Unit =
      for (l <- 0 until lanes if (owned(side, address) >> l & 1) == 1 && content(address + l) >= 0)
        assert(
          (data >> 8 * l & 0xff).toInt == content(address + l),
          f"side $side at 0x${address + l}%04x"
        )

    var reading = Option.empty[Int] // the frames' read that answers in this cycle
    var cycle   = 0
    var busy    = true

    /** One core cycle; the frame processor takes every second one, as long as it is busy. */
    def step(): Unit = {
      reading.foreach(check(0, _, dut.ecat.readData.peek().litValue))
      reading = None
      val turn           = busy && cycle % 2 == 0
      val reads          = turn && random.nextInt(8) > 0
      val writes         = turn && random.nextInt(8) > 0
      val (from, to)     = (word(0), word(0))
      val mask           = 1 + random.nextInt(all) & owned(0, to)
      val data           = BigInt(8 * lanes, random)
      val readsWhatComes = from == to && writes // gives the old word; checked elsewhere
      dut.ecat.read.poke(reads)
      dut.ecat.readAddress.poke(from)
      dut.ecat.write.poke(writes && mask != 0)
      dut.ecat.writeAddress.poke(to)
      dut.ecat.writeMask.poke(mask)
      dut.ecat.writeData.poke(data)
      if (reads && !readsWhatComes) reading = Some(from)
      if (writes) note(to, mask, data)
      dut.clock.step()
      cycle += 1
    }

    var longest = 0
    def host(write: Boolean, address: Int, mask: Int, data: BigInt): BigInt = {
      dut.host.req.poke(true)
      dut.host.write.poke(write)
      dut.host.addr.poke(address)
      dut.host.be.poke(mask)
      dut.host.wdata.poke(data)
      var waited = 0
      while (!is(dut.host.ack)) {
        assert(waited < 20, f"no answer at 0x$address%04x")
        step()
        waited += 1
      }
      longest = longest max waited
      val answer = dut.host.rdata.peek().litValue
      dut.host.req.poke(false)
      step()
      (0 until random.nextInt(3)).foreach(_ => step())
      answer
    }
    def hostRead(address: Int): Unit = check(1, address, host(write = false, address, 0, 0))

    for (_ <- 0 until 4000) {
      val address = word(1)
      if (random.nextBoolean()) hostRead(address)
      else {
        val mask = 1 + random.nextInt(all) & owned(1, address)
        val data = BigInt(8 * lanes, random)
        host(write = true, address, mask, data)
        note(address, mask, data)
      }
    }
    // A look-up and a write, each after a cycle of the frame processor at most, and the answer.
    assert(longest <= 5)

    // In the end both sides see what each has written.
    busy = false
    for (address <- first until end by lanes) {
      val answer = host(write = false, address, 0, 0)
      check(0, address, answer)
      check(1, address, answer)
    }
  }

  private def absence(dut: EscMemory, lanes: Int): Unit = {
    dut.ramOpen.poke(true)
    def read(address: Int): Boolean = {
      dut.ecat.read.poke(true)
      dut.ecat.readAddress.poke(address)
      dut.clock.step()
      dut.ecat.read.poke(false)
      val lane  = address % lanes
      val found = dut.ecat.readable.peek().litValue.testBit(lane)
      assert(found == dut.ecat.writable.peek().litValue.testBit(lane))
      found
    }
    assert(read(0x1000) && read(end - 1) && !read(end))
    assert(read(first) && read(0x0fff) && !read(first - 1))
    dut.ramOpen.poke(false)
    assert(!read(0x1000) && !read(end - 1))
    assert(read(first) && read(0x0fff))
    dut.ramOpen.poke(true)
    assert(!read(0x10000 + first), "B-18: addresses do not wrap")
  }

  private def hostAfterLog(dut: EscMemory, lanes: Int): Unit = {
    // 200 bytes to the alias would not pass the frame processor, but the log does not look at addresses.
    for (i <- 0 until 200) {
      dut.ecat.write.poke(true)
      dut.ecat.logByte.poke(true)
      dut.ecat.writeAddress.poke(0x0012)
      dut.ecat.writeMask.poke(1 << 2 % lanes)
      dut.ecat.writeData.poke(BigInt(i) << 8 * (2 % lanes))
      dut.clock.step()
    }
    dut.ecat.write.poke(false)
    dut.ecat.logByte.poke(false)
    dut.ecat.commit.poke(true)
    dut.clock.step()
    dut.ecat.commit.poke(false)
    dut.clock.step(3)
    dut.host.req.poke(true)
    dut.host.write.poke(true)
    dut.host.addr.poke(0x0012)
    dut.host.be.poke(1 << 2 % lanes)
    dut.host.wdata.poke(BigInt(0xee) << 8 * (2 % lanes))
    var waited = 0
    while (!is(dut.host.ack)) { dut.clock.step(); waited += 1; assert(waited < 300) }
    assert(waited > 190)
    dut.host.req.poke(false)
    dut.clock.step(300)
    assert((dut.value.uint("station_alias").peek().litValue & 0xff) == 0xee)
  }
}
