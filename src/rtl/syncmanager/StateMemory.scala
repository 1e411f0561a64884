package flyframe.syncmanager

import chisel3._
import chisel3.util._
import flyframe.ram.DualPortRamIO

/** The states of SyncManagers in a block RAM: that of one is read, and a cycle later written again. One that
  * does not work is as after a reset (B-50), without a cycle in which it is written.
  *
  * @param n
  *   how many
  * @param sequential
  *   there is the sequential mode
  */
class StateMemory(n: Int, sequential: Boolean) extends Module {

  /** Each: enabled and not deactivated. */
  val works = IO(Input(Vec(n, Bool())))

  /** Which one is read. */
  val number = IO(Input(UInt((log2Ceil(n) max 1).W)))

  /** A cycle later: which one that was, and its state; if `acts`, that becomes `after`. */
  val acting = IO(Output(UInt(number.getWidth.W)))
  val state  = IO(Output(new SyncManagerState(sequential)))
  val acts   = IO(Input(Bool()))
  val after  = IO(Input(new SyncManagerState(sequential)))

  /** Nothing has happened to it since it began to work, or it does not. */
  val isFresh = IO(Output(Vec(n, Bool())))

  /** The block RAM. */
  val ram = IO(Flipped(new DualPortRamIO(StateMemory.Words, state.getWidth)))

  acting           := RegNext(number)
  ram.clock        := clock
  ram.readAddress  := number
  ram.write        := acts
  ram.writeAddress := acting
  ram.writeData    := after.asUInt

  // Reset: none works.
  private val fresh = RegInit(VecInit(Seq.fill(n)(true.B)))
  for (i <- 0 until n) {
    when(acts && acting === i.U) { fresh(i) := false.B }
    when(!works(i)) { fresh(i) := true.B }
  }
  isFresh := fresh

  // What is written while it is read is not yet in what is read.
  private val again = RegNext(acts && acting === number, false.B)
  private val kept =
    Mux(RegNext(fresh(number)), SyncManagerState.start(sequential), ram.readData.asTypeOf(state))
  state := Mux(again, RegNext(after), kept)
}

object StateMemory {

  /** Words of the block RAM, at least so many that it goes to one. */
  val Words = 64
}
