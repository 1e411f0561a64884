package flyframe.model

import flyframe.params.EscParams
import flyframe.registers.Register

/** The cyclic unit with SYNC0 and SYNC1 (DC-26 to DC-36, DC-40). Its time is that of the bench, which comes
  * in steps: a pulse begins in the step in which its time comes, and what ends within the step has not been.
  *
  * @param pulses
  *   a signal becomes active, by its number
  */
class SyncModel(p: EscParams, registers: ModelRegisters, pulses: Int => Unit = _ => ()) extends ModelUnit {
  import SyncModel._
  private val start  = new Array[Int](8)
  private val active = Array(false, false, false) // the cyclic unit, SYNC0, SYNC1
  private val next   = Array.fill(2)(Option.empty[Long])
  private val rest   = Array(0L, 0L)              // of the pulse, ns
  private val held   = Array(false, false)        // until it is acknowledged
  private var time   = 0L
  private var began  = false                      // there has been a pulse
  private var begins = false                      // with the end of the frame
  private var modes  = 0                          // 0x0981[6:3] (DC-36)
  private val pings  = Array(false, false)        // a pulse by hand goes on

  // The first pulse is to come; the start time was not in the near future.
  private val pending     = Array(false, false)
  private var implausible = false

  private def length: Long = registers.value("sync_pulse_length") * 10L
  private def cycle(n: Int): Long =
    if (n < p.syncSignals) registers.wide(s"sync${n}_cycle") else 0
  private def startTime: Long = {
    val written = start.foldRight(0L)((byte, rest) => rest << 8 | byte)
    if (isOn(ExtendedStart)) time + (written - time).toInt else written
  }
  private def isOn(mode: Int): Boolean = (modes & mode) != 0

  /** The signal is active. */
  def level(n: Int): Boolean = if (length == 0) held(n) else rest(n) > 0

  /** From `since` to `until`, with 32 bits around their end. */
  private def between(since: Long, until: Long): Long =
    if (p.clockBits == 64) until - since else (until - since).toInt.toLong

  /** The system time is `now`, `ns` after the last step. */
  def follow(now: Long, ns: Long): Unit = {
    for (n <- 0 to 1) {
      rest(n) = (rest(n) - ns).max(0)
      if (!level(n)) pings(n) = false
    }
    // What a jump of the time has passed over has not been.
    val passed = between(time, now)
    if (passed < 0) time = now else if (passed > 2 * ns) time = now - ns
    // In their order; both at once: SYNC1 first, as that of SYNC0 does not begin its next delay (OP-05).
    def due = Seq(1, 0)
      .filter(n => next(n).exists(t => between(t, now) >= 0 && between(time, t) >= 0))
      .minByOption(n => between(time, next(n).get))
    var left = due
    while (left.isDefined) {
      fire(left.get, now)
      left = due
    }
    time = now
    // A jump over a pulse leaves it out (B-87).
    for (t <- next(0) if began && between(t, now) > 0) {
      val cycles = between(t, now) / cycle(0).max(1) + 1
      if (cycle(0) > 0 && cycles < 1000000) next(0) = Some(t + cycles * cycle(0))
    }
    for (t <- next(1); n <- next(0) if t < n && between(t, now) > 0) next(1) = Some(n + cycle(1))
    show()
  }

  private def fire(n: Int, now: Long): Unit = {
    val at = next(n).get
    if (active(1 + n)) {
      if (!level(n)) pulses(n)
      rest(n) = (length - between(at, now)).max(0)
      held(n) = true
    }
    time = at
    pending(n) = false
    if (n == 1) next(1) = next(0).filter(between(at, _) > 0).map(_ + cycle(1))
    else {
      began = true
      // With a shorter cycle time all pulses behind the first are left out (B-86).
      next(0) = Option.when(cycle(0) >= ClockModel.ShortestCycleNs)(at + cycle(0))
      if (next(1).isEmpty) next(1) = next(0).map(_ + cycle(1))
    }
  }

  /** All that a frame has written is there: the start time that is there now counts (B-88). */
  def settle(): Unit = {
    if (begins && active(0)) begin()
    begins = false
  }
  private def begin(): Unit = {
    began = false
    for (n <- 0 until p.syncSignals) pending(n) = true
    val ahead = between(time, startTime)
    implausible = ahead < 0 || (isOn(NearFuture) && ahead >= (1L << 31))
    val first = if (implausible && isOn(CheckedStart)) time + AtOnceNs else startTime
    next(0) = Some(first)
    next(1) = Some(first + cycle(1))
    show()
  }

