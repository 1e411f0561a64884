package flyframe.sii

import chisel3._
import chiseltest._
import org.scalatest.Assertions
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.SharedSimulation
import flyframe.model.SiiModel
import flyframe.params.EscParams

/** The EEPROM interface at its pins and at its registers: SII-01 to SII-20, OP-06, B-63 to B-66. */
class SiiControllerSpec extends AnyFlatSpec with SharedSimulation {
  import BusEvent._

  private val fast = EscParams(coreClockMhz = 25, sii = 1, siiClockKhz = 1000, siiStartUs = 2)
  private val slow = EscParams(coreClockMhz = 100, sii = 1, siiClockKhz = 400, siiStartUs = 3)

  private def check(p: EscParams, name: String)(run: SiiBench => Unit): (String, SiiController => Unit) =
    name -> (dut => run(new SiiBench(dut, p)))
  private def both(name: String)(run: (SiiBench, Boolean) => Unit): Seq[(String, SiiController => Unit)] =
    for (two <- Seq(false, true))
      yield check(fast, s"$name, ${if (two) "two address bytes" else "one address byte"}")(run(_, two))
  private def one(name: String)(run: SiiBench => Unit) = Seq(check(fast, name)(run))

  // Some contents; the low byte of word 7 is the checksum.
  private def area(bytes: Seq[Int]): Seq[Int] = bytes ++ Seq(SiiModel.checksum(bytes), 0)
  private val first  = area(Seq(0x80, 0xfe, 0x12, 0x34, 1, 2, 0x56, 0x78, 0x34, 0x12, 0xb7, 0xf5, 0x9a, 0))
  private val second = area(Seq(0x05, 0x05, 0x21, 0x43, 3, 4, 0x65, 0x87, 0x78, 0x56, 0x48, 0x0a, 0xa9, 0))
  private def spoiled(a: Seq[Int]) = a.updated(14, a(14) ^ 0x10)

  /** How a load of the configuration area looks on the lines. */
  private def transfer(two: Boolean, address: Int, bytes: Seq[Int]): Seq[BusEvent] =
    heading(two, address) ++ Seq(Start, Written(0xa1 | address >> (if (two) 16 else 8) << 1)) ++
      bytes.init.map(Read(_)) ++ Seq(Read(bytes.last, acknowledged = false), Stop)
  private def heading(two: Boolean, address: Int): Seq[BusEvent] =
    Seq(Start, Written(0xa0 | address >> (if (two) 16 else 8) << 1)) ++
      (if (two) Seq(Written(address >> 8 & 0xff)) else Nil) ++ Seq(Written(address & 0xff))
  private val refused: Seq[BusEvent] = Seq(Start, Written(0xa0, acknowledged = false), Stop)

