package flyframe.syncmanager

import chisel3._
import chiseltest._
import chiseltest.formal._
import chiseltest.formal.backends.Engines
import org.scalatest.flatspec.AnyFlatSpec

/** A [[StateMemory]] beside flip-flops, with any states; what acts has worked when it was read. */
class StateMemoryProof extends Module {
  private val n        = 2
  private val works    = IO(Input(Vec(n, Bool())))
  private val number   = IO(Input(UInt(1.W)))
  private val wantsAct = IO(Input(Bool()))
  private val after    = IO(Input(new SyncManagerState(sequential = true)))

  private val dut    = Module(new StateMemory(n, sequential = true))
  private val worked = RegNext(works(number), false.B)
  private val acts   = wantsAct && worked
  dut.works  := works
  dut.number := number
  dut.acts   := acts
  dut.after  := after

  // The block RAM, with contents that are undefined at the beginning.
  private val words = Reg(Vec(n, UInt(after.getWidth.W)))
  dut.ram.readData := RegNext(words(dut.ram.readAddress(0)))
  when(dut.ram.write) { words(dut.ram.writeAddress(0)) := dut.ram.writeData }

  private val states = RegInit(VecInit(Seq.fill(n)(SyncManagerState.start(sequential = true))))
  when(acts) { states(dut.acting) := after }
  for (i <- 0 until n) {
    when(!works(i)) { states(i) := SyncManagerState.start(sequential = true) }
    when(dut.isFresh(i)) {
      assert(states(i).asUInt === SyncManagerState.start(sequential = true).asUInt, "fresh, but not new")
    }
  }
  when(worked) { assert(dut.state.asUInt === states(dut.acting).asUInt, "another state") }
}

class StateMemoryFormal extends AnyFlatSpec with ChiselScalatestTester with Formal {
  "SM-27, SM-28, B-50: states in block RAM" should "be those of flip-flops, and begin anew" in {
    assume(Engines.present, Engines.missing)
    verify(new StateMemoryProof, Seq(BoundedCheck(10), Engines.boolector))
  }
}
