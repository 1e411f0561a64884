package flyframe.host

import chiseltest._
import org.scalatest.Assertions
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.SharedSimulation
import flyframe.params.EscParams

/** The host's way to memory through the SyncManagers: B-44, B-51 to B-54, B-58, PDI-06. */
class HostSequencerSpec extends AnyFlatSpec with SharedSimulation {
  private sealed trait Event

  /** An access at the memory behind, of the bytes `mask`. */
  private case class Memory(write: Boolean, address: Int, mask: Int)            extends Event
  private case class Touch(index: Int, first: Boolean, single: Boolean = false) extends Event
  private case class Close(index: Int)                                          extends Event

  private case class Area(
      start: Int,
      length: Int,
      ecatWrites: Boolean,
      works: Boolean = true,
      mayOpen: Boolean = true,
      isOpen: Boolean = false,
      writer: Int = 0,
      reader: Int = 0,
      buffers: Int = 1
  )

  private class Bench(dut: HostSequencer, p: EscParams) extends Assertions {
    private val random          = new scala.util.Random(1)
    val content                 = Array.tabulate(0x10000)(a => (a * 7 + (a >> 8) * 13 + 1) & 0xff)
    var log: Vector[Event]      = Vector.empty
    private var areas           = Vector.empty[Area]
    private var isOpen          = Vector.empty[Boolean]
    private var lastIndex       = 7
    private var delay           = 0
    var ecatActs: () => Boolean = () => false

    dut.host.req.poke(false)
    dut.memory.ack.poke(false)
    dut.areas.ramOpen.poke(true)
    dut.areas.changing.poke(false)
    set()

    def set(now: Area*): Unit = {
      areas = now.toVector
      isOpen = areas.map(_.isOpen)
      log = Vector.empty
    }

    // What was asked in the cycle before acts in this one; the answer is there in the next.
    private var asked  = Option.empty[(Int, Boolean, Boolean, Boolean, Boolean, Boolean)]
    private var answer = Option.empty[(Boolean, Boolean, Boolean, Boolean, Int)] // last: the offset

    private def act(): Unit = {
      val port = dut.areas.answer
      def any  = random.nextBoolean() // the answer is there for its cycle only
      val (allowed, inBuffer, works, locked, offset) =
        answer.getOrElse((any, any, any, any, random.nextInt(0x20000)))
      port.allowed.poke(allowed)
      port.inBuffer.poke(inBuffer)
      port.works.poke(works)
      port.locked.poke(locked)
      dut.areas.offset.poke(offset)
      answer = asked.map { case (n, write, touch, first, close, single) =>
        val a        = areas.lift(n)
        val works    = a.exists(_.works)
        val right    = works && a.exists(_.ecatWrites != write)
        val inBuffer = right && (single || isOpen(n) || (first && a.exists(_.mayOpen)))
        val buffer   = a.fold(2)(x => if (write) x.writer else x.reader)
        if (touch && inBuffer) {
          log :+= Touch(n, first, single)
          if (first && !single) isOpen = isOpen.updated(n, true)
        }
        if (close && right && (single || isOpen(n))) {
          log :+= Close(n)
          isOpen = isOpen.updated(n, false)
        }
        (inBuffer || (works && single), inBuffer, works, a.exists(!_.works), buffer * a.fold(0)(_.length))
      }
      asked = None
    }
    def open(ram: Boolean): Unit = dut.areas.ramOpen.poke(ram)