  // Vectors of SII-02, all of which must be taken as the RTL calculates them.
  private val vectors = Seq(
    Seq(0x00, 0x0d).padTo(14, 0)                         -> 0x46,
    Seq(0x04, 0x01, 0, 0, 0, 0, 0x0f).padTo(14, 0)       -> 0xd8,
    Seq(0x80, 0x03, 0, 0x6e, 0xff, 0, 0xff).padTo(14, 0) -> 0x22,
    Seq(0x05, 0x0e, 0x03, 0x06, 0x10, 0x27).padTo(14, 0) -> 0xd7,
    Seq.fill(14)(0x00)                                   -> 0x30,
    Seq.fill(14)(0xff)                                   -> 0xa3
  )
  private val loads =
    vectors.zipWithIndex.flatMap { case ((bytes, sum), i) =>
      one(s"SII-01, SII-02: vector $i") { b =>
        b.boot(bytes ++ Seq(sum, 0x5a))
        assert(!b.notLoaded && !b.checksumError)
        assert(b.eeprom.log.count(_ == Stop) == 1, "one try is enough")
      } ++ one(s"SII-01, SII-02: vector $i with one bit of the checksum wrong") { b =>
        b.boot(bytes ++ Seq(sum ^ 1 << i, 0))
        assert(b.notLoaded && b.checksumError)
      }
    } ++ one("SII-02: all zeros and all ones are no configuration") { b =>
      for (filler <- Seq(0x00, 0xff)) {
        b.boot(Seq.fill(16)(filler))
        assert(b.notLoaded && b.checksumError && b.configuration.isEmpty)
        b.restart()
      }
    } ++ one("SII-03: the checksum word 0x88A4 switches the check off, its halves do not") { b =>
      b.boot(first.take(14) ++ Seq(0xa4, 0x88))
      assert(!b.notLoaded)
      for (word <- Seq(Seq(0xa4, 0x89), Seq(0xa5, 0x88), Seq(0x88, 0xa4))) {
        b.restart()
        b.boot(first.take(14) ++ word)
        assert(b.notLoaded && b.checksumError)
      }
    } ++ both("SII-05, SII-07, LP-12: after reset the registers get their values") { (b, two) =>
      b.boot(first, two)
      assert(!b.notLoaded && !b.checksumError && !b.commandError && !b.writeError)
      val expected = Map(
        0x140 -> 0x80,
        0x141 -> 0xfe,
        0x150 -> 0x12,
        0x151 -> 0x34,
        0x152 -> 0x56,
        0x153 -> 0x78,
        0x012 -> 0x34,
        0x013 -> 0x12,
        0x142 -> 0xb7,
        0x143 -> 0xf5,
        0x144 -> 0x9a,
        0x102 -> 0xb5 // A5[7:4], and A5[11:9] inverted
      )
      assert(b.configuration == expected)
      assert(b.eeprom.log == transfer(two, 0, first), "the lines")
    } ++ one("SII-05, LED-01: busy, not loaded and loading until the first load is done") { b =>
      b.eeprom = new I2cEeprom(b.memory(first), false)
      assert(b.busy && b.notLoaded && b.loading)
      b.until(100000)(b.configuration.nonEmpty)
      assert(b.busy && b.notLoaded && b.loading, "values still come")
      b.finish()
      assert(!b.notLoaded && !b.loading)
    } ++ both("SII-06: no EEPROM: two tries, then not loaded, no register changed") { (b, two) =>
      b.boot(first, two, _.isAbsent = true)
      assert(b.notLoaded && b.configuration.isEmpty && !b.loading)
      assert(b.eeprom.log == refused ++ refused)
      b.idle(5000)
      assert(b.eeprom.log.size == 6, "no third try")
    } ++ one("SII-06: a wrong checksum: two tries, then not loaded, no register changed") { b =>
      b.boot(spoiled(first))
      assert(b.notLoaded && b.checksumError && !b.commandError && b.configuration.isEmpty)
      assert(
        b.eeprom.log == transfer(two = false, 0, spoiled(first)) ++ transfer(two = false, 0, spoiled(first))
      )
    } ++ (for (byte <- 0 to 3) yield both(s"SII-06: acknowledge $byte missing once: the second try counts") {
      (b, two) =>
        b.boot(first, two, _.refuses = (t, i) => t == 0 && i == byte)
        assert(!b.notLoaded && !b.commandError && b.configuration.size == 12)
        // With one address byte there are only three acknowledges.
        assert(b.eeprom.log.count(_ == Stop) == (if (byte == 3 && !two) 1 else 2))
    }).flatten ++ one("SII-06: a checksum wrong once: the second try counts") { b =>
      val bytes = b.memory(spoiled(first))
      b.eeprom = new I2cEeprom(bytes, false)
      b.until(100000)(b.eeprom.log.contains(Stop))
      bytes(14) = first(14)
      b.finish()
      assert(!b.notLoaded && !b.checksumError && b.configuration.size == 12)
    } ++ one("SII-08: a reload keeps the alias and 0x0141[1,7:4], the others change") { b =>
      b.boot(first)
      b.present(0x102, 3)
      b.configuration = Map.empty
      b.replace(second)
      b.command(4)
      b.finish()
      val now = b.configuration
      assert(!now.contains(0x012) && !now.contains(0x013))
      assert(now(0x141) == 0xf7, "old 0xFE, new 0x05")
      assert(Seq(0x140, 0x150, 0x151, 0x152, 0x153).map(now) == Seq(0x05, 0x21, 0x43, 0x65, 0x87))
      assert(Seq(0x142, 0x143, 0x144).map(now) == Seq(0x48, 0x0a, 0xa9))
      assert(now(0x102) >> 4 == 4)
      assert(!b.loading)
    } ++ one("SII-07, OP-06: a failed reload leaves registers and [12]; a wrong checksum sets [11]") { b =>
      b.boot(first)
      b.configuration = Map.empty
      b.replace(spoiled(second))
      b.command(4)
      b.until(100)(b.busy)
      assert(!b.notLoaded, "nor meanwhile")
      b.finish()
      assert(b.checksumError && !b.notLoaded && !b.commandError && b.configuration.isEmpty)
      b.command(0)
      assert(b.checksumError, "B-64: only a load clears it")
      b.replace(second)
      b.command(4)
      b.finish()
      assert(!b.checksumError && b.configuration.nonEmpty)
    } ++ one("OP-06, B-65: a reload without acknowledge sets [13], the rest unchanged") { b =>
      b.boot(first)
      b.configuration = Map.empty
      b.eeprom.isAbsent = true
      b.command(4)
      b.finish()
      assert(b.commandError && !b.checksumError && !b.notLoaded && b.configuration.isEmpty)
    } ++ one("OP-06: a good reload after a failed first load clears [12]") { b =>
      b.boot(spoiled(first))
      assert(b.notLoaded)
      b.replace(first)
      b.command(4)
      assert(b.notLoaded)
      b.finish()
      assert(!b.notLoaded && !b.checksumError && b.configuration(0x150) == 0x12)
    }

