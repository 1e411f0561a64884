package flyframe.can

import flyframe.params.CanParams
import flyframe.registers.CanRegisters

/** The golden model of a CAN port behind its registers.
  *
  * @param port
  *   0: F, 1: T
  * @param isTolerant
  *   a recessive FDF is a protocol exception (CAN-08); on the ring it is a form error (FB-11)
  */
class CanPortModel(p: CanParams = CanParams(), port: Int = 0, isTolerant: Boolean = true)
    extends CanUnderTest
    with CanFrames
    with CanModes {
  import CanPortModel._
  private val prefix  = CanRegisters.Ports(port)
  private val start   = CanRegisters.PortStarts(port)
  private val slots0  = CanRegisters.SlotStarts(port)
  private val filter0 = CanRegisters.FilterStarts(port)
  private val memory  = new CanMemoryModel(CanRegisters(port, p))
  private val records = new CanRecords
  private val engine  = new CanEngineModel(this, this, records, () => time, isTolerant)
  private val fifo    = new CanFifoModel(p.rxFrames)
  private val slots   = new CanSlotsModel(p.slots, inSlot, p.offerCycles)
  private val filters = new CanFiltersModel(p.filters, filterWords)

  private var cycles = 0L
  private var timing = Option.empty[BitTimingModel] // while it runs
  private var left   = 0                            // cycles of the quantum

  def cycle: Long = cycles

  /** The us counter. */
  private def time: Int = (cycles / p.coreClockMhz).toInt

  // ---- time passes ----

  // Kept beside the registers, as they are looked at in each quantum.
  private var isListening = false
  private var isLooped    = false
  private var prescaler   = 1

  def driven: Boolean = engine.level || isListening || isLooped

  def step(heard: Boolean): Unit = {
    for (t <- timing) {
      left -= 1
      if (left == 0) {
        t.quantum(if (isLooped) engine.level else if (isListening) heard && engine.level else heard)
        left = prescaler
      }
    }
    slots.pass(1)
    cycles += 1
  }

  // ---- what the engine asks and tells ----

  def listenOnly: Boolean     = isListening
  def loopBack: Boolean       = isLooped
  def recoversItself: Boolean = control("recover_itself")

  private def control(name: String) = memory.value(s"${prefix}_$name") == 1

  private def inSlot(n: Int) =
    CanFrame.of(memory.bytes(slots0 + n * CanRegisters.FrameBytes, CanRegisters.FrameBytes))

  def offered: Option[CanFrame] = slots.offer.map(inSlot)
  def begins(): Unit            = slots.begins()
  def fails(): Unit             = slots.fails(control("one_shot"))

  def sent(time: Int): Unit = {
    val slot = slots.succeeds()
    memory.put(slots0 + slot * CanRegisters.FrameBytes + TimeStamp, Seq(time & 0xff, time >> 8 & 0xff))
  }

  def received(frame: CanFrame, time: Int): Unit =
    for (filter <- filters.matching(frame)) {
      if (!fifo.put(frame.bytes(filter, time))) records.overrun()
      // An own frame comes in loop back only.
      if (control("bridge") && !engine.isSending && CanParams.BridgeFilters.contains(filter)) bridges(frame)
    }

  /** What becomes of a frame for the bridge (BR-01): the other port takes it. */
  var bridges: CanFrame => Unit = _ => ()

  /** A frame of the other port (BR-01, BR-02). */
  def bridged(frame: CanFrame): Unit = new CanBridgeModel(slots, memory, slots0, records).take(frame)

  private def filterWords(entry: Int) = {
    def word(from: Int) =
      (0 until 4).map(i => memory.byte(filter0 + entry * CanRegisters.FilterBytes + from + i) << 8 * i).sum
    (word(0), word(4))
  }

  // ---- registers ----

  def write(address: Int, bytes: Seq[Int]): Unit =
    for ((byte, i) <- bytes.zipWithIndex; r <- memory.register(address + i))
      if (r.pdi.writable) writeByte(address + i, byte)

  private def writeByte(address: Int, byte: Int): Unit =
    if (address >= filter0) memory.writeFilter(address, byte)
    else if (address >= slots0) {
      val slot    = (address - slots0) / CanRegisters.FrameBytes
      val isStamp = Seq(TimeStamp, TimeStamp + 1).contains((address - slots0) % CanRegisters.FrameBytes)
      if (!slots.isPending(slot) && !isStamp) memory.write(address, byte)
    } else
      address - start match {
        case CanRegisters.Control =>
          memory.write(address, byte)
          controls()
        case at if at >= CanRegisters.Timing && at < CanRegisters.Timing + 4 =>
          if (!control("run")) memory.write(address, byte)
        case CanRegisters.Command   => command(byte)
        case CanRegisters.RxRelease => fifo.release()
        case at if at >= CanRegisters.Requests =>
          val map = byte << 8 * (at % 2)
          at & ~1 match {
            case CanRegisters.Requests => slots.request(map)
            case CanRegisters.Aborts   => slots.abort(map)
            case CanRegisters.Sent     => slots.sent &= ~map
            case _                     => slots.failed &= ~map
          }
        case _ =>
      }

  private def command(byte: Int): Unit = {
    if ((byte & 1) != 0) engine.recover()
    if ((byte & 2) != 0) records.clear()
    if ((byte & 4) != 0) slots.abort(0xffff)
  }

  private def setting = {
    def segment(name: String) = memory.value(s"${prefix}_$name") + 1
    BitSetting(segment("tseg1"), segment("tseg2"), segment("sjw"), control("three_samples"))
  }

  // CB-15 beside CAN-01.
  private def isPossible =
    setting.isPossible && setting.tseg1 * (memory.value(s"${prefix}_prescaler") + 1) >= 3

  private def controls(): Unit = {
    isListening = control("listen_only")
    isLooped = control("loop_back")
    val runs = control("run") && isPossible
    if (runs && timing.isEmpty) {
      prescaler = memory.value(s"${prefix}_prescaler") + 1
      left = prescaler
      timing = Some(new BitTimingModel(setting, engine))
      engine.start()
    } else if (!runs && timing.nonEmpty) {
      timing = None
      engine.stop()
    }
  }

  /** TEC as the host has read its first byte: one with words of a byte reads the other one later (CB-16). */
  private var tecRead = 0

  def read(address: Int, count: Int): Seq[Int] = (address until address + count).map { a =>
    if (a == start + CanRegisters.ErrorCounters || p.hostBytes > 1) tecRead = engine.tec
    if (a >= CanUnderTest.TimeAddress && a < CanUnderTest.TimeAddress + 4)
      time >> 8 * (a - CanUnderTest.TimeAddress) & 0xff
    else memory.register(a).fold(0)(memory.read(_, a, name => status(name.stripPrefix(s"${prefix}_"))))
  }

  private def status(name: String): BigInt = name match {
    case "state" =>
      if (timing.isEmpty) CanState.Stopped
      else if (engine.isBusOff) CanState.BusOff
      else if (engine.isPassive) CanState.Passive
      else CanState.Active
    case "warning"        => flag(engine.warns)
    case "integrating"    => flag(timing.nonEmpty && engine.isIntegrating)
    case "sending"        => flag(engine.isSending)
    case "receiving"      => flag(engine.isReceiving)
    case "impossible"     => flag(!isPossible)
    case "tec"            => tecRead
    case "rec"            => engine.rec
    case "error_type"     => records.errorType
    case "error_sender"   => flag(records.asSender)
    case "error_field"    => records.errorField
    case "error_bit"      => records.errorBit
    case "lost_bit"       => records.lostBit
    case "rx_level"       => fifo.level
    case "pending"        => slots.pending
    case "sent"           => slots.sent
    case "failed"         => slots.failed
    case "bridge_dropped" => records.bridgeDropped
    case _                => received(name).getOrElse(counted(name))
  }

  private def flag(set: Boolean): BigInt = if (set) 1 else 0

  private def counted(name: String): BigInt =
    CanRegisters.CounterNames.indexOf(name) match {
      case -1 => 0
      case n  => records.counter(n)
    }

  /** A field of the oldest frame received. */
  private def received(name: String): Option[BigInt] =
    rxFields.get(name).map(f => (fifo.oldest & f.mask) >> f.low)
  private lazy val rxFields =
    CanRegisters(port, p)
      .find(_.address == start + CanRegisters.RxFrame)
      .get
      .fields
      .map(f => f.name.stripPrefix(s"${prefix}_") -> f)
      .toMap
}

object CanPortModel {

  /** Of a frame in a slot: the byte at which its time stamp begins. */
  private val TimeStamp = 6
}
