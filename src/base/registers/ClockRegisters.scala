package flyframe.registers

import flyframe.params.EscParams
import RegisterTable._

/** Distributed clocks: the local times at which frames have begun (DC-07), for four ports, as masters read
  * them, and 0 for ports that do not exist; and the system time with what brings it to that of the reference
  * clock (DC-16 to DC-23).
  */
object ClockRegisters {

  /** A write of this byte has the times of its frame kept. */
  val Trigger = 0x0900

  /** First byte of the time at the processing unit. */
  val Processing = 0x0918

  val SystemTime = 0x0910
  val Offset     = 0x0920
  val Delay      = 0x0928
  val Difference = 0x092c
  val SpeedStart = 0x0930
  val Speed      = 0x0932
  val Direct     = 0x0938
  val Activation = 0x0981
  val StartTime  = 0x0990
  val NextSync1  = 0x0998
  val SyncCycles = 0x09a0
  val LatchTimes = 0x09b0

  /** Times of SyncManagers' buffers: of frames, where the host begins, and where it changes them. */
  val EventTimes: Seq[Int] = Seq(0x09f0, 0x09f8, 0x09fc)

  /** Names of the fields of a port, lowest first, with their bytes. */
  def port(y: Int): Seq[(String, Int)] =
    if (y == 0) Seq("receive_time_port0_low" -> 1, "receive_time_port0_high" -> 3)
    else Seq(s"receive_time_port$y"          -> 4)

  // format: off
  /** All of them, as far as they are built. */
  def apply(p: EscParams): Seq[Register] = {
    def switched(on: String)(registers: Seq[Register]) =
      if (p.savesClockPower) registers.map(_.copy(present = Some(on))) else registers
    receiveTimes ++
      switched("clocks_on")(processingTime(p) +: (if (p.hasSystemTime) systemTime(p) else Nil)) ++
      switched("clocks_on")(owners(p)) ++
      switched("sync_on")(if (p.syncSignals > 0) syncSignals(p) else Nil) ++
      switched("latch_on")((0 until p.latchSignals).flatMap(latchSignal(p, _))) ++
      (if (p.hasEventTimes) eventTimes else Nil)
  }

  private val receiveTimes: Seq[Register] = Seq(
    register(Trigger, 1, "receive_time_trigger",           rw, r, "DC-07", "Receive time of port 0, low",
      field("receive_time_port0_low",    7, 0, kept, 0,
          "A write has the receive times of its frame kept; its data is ignored")),
    register(0x0901, 3, "receive_time_port0",              r, r, "DC-07", "Receive time of port 0, high",
      field("receive_time_port0_high",  23, 0, kept, 0, "Local time, ns"))
  ) ++ (1 to 3).map(y =>
    register(Trigger + 4 * y, 4, s"receive_time_port$y",   r, r, "DC-07", s"Receive time of port $y",
      field(s"receive_time_port$y",     31, 0, kept, 0, "Local time, ns"))
  )

  private def processingTime(p: EscParams): Register =
    register(Processing, p.clockBytes, "receive_time_processing_unit", r, r, "DC-07",
        "Receive time of the processing unit",
      field("receive_time_processing_unit", 8 * p.clockBytes - 1, 0, kept, 0, "Local time, ns"))