  private val interface = one("SII-10: ECAT has it unless offered or taken; nobody while it is busy") { b =>
    assert(b.busy && !b.ecatMay && !b.pdiMay)
    b.boot(first)
    for (offered <- Seq(false, true); taken <- Seq(false, true)) {
      b.owner(offered, taken)
      assert(b.ecatMay == (!offered && !taken) && b.pdiMay == (offered || taken))
    }
    for (offered <- Seq(false, true)) {
      b.owner(offered, taken = false)
      b.command(1)
      b.idle(2)
      assert(b.busy && !b.ecatMay && !b.pdiMay)
      b.finish()
    }
  } ++ one("SII-12: write enable is set by ECAT, shown, and ends with the frame") { b =>
    b.boot(first)
    assert(!b.writeEnable)
    b.low(1)
    assert(b.writeEnable)
    b.low(0)
    assert(!b.writeEnable)
    b.low(1)
    b.frame()
    assert(!b.writeEnable)
    b.low(1, host = true)
    assert(!b.writeEnable, "the host's write sets none")
  } ++ one("SII-12, SII-15: an ECAT write without enable sets [14] and does nothing") { b =>
    b.boot(first)
    b.clearLog()
    b.ram(0x508) = 0x55
    b.command(2)
    b.idle(2000)
    assert(b.writeError && !b.commandError && !b.busy && b.eeprom.log.isEmpty)
    b.low(1)
    b.frame()
    b.command(2)
    b.idle(2000)
    assert(b.writeError && b.eeprom.log.isEmpty, "enable of the frame before")
    b.low(1)
    b.low(0)
    b.command(2)
    b.idle(2000)
    assert(b.writeError && b.eeprom.log.isEmpty, "enable taken back")
    b.low(1)
    b.command(2)
    b.finish()
    assert(!b.writeError && b.eeprom.content(0) == 0x55)
  } ++ one("SII-12: enable and command in the same cycle") { b =>
    b.boot(first)
    b.clearLog()
    b.together(enable = 1, code = 2)
    b.finish()
    assert(!b.writeError && b.eeprom.log.last == Stop)
    b.frame()
    b.clearLog()
    b.together(enable = 0, code = 2)
    b.idle(100)
    assert(b.writeError && b.eeprom.log.isEmpty)
  } ++ one("SII-12: the PDI needs no enable") { b =>
    b.boot(first)
    b.owner(offered = true, taken = true)
    b.clearLog()
    b.ram(0x504) = 0x20
    b.ram(0x508) = 0xaa
    b.ram(0x509) = 0xbb
    b.command(2, host = true)
    b.finish()
    assert(!b.writeError && b.eeprom.content.slice(0x40, 0x42).toSeq == Seq(0xaa, 0xbb))
  } ++ one("SII-13: a command waits for the other register writes, then it is busy and shown") { b =>
    b.boot(first)
    b.clearLog()
    b.registersBusy(true)
    b.command(1)
    b.idle(200)
    assert(b.busy && b.shown == 1 && b.eeprom.log.isEmpty)
    b.ram(0x504) = 4 // comes behind the command
    b.registersBusy(false)
    b.finish()
    assert(b.shown == 0, "clears itself")
    assert(b.ram(0x508) == 0x34)
  } ++ (for (code <- Seq(3, 5, 6, 7)) yield one(s"SII-15, B-64: invalid command $code sets [13]") { b =>
    b.boot(first)
    b.clearLog()
    b.low(1)
    b.command(code)
    b.idle(2000)
    assert(b.commandError && !b.writeError && !b.busy && b.shown == 0 && b.eeprom.log.isEmpty)
  }).flatten ++ one("SII-13, B-64: command 0 clears [13] and [14]") { b =>
    b.boot(spoiled(first))
    b.command(2)
    b.command(7)
    assert(b.writeError && b.commandError && b.checksumError && b.notLoaded)
    b.command(0)
    assert(!b.writeError && !b.commandError && b.checksumError && b.notLoaded && !b.busy)
  } ++ one("SII-12: the next command clears [13] and [14]") { b =>
    b.boot(first)
    b.command(2)
    b.command(7)
    assert(b.writeError && b.commandError)
    b.command(1)
    assert(!b.writeError && !b.commandError)
    b.finish()
    assert(!b.writeError && !b.commandError)
  } ++ one("B-64: while busy, commands are not taken") { b =>
    b.boot(first)
    b.clearLog()
    b.command(1)
    b.until(10000)(b.eeprom.log.nonEmpty)
    b.command(7)
    b.low(1)
    b.command(2)
    b.finish()
    assert(!b.commandError && b.eeprom.log.count(_ == Stop) == 1)
  } ++ both("SII-15, OP-07: no acknowledge to a read sets [13]; no retry") { (b, two) =>
    b.boot(first, two)
    for (byte <- 0 to (if (two) 3 else 2)) {
      b.clearLog()
      b.eeprom.refuses = (_, i) => i == byte
      b.command(1)
      b.finish()
      assert(b.commandError && !b.writeError, s"byte $byte")
      assert(
        b.eeprom.log.count(_ == Stop) == 1 && b.eeprom.log.count(_ == Start) == (if (
                                                                                   byte == (if (two) 3 else 2)
                                                                                 ) 2
                                                                                 else 1)
      )
      assert(b.eeprom.log.init.last.asInstanceOf[Written].acknowledged == false, "ends with it")
      b.eeprom.refuses = (_, _) => false
      b.command(1)
      b.finish()
      assert(!b.commandError)
    }
  } ++ both("SII-15, OP-07: no acknowledge to a write sets [13]") { (b, two) =>
    b.boot(first, two)
    b.ram(0x504) = 0x20
    for (byte <- 0 to (if (two) 4 else 3)) {
      b.eeprom.refuses = (_, i) => i == byte
      b.low(1)
      b.command(2)
      b.finish()
      assert(b.commandError, s"byte $byte")
    }
  } ++ both("SII-15: an EEPROM busy after a write does not answer, later it does") { (b, two) =>
    b.boot(first, two)
    b.eeprom.writeCycles = 3000
    b.ram(0x504) = 0x08
    b.ram(0x508) = 0x11
    b.ram(0x509) = 0x22
    b.low(1)
    b.command(2)
    b.finish()
    assert(!b.commandError, "written")
    b.command(1)
    b.finish()
    assert(b.commandError, "deaf")
    b.idle(3000)
    b.command(1)
    b.finish()
    assert(!b.commandError && b.ram(0x508) == 0x11 && b.ram(0x509) == 0x22)
  }

