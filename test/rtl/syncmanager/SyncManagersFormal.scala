package flyframe.syncmanager

import chisel3._
import chisel3.util._
import chiseltest._
import chiseltest.formal._
import chiseltest.formal.backends.Engines
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.Tier

/** Two SyncManagers, each of any mode and direction, between a bus and a host of which the solver chooses
  * every step: which SyncManager, first, last or other byte, when a frame ends and how, when one is switched
  * off and on.
  *
  * Both sides ask the views before they access, as frame processor and host sequencer do; what is denied has
  * no effect. A buffer is two bytes or longer. A byte read is accessed in one cycle, its end in a later one;
  * a byte written by ECAT in one.
  */
class SyncManagersProof extends Module {
  private val n = 2

  /** What one side does in this cycle. */
  private class Step extends Bundle {
    val index = UInt(1.W)
    val touch = Bool()
    val first = Bool()
    val last  = Bool()
    val close = Bool()
  }
  private val ecat        = IO(Input(new Step))
  private val pdi         = IO(Input(new Step))
  private val goodEnd     = IO(Input(Bool()))
  private val badEnd      = IO(Input(Bool()))
  private val wantEnabled = IO(Input(UInt(n.W)))
  private val wantLocked  = IO(Input(UInt(n.W)))
  private val modes       = IO(Input(UInt(n.W)))
  private val directions  = IO(Input(UInt(n.W)))

  // Mode and direction are the same all the time.
  private val started = RegInit(false.B)
  started := true.B
  private def steady(value: UInt): UInt = Mux(started, RegEnable(value, !started), value)
  private val isMailbox                 = steady(modes)
  private val ecatWrites                = steady(directions)

  private val dut     = Module(new SyncManager(sequential = false, byWrite = false))
  private val acts    = Wire(Bool())
  private val number  = Wire(UInt(1.W))
  private val states  = RegInit(VecInit(Seq.fill(n)(SyncManagerState.start(sequential = false))))
  private val enabled = RegInit(0.U(n.W))
  private val locked  = RegInit(0.U(n.W))

  // Bus: an end that has been read ahead is still to come; what the frame has touched.
  private val ending                                         = RegInit(0.U(n.W))
  private val touched                                        = RegInit(0.U(n.W))
  private val closed                                         = RegInit(0.U(n.W))
  private val begun                                          = RegInit(0.U(n.W))
  private def set(bits: UInt, index: UInt, when: Bool): UInt = bits | Mux(when, UIntToOH(index, n), 0.U)

  // A frame ends for one SyncManager after the other.
  private val ends     = RegInit(0.U(n.W))
  private val wasGood  = Reg(Bool())
  private val good     = goodEnd && ending === 0.U && !ends.orR
  private val bad      = badEnd && !good && !ends.orR
  private val frameEnd = good || bad || ends.orR
  ends := Mux(good || bad, 1.U, ends << 1)
  when(good || bad) { wasGood := good }
  private val busWrites = ecatWrites(ecat.index)
  private val busAsks   = ecat.touch && !frameEnd && !ending(ecat.index)
  private val busTouch  = busAsks && dut.answer.inBuffer
  private val busLast   = ecat.last && !ecat.first
  private val busCloses = !frameEnd && !busAsks && ecat.close && ending(ecat.index)
  private val busClose  = busCloses || (busTouch && busWrites && busLast)
  private val busActs   = busAsks || busCloses || frameEnd
  ending := ~ends & set(ending, ecat.index, busTouch && !busWrites && busLast) &
    ~set(0.U(n.W), ecat.index, busClose)
  touched := ~ends & set(touched, ecat.index, busTouch)
  begun   := ~ends & set(begun, ecat.index, busTouch && ecat.first)
  closed  := ~ends & set(closed, ecat.index, busClose)

  // Host: the end of the byte it has accessed is still to come.
  private val hostEnds  = RegInit(false.B)
  private val hostIndex = Reg(UInt(1.W))
  private val hostAsks  = pdi.touch && !busActs && !hostEnds
  private val hostTouch = hostAsks && dut.answer.inBuffer
  private val hostClose = pdi.close && !busActs && hostEnds && states(hostIndex).pdiOpen
  when(hostTouch) {
    hostEnds  := pdi.last && !pdi.first
    hostIndex := pdi.index
  }.elsewhen(pdi.close && !busActs) { hostEnds := false.B }

  // Switched off and on between frames; locked between accesses of the host too (B-59).
  private val resting = touched === 0.U && !busActs
  when(resting) { enabled := wantEnabled }
  when(resting && !hostTouch && !hostEnds) { locked := wantLocked }

