package flyframe.master

import chisel3._
import chisel3.util.Valid
import chiseltest._
import chiseltest.formal._
import chiseltest.formal.backends.Engines
import flyframe.protocol.SlaveStatus
import org.scalatest.flatspec.AnyFlatSpec

/** A [[CyclicState]] whose inputs are all free: whatever came before, and whatever else comes. */
class SoundProof extends Module {
  private val answer     = IO(Input(Valid(UInt(16.W))))
  private val over       = IO(Input(Valid(Bool())))
  private val newAlarm   = IO(Input(Bool()))
  private val newSound   = IO(Input(Bool()))
  private val silence    = IO(Input(Bool()))
  private val resetAlarm = IO(Input(Bool()))
  private val expires    = IO(Input(Bool()))
  private val givenUp    = IO(Input(Bool()))
  private val dut        = Module(new CyclicState)
  dut.answer     := answer
  dut.over       := over
  dut.newAlarm   := newAlarm
  dut.newSound   := newSound
  dut.silence    := silence
  dut.resetAlarm := resetAlarm
  dut.expires    := expires
  dut.givenUp    := givenUp

  assume(!(answer.valid && over.valid)) // an answer is looked at before its cycle is over

  private def comes(bits: Int) = answer.valid && (answer.bits & bits.U).orR
  private val sounds           = comes(SlaveStatus.Sounding)
  private val smoke            = comes(SlaveStatus.Alarm | SlaveStatus.Latched)

  // Answers that have come since the cycle before was over, and those of the last one that was whole.
  private val heard  = RegInit(false.B) // in this cycle
  private val before = RegInit(false.B) // what sounds may have been silenced
  when(over.valid) {
    heard := false.B
    when(over.bits) { before := heard }
  }
  when(sounds) {
    heard  := true.B
    before := true.B
  }
  when(givenUp && !sounds) {
    heard  := false.B
    before := false.B
  }

  // The next clock edge switches the sounder on.
  private val rises = RegNext(sounds && !before || newSound, false.B)
  assert(!rises || dut.sounding, "a slave has begun to sound, the master has not")
  assert(!RegNext(smoke, false.B) || dut.fire, "there is smoke, and no fire")

  // Only people end the sound; fire ends after a reset only.
  private val on = RegNext(dut.sounding && !silence && !resetAlarm, false.B)
  assert(!on || dut.sounding, "the sound has ended by itself")
  private val asked = RegInit(false.B)
  when(resetAlarm) { asked := true.B }
  assert(asked || !RegNext(dut.fire, false.B) || dut.fire, "fire has ended without a reset")
}

class CyclicStateFormal extends AnyFlatSpec with ChiselScalatestTester with Formal {
  "LM-05, LM-06: a status word with sounding or alarm" should
    "switch sounder and fire on with the next clock, whatever else happens; only people end them" in {
      assume(Engines.present, Engines.missing)
      verify(new SoundProof, Seq(BoundedCheck(12), Engines.boolector))
    }
}