  private def show(): Unit = {
    def mask(time: Long) = if (p.clockBits == 64) time else time & 0xffffffffL
    registers.setWide("start_time", mask(next(0).getOrElse(startTime)))
    if (p.syncSignals > 1) for (t <- next(1)) registers.setWide("next_sync1", mask(t))
  }

  // ---- registers ----
  private def byPdi(n: Int): Boolean = {
    val first = registers.value("sync0_by_pdi") == 1
    if (n == 0 || p.syncSignals < 2) first else first != (registers.value("sync1_by_other") == 1)
  }
  override def guard(name: String): Option[Boolean] = name match {
    case "sync0_of_ecat" => Some(!byPdi(0))
    case "sync0_of_pdi"  => Some(byPdi(0))
    case "sync1_of_ecat" => Some(!byPdi(1))
    case "sync1_of_pdi"  => Some(byPdi(1))
    case "sync_of_ecat"  => Some(!byPdi(0) || !byPdi(1))
    case "sync_of_pdi"   => Some(byPdi(0) || byPdi(1))
    case _               => None
  }
  private def isMapped(n: Int): Boolean =
    !p.hasSii || (registers.value("pdi_configuration") >> (8 + 3 + 4 * n) & 1) == 1

  override def status(field: String): Option[Int] = {
    val set = field match {
      case "cyclic_active"       => Some(active(0))
      case "sync0_enable"        => Some(active(1))
      case "sync1_enable"        => Some(active(2))
      case "sync0_status"        => Some(level(0))
      case "sync1_status"        => Some(level(1))
      case "sync0_event"         => Some(level(0) && isMapped(0))
      case "sync1_event"         => Some(level(1) && isMapped(1))
      case "auto_activation"     => Some(isOn(AutoActivation))
      case "start_time_extended" => Some(isOn(ExtendedStart))
      case "start_time_checked"  => Some(isOn(CheckedStart))
      case "near_future"         => Some(isOn(NearFuture))
      case "debug_pulse"         => Some(false)
      case "sync0_pending"       => Some(pending(0))
      case "sync1_pending"       => Some(pending(1))
      case "start_implausible"   => Some(implausible)
      case _                     => None
    }
    set.map(if (_) 1 else 0)
  }

  override def written(register: Register, address: Int, byte: Int, byHost: Boolean): Unit =
    register.name match {
      case "start_time" =>
        val place = address - register.address
        start(place) = byte
        val last = if (isOn(ExtendedStart)) 3 else p.clockBytes - 1
        if (isOn(AutoActivation) && place == last && !active(0)) {
          active(0) = true
          if (byHost) begin() else begins = true
        }
        if (!active(0)) show()
      case "sync_activation" =>
        val was = active(0)
        for ((n, owner) <- Seq(0 -> 0, 1 -> 0, 2 -> 1) if byHost == byPdi(owner) && n <= p.syncSignals)
          active(n) = (byte >> n & 1) == 1
        if (p.hasEnhancedSync && byHost == byPdi(0)) {
          modes = byte & 0x78
          if ((byte & DebugPulse) != 0) for (n <- 0 until p.syncSignals if active(1 + n)) {
            if (!level(n)) pulses(n)
            rest(n) = length
            held(n) = true
            pings(n) = true
          }
        }
        if (was && !active(0)) for (n <- 0 to 1) pings(n) = false
        if (active(0) && !was) if (byHost) begin() else begins = true
        end()
      case _ =>
    }

  /** What is not active has neither pulses nor levels. */
  private def end(): Unit = {
    if (!active(0)) for (n <- 0 to 1) {
      next(n) = None
      pending(n) = false
    }
    for (n <- 0 to 1 if !(active(0) || pings(n)) || !active(1 + n)) {
      rest(n) = 0
      held(n) = false
    }
  }

  /** The unit is not there (DC-06). */
  def switchOff(): Unit = {
    for (n <- active.indices) active(n) = false
    modes = 0
    end()
  }

  override def acknowledged(register: Register, address: Int): Unit = register.name match {
    case "sync0_status" => held(0) = false
    case "sync1_status" => held(1) = false
    case _              =>
  }
}

private[model] object SyncModel {

  // 0x0981[7:3] (DC-36).
  val AutoActivation = 0x08
  val ExtendedStart  = 0x10
  val CheckedStart   = 0x20
  val NearFuture     = 0x40
  val DebugPulse     = 0x80

  /** The first pulse that comes at once does so this long after the unit has become active (B-99). */
  val AtOnceNs = 16384L
}
