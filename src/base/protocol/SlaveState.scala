package flyframe.protocol

/** States of a slave's application layer (AL-01): bits 3 to 0 of AL control and AL status. */
object AlState extends Codes("al", "States of a slave's application layer") {
  val Init            = code(1, "init", "no communication but with registers")
  val PreOperational  = code(2, "preop", "mailboxes")
  val Bootstrap       = code(3, "boot", "a mailbox for new firmware")
  val SafeOperational = code(4, "safeop", "inputs")
  val Operational     = code(8, "op", "inputs and outputs")

  /** Bit 4: in AL control the master acknowledges an error, in AL status there is one. */
  val Error = code(0x10, "error", "AL control: acknowledges an error; AL status: there is one")
}

/** What a LED shows: codes of the registers `run_led` and `err_led` (LED-01 to LED-03). From 1 to 12 a code
  * is a number of flashes.
  */
object LedCode extends Codes("led", "What a LED shows; from 1 to 12 a number of flashes") {
  val Off      = code(0x0, "off", "dark")
  val Single   = code(0x1, "single", "one flash")
  val Double   = code(0x2, "double", "two flashes")
  val Blinking = code(0xd, "blinking", "on and off every 200 ms")
  val Flicker  = code(0xe, "flicker", "on and off every 50 ms")
  val On       = code(0xf, "on", "lit")
}

/** Loop settings of a port in DL control (LP-01). */
object LoopSetting extends Codes("loop", "Loop settings of a port in DL control") {
  val Auto      = code(0, "auto", "open while there is a link")
  val AutoClose = code(1, "auto_close", "the same, but opened by a write or a good frame only")
  val Open      = code(2, "open", "open")
  val Closed    = code(3, "closed", "closed")
}
