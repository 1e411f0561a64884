package flyframe.can

import flyframe.registers.CanRegisters
import org.scalatest.Assertions._

/** A bit timing to test with.
  *
  * @param prescaler
  *   core cycles per quantum
  */
final case class Rate(name: String, prescaler: Int, setting: BitSetting) {
  def bitCycles: Int = prescaler * setting.length
}

object Rate {

  /** At a core clock of 50 MHz: 10 tq, and 25 tq with the sample point of the fibre. */
  val Fast: Rate = Rate("1 Mbit/s", 5, BitSetting(tseg1 = 6, tseg2 = 3, sjw = 2))
  val Slow: Rate = Rate("125 kbit/s", 16, BitSetting(tseg1 = 21, tseg2 = 3, sjw = 2))
}

/** The lower tester of ISO 16845: all other nodes of the bus in one, bit by bit and quantum by quantum; and
  * the host of the controller under test.
  *
  * What the others do is written as a text, a character per bit or quantum: '0' they drive dominant, '1'
  * recessive, 'R' recessive is forced upon the controller whatever it drives. What the controller is expected
  * to drive: '0', '1', or '.' for either.
  */
class LowerTester(val device: CanUnderTest, val rate: Rate) {
  import CanRegisters._
  private val port = PortStarts.head

  // ---- the bus ----

  /** Plays bits, and compares what the controller drives in the middle of each. */
  def play(others: String, own: String): Unit = {
    assert(others.length == own.length, "the two texts must have the same length")
    val drove = new StringBuilder
    for (level <- others) {
      val half = rate.bitCycles / 2
      drove += symbol(hold(level, half).last)
      hold(level, rate.bitCycles - half)
    }
    compare(others, own, drove.toString)
  }

  /** Plays bits in which the controller has to be recessive. */
  def quietly(others: String): Unit = play(others, "1" * others.length)

  /** Plays bits without a look at what the controller does. */
  def silently(others: String): Unit = play(others, "." * others.length)

  /** Plays quanta; what is driven at the beginning of each counts. */
  def quanta(others: String, own: String): Unit = {
    assert(others.length == own.length, "the two texts must have the same length")
    compare(others, own, others.map(level => symbol(hold(level, rate.prescaler).head)))
  }

  /** Plays quanta, and returns what the controller drove. */
  def quanta(others: String): String = others.map(level => symbol(hold(level, rate.prescaler).head))

  private def hold(level: Char, cycles: Int) = device.run(level != '0', cycles, forced = level == 'R')
  private def symbol(level: Boolean)         = if (level) '1' else '0'

  private def compare(others: String, own: String, drove: String): Unit = {
    val wrong = own.indices.filter(i => own(i) != '.' && own(i) != drove(i))
    assert(wrong.isEmpty, s"\nothers   $others\nexpected $own\ndrove    $drove\n${rate.name}")
  }

  /** Waits at most `bits` for the SOF of the controller, in whose first cycle it ends. */
  def awaitEdge(bits: Int): Unit = {
    val end = device.cycle + bits * rate.bitCycles
    while (device.driven && device.cycle < end) device.run(others = true, 1)
    assert(!device.driven, s"no SOF within $bits bits, ${rate.name}")
  }

  /** The controller begins a frame within `bits` bits. The others go on from the bit behind its SOF, and
    * their bits have its beginnings.
    *
    * @param sof
    *   what the others do in the SOF
    */
  def awaitSof(bits: Int = 12, sof: Char = '1'): Unit = {
    awaitEdge(bits)
    hold(sof, rate.bitCycles)
  }

  /** The others are recessive until core cycle `cycle`, in which a bit of theirs begins again. */
  def until(cycle: Long): Unit = {
    assert(device.cycle <= cycle, "that time is over")
    hold('1', (cycle - device.cycle).toInt)
  }

  /** The bus is idle for some bits. */
  def idle(bits: Int): Unit = quietly("1" * bits)

  // ---- what often happens ----

  /** The others send a frame, which the controller acknowledges. */
  def sendAcked(wire: Wire): Unit = {
    quietly(wire.levels)
    play(Wire.Ack, Wire.Acked)
    quietly(Wire.Eof)
  }

  def intermission(): Unit = quietly(Wire.Intermission)

  /** The controller sends a frame, from bit `from` on, and is acknowledged. */
  def hearFrom(wire: Wire, from: Int): Unit = {
    val rest = wire.levels.drop(from)
    play("1" * rest.length, rest)
    quietly(Wire.Acked)
    quietly(Wire.Eof)
  }

  /** The same when its SOF is over. */
  def hearRest(wire: Wire): Unit = hearFrom(wire, 1)

  /** The controller begins a frame with this bit, sends it and is acknowledged. */
  def hear(wire: Wire): Unit = {
    play("1", "0")
    hearRest(wire)
  }