    private def step(): Unit = {
      // The table answers in the cycle after.
      val entry = dut.areas.entries(0)
      val area  = if (atTheEnd) areas.headOption.filter(_ => lastIndex == 7) else areas.lift(lastIndex)
      entry.index.poke(if (atTheEnd) 0 else lastIndex min 3)
      entry.start.poke(area.fold(0)(_.start))
      entry.extent.poke(area.fold(0)(a => a.length * a.buffers))
      entry.takesPart.poke(area.isDefined)
      lastIndex = dut.areas.index.peekInt().toInt

      act()
      val acts = ecatActs()
      dut.areas.granted.poke(!acts)
      val access = dut.areas.access
      if (dut.areas.request.peekBoolean() && !acts)
        asked = Some(
          (
            dut.areas.number.peekInt().toInt,
            access.write.peekBoolean(),
            access.touch.peekBoolean(),
            access.first.peekBoolean(),
            access.close.peekBoolean(),
            access.single.peekBoolean()
          )
        )

      // The memory takes its time, as it may.
      val m = dut.memory
      if (m.req.peekBoolean() && delay == 0) {
        val (write, mask) = (m.write.peekBoolean(), m.be.peekInt().toInt)
        val address       = m.addr.peekInt().toInt
        val base          = address / p.lanes * p.lanes
        log :+= Memory(write, base, mask)
        val data = m.wdata.peekInt()
        for (i <- 0 until p.lanes if write && (mask >> i & 1) == 1)
          content(base + i) = (data >> 8 * i & 0xff).toInt
        m.rdata.poke((0 until p.lanes).map(i => BigInt(content(base + i)) << 8 * i).sum)
        m.ack.poke(true)
      } else {
        m.ack.poke(false)
        m.rdata.poke(BigInt(8 * p.lanes, random))
        delay = if (m.req.peekBoolean()) delay - 1 else random.nextInt(4)
      }
    }

    /** The first SyncManager stands in the last entry of the table. */
    var atTheEnd = false

    /** Called with the number of each cycle of an access. */
    var during: Int => Unit = _ => ()

    /** The first SyncManager is switched off (SM-28), on; the table knows at once. */
    def switch(on: Boolean, area: Area): Unit = {
      areas = if (on) Vector(area) else Vector.empty
      isOpen = Vector(false) // the state is that of reset
    }
    def quiet: Boolean = dut.quiet.peekBoolean()

    private def access(write: Boolean, address: Int, mask: Int, data: BigInt): BigInt = {
      val h = dut.host
      h.req.poke(true)
      h.write.poke(write)
      h.addr.poke(address)
      h.be.poke(mask)
      h.wdata.poke(data)
      var waited = 0
      step()
      while (!h.ack.peekBoolean()) {
        assert(waited < 400, "no answer")
        during(waited)
        assert(!quiet || waited == 0, "B-59")
        dut.clock.step()
        step()
        waited += 1
      }
      val result = h.rdata.peekInt()
      dut.clock.step()
      h.req.poke(false)
      step()
      assert(!h.ack.peekBoolean())
      dut.clock.step()
      result
    }

    /** Bytes of a word, those of `mask`. */
    def read(address: Int, mask: Int = (1 << p.lanes) - 1): Seq[Int] = {
      val word = access(write = false, address, mask, 0)
      (0 until p.lanes).map(i => (word >> 8 * i & 0xff).toInt)
    }
    def write(address: Int, data: Seq[Int], mask: Int = (1 << p.lanes) - 1): Unit =
      access(write = true, address, mask, data.zipWithIndex.map { case (b, i) => BigInt(b) << 8 * i }.sum)

    /** One byte, wherever it lies in its word. */
    def readByte(address: Int): Int = read(address, 1 << address % p.lanes)(address % p.lanes)
    def writeByte(address: Int, byte: Int): Unit =
      write(address, Seq.fill(p.lanes)(byte), 1 << address % p.lanes)
    def memory(write: Boolean, address: Int): Event =
      Memory(write, address / p.lanes * p.lanes, 1 << address % p.lanes)
    def random(bound: Int): Int = random.nextInt(bound)
  }

  private val large = EscParams(syncManagers = 3, applicationLayer = 1, ramKiB = 60)
  together("60 KiB", new HostSequencer(large))(
    "B-52: a buffer that ends beyond the address space is closed there, without data" -> {
      dut: HostSequencer =>
        val b = new Bench(dut, large)
        b.set(Area(0x1000, 0x6000, ecatWrites = true, isOpen = true, reader = 2))
        assert(b.readByte(0x3fff) == b.content(0xffff) && b.readByte(0x4000) == 0)
        assert(b.readByte(0x6fff) == 0 && b.log.last == Close(0))
    }
  )

