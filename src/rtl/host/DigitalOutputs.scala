package flyframe.host

import chisel3._

/** What the digital outputs show where there is no host (B-118): with each event what has been written to
  * them, as long as they may be driven; else 0, at once.
  *
  * @param bytes
  *   of outputs, 1 to 4
  * @param late
  *   the watchdog is looked at with events only
  */
class DigitalOutputs(bytes: Int, late: Boolean) extends Module {

  /** The levels that have been written; the watchdog runs. */
  val written = IO(Input(UInt((8 * bytes).W)))
  val running = IO(Input(Bool()))

  /** Nothing but the watchdog keeps the outputs from being driven. */
  val allowed = IO(Input(Bool()))

  /** What has been written is to be shown. */
  val update = IO(Input(Bool()))

  val levels = IO(Output(UInt((8 * bytes).W)))
  val driven = IO(Output(Bool()))

  /** Levels are shown that an event has brought: one cycle, the first of them. */
  val valid = IO(Output(Bool()))

  // In registers, as pins must not flicker. Reset: safe, as it may come at any time.
  private val shown   = RegInit(0.U((8 * bytes).W))
  private val drives  = RegInit(false.B)
  private val changes = RegNext(update && allowed && running, false.B)
  when(!allowed || (!running && (update || (!late).B))) {
    shown  := 0.U
    drives := false.B
  }.elsewhen(update) {
    shown  := written
    drives := true.B
  }
  levels := shown
  driven := drives
  valid  := changes
}