  private val transfers = both("SII-14, SII-17, SII-19, B-63: reading") { (b, two) =>
    b.boot(first, two)
    for (
      word <- (if (two) Seq(0, 4, 0x7f, 0x80, 0x1234, 0x8000, 0x3fff0) else Seq(0, 4, 0x7f, 0x80, 0x3f0))
    ) {
      b.clearLog()
      b.address(word)
      b.command(1)
      b.finish()
      val bytes = (0 until 8).map(i => b.eeprom.content((2 * word + i) % b.eeprom.content.length))
      assert(b.eeprom.log == transfer(two, 2 * word, bytes), s"word $word")
      assert((0x508 to 0x50f).map(b.ram) == bytes)
    }
  } ++ both("SII-14, SII-17, SII-18: writing a word") { (b, two) =>
    b.boot(first, two)
    for (word <- (if (two) Seq(0x10, 0x80, 0x7fff, 0x1abcd) else Seq(0x10, 0x80, 0x3ff))) {
      b.clearLog()
      val data = Seq(word * 7 & 0xff, word * 13 >> 2 & 0xff)
      b.address(word)
      b.ram(0x508) = data.head
      b.ram(0x509) = data(1)
      b.ram(0x50a) = 0xee
      val before = b.eeprom.content.clone
      b.low(1)
      b.command(2)
      b.finish()
      assert(b.eeprom.log == heading(two, 2 * word) ++ data.map(Written(_)) ++ Seq(Stop))
      before(2 * word) = data.head
      before(2 * word + 1) = data(1)
      assert(b.eeprom.content.sameElements(before), "that word, no other")
      assert(b.ram(0x508) == data.head && !b.commandError)
    }
  } ++ both("SII-16, B-66: address bits beyond the EEPROM's are ignored") { (b, two) =>
    b.boot(first, two)
    b.clearLog()
    b.address(if (two) 0xfffc0004 else 0xfffffc04)
    b.command(1)
    b.finish()
    assert(b.eeprom.log == transfer(two, 8, first.slice(8, 16)))
  }

