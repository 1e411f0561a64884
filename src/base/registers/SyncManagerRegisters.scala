package flyframe.registers

import flyframe.params.EscParams
import RegisterTable._

/** Configuration and state of the SyncManagers (SM-01 to SM-35); used by
  * [[flyframe.syncmanager.SyncManagerUnit]].
  */
object SyncManagerRegisters {
  val First  = 0x0800
  val Stride = 8

  /** The first byte of SyncManager `n`. */
  def of(n: Int): Int = First + Stride * n

  // Where a byte stands among those of its SyncManager.
  val Control    = 4
  val Status     = 5
  val Activate   = 6
  val PdiControl = 7

  // format: off
  private def syncManager(n: Int, first: Int): Seq[Register] = {
    val idle = rwIf(s"sm${n}_disabled")
    Seq(
    register(first,              2, s"sm${n}_start",       idle, r,   "SM-01 to SM-10",
        "SyncManager start address",
      field(s"sm${n}_start",              15, 0, ram,    0, "First byte; writable while inactive")),
    register(first + 2,          2, s"sm${n}_length",      idle, r,   "SM-01 to SM-10", "SyncManager length",
      field(s"sm${n}_length",             15, 0, ram,    0, "Bytes of a buffer; writable while inactive")),
    register(first + Control,    1, s"sm${n}_control",     idle, r,   "SM-01 to SM-10", "SyncManager control",
      field(s"sm${n}_control",             7, 0, ram,    0,
          "[1] 0 buffered, 1 mailbox; [2] 1 ECAT writes; [4] ECAT, [5] AL interrupt; [6] watchdog " +
            "trigger; [7] sequential mode, if that is built; writable while inactive")),
    register(first + Status,     1, s"sm${n}_status",      r,    r,   "SM-15, SM-21",   "SyncManager status",
      field(s"sm${n}_write_event",         0, 0, keptStatus, 0,
          "1: completely written; ends with the read of the first byte"),
      field(s"sm${n}_read_event",          1, 1, keptStatus, 0,
          "1: completely read; ends with the write of the first byte"),
      field(s"sm${n}_sequential_error",    2, 2, keptStatus, 0,
          "Sequential mode: 1 the end was written before a byte in front of it"),
      field(s"sm${n}_mailbox_full",        3, 3, keptStatus, 0, "Mailbox: 1 full"),
      field(s"sm${n}_last_buffer",         5, 4, keptStatus, 3, "Buffered: buffer written last, 3 = none"),
      field(s"sm${n}_read_open",           6, 6, keptStatus, 0, "1: a buffer is open for reading"),
      field(s"sm${n}_write_open",          7, 7, keptStatus, 0, "1: a buffer is open for writing")),
    register(first + Activate,   1, s"sm${n}_activate",    rw,   ack, "SM-28, SM-35",
        "SyncManager activate",
      field(s"sm${n}_enable",              0, 0, stored, 0, "1: active"),
      field(s"sm${n}_repeat_request",      1, 1, stored, 0, "Toggled by the master"),
      field(s"sm${n}_latch_ecat",          6, 6, stored, 0, "1: buffers that the master changes have times"),
      field(s"sm${n}_latch_pdi",           7, 7, stored, 0, "1: buffers of the host have times")),
    register(first + PdiControl, 1, s"sm${n}_pdi_control", r,    rw,  "SM-27, SM-35",
        "SyncManager PDI control",
      field(s"sm${n}_deactivated",         0, 0, status, 0, "1: switched off by the host, area locked"),
      field(s"sm${n}_repeat_acknowledge",  1, 1, stored, 0, "Toggled by the host"),
      field(s"sm${n}_deactivation_delay",  6, 6, stored, 0, "1: the last buffer outlives the master's 0"),
      field(s"sm${n}_delay_active",        7, 7, status, 0, "1: it does so"))
    )
  }
  // format: on

  private def isBuilt(p: EscParams, field: Field): Boolean = field.name.replaceFirst("sm\\d+_", "") match {
    case "sequential_error"                    => p.hasSequentialMode
    case "deactivation_delay" | "delay_active" => p.hasDeactivationDelay
    case "read_open" | "write_open"            => p.tellsOpenBuffers
    case "latch_ecat" | "latch_pdi"            => p.hasEventTimes
    case _                                     => true
  }

  def apply(p: EscParams): Seq[Register] = for {
    n <- 0 until p.syncManagers
    r <- syncManager(n, of(n))
  } yield r.copy(
    fields = r.fields.filter(isBuilt(p, _)),
    block = Some(Block(n, p.syncManagers, Stride))
  )
}