  private def systemTime(p: EscParams): Seq[Register] = {
    // The side that has the time loop writes.
    val (ecat, pdi) = if (p.hasTimeByPdi) (r, rw) else (rw, r)
    val compared    = if (p.hasTimeByPdi) "A write: compare with LATCH0" else "A write: compare"
  Seq(
    register(SystemTime, 4, "system_time",                 ecat, pdi, "DC-17, DC-24, B-84", "System time",
      field("system_time",              31, 0, kept, 0,
          s"Local time + offset, ns; for ECAT when its frame began, less the delay. $compared"))
  ) ++ Option.when(p.clockBits == 64)(
    register(SystemTime + 4, 4, "system_time_high",        r,  r, "DC-01",       "System time, high half",
      field("system_time_high",         31, 0, kept, 0, "Its upper 32 bits"))
  ) ++ Seq(
    register(Offset,     p.clockBytes, "system_time_offset", ecat, pdi, "DC-16",     "System time offset",
      field("system_time_offset", 8 * p.clockBytes - 1, 0, keptWritten, 0,
          "What is added to the local time, ns")),
    register(Delay,      4, "system_time_delay",           ecat, pdi, "DC-15",       "System time delay",
      field("system_time_delay",        31, 0, keptWritten, 0, "From the reference clock to here, ns")),
    register(Difference, 4, "system_time_difference",      r,  r, "DC-19, B-84", "System time difference",
      field("system_time_difference",   31, 0, kept, 0,
          "Mean of the difference, ns; bit 31: 1 if the time here is the later one, or both are the same")),
    register(SpeedStart, 2, "speed_counter_start",         ecat, pdi, "DC-20",       "Speed counter start",
      field("speed_counter_start",      14, 0, stored, 0x1000,
          "Bandwidth of the drift control; a write resets its filters")),
    register(Speed,      2, "speed_counter_difference",    r,  r, "B-85",        "Speed counter difference",
      field("speed_counter_difference", 15, 0, kept, 0, "Mean deviation of the local clock's speed")),
    register(0x0934,     1, "time_filter_depth",           ecat, pdi, "DC-20, B-85",
        "System time difference filter depth",
      field("time_filter_depth",         3, 0, stored, 4,  "2^n samples; a write resets this filter")),
    register(0x0935,     1, "speed_filter_depth",          ecat, pdi, "DC-20, B-85",
        "Speed counter filter depth",
      field("speed_filter_depth",        3, 0, stored, 12, "2^n samples; a write resets this filter"))
  ) ++ Option.when(p.hasDirectSpeed)(
    register(Direct,     2, "speed_counter_direct",        ecat, pdi, "DC-25, B-112",
        "Speed counter difference, direct control",
      field("speed_counter_direct",     15, 0, keptWritten, 0,
          "0: off; else the speed counter difference, within the speed counter start - 0x7F"))
  )
  }

  private val eventTimes: Seq[Register] = Seq(
    register(EventTimes(0), 4, "ecat_buffer_change_time", r, r, "DC-42, B-111",
        "ECAT buffer change event time",
      field("ecat_buffer_change_time",  31, 0, kept, 0,
          "Local time of the beginning of the last frame that changed a buffer of a SyncManager, ns")),
    register(EventTimes(1), 4, "pdi_buffer_start_time",   r, r, "DC-42, B-111", "PDI buffer start event time",
      field("pdi_buffer_start_time",    31, 0, kept, 0,
          "Local time at which the host last accessed the first byte of a buffer, ns")),
    register(EventTimes(2), 4, "pdi_buffer_change_time",  r, r, "DC-42, B-111",
        "PDI buffer change event time",
      field("pdi_buffer_change_time",   31, 0, kept, 0,
          "Local time at which the host last changed a buffer, ns"))
  )

  /** Who has the units: one register of all that there are. */
  private def owners(p: EscParams): Seq[Register] = {
    val fields = Seq(
      Option.when(p.syncSignals > 0)(
        field("sync0_by_pdi",   0, 0, stored, 0, "1: the PDI has the cyclic unit and SYNC0, not ECAT")),
      Option.when(p.syncSignals > 1)(
        field("sync1_by_other", 1, 1, stored, 0, "1: SYNC1 belongs to the other side than SYNC0"))
    ).flatten ++ (0 until p.latchSignals).map(n =>
        field(s"latch${n}_by_pdi", 4 + n, 4 + n, stored, 0, s"1: the PDI has LATCH$n, not ECAT"))
    Option.when(fields.nonEmpty)(
      register(0x0980, 1, "cyclic_unit_control", rw, r, "DC-40", "Cyclic unit control", fields: _*)
    ).toSeq
  }

  private val (syncEcat, syncPdi)   = (rwIf("sync_of_ecat"), rwIf("sync_of_pdi"))
  private val (sync0Ecat, sync0Pdi) = (rwIf("sync0_of_ecat"), rwIf("sync0_of_pdi"))
  private val (sync1Ecat, sync1Pdi) = (rwIf("sync1_of_ecat"), rwIf("sync1_of_pdi"))

