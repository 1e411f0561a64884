package flyframe.model

import flyframe.params.EscParams
import flyframe.protocol.Command
import flyframe.registers.{ClockRegisters, Register}

/** Distributed clocks: the receive times of frames (DC-07, DC-08), and the system time (DC-16 to DC-23). Its
  * time is that of the bench, in which a frame comes as a whole: the beginning of each frame is right, as far
  * as the bench tells the time between them.
  *
  * @param pulses
  *   a SYNC signal becomes active, by its number
  */
class ClockModel(
    p: EscParams,
    registers: ModelRegisters,
    hasLink: Int => Boolean,
    pulses: Int => Unit = _ => ()
) extends ModelUnit {
  import ClockModel._
  private var now    = 0L
  private var part   = 0.0                                     // of a ns, beside `now`
  private val began  = Array.fill(p.ports)(Option.empty[Long]) // since a frame came to the processing unit
  private val awaits = Array.fill(p.ports)(false)              // the frame is on its way back to there
  private var latest = Option.empty[(Int, Long)]               // port and time of the frame at hand
  private var first  = Option.empty[Long]                      // when the last frame came to port 0
  private val ways   = Seq.fill(p.ports)(new MeanWay)          // from there to the port

  // What the frame in the processing unit has written 0x0900 with.
  private var commands = Set.empty[Int]

  // What has been written to the system time, by byte, and whether the frame has written the first one.
  private val received = new Array[Int](4)
  private var compares = false
  private var drives   = false // the frame has written the speed
  private val loop     = new TimeLoop
  private var slew     = 0     // ns to fall back by
  private var ofFrame  = 0L    // the system time of the frame at hand

  private val sync    = Option.when(p.syncSignals > 0)(new SyncModel(p, registers, pulses))
  private val latches = (0 until p.latchSignals).map(new LatchModel(p, registers, _))

  /** SYNC and LATCH signals, each a unit of its own. */
  def signals: Seq[ModelUnit] = sync.toSeq ++ latches

  /** The level of SYNC signal `n`. */
  def syncLevel(n: Int): Boolean = sync.exists(_.level(n))

  /** LATCH signal `n` has a new level. */
  def setLatch(n: Int, level: Boolean): Unit = latches(n).set(level, systemTime)

  override def guard(name: String): Option[Boolean] = name match {
    case "clocks_on" => Some(isOn("sync") || isOn("latch"))
    case "sync_on"   => Some(isOn("sync"))
    case "latch_on"  => Some(isOn("latch"))
    case _           => None
  }

  /** 0x0141[3:2] (DC-06). */
  private def isOn(unit: String): Boolean = !p.savesClockPower ||
    (registers.value("esc_configuration") >> (if (unit == "sync") 1 else 2) & 1) == 1

  override def status(field: String): Option[Int] = field match {
    case "latch_event"      => Some(if (latches.exists(_.waits(host = true))) 1 else 0)
    case "ecat_latch_event" => Some(if (latches.exists(_.waits(host = false))) 1 else 0)
    case _                  => None
  }

  /** Lets time pass, ns. */
  def advance(ns: Long): Unit = {
    val falls = slew.max((-ns / SlewNs).toInt).min((ns / SlewNs).toInt)
    slew -= falls
    part += ns.toDouble / p.clockPeriodNs * loop.winsPerCycle
    now += ns - falls + part.floor.toLong
    part -= part.floor
    if (!isOn("sync")) sync.foreach(_.switchOff())
    if (!isOn("latch")) latches.foreach(_.switchOff())
    sync.foreach(_.follow(systemTime, ns))
  }

  private def systemTime: Long = now + registers.wide("system_time_offset")

  private def show(time: Long): Unit = {
    registers.setWide("system_time", time & 0xffffffffL)
    if (p.clockBits == 64) registers.setWide("system_time_high", time >>> 32)
  }

  /** The host reads from `address` on: it sees the time at the first byte. */
  def hostReads(address: Int): Unit = {
    if (p.hasSystemTime && address == ClockRegisters.SystemTime) show(systemTime)
    for (r <- registers.register(address) if address == r.address) showBuffers(_ == r.name)
  }

  /** A time, of which a bench without a common clock knows nothing. */
  def isTime(address: Int): Boolean =
    registers.register(address).exists(r => ClockRegisters(p).exists(_.name == r.name) && !r.stores)

  /** A frame begins at `port`. */
  def portBegins(port: Int): Unit = {
    if (port == 0) {
      first = Some(now)
      ways.foreach(_.begins())
    }
    val late = first.filter(_ => port > 0 && p.hasMeanWays).fold(0L) { since =>
      ways(port).late((now - since) / p.clockPeriodNs)
    }
    val time = now - Math.floorDiv(late * p.clockPeriodNs, 64L)
    latest = Some(port -> time)
    began(port) = Some(time)
    if (awaits(port)) keep(port, time)
  }

  /** The frame at hand enters the processing unit. */
  def processingBegins(): Unit = {
    for (port <- began.indices) began(port) = latest.collect { case (`port`, time) => time }
    commands = Set.empty
    showBuffers(_ => true)
    if (p.hasSystemTime) {
      ofFrame = latest.fold(now)(_._2) + registers.wide("system_time_offset") -
        registers.wide("system_time_delay")
      show(ofFrame)
    }
  }

  /** A buffer of a SyncManager changes (DC-42): by a frame, whose beginning counts, or by the host, now. */
  def happens(event: BufferEvent): Unit = if (p.hasEventTimes) {
    val time = if (event == BufferEvent.EcatChange) latest.fold(now)(_._2) else now
    buffers += event.field -> (time & 0xffffffffL)
  }
  private var buffers = Map.empty[String, Long]
  private def showBuffers(field: String => Boolean): Unit =
    for ((name, time) <- buffers if field(name)) registers.setWide(name, time)

  /** It writes the byte at `address`. */
  def isWritten(address: Int, command: Int): Unit =
    if (address == ClockRegisters.Trigger) commands += command

  /** It is over, and its times are to be kept if it asked for that. */
  def frameEnds(good: Boolean): Unit = {
    if (good && commands.nonEmpty)
      for ((_, time) <- latest) {
        val mask = if (p.clockBits == 64) -1L else 0xffffffffL
        registers.setWide("receive_time_processing_unit", time & mask)
      }
    if (good && commands.exists(Set(Command.Bwr, Command.Fpwr)))
      for (port <- began.indices) began(port) match {
        case Some(time) => keep(port, time)
        case None       => awaits(port) = hasLink(port)
      }
    commands = Set.empty
  }

  override def written(register: Register, address: Int, byte: Int, byHost: Boolean): Unit =
    register.name match {
      case "system_time" =>
        received(address - register.address) = byte
        if (!p.hasTimeByPdi) compares |= address == register.address
        else if (address == register.range.last) { // DC-24
          sample(registers.wide("latch0_positive_time"))
          showLoop()
        }
      case "speed_counter_start" =>
        loop.reset(start, registers.value("speed_filter_depth"), direct)
        showLoop()
      case "speed_counter_direct" =>
        drives = true
        if (byHost) {
          drive()
          showLoop()
        }
      case "time_filter_depth" =>
        loop.resetMean()
        showLoop()
      case "speed_filter_depth" =>
        loop.resetSpeed()
        showLoop()
      case _ =>
    }

  /** All that the frame has written has taken effect: it is compared (DC-17). */
  def compare(): Unit = if (p.hasSystemTime) {
    if (compares) sample(ofFrame)
    compares = false
    drive()
    sync.foreach(_.settle())
    showLoop()
  }

  private def start = registers.value("speed_counter_start")

  /** The speed counter difference that is set directly, with its sign (DC-25). */
  private def direct: Int = if (p.hasDirectSpeed) registers.value("speed_counter_direct").toShort.toInt else 0

  /** What was received is compared with the system time of then. */
  private def sample(time: Long): Unit = for (
    late <- loop.sample(
      time.toInt - received.foldRight(0)((byte, rest) => rest << 8 | byte),
      start,
      registers.value("time_filter_depth"),
      registers.value("speed_filter_depth"),
      direct
    )
  ) slew = late

  /** The speed has been written (DC-25). */
  private def drive(): Unit = {
    if (drives && direct != 0) loop.set(start, registers.value("speed_filter_depth"), direct)
    drives = false
  }
  private def showLoop(): Unit = {
    registers.setWide("system_time_difference", loop.shownDifference)
    registers.set("speed_counter_difference", loop.shownSpeed)
  }

  /** Its link goes down: nothing comes back from there. */
  def portGoes(port: Int): Unit = {
    awaits(port) = false
    if (port == 0) ways.foreach(_.forget()) else ways(port).forget()
  }

  private def keep(port: Int, time: Long): Unit = {
    awaits(port) = false
    ClockRegisters.port(port).foldLeft(time) { case (left, (field, bytes)) =>
      registers.setWide(field, left & ((1L << (8 * bytes)) - 1))
      left >> (8 * bytes)
    }
  }
}

private[model] object ClockModel {

  /** The time falls back by 1 ns in so many ns. */
  val SlewNs = 80L

  /** Cycle times of SYNC0 that work (B-86). */
  val ShortestCycleNs = 4000L
}
