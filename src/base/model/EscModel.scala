package flyframe.model

import flyframe.params.EscParams
import flyframe.protocol.LoopSetting
import flyframe.registers.{DlRegisters, Register}

/** A slave controller as the rules in `docs/rules` describe it: frame in, frame out, state visible.
  *
  * Independent of the RTL: it shares the register and parameter data, no logic.
  *
  * @param eeprom
  *   content of the SII EEPROM, bytes; None: a configuration of zeros has been loaded
  * @param added
  *   registers of a product beside those of the units
  * @param addedUnits
  *   the units behind them
  */
class EscModel(
    val p: EscParams,
    eeprom: Option[Seq[Int]] = None,
    added: Seq[Register] = Nil,
    addedUnits: Seq[ModelUnit] = Nil
) {
  // By name of the field. The model asks for them with every access.
  private val statuses: Map[String, () => Boolean] = (0 until 4).flatMap { y =>
    Seq[(String, () => Boolean)](
      s"physical_link_port$y" -> (() => detection.fold(links(y))(_.found(y))),
      s"communication_port$y" -> (() => links(y)),
      s"loop_closed_port$y"   -> (() => !wanted(y))
    )
  }.toMap

  private val portNumbers = 0 until p.ports
  private val links       = Array.fill(p.ports)(true)

  // Auto close: written, or a good frame, since the link came up (LP-04).
  private val released = Array.fill(p.ports)(true)
  private val opened   = Array.fill(p.ports)(true)

  /** What the management bus leads to. */
  var phys: PhyBus = PhyBus.Empty
  private val detection: Option[LinkModel] =
    Option.when(p.detectsLinks)(new LinkModel(p, () => phys, y => space.enhancedLink(y)))
  private val space: LocalSpace =
    new LocalSpace(p, eeprom, status, added, addedUnits ++ detection, () => phys)

  val registers: ModelRegisters = space.registers

  /** The smoke detector, where there is one. */
  val alarm: Option[AlarmModel] = space.alarm
  val clock: Option[ClockModel] = space.clock

  /** The byte at `address` tells a time, which the model does not know to the nanosecond. */
  def isTime(address: Int): Boolean = space.isTime(address)

  /** A frame is still leaving delayed when the next one begins: that gets no datagram (AP-09). */
  var waiting: Boolean = false

  /** What appending has done to the last frame. */
  def extension: Extension = extended
  private var extended     = Extension()

  // A temporary loop setting (B-31): the settings to return to, and the time left.
  private var temporary: Option[(Seq[Int], Int)] = None
  updateLoops()

  // ---- ports ----

  private def setting(port: Int): Int = registers.value(s"loop_port$port")

  private def wanted(port: Int): Boolean = setting(port) match {
    case LoopSetting.Auto      => links(port)
    case LoopSetting.AutoClose => links(port) && released(port)
    case LoopSetting.Open      => true
    case _                     => false
  }

  private def updateLoops(): Unit = {
    portNumbers.foreach(y => opened(y) = wanted(y))
    if (!opened.contains(true)) opened(0) = true // recovery port (LP-06)
    space.watch()
  }

  /** Frames leave and enter at this port. */
  def open(port: Int): Boolean = opened(port)

  private def status(name: String): Int = if (statuses(name)()) 1 else 0

  /** The link input of the port says so. */
  def setLink(port: Int, up: Boolean): Unit = {
    detection.fold(change(port, up))(_.signal(port, up))
    follow()
  }

  /** Links are what link detection makes of them. */
  private def follow(): Unit = {
    for (d <- detection; y <- portNumbers if links(y) != d.link(y)) change(y, d.link(y))
    updateLoops()
  }

  private def change(port: Int, up: Boolean): Unit = {
    if (links(port) && !up && opened(port) && setting(port) == 0) registers.count(s"lost_link_port$port")
    if (!up) released(port) = false
    links(port) = up
    if (!up) space.clock.foreach(_.portGoes(port))
  }

  /** Bus or host ask for a reset (SYS-04). */
  def resetRequested: Boolean = space.resetRequested

  /** The resets of PHYs that are active, a bit per port (LNK-10). */
  def phyResets: Int = detection.fold(0)(_.resets)

  // ---- local side ----

  /** Process data RAM is open (FP-31). */
  def pdiOperational: Boolean = space.pdiOperational
  def pdiOperational_=(on: Boolean): Unit = {
    space.pdiOperational = on
    space.watch()
  }

  /** A byte as the host reads it, with all that reading does; 0 where nothing is. */
  def hostRead(address: Int): Int = space.hostRead(address)

  /** The bytes from `address` on as the host reads them in one access. */
  def hostRead(address: Int, bytes: Int): Seq[Int] = space.hostRead(address, bytes)

  def hostWrite(address: Int, byte: Int): Unit = space.hostWrite(address, byte)

  /** The level of the interrupt to the host (IRQ-01). */
  def interrupt: Boolean = space.interrupt

  /** Lets time pass, for watchdogs and temporary loop settings. */
  def advanceMs(ms: Int): Unit = {
    space.watchdogs.foreach(_.advance(ms * 25000L))
    alarm.foreach(_.advance(ms * 1000L))
    detection.foreach(_.advanceMs(ms))
    space.advance(ms * 1000000L)
    follow()
    advanceLoops(ms)
  }

  /** The levels of the general purpose inputs. */
  def generalInputs(levels: Long): Unit = space.generalPurpose.inputs = levels

  /** Digital outputs and inputs. */
  def digital: DigitalModel = space.digital

  /** The same for times too short to matter to loop settings. */
  def advanceUs(us: Int): Unit = {
    space.watchdogs.foreach(_.advance(us * 25L))
    alarm.foreach(_.advance(us))
    detection.foreach(_.advanceUs(us))
    space.advance(us * 1000L)
    space.watch()
  }

  private def advanceLoops(ms: Int): Unit = temporary.foreach { case (former, left) =>
    if (ms < left) temporary = Some(former -> (left - ms))
    else {
      temporary = None
      registers.set("temporary_use", 0)
      portNumbers.foreach(y => registers.set(s"loop_port$y", former(y)))
      updateLoops()
    }
  }

  // ---- frames ----

  /** A frame arrives at `port`; what leaves the controller, and where. None: nothing leaves (the loop is
    * closed).
    */
  def receive(port: Int, frame: WireFrame): Option[(Int, SentFrame)] = {
    val received = Receiver.receive(frame)
    extended =
      Extension(nibbles = received.preamble + (if (received.hasSfd) 1 else 0) + received.payload.size)
    val wasOpen = opened(port)
    space.clock.foreach(_.portBegins(port))
    val sent = Option.when(wasOpen)(pass(port, received))
    // Counted when the frame is over: a datagram in it still reads the old values.
    if (wasOpen) {
      registers.count(s"rx_er_port$port", received.rxErrors)
      received.verdict match {
        case Verdict.Invalid   => registers.count(s"invalid_frame_port$port")
        case Verdict.Forwarded => registers.count(s"forwarded_error_port$port")
        case _                 =>
      }
    }
    if (received.good && links(port)) released(port) = true
    detection.foreach(_.errors(port, received.rxErrors))
    follow()
    space.advance(40L * frame.symbols.size)
    sent
  }

  /** Symbols with RX_ER outside a frame (HINT-04). */
  def falseCarrier(port: Int, symbols: Int): Unit = {
    if (opened(port)) registers.count(s"rx_er_port$port", symbols)
    detection.foreach(_.errors(port, symbols))
    follow()
  }

  /** The way from behind loop-back `port` on (LP-08, LP-09). */
  private def pass(port: Int, received: ReceivedFrame): (Int, SentFrame) = {
    val cycle = Seq(3, 1, 2, 0).filter(_ < p.ports)
    val route = (cycle ++ cycle ++ cycle).dropWhile(_ != port).tail

    // After the loop-back of port 0 comes the processing unit, then the cycle starts again.
    def walk(left: Seq[Int], through: Boolean, payload: Vector[Int], bad: Boolean): (Int, SentFrame) = {
      val added = if (through && !waiting) alarm.flatMap(_.datagram) else None
      if (through) {
        extended = extended.copy(delayed = added.isDefined)
        alarm.foreach(_.frameBegins())
      }
      val (now, isBad) = if (through && received.hasSfd) process(payload, bad, added) else (payload, bad)
      if (through && !received.hasSfd) {
        registers.count("epu_error")
        space.frameWithoutSfd()
      }
      val next = left.head
      if (!opened(next)) walk(left.tail, next == 0, now, isBad)
      else if (isBad) next -> Transmitter.bad(received.preamble, received.hasSfd, now)
      else next            -> Transmitter.good(received.preamble, now)
    }
    walk(route, port == 0, received.payload, !received.good)
  }

  /** Through the processing unit, where a datagram may be appended; the payload behind it, and whether the
    * frame is in error.
    */
  private def process(
      payload: Vector[Int],
      alreadyBad: Boolean,
      added: Option[Seq[Int]]
  ): (Vector[Int], Boolean) = {
    val frame = new space.Frame
    val settings = ProcessingSettings(
      stationAddress = registers.value("station_address"),
      alias = Option.when(registers.value("alias_enable") == 1)(registers.value("station_alias")),
      destroyForeign = registers.value("destroy_non_ethercat") == 1,
      circulating = !opened(0) && setting(0) <= 1, // LP-14
      ecatEvents = space.ecatEvents,
      maxSubTelegrams = p.maxSubTelegrams,
      fmmus = (0 until p.fmmus).map(FmmuModel.of(registers, _, p.hasBitwiseFmmus)),
      readWriteOffset = if (p.hasReadWriteOffset) registers.value("read_write_offset") else 0
    )
    val done = new ProcessingUnit(settings, frame).process(payload, alreadyBad)
    if (done.bad || done.tooMany) registers.count("epu_error")
    // It takes the datagram before its writes take effect.
    val sent = added.map(AppendModel.append(done.payload, done.bad, _, p.maxSubTelegrams))
    if (sent.exists(_.insertedAt.isDefined)) alarm.foreach(_.frameTook())
    val before  = portNumbers.map(setting)
    val written = frame.end(!done.bad)
    if (!done.bad) settle(before, written)
    val destroyed = payload.size - done.payload.size // nibbles (B-11)
    extended = extended.copy(
      nibbles = extended.nibbles - destroyed,
      insertedAt = sent.flatMap(_.insertedAt),
      hasTime = frame.hasTime
    )
    sent.fold((done.payload, done.bad))(s => (s.payload, s.bad))
  }

  /** A good frame has written to registers: what that means for the ports, whose settings were `before`. */
  private def settle(before: Seq[Int], written: Seq[Int]): Unit = {
    if (written.contains(DlRegisters.LoopByte))
      portNumbers.foreach(y => if (links(y)) released(y) = true) // B-33
    val asked = registers.value("temporary_use") == 1
    if (!asked) temporary = None
    else if (temporary.isEmpty) temporary = Some(before -> p.temporaryLoopMs)
  }
}

/** What an alarm slave has done to a frame beside processing it.
  *
  * @param nibbles
  *   that came or, if it was destroyed here, are left; preamble included
  * @param delayed
  *   it has left late, ready for a datagram (AP-02)
  * @param insertedAt
  *   nibble of its payload at which the datagram stands, if it got one (AP-05)
  * @param hasTime
  *   datagrams in it have read the time of an event
  */
final case class Extension(
    nibbles: Int = 0,
    delayed: Boolean = false,
    insertedAt: Option[Int] = None,
    hasTime: Boolean = false
)