  private def syncSignals(p: EscParams): Seq[Register] = {
    val two   = p.syncSignals > 1
    val bytes = p.clockBytes
    Seq(
      register(Activation, 1, "sync_activation", syncEcat, syncPdi, "DC-26 to DC-31", "SYNC activation",
        field("cyclic_active", 0, 0, status, 0, "1: the cyclic unit is active, with the start time then") +:
          field("sync0_enable", 1, 1, status, 0, "1: SYNC0 has pulses") +:
          Option.when(two)(field("sync1_enable", 2, 2, status, 0, "1: SYNC1 has pulses")).toSeq ++:
          (if (p.hasEnhancedSync) extendedActivation else Nil): _*),
      register(0x0982, 2, "sync_pulse_length", r, r, "DC-26", "Pulse length of SYNC signals",
        field("sync_pulse_length", 15, 0, if (p.hasSii) stored else constant, p.syncPulse,
            "In 10 ns; 0: until the host reads the status" + (if (p.hasSii) "; EEPROM A2" else ""))),
      register(StartTime, bytes, "start_time", sync0Ecat, sync0Pdi, "DC-27", "Start time, next SYNC0 pulse",
        field("start_time", 8 * bytes - 1, 0, kept, 0,
            "Written: system time of the first pulse, ns; read: that of the next one"))
    ) ++ Option.when(p.hasEnhancedSync)(
      register(0x0984, 1, "sync_activation_status", r, r, "DC-36", "SYNC activation status",
        field("sync0_pending", 0, 0, status, 0, "1: the first pulse of SYNC0 is still to come") +:
          Option.when(two)(
            field("sync1_pending", 1, 1, status, 0, "1: the first pulse of SYNC1 is still to come")).toSeq :+
          field("start_implausible", 2, 2, status, 0,
              "1: the start time was not in the near future when the unit became active"): _*)
    ) ++ Option.when(two)(
      register(NextSync1, bytes, "next_sync1", r, r, "DC-32", "Next SYNC1 pulse",
        field("next_sync1", 8 * bytes - 1, 0, kept, 0, "System time, ns"))
    ) ++ Seq(
      register(SyncCycles, 4, "sync0_cycle", sync0Ecat, sync0Pdi, "DC-26, B-86", "SYNC0 cycle time",
        field("sync0_cycle", 31, 0, keptWritten, 0, "ns; 0: a single pulse"))
    ) ++ Option.when(two)(
      register(SyncCycles + 4, 4, "sync1_cycle", sync1Ecat, sync1Pdi, "DC-32", "SYNC1 cycle time",
        field("sync1_cycle", 31, 0, keptWritten, 0, "From a pulse of SYNC0 to that of SYNC1, ns"))
    ) ++ (0 until p.syncSignals).map(n =>
      register(0x098e + n, 1, s"sync${n}_status", r, ack, "DC-30", s"SYNC$n status",
        field(s"sync${n}_status", 0, 0, status, 0, s"1: SYNC$n is active"))
    )
  }

  private def extendedActivation: Seq[Field] = Seq(
    field("auto_activation",     3, 3, status, 0, "1: the unit becomes active by a write of the start time"),
    field("start_time_extended", 4, 4, status, 0,
        "1: the upper half of the start time follows from the lower"),
    field("start_time_checked",  5, 5, status, 0,
        "1: the first pulse comes at once if the start time is not in the near future"),
    field("near_future",         6, 6, status, 0, "Near future: 0: half the range of times; 1: 2^31 ns"),
    field("debug_pulse",         7, 7, status, 0, "Written 1: one pulse at once on the enabled signals")
  )

  private def latchSignal(p: EscParams, n: Int): Seq[Register] = {
    val edges = Seq("positive", "negative").zipWithIndex
    Seq(
      register(0x09a8 + n, 1, s"latch${n}_control", rwIf(s"latch${n}_of_ecat"), rwIf(s"latch${n}_of_pdi"),
          "DC-38, DC-39", s"LATCH$n control",
        edges.map { case (edge, i) =>
          field(s"latch${n}_${edge}_single", i, i, stored, 0,
              s"$edge edge: 1: only the first one, until its time is read; 0: every one")
        }: _*),
      register(0x09ae + n, 1, s"latch${n}_status", r, r, "DC-38, DC-41", s"LATCH$n status",
        edges.map { case (edge, i) =>
          field(s"latch${n}_$edge", i, i, status, 0, s"1: there was a $edge edge, and it is the only one")
        } :+ field(s"latch${n}_pin", 2, 2, status, 0, s"Level of LATCH$n"): _*)
    ) ++ edges.map { case (edge, i) =>
      register(LatchTimes + 16 * n + 8 * i, p.clockBytes, s"latch${n}_${edge}_time", ack, ack, "DC-38, DC-40",
          s"LATCH$n time of the $edge edge",
        field(s"latch${n}_${edge}_time", 8 * p.clockBytes - 1, 0, kept, 0,
            "System time, ns; whose owner reads it waits for the next edge"))
    }
  }
  // format: on
}