  private def waveform(p: EscParams) = Seq(
    check(p, "SII-20: data is stable while the clock is high, but for START and STOP") { b =>
      b.boot(first)
      val e = b.eeprom
      // 16 + 3 bytes of nine clocks, and none more; every START and STOP is one the log expects.
      assert(e.races == 0 && e.log == transfer(two = false, 0, first))
      assert(e.rises.size == 19 * 9 + 2, "bits, the repeated START and the STOP")
      val quarter = p.coreClockMhz * 1000 / p.siiClockKhz / 4
      for (change <- e.changes) {
        assert(e.rises.forall(r => r < change || r - change >= quarter - 3), "set up")
        assert(e.falls.forall(f => f > change || change - f >= 1), "hold")
      }
      for (s <- e.starts) {
        assert(e.rises.forall(r => r > s || s - r >= quarter), "START set up")
        assert(
          e.falls.exists(f => f > s && f - s >= quarter) && e.falls.forall(f => f < s || f - s >= quarter)
        )
      }
      for (s <- e.stops) assert(e.rises.forall(r => r > s || s - r >= quarter), "STOP set up")
    },
    check(p, s"SII-16: the clock is at most ${p.siiClockKhz} kHz, and not much less within a byte") { b =>
      b.boot(first)
      val periods = b.eeprom.rises.zip(b.eeprom.rises.drop(1)).map { case (a, c) => c - a }
      val nominal = p.coreClockMhz * 1000.0 / p.siiClockKhz
      assert(periods.min >= nominal, "faster than asked for")
      assert(periods.count(_ <= nominal + 4) >= 19 * 8, "bits of a byte follow each other")
      for (f <- b.eeprom.falls) { // high and low time
        b.eeprom.rises.filter(_ < f).lastOption.foreach(r => assert(f - r >= (nominal / 2).floor))
        b.eeprom.rises.find(_ > f).foreach(r => assert(r - f >= (nominal / 2).floor))
      }
    },
    check(p, s"SII-20: loading begins ${p.siiStartUs} us after reset") { b =>
      b.boot(first)
      val begin = p.siiStartUs * p.coreClockMhz
      val end   = begin + 2 * p.coreClockMhz * 1000 / p.siiClockKhz
      assert(b.eeprom.starts.head >= begin && b.eeprom.starts.head <= end)
      assert(b.eeprom.falls.head > b.eeprom.starts.head, "the lines are free until then")
    }
  )