  for (lanes <- Seq(1, 2, 4)) {
    val p = EscParams(syncManagers = 3, applicationLayer = 1, ramKiB = 8, dataBusWidth = 8 * lanes)
    def check(name: String)(run: Bench => Unit): (String, HostSequencer => Unit) =
      name -> (dut => run(new Bench(dut, p)))
    together(s"$lanes-byte words", new HostSequencer(p))(
      check("PDI-06: accesses to registers pass as they are, whatever the SyncManagers cover") { b =>
        b.set(Area(0, 0x4000, ecatWrites = false))
        for (address <- Seq(0x0000, 0x0120, 0x0f7c); mask <- 1 until 1 << lanes) {
          b.set(Area(0, 0x4000, ecatWrites = false))
          assert(b.read(address, mask) == (0 until lanes).map(i => b.content(address + i)))
          assert(b.log == Seq(Memory(write = false, address, mask)))
          b.write(address, Seq.fill(lanes)(0x5a), mask)
          assert(b.log.last == Memory(write = true, address, mask) && b.log.size == 2)
        }
      },
      check("B-44: RAM without SyncManager: enabled bytes only, in ascending order") { b =>
        for (address <- Seq(0x0f80, 0x1000, 0x2ffc); mask <- 0 until 1 << lanes) {
          b.set()
          val bytes = (0 until lanes).filter(i => (mask >> i & 1) == 1)
          val found = b.read(address, mask)
          assert(found == (0 until lanes).map(i => if (bytes.contains(i)) b.content(address + i) else 0))
          assert(b.log == bytes.map(i => b.memory(write = false, address + i)))
          b.set()
          val before = b.content.clone
          b.write(address, Seq(1, 2, 3, 4).take(lanes), mask)
          for (i <- bytes) before(address + i) = i + 1
          assert(
            b.content.sameElements(before) && b.log == bytes.map(i => b.memory(write = true, address + i))
          )
        }
      },
      check("SM-12, B-51: bytes come from and go to the buffer in use, in whatever lane it lies") { b =>
        for (length <- Seq(4, 5, 7); buffer <- 0 to 2; start <- Seq(0x1000, 0x1003)) {
          b.set(Area(start, length, ecatWrites = true, isOpen = true, reader = buffer))
          for (i <- 1 until length - 1)
            assert(b.readByte(start + i) == b.content(start + i + buffer * length))
          assert(
            b.log.collect { case m: Memory => m } ==
              (1 until length - 1).map(i => b.memory(write = false, start + i + buffer * length))
          )
          b.set(Area(start, length, ecatWrites = false, isOpen = true, writer = buffer))
          for (i <- 1 until length - 1) {
            b.writeByte(start + i, 0xc0 + i)
            assert(b.content(start + i + buffer * length) == 0xc0 + i)
          }
        }
      },
      check("SM-01, SM-03, B-54: the first byte opens, each one touches, the last closes") { b =>
        b.set(Area(0x1001, 3, ecatWrites = true, reader = 1))
        for (i <- 0 until 3) assert(b.readByte(0x1001 + i) == b.content(0x1004 + i))
        def m(i: Int) = b.memory(write = false, 0x1004 + i)
        assert(
          b.log == Seq(
            Touch(0, first = true),
            m(0),
            Touch(0, first = false),
            m(1),
            Touch(0, first = false),
            m(2),
            Close(0)
          )
        )
        b.set(Area(0x1001, 3, ecatWrites = true, reader = 1))
        assert(b.readByte(0x1002) == 0 && b.readByte(0x1003) == 0 && b.log.isEmpty, "not open")
      },
      check("B-44: a wide access to a whole buffer opens it, touches every byte and closes") { b =>
        b.set(Area(0x1000 - lanes, lanes, ecatWrites = true), Area(0x1000, lanes, ecatWrites = true))
        b.read(0x1000)
        assert(b.log.contains(Touch(1, first = true, single = lanes == 1)))
        assert(b.log.last == Close(1) && b.log.size == 2 * lanes + 1)
      },
      check("B-54, OP-11: wrong direction: nothing moves, nothing is touched, zeros are read") { b =>
        b.set(
          Area(0x1000, 8, ecatWrites = true, isOpen = true),
          Area(0x1008, 8, ecatWrites = false, isOpen = true)
        )
        val before = b.content.clone
        for (i <- 0 until 8) { b.writeByte(0x1000 + i, 0x77); assert(b.readByte(0x1008 + i) == 0) }
        assert(b.log.isEmpty && b.content.sameElements(before))
      },
      check("SM-14, SM-19: a buffer that may not be opened: nothing moves") { b =>
        b.set(
          Area(0x1000, 8, ecatWrites = true, mayOpen = false),
          Area(0x1008, 8, ecatWrites = false, mayOpen = false)
        )
        assert(b.readByte(0x1000) == 0)
        b.writeByte(0x1008, 1)
        assert(b.log.isEmpty)
      },
      check("SM-27: a deactivated one locks its three buffers") { b =>
        b.set(Area(0x1000, 8, ecatWrites = true, works = false, isOpen = true, buffers = 3))
        for (i <- 0 until 24) { assert(b.readByte(0x1000 + i) == 0); b.writeByte(0x1000 + i, 1) }
        assert(b.log.isEmpty)
        assert(b.readByte(0x1018) == b.content(0x1018))
      },
      check("B-51: the lowest-numbered one counts") { b =>
        b.set(Area(0x1004, 4, ecatWrites = true), Area(0x1000, 16, ecatWrites = false, isOpen = true))
        assert(b.readByte(0x1004) == b.content(0x1004))
        assert(b.log.head == Touch(0, first = true))
        assert(b.readByte(0x1008) == 0)
        b.writeByte(0x1008, 9)
        assert(b.log.last == b.memory(write = true, 0x1008))
      },
      check("B-53: one byte is plain memory in both directions, with events in one") { b =>
        b.set(Area(0x1002, 1, ecatWrites = true, reader = 2, mayOpen = false))
        assert(b.readByte(0x1002) == b.content(0x1002))
        assert(b.log == Seq(b.memory(write = false, 0x1002), Touch(0, first = true, single = true), Close(0)))
        b.writeByte(0x1002, 0x99)
        assert(b.content(0x1002) == 0x99 && b.log.drop(3) == Seq(b.memory(write = true, 0x1002)))
      },
      check("B-52: no memory: denied; a buffer beyond the address space has no data") { b =>
        b.set(Area(0x3000, 4, ecatWrites = true, isOpen = true))
        assert(b.readByte(0x3000) == 0 && b.log.isEmpty, "8 KiB end at 0x3000")
        b.set(Area(0x1000, 4, ecatWrites = true, isOpen = true))
        b.open(ram = false)
        assert(b.readByte(0x1000) == 0 && b.log.isEmpty)
        b.set(Area(0x0fa0, 4, ecatWrites = true, isOpen = true))
        assert(b.readByte(0x0fa1) == b.content(0x0fa1), "user RAM")
        b.open(ram = true)
        b.set(Area(0x2ffe, 0xd002, ecatWrites = true, reader = 1))
        assert(b.readByte(0x2ffe) == 0 && b.log == Seq(Touch(0, first = true)))
      },
      check("SM-28: switched off at any moment of a read: the byte of the buffer, or of plain memory") { b =>
        val area = Area(0x1000, 4, ecatWrites = true, isOpen = true, reader = 1)
        for (moment <- 0 until 18 * lanes; offset <- Seq(1, 3)) {
          b.set(area)
          b.during = n => if (n == moment) b.switch(on = false, area)
          val found = b.readByte(0x1000 + offset)
          assert(Set(b.content(0x1000 + offset), b.content(0x1004 + offset))(found), s"moment $moment")
        }
      },
      check("B-50: switched on at any moment of a write: nothing is closed that was not opened") { b =>
        val area = Area(0x1000, 4, ecatWrites = false, writer = 0)
        for (moment <- 0 until 18 * lanes) {
          b.set(area)
          b.atTheEnd = true
          b.switch(on = false, area)
          b.during = n => if (n == moment) b.switch(on = true, area)
          b.writeByte(0x1003, 0x99)
          assert(!b.log.contains(Close(0)), s"moment $moment")
        }
      },
      check("B-58: the host's touching and closing keep out of ECAT's way") { b =>
        var n = 0
        b.ecatActs = () => { n += 1; b.random(4) > 0 }
        for (_ <- 0 until 30) {
          b.set(Area(0x1000, 3, ecatWrites = true))
          for (i <- 0 until 3) assert(b.readByte(0x1000 + i) == b.content(0x1000 + i))
          assert(b.log.count { case _: Touch => true; case _ => false } == 3 && b.log.last == Close(0))
        }
      }
    )
  }
}