  dut.good           := ends.orR && wasGood
  dut.bad            := ends.orR && !wasGood
  acts               := busActs && !(good || bad) || hostAsks || hostClose
  number             := Mux(ends.orR, ends(1), Mux(busActs, ecat.index, Mux(hostClose, hostIndex, pdi.index)))
  dut.byPdi          := !busActs
  dut.access.write   := dut.byPdi =/= ecatWrites(number) // the side's own direction
  dut.access.touch   := busAsks || hostAsks
  dut.access.first   := Mux(busActs, ecat.first, pdi.first)
  dut.access.close   := Mux(busAsks, busWrites && busLast, busCloses || hostClose)
  dut.access.single  := false.B
  dut.access.address := 0.U
  dut.access.acknowledge    := 0.U
  dut.settings.isSequential := false.B

  dut.state := states(number) // SyncManagerStates has them in a [[StateMemory]]
  when(acts) { states(number) := dut.after }
  private def works(i: UInt): Bool = enabled(i) && !locked(i)
  dut.settings.works      := works(number)
  dut.settings.locked     := enabled(number) && locked(number)
  dut.settings.isMailbox  := isMailbox(number)
  dut.settings.ecatWrites := ecatWrites(number)

  for (i <- 0 until n) {
    when(!works(i.U)) { states(i) := SyncManagerState.start(sequential = false) }
    val bus   = busTouch && ecat.index === i.U
    val host  = hostTouch && pdi.index === i.U
    val busC  = busClose && ecat.index === i.U
    val hostC = hostClose && hostIndex === i.U

    // What has happened, seen from outside.
    val working   = works(i.U)
    val good      = ends(i) && wasGood
    val bad       = ends(i) && !wasGood
    val buffered  = !isMailbox(i)
    val writer    = states(i).writer
    val reader    = states(i).reader
    val byEcat    = ecatWrites(i)
    val busDone   = good && closed(i)
    val wrote     = Mux(byEcat, busDone, hostC)
    val hasRead   = Mux(byEcat, hostC, busDone)
    val busBegan  = good && begun(i)
    val hostBegan = host && pdi.first
    val opens     = Mux(byEcat, host && pdi.first, bus && ecat.first)
    val lets      = Mux(byEcat, hostC, busDone || (bad && touched(i)))

    val anyWritten = RegInit(false.B)
    val complete   = Reg(UInt(2.W)) // the buffer written last
    val full       = RegInit(false.B)
    val reading    = RegInit(false.B)
    val held       = Reg(UInt(2.W)) // the buffer the reader has
    val writeEvent = RegInit(false.B)
    val readEvent  = RegInit(false.B)
    when(opens && !reading) {
      reading := true.B
      held    := complete
      assert(Mux(buffered, anyWritten, full), "opened for reading with nothing to read")
    }
    when(lets) { reading := false.B }
    when(Mux(byEcat, hostBegan, busBegan)) { writeEvent := false.B }
    when(Mux(byEcat, busBegan, hostBegan)) { readEvent := false.B }
    when(wrote) {
      anyWritten := true.B
      complete   := writer
      full       := true.B
      writeEvent := true.B
      when(!buffered) { assert(!full, "a message is overwritten, lost") }
    }
    when(hasRead) {
      full      := false.B
      readEvent := true.B
      when(!buffered) { assert(full, "a message is read twice") }
    }
    when(!working) {
      Seq(anyWritten, full, reading, writeEvent, readEvent).foreach(_ := false.B)
    }

    // Three buffers, the third one between the two.
    when(buffered) {
      assert(writer =/= reader, "writer and reader have the same buffer")
      assert(writer =/= 3.U && reader =/= 3.U, "a buffer that does not exist")
    }
    when(working && buffered) {
      when(reading) {
        assert(reader === held, "the reader has not the newest buffer, or loses it")
        assert(writer =/= held, "the reader's buffer is written")
      }
      when(anyWritten) { assert(writer =/= complete, "the newest buffer is written") }
      when(anyWritten && states(i).newer) {
        assert(states(i).next === complete, "NEXT is the newest")
      }
    }
    when(working) {
      assert(buffered || states(i).newer === full, "mailbox full in the status")
      assert(states(i).writeEvent === writeEvent && states(i).readEvent === readEvent, "events")
      assert((acts && dut.written && number === i.U) === wrote, "a complete write, for the watchdog")
    }

    // Nobody acts on this one: it stays as it is, whatever happens to the other.
    val untouched = started && !bus && !busC && !host && !hostC && !(ends(i) && touched(i))
    val state     = states(i).asUInt
    when(RegNext(untouched && working, false.B) && working) {
      assert(state === RegNext(state), "changes by what concerns another")
    }
  }
}

class SyncManagersFormal extends AnyFlatSpec with ChiselScalatestTester with Formal {
  private val tier = Tier("proof of two SyncManagers in any modes", "cycles", test = 20, soak = 24)

  "SM-12 to SM-20" should s"hold for two SyncManagers in any modes, ${tier.size} cycles of any accesses" in {
    assume(Engines.present, Engines.missing)
    tier.run("all", tier.size)(
      verify(new SyncManagersProof, Seq(BoundedCheck(tier.size.toInt), Engines.boolector))
    )
  }
}