  together("25 MHz", new SiiController(fast))(loads ++ interface ++ transfers ++ waveform(fast): _*)
  together("100 MHz", new SiiController(slow))(waveform(slow): _*)
}

/** A [[SiiController]] with an EEPROM at its lines and a memory behind it. */
class SiiBench(dut: SiiController, p: EscParams) extends Assertions {
  private val random = new scala.util.Random(1)

  var eeprom = new I2cEeprom(Array.fill(2048)(0), false)

  /** Registers as they are kept, and those a load wrote. */
  val ram                           = Array.fill(4096)(0)
  var configuration: Map[Int, Int]  = Map.empty
  private var asked: Option[Int]    = None
  private var line: Vector[Boolean] = Vector(true, true) // crossing of the data line

  restart()
  def restart(): Unit = {
    eeprom = new I2cEeprom(Array.fill(2048)(0), false)
    configuration = Map.empty
    line = Vector(true, true)
    asked = None
    dut.lines.get.sda.poke(true)
    dut.lines.get.twoByte.poke(false)
    dut.writeLow.valid.poke(false)
    dut.writeHigh.valid.poke(false)
    dut.byHost.poke(false)
    dut.registersBusy.poke(false)
    dut.frameStart.poke(false)
    dut.offered.poke(false)
    dut.forced.poke(false)
    dut.taken.poke(false)
    dut.enhancedLinkDetection.poke(0)
    dut.fifoSize.poke(7)
    dut.data.valid.poke(false)
    dut.reset.poke(true.B)
    dut.clock.step(2)
    dut.reset.poke(false.B)
  }

  /** One core cycle. */
  def step(): Unit = {
    val scl = !dut.lines.get.sclLow.peekBoolean()
    val sda = !dut.lines.get.sdaLow.peekBoolean()
    eeprom.step(scl, sda && !eeprom.pulls)
    line = line.tail :+ (sda && !eeprom.pulls)
    dut.lines.get.sda.poke(line.head)

    dut.data.valid.poke(asked.isDefined)
    dut.data.bits.poke(asked.fold(0xee)(ram))
    asked = None
    val (mayWrite, mayRead) = (random.nextBoolean(), random.nextBoolean()) // memory is shared
    dut.write.ready.poke(mayWrite)
    dut.read.ready.poke(mayRead)
    if (mayRead && dut.read.valid.peekBoolean()) asked = Some(dut.read.bits.peekInt().toInt)
    if (mayWrite && dut.write.valid.peekBoolean()) {
      val (address, byte) =
        (dut.write.bits.address.peekInt().toInt, dut.write.bits.data.peekInt().toInt)
      ram(address) = byte
      if (address < 0x500) present(address, byte)
      else assert((0x508 to 0x50f).contains(address) || (0x560 to 0x56f).contains(address), "where else?")
    }
    dut.clock.step()
  }
  def idle(cycles: Int): Unit = (0 until cycles).foreach(_ => step())
  def until(limit: Int)(condition: => Boolean): Unit = {
    var waited = 0
    while (!condition) { assert(waited < limit, "never happens"); step(); waited += 1 }
  }
  def finish(): Unit = until(200000)(!busy)

