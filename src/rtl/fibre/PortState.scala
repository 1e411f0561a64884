package flyframe.fibre

import chisel3._

/** Whether a port is up (FR-12, FR-14, FB-04, FB-07, FB-16). */
class PortState extends Module {

  /** There is signal and no search. */
  val good = IO(Input(Bool()))

  /** The port is switched off. */
  val off = IO(Input(Bool()))

  /** Milliseconds until it comes up. */
  val upMs = IO(Input(UInt(8.W)))

  /** A millisecond, a quarter of a second ends with this cycle. */
  val ms      = IO(Input(Bool()))
  val quarter = IO(Input(Bool()))

  val up = IO(Output(Bool()))

  /** It is kept down: three losses within a second. */
  val held = IO(Output(Bool()))

  /** It goes down, and was not switched off. */
  val loses = IO(Output(Bool()))

  private val isUp = RegInit(false.B) // reset: down
  up    := isUp
  loses := isUp && !good && !off

  // Quarters of a second since the last loss, and since the one before, up to more than a second has.
  private val never   = 5.U(3.W)
  private val last    = RegInit(never) // reset: none
  private val second  = RegInit(never)
  private val isThird = Reg(Bool())    // the last loss was; no reset: there is none
  private val isHeld  = isThird && last =/= never
  held := isHeld
  when(loses) {
    isThird := second =/= never
    second  := last
    last    := 0.U
  }.elsewhen(quarter) {
    when(last =/= never) { last := ShortCounter.up(last) }
    when(second =/= never) { second := ShortCounter.up(second) }
  }

  private val left  = Reg(UInt(8.W)) // no reset: the port begins to wait behind it
  private val waits = good && !isUp && !isHeld
  private val comes = ms && left === 0.U
  isUp := good && (isUp || (comes && !isHeld))
  when(!waits) { left := upMs }.elsewhen(ms) { left := ShortCounter.down(left) }
}
