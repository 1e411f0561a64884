package flyframe.dc

import chisel3._
import chiseltest._
import chiseltest.formal._
import chiseltest.formal.backends.Engines
import org.scalatest.flatspec.AnyFlatSpec

/** A [[SyncSignal]] whose inputs are free: when it is armed and for which time, what each cycle counts, when
  * it is enabled, active, acknowledged, when there is a pulse by hand. Assumed is what [[SyncSignals]] and
  * [[SpeedControl]] keep: it is not armed while it is armed, a cycle counts its period and -2 to 2 ns, and
  * the pulse length does not change. For the solver's sake times are less than 64 ns and lengths less than
  * 16; the upper bits of the counters are left to the tests. That the engine arms the signal for the right
  * time, and once for each, is no part of this.
  */
abstract class SyncSignalInputs(periodNs: Int) extends Module {
  protected val active      = IO(Input(Bool()))
  protected val byHand      = IO(Input(Bool()))
  protected val enabled     = IO(Input(Bool()))
  protected val arm         = IO(Input(Bool()))
  protected val value       = IO(Input(UInt(16.W)))
  protected val passes      = IO(Input(UInt(4.W)))
  protected val length      = IO(Input(UInt(16.W)))
  protected val acknowledge = IO(Input(Bool()))
  protected val dut         = Module(new SyncSignal(periodNs))
  dut.active      := active
  dut.byHand      := byHand
  dut.enabled     := enabled
  dut.arm         := arm
  dut.value       := value
  dut.passes      := passes
  dut.length      := length
  dut.acknowledge := acknowledge
  assume(!(arm && dut.armed))
  assume(passes >= (periodNs - 2).U && passes <= (periodNs + 2).U)
  assume(value < 64.U && length < 16.U)
  private val started = RegInit(false.B)
  started := true.B
  when(started) { assume(length === RegNext(length)) }
}

/** When pulses come: the time since the signal was armed is counted up. */
class SyncTimeProof(periodNs: Int) extends SyncSignalInputs(periodNs) {
  private val pending = RegInit(false.B)
  private val due     = Reg(UInt(8.W))
  private val gone    = Reg(UInt(8.W))
  private val fires   = pending && gone +& passes > due
  gone := gone + passes
  when(fires || !active) { pending := false.B }
  when(arm && active) {
    pending := true.B
    due     := value
    gone    := 0.U
  }
  assert(dut.armed === pending, "a pulse is lost, or comes without a time")
  assert(dut.fires === fires, "a pulse is early or late")
}

/** How long they are: cycles since the last one has begun are counted up. */
class SyncLevelProof(periodNs: Int) extends SyncSignalInputs(periodNs) {
  private val begun = RegInit(false.B)
  private val since = Reg(UInt(8.W))
  private val acked = Reg(Bool())
  since := since + 1.U
  // The host has seen the signal two cycles before.
  when(acknowledge && since >= 2.U) { acked := true.B }
  when((dut.fires && active || byHand) && enabled) {
    begun := true.B
    since := 0.U
    acked := false.B
  }
  // Those by hand come also while it is not active.
  when(!enabled || !active && RegNext(active, false.B)) { begun := false.B }
  when(!begun) { assert(!dut.level, "a level without a pulse") }
  when(begun && length === 0.U) { assert(dut.level === !acked, "until it is acknowledged") }
  when(begun && length =/= 0.U) {
    if (periodNs == 10) assert(dut.level === (since < length), "the length of a pulse")
    else {
      val wanted = length * 10.U(4.W)
      when(dut.level) { assert(since * periodNs.U(4.W) <= wanted, "a pulse is too long") }
        .otherwise { assert((since +& 1.U) * periodNs.U(4.W) >= wanted, "a pulse is too short") }
    }
  }
}

class SyncSignalFormal extends AnyFlatSpec with ChiselScalatestTester with Formal {
  private def prove(proof: => Module, cycles: Int): Unit = {
    assume(Engines.present, Engines.missing)
    verify(proof, Seq(BoundedCheck(cycles), Engines.boolector))
  }
  for (periodNs <- Seq(8, 10)) {
    s"DC-26 to DC-29, $periodNs ns: a time that is armed" should
      "give exactly one pulse, when it has come, and none without it" in
      prove(new SyncTimeProof(periodNs), cycles = 8)
    s"DC-28, DC-30, DC-31, DC-34, $periodNs ns: a pulse" should
      "have its length, or stay until it is acknowledged" in
      prove(new SyncLevelProof(periodNs), cycles = 14)
  }
}