  /** A register has a value, from the EEPROM or otherwise. */
  def present(address: Int, byte: Int): Unit = {
    configuration += address -> byte
    ram(address) = byte
    if (address == 0x141) dut.enhancedLinkDetection.poke(byte >> 4 << 1 | byte >> 1 & 1)
    if (address == 0x102) dut.fifoSize.poke(byte & 7)
  }

  /** Content of an EEPROM that begins with `start`. */
  def memory(start: Seq[Int], two: Boolean = false): Array[Int] = {
    val bytes = Array.tabulate(if (two) 1 << 19 else 2048)(i => (i * 37 + (i >> 8) * 11 + 5) & 0xff)
    start.copyToArray(bytes)
    bytes
  }

  /** The first load, from an EEPROM that begins with `start`. */
  def boot(start: Seq[Int], two: Boolean = false, set: I2cEeprom => Unit = _ => ()): Unit = {
    eeprom = new I2cEeprom(memory(start, two), two)
    set(eeprom)
    dut.lines.get.twoByte.poke(two)
    finish()
  }
  def replace(start: Seq[Int]): Unit = start.copyToArray(eeprom.content)
  def clearLog(): Unit               = eeprom.log = Vector.empty

  def address(word: Int): Unit = for (i <- 0 until 4) ram(0x504 + i) = word >> 8 * i & 0xff

  /** A write to 0x0502, to 0x0503. */
  def low(byte: Int, host: Boolean = false): Unit = {
    dut.byHost.poke(host)
    dut.writeLow.valid.poke(true)
    dut.writeLow.bits.poke((byte & 1) == 1)
    step()
    dut.writeLow.valid.poke(false)
  }
  def command(code: Int, host: Boolean = false): Unit = {
    dut.byHost.poke(host)
    dut.writeHigh.valid.poke(true)
    dut.writeHigh.bits.poke(code)
    step()
    dut.writeHigh.valid.poke(false)
  }
  def together(enable: Int, code: Int): Unit = {
    dut.writeLow.valid.poke(true)
    dut.writeLow.bits.poke(enable == 1)
    command(code)
    dut.writeLow.valid.poke(false)
  }
  def frame(): Unit = { dut.frameStart.poke(true); idle(30); dut.frameStart.poke(false); step() }
  def owner(offered: Boolean, taken: Boolean): Unit = {
    dut.offered.poke(offered)
    dut.taken.poke(taken)
  }
  def registersBusy(busy: Boolean): Unit = dut.registersBusy.poke(busy)

  def busy: Boolean          = dut.busy.peekBoolean()
  def notLoaded: Boolean     = dut.notLoaded.peekBoolean()
  def loading: Boolean       = dut.loading.peekBoolean()
  def checksumError: Boolean = dut.checksumError.peekBoolean()
  def commandError: Boolean  = dut.commandError.peekBoolean()
  def writeError: Boolean    = dut.writeError.peekBoolean()
  def writeEnable: Boolean   = dut.writeEnable.peekBoolean()
  def ecatMay: Boolean       = dut.ecatMayWrite.peekBoolean()
  def pdiMay: Boolean        = dut.pdiMayWrite.peekBoolean()
  def shown: Int             = dut.command.peekInt().toInt
}
