package flyframe.memory

import chisel3.Bool
import chiseltest._
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.SharedSimulation
import flyframe.params.EscParams
import flyframe.registers.FmmuRegisters

/** Frame processor and host at the same memory at the same time. */
class EscMemorySpec extends AnyFlatSpec with SharedSimulation {
  private val first = 0x0f80 // user RAM and process data RAM are one range of bytes
  private val end   = 0x1000 + 1024

  // With FMMUs a read takes two cycles, and registers are in RAM; the EEPROM's interface is a unit that uses
  // them.
  for (lanes <- Seq(1, 2, 4); (title, units) <- Seq("" -> 0, ", FMMUs, EEPROM" -> 1)) {
    val p = EscParams(dataBusWidth = 8 * lanes, fmmus = units, sii = units)
    together(s"$lanes-byte words$title", new EscMemory(p))(
      Seq[(String, EscMemory => Unit)](
        "PDI-06: host and frames in one RAM at the same time lose no write, " +
          "and the host waits for a bounded time" -> (bothSides(_, p)),
        "FP-31, B-18: process data RAM is absent while closed, user RAM not, and addresses do not wrap" ->
          (absence(_, p)),
        "FP-32: a host that writes a register waits for the log, and comes last" -> (hostAfterLog(_, lanes))
      ).map { case (name, run) =>
        name -> { dut: EscMemory =>
          while (is(dut.clearing)) dut.clock.step()
          run(dut)
        }
      }: _*
    )
  }

  private def is(signal: Bool): Boolean = signal.peekBoolean()

  /** A unit that writes and reads a few bytes of registers in RAM, which nobody else writes. */
  private class UnitSide(dut: EscMemory, random: scala.util.Random) {
    private val content = scala.collection.mutable.Map.empty[Int, Int]
    private var rest    = 0     // cycles until the next access
    private var address = 0
    private var writing = Option.empty[Int]
    private var reads   = false // asked for, not answered
    private var waited  = 0
    var answers         = 0

    /** Before the clock rises. */
    def step(): Unit = {
      if (reads) {
        waited += 1
        assert(waited < 60, "a unit's read was not answered")
        if (is(dut.unitData.valid)) {
          val byte = dut.unitData.bits.peekInt().toInt
          assert(content.get(address).forall(_ == byte), f"unit at 0x$address%04x")
          answers += 1
          reads = false
          rest = random.nextInt(4)
        }
      }
      if (!reads && writing.isEmpty && rest > 0) rest -= 1
      else if (!reads && writing.isEmpty && !is(dut.unitRead.valid)) {
        address = FmmuRegisters.First + random.nextInt(6)
        if (random.nextInt(3) == 0) writing = Some(random.nextInt(256))
        dut.unitRead.valid.poke(writing.isEmpty)
        dut.unitRead.bits.poke(address)
        dut.unitWrite.valid.poke(writing.isDefined)
        dut.unitWrite.bits.address.poke(address)
        dut.unitWrite.bits.data.poke(writing.getOrElse(0))
      }
    }
    private var readTaken, writeTaken = false

    /** What is taken with the rising edge. */
    def notice(): Unit = {
      readTaken = is(dut.unitRead.valid) && is(dut.unitRead.ready)
      writeTaken = is(dut.unitWrite.valid) && is(dut.unitWrite.ready)
    }
    def stepped(): Unit = {
      if (readTaken) {
        dut.unitRead.valid.poke(false)
        reads = true
        waited = 0
      }
      if (writeTaken) {
        dut.unitWrite.valid.poke(false)
        content(address) = writing.get
        writing = None
        rest = 6 + random.nextInt(4) // until it is in RAM
      }
    }
  }

  private def bothSides(dut: EscMemory, p: EscParams): Unit = {
    val lanes = p.lanes
    dut.ramOpen.poke(true)
    val unit    = Option.when(p.hasSii)(new UnitSide(dut, new scala.util.Random(lanes)))
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

    // The frames' reads, by the cycle in which they are answered.
    val reading = scala.collection.mutable.Map.empty[Int, Int]
    var cycle   = 0
    var busy    = true

    /** One core cycle; the frame processor takes every second one, as long as it is busy. */
    def step(): Unit = {
      reading.remove(cycle).foreach(check(0, _, dut.ecat.readData.peekInt()))
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
      if (reads && !readsWhatComes) reading(cycle + EscMemory.readCycles(p)) = from
      if (writes) note(to, mask, data)
      unit.foreach(_.step())
      unit.foreach(_.notice())
      dut.clock.step()
      unit.foreach(_.stepped())
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
      val answer = dut.host.rdata.peekInt()
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
    assert(longest <= (if (p.translates) 7 else 5), s"the host waited $longest cycles")
    assert(unit.forall(_.answers > 500), s"${unit.map(_.answers)} reads of the unit")

    // In the end both sides see what each has written.
    busy = false
    for (address <- first until end by lanes) {
      val answer = host(write = false, address, 0, 0)
      check(0, address, answer)
      check(1, address, answer)
    }
  }

  private def absence(dut: EscMemory, p: EscParams): Unit = {
    val lanes = p.lanes
    dut.ramOpen.poke(true)
    def read(address: Int): Boolean = {
      dut.ecat.read.poke(true)
      dut.ecat.readAddress.poke(address)
      dut.clock.step()
      dut.ecat.read.poke(false)
      if (EscMemory.readCycles(p) > 1) dut.clock.step()
      val lane  = address % lanes
      val found = dut.ecat.readable.peekInt().testBit(lane)
      assert(found == dut.ecat.writable.peekInt().testBit(lane))
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
    assert((dut.value.uint("station_alias").peekInt() & 0xff) == 0xee)
  }
}
