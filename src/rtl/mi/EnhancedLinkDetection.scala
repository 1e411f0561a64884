package flyframe.mi

import chisel3._
import chisel3.util._

/** Enhanced link detection (LNK-08 to LNK-10): 32 symbols with RX_ER within one of the fixed intervals of 10
  * us take the link away until it has gone down by itself.
  *
  * @param ports
  *   their number
  */
class EnhancedLinkDetection(ports: Int, coreClockMhz: Int) extends Module {

  /** What link detection has found so far, symbols with RX_ER, and whether it is on at the port. */
  val found = IO(Input(Vec(ports, Bool())))
  val rxEr  = IO(Input(Vec(ports, Bool())))
  val on    = IO(Input(Vec(ports, Bool())))

  /** The links that are left. */
  val link = IO(Output(Vec(ports, Bool())))

  /** The link of the port is taken away in this cycle: the PHY must begin anew. */
  val restarts = IO(Output(Vec(ports, Bool())))

  /** Every 10 us. */
  val tick = IO(Output(Bool()))

  tick := Counter(coreClockMhz * 10).inc()
  for (y <- 0 until ports) {
    val errors = RegInit(0.U(6.W)) // of this interval, up to 32; without a link there are many
    when(!found(y)) { errors := 0.U }
      .elsewhen(tick) { errors := rxEr(y) }
      .elsewhen(rxEr(y) && !errors(5)) { errors := errors + 1.U }
    val held = RegInit(false.B) // reset: no link is held off
    held        := found(y) && (held || (on(y) && errors(5)))
    restarts(y) := found(y) && !held && on(y) && errors(5)
    link(y)     := found(y) && !held
  }
}

/** The reset of a port's PHY: between 1.28 and 2.56 ms from an order on (B-97). */
class PhyReset extends Module {

  /** Every 1.28 ms. */
  val tick = IO(Input(Bool()))

  /** Begin anew. */
  val start  = IO(Input(Bool()))
  val resetN = IO(Output(Bool()))

  private val left = RegInit(0.U(2.W)) // ticks; reset: none, as the pin follows the reset itself
  when(start) { left := 2.U }.elsewhen(tick && left =/= 0.U) { left := left - 1.U }
  resetN := RegNext(left === 0.U, false.B) && !reset.asBool // at once, though the clock may not run (PHY-01)
}

/** Restarts the auto-negotiation of PHYs where nothing else accesses them (LNK-08).
  *
  * @param ports
  *   their number
  */
class Restarts(ports: Int) extends Module {
  val restart   = IO(Input(Vec(ports, Bool())))
  val restarted = IO(Output(Vec(ports, Bool())))
  val access    = IO(new PhyAccess)

  private val runs = RegInit(false.B)
  private val port = Reg(UInt(2.W))
  when(!runs) {
    runs := restart.asUInt.orR
    port := PriorityEncoder(restart)
  }.elsewhen(access.done) { runs := false.B }
  access.valid    := runs
  access.port     := port
  access.register := Phy.Control.U
  access.isWrite  := true.B
  access.data     := Phy.Restart.U
  for (y <- 0 until ports) restarted(y) := access.done && port === y.U
}
