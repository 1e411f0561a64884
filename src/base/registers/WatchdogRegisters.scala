package flyframe.registers

import RegisterTable._

/** The watchdogs (WD-01 to WD-09); used by [[flyframe.application.Watchdogs]]. */
object WatchdogRegisters {
  val TimePdi           = 0x0410
  val TimeProcessData   = 0x0420
  val StatusProcessData = 0x0440
  val StatusPdi         = 0x0448

  /** From the divider to the last time. */
  val settings: Range = 0x0400 until TimeProcessData + 2

  // format: off
  val all: Seq[Register] = Seq(
    register(0x0400,            2, "watchdog_divider",             rw,  r,   "WD-01", "Watchdog divider",
      field("watchdog_divider",            15, 0, stored,              0x09c2,
          "A tick is (value + 2) * 40 ns")),
    register(TimePdi,           2, "watchdog_time_pdi",            rw,  r,   "WD-06", "Watchdog time PDI",
      field("watchdog_time_pdi",           15, 0, stored,              0x03e8, "In watchdog ticks; 0 = off")),
    register(TimeProcessData,   2, "watchdog_time_process_data",   rw,  r,   "WD-04",
        "Watchdog time process data",
      field("watchdog_time_process_data",  15, 0, stored,              0x03e8, "In watchdog ticks; 0 = off")),
    register(StatusProcessData, 2, "watchdog_status_process_data", r,   ack, "WD-05",
        "Watchdog status process data",
      field("watchdog_process_data",        0, 0, status,              0,
          "1: running or off; 0: expired")),
    register(0x0442,            1, "watchdog_count_process_data",  clr, r,   "WD-09",
        "Watchdog counter process data",
      field("watchdog_count_process_data",  7, 0, counter("watchdog"), 0,      "Expiries")),
    register(0x0443,            1, "watchdog_count_pdi",           clr, r,   "WD-09", "Watchdog counter PDI",
      field("watchdog_count_pdi",           7, 0, counter("watchdog"), 0,      "Expiries")),
    register(StatusPdi,         1, "watchdog_status_pdi",          r,   r,   "WD-07", "Watchdog status PDI",
      field("watchdog_pdi",                 0, 0, status,              0,
          "1: running or off; 0: expired"))
  )
  // format: on
}
