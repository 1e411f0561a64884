package flyframe.relay

import chisel3._
import chisel3.util._
import chiseltest._
import chiseltest.formal._
import chiseltest.formal.backends.Engines
import flyframe.Tier
import org.scalatest.flatspec.AnyFlatSpec

/** What is sent is ended, at any moment, by seven dominant bits. */
class AbortProof extends Module {
  private val begin   = IO(Input(Bool()))
  private val own     = IO(Input(Bool()))
  private val abort   = IO(Input(Bool()))
  private val silence = IO(Input(Bool()))
  private val step    = IO(Input(Bool()))
  private val byte    = IO(Input(Valid(UInt(8.W))))
  private val dut     = Module(new LinkSender)
  dut.begin   := begin
  dut.own     := own
  dut.abort   := abort
  dut.silence := silence
  dut.step    := step
  dut.byte    := byte
  assume(!begin || (dut.quiet >= LinkFrame.EndBits.U && !abort))

  private val left = RegInit(0.U(3.W)) // dominant bits that must come; reset: none
  private val low  = RegInit(false.B)  // this bit is one; reset: it is not
  when(step) {
    low := left =/= 0.U
    when(left =/= 0.U) { left := left - 1.U }
  }
  when(abort && dut.busy) { left := LinkFrame.AbortBits.U }
  when(silence) {
    left := 0.U
    low  := false.B
  }
  when(low) { assert(!dut.level, "a recessive bit within an abort") }
  when(left =/= 0.U) { assert(!dut.busy && dut.quiet === 0.U, "a frame goes on behind its abort") }
}

/** Whatever is heard: a frame with six dominant bits in a row, as an abort has them, is never good; and one
  * whose header was told is over once, good or bad.
  */
class EndProof extends Module {
  private val heard = IO(Input(Bool())) // in each cycle a bit
  private val dut   = Module(new LinkReceiver)
  dut.sample.valid := true.B
  dut.sample.bits  := heard
  dut.restart      := false.B
  dut.address      := 5.U

  private val run   = RegInit(0.U(3.W)) // dominant bits in a row, this one left out; reset: none
  private val ended = RegInit(false.B)  // six have come since the start bit; reset: no
  private val told  = RegInit(false.B)  // the header, and not the end; reset: no frame
  private val six   = !heard && run >= 5.U
  run   := Mux(heard, 0.U, Mux(run === 7.U, 7.U, run + 1.U))
  ended := !dut.events.starts && (ended || six)
  told  := dut.events.header || (told && !dut.events.good && !dut.events.bad)
  when(dut.events.good) {
    assert(!ended && !six, "an abort has become a good frame")
    assert(told, "a frame without a header")
  }
  when(dut.events.bad) { assert(told, "a frame that had no header is over") }
  when(dut.events.header) { assert(!told, "a header within a frame") }
  assert(!(dut.events.good && dut.events.bad), "good and bad")
}

class LinkFormal extends AnyFlatSpec with ChiselScalatestTester with Formal {
  private def prove(dut: => Module, steps: Int): Unit = {
    assume(Engines.present, Engines.missing)
    verify(dut, Seq(BoundedCheck(steps), Engines.boolector))
  }

  "FR-43, FR-47" should "hold: a frame that is ended while it leaves is ended by an abort" in
    prove(new AbortProof, steps = 24)

  // The shortest good frame takes 126 bits from reset.
  private val bits = Tier("proof that no aborted frame is good", "bits", test = 128, soak = 160)
  it should "hold: what an abort ends is never good" in
    bits.run("all", bits.size)(prove(new EndProof, steps = bits.size.toInt))
}
