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

  /** 8 us, a millisecond, a quarter of a second ends with this cycle. */
  val eight   = IO(Input(Bool()))
  val ms      = IO(Input(Bool()))
  val quarter = IO(Input(Bool()))

  val up = IO(Output(Bool()))

  /** It sends search, so that the other end goes down, too (FB-16). */
  val tells = IO(Output(Bool()))

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
  when(loses) {
    isThird := second =/= never
    second  := last
    last    := 0.U
  }.elsewhen(quarter) {
    when(last =/= never) { last := ShortCounter.up(last) }
    when(second =/= never) { second := ShortCounter.up(second) }
  }

  // Ends of 8 us until it has told that it went down. Reset: it may have been up before.
  private val telling = RegInit(2.U(2.W))
  when(isUp && !good) { telling := 2.U }
    .elsewhen(eight && telling.orR) { telling := ShortCounter.down(telling) }
  tells := isHeld || telling.orR

  private val left  = Reg(UInt(8.W)) // no reset: the port begins to wait behind it
  private val waits = good && !isUp && !tells
  isUp := good && (isUp || (ms && waits && left === 0.U))
  when(!waits) { left := upMs }.elsewhen(ms) { left := ShortCounter.down(left) }
}
