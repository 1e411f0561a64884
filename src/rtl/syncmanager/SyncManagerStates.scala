package flyframe.syncmanager

import chisel3._
import chisel3.util._

/** How one side accesses buffers.
  *
  * @param indexBits
  *   bits of a SyncManager's number
  */
class StatePort(indexBits: Int) extends Bundle {

  /** The side may make a request in this cycle; ECAT keeps the PDI away. */
  val turn = Input(Bool())

  /** An access to the area of SyncManager `number`. Granted to ECAT always, to the PDI if `granted` is set in
    * the same cycle (B-58). It acts in the next cycle; `answer` is there in the one after, for that cycle
    * only.
    */
  val request = Input(Bool())
  val granted = Output(Bool())
  val number  = Input(UInt(indexBits.W))
  val access  = Input(new BufferAccess)
  val answer  = Output(new BufferAnswer)
}

/** What happens to the SyncManagers, one after the other: the ends of frames, else ECAT's accesses, else the
  * PDI's. Two steps, so that neither is long: choose, then act.
  */
class SyncManagerStates(n: Int) extends Module {
  private val indexBits = log2Ceil(n) max 1

  val settings = IO(Input(Vec(n, new SyncManagerSettings)))
  val ecat     = IO(new StatePort(indexBits))
  val pdi      = IO(new StatePort(indexBits))

  /** End of a frame. */
  val good = IO(Input(Bool()))
  val bad  = IO(Input(Bool()))

  /** The end of a frame is being carried out; it has been, for a good one: one pulse. */
  val walking = IO(Output(Bool()))
  val settled = IO(Output(Bool()))

  /** Which SyncManager the present request is for; a cycle later, a cycle before the answer, the buffer. */
  val asked  = IO(Output(UInt(indexBits.W)))
  val buffer = IO(Output(UInt(2.W)))

  private val bank = Module(new SyncManagerBank(n))
  val states       = IO(chiselTypeOf(bank.states))
  val writeEvent   = IO(chiselTypeOf(bank.writeEvent))
  val readEvent    = IO(chiselTypeOf(bank.readEvent))
  val written      = IO(chiselTypeOf(bank.written))
  states     := bank.states
  writeEvent := bank.writeEvent
  readEvent  := bank.readEvent
  written    := bank.written
  bank.works := VecInit(settings.map(_.works))

  private val walks   = RegInit(false.B) // reset: no frame
  private val wasGood = Reg(Bool())
  private val walk    = Reg(UInt(indexBits.W))
  private val isLast  = walks && walk === (n - 1).U
  // What ECAT asks for in the cycle behind a frame's end still belongs to the frame (B-55).
  private val begins = RegNext(good || bad, false.B)
  when(good || bad) { wasGood := good }
  when(begins) {
    walks := true.B
    walk  := 0.U
  }.elsewhen(walks) {
    walk  := walk + 1.U
    walks := !isLast
  }
  walking := walks || good || bad || begins || RegNext(walks, false.B)
  settled := ShiftRegister(isLast && wasGood, 2, false.B, true.B)

  ecat.granted := true.B
  pdi.granted  := !walks && !good && !bad && !begins && !ecat.turn
  private val accesses = (ecat.request || (pdi.request && pdi.granted)) && !walks
  private val number   = Mux(walks, walk, Mux(ecat.turn, ecat.number, pdi.number))
  // What does not work must not keep the state it had: it may work again in the next cycle, and then begins
  // anew.
  bank.acts   := RegNext((walks || accesses) && settings(number).works, false.B)
  bank.number := RegNext(number)
  // A cycle old; of the state, what happened in that cycle is added. The configuration changes only while the
  // SyncManager does not work, and that clears its state at once.
  bank.chosen := RegNext(settings(number))
  bank.state  := RegNext(Mux(bank.acts && bank.number === number, bank.after, bank.states(number)))
  bank.byPdi  := RegNext(!ecat.turn)
  bank.good   := RegNext(walks && wasGood, false.B)
  bank.bad    := RegNext(walks && !wasGood, false.B)
  bank.access := {
    val access = WireDefault(Mux(ecat.turn, ecat.access, pdi.access))
    when(!accesses) {
      access.touch := false.B
      access.close := false.B
    }
    RegNext(access)
  }
  private val answer = RegNext(bank.answer)
  asked       := number
  buffer      := bank.answer.buffer
  ecat.answer := answer
  pdi.answer  := answer
}

/** The states and events of all SyncManagers, and the logic they share: one of them acts in a cycle. */
class SyncManagerBank(n: Int) extends Module {
  private val indexBits = log2Ceil(n) max 1

  /** Each: enabled and not deactivated. */
  val works = IO(Input(Vec(n, Bool())))

  /** Something happens to SyncManager `number`: an access, or the end of a frame. */
  val acts   = IO(Input(Bool()))
  val number = IO(Input(UInt(indexBits.W)))
  val chosen = IO(Input(new SyncManagerSettings)) // of that one
  val state  = IO(Input(new SyncManagerState))    // of that one
  val after  = IO(Output(new SyncManagerState))   // and what becomes of it
  val access = IO(Input(new BufferAccess))
  val byPdi  = IO(Input(Bool()))
  val good   = IO(Input(Bool()))
  val bad    = IO(Input(Bool()))
  val answer = IO(Output(new BufferAnswer))

  val states     = IO(Output(Vec(n, new SyncManagerState)))
  val writeEvent = IO(Output(Vec(n, Bool())))
  val readEvent  = IO(Output(Vec(n, Bool())))

  /** A buffer has been written completely: that of this SyncManager. */
  val written = IO(Output(Valid(UInt(indexBits.W))))

  private val logic = Module(new SyncManager)
  logic.state    := state
  logic.settings := chosen
  logic.access   := access
  logic.byPdi    := byPdi
  logic.good     := good
  logic.bad      := bad
  after          := logic.after
  answer         := logic.answer

  for (i <- 0 until n) {
    val mine = acts && number === i.U
    val own  = RegInit(SyncManagerState.start).suggestName(s"state_$i")
    when(mine) { own := logic.after }
    when(!works(i)) { own := SyncManagerState.start }
    states(i) := own

    // Reset: no event.
    def event(begin: Bool, end: Bool, name: String): Bool = {
      val flag = RegInit(false.B).suggestName(s"${name}_$i")
      when(mine && end) { flag := false.B }
      when(mine && begin) { flag := true.B }
      when(!works(i)) { flag := false.B }
      flag
    }
    writeEvent(i) := event(logic.writeEvent, logic.writeEventEnd, "isWritten")
    readEvent(i)  := event(logic.readEvent, logic.readEventEnd, "isRead")
  }
  written.valid := acts && logic.writeEvent
  written.bits  := number
}