  /** An active flag or an overload flag. */
  def activeFlag(): Unit = play("1" * 6, "0" * 6)

  def delimiter(): Unit = quietly("1" * 8)

  /** Flag, delimiter and intermission of an active controller. */
  def errorFrame(): Unit = {
    activeFlag()
    delimiter()
    intermission()
  }

  /** The others send a frame up to and with bit `last`, which is the other level than it should be. */
  def sendWrong(levels: String, last: Int): Unit = {
    quietly(levels.take(last))
    quietly(Wire.not(levels(last)).toString)
  }

  /** The controller sends, its SOF is over; bit `last` is changed on the wire. */
  def hearWrong(levels: String, last: Int): Unit = {
    play("1" * (last - 1), levels.slice(1, last))
    play(if (levels(last) == '0') "R" else "0", levels(last).toString)
  }

  // ---- the host ----

  private def little(value: Long, bytes: Int): Seq[Int] =
    (0 until bytes).map(i => (value >> 8 * i & 0xff).toInt)
  private def read(offset: Int, bytes: Int): Long =
    device.read(port + offset, bytes).zipWithIndex.map { case (b, i) => b.toLong << 8 * i }.sum

  /** Sets bit timing and an entry of the filters that lets all pass, and starts.
    *
    * @param control
    *   bits of the control register beside `run`
    */
  def start(control: Int = 0): Unit = {
    val s = rate.setting
    setTiming(rate.prescaler, s)
    setFilter(0, CanFiltersModel.InUse, 0)
    setControl(control | 1)
  }

  def setTiming(prescaler: Int, s: BitSetting): Unit = device.write(
    port + Timing,
    little(prescaler - 1, 2) ++ Seq(s.tseg1 - 1, s.tseg2 - 1 | s.sjw - 1 << 4)
  )

  def setFilter(entry: Int, value: Int, mask: Int): Unit =
    device.write(FilterStarts.head + entry * FilterBytes, little(value, 4) ++ little(mask, 4))

  def setControl(bits: Int): Unit = device.write(port + Control, Seq(bits))
  def command(bits: Int): Unit    = device.write(port + Command, Seq(bits))

  /** Writes frames to slots, from slot 0 on or those given, and requests them with one write. */
  def request(frames: CanFrame*): Unit = requestAt(frames.zipWithIndex.map(_.swap): _*)

  def requestAt(frames: (Int, CanFrame)*): Unit = {
    for ((slot, frame) <- frames) setSlot(slot, frame)
    device.write(port + Requests, little(frames.map(1L << _._1).sum, 2))
  }

  def setSlot(slot: Int, frame: CanFrame): Unit =
    device.write(SlotStarts.head + slot * FrameBytes, frame.bytes())

  def slot(slot: Int): Seq[Int]   = device.read(SlotStarts.head + slot * FrameBytes, FrameBytes)
  def abort(map: Int): Unit       = device.write(port + Aborts, little(map, 2))
  def clearSent(map: Int): Unit   = device.write(port + Sent, little(map, 2))
  def clearFailed(map: Int): Unit = device.write(port + Failed, little(map, 2))
  def pending: Int                = read(Requests, 2).toInt
  def sent: Int                   = read(Sent, 2).toInt
  def failed: Int                 = read(Failed, 2).toInt
  def tec: Int                    = read(ErrorCounters, 2).toInt
  def rec: Int                    = read(ErrorCounters + 2, 2).toInt
  def status: Int                 = read(Status, 1).toInt
  def state: Int                  = status & 3
  def counter(name: String): Int  = read(Counters + CounterNames.indexOf(name), 1).toInt
  def counters: Seq[Int]          = CounterNames.map(counter)
  def rxLevel: Int                = read(RxLevel, 2).toInt
  def release(): Unit             = device.write(port + RxRelease, Seq(1))
  def lastError: (Int, Boolean, Int, Int) = {
    val word = read(LastError, 4)
    ((word & 7).toInt, (word >> 3 & 1) == 1, (word >> 8 & 0x1f).toInt, (word >> 16 & 0x1f).toInt)
  }
  def lostBit: Int = (read(LastError, 4) >> 24 & 0x3f).toInt
  def time: Long =
    device.read(CanUnderTest.TimeAddress, 4).zipWithIndex.map { case (b, i) => b.toLong << 8 * i }.sum

  /** The oldest frame, as 16 bytes, and the FIFO without it. */
  def takeBytes(): Seq[Int] = {
    val bytes = device.read(port + RxFrame, FrameBytes)
    release()
    bytes
  }

  /** All frames of the FIFO, which is empty then. */
  def received(): Seq[CanFrame] = Seq.fill(rxLevel)(CanFrame.of(takeBytes()))
}
