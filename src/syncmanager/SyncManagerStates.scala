package flyframe.syncmanager

import chisel3._
import chisel3.util._

/** How one side accesses buffers.
  *
  * @param indexBits
  *   bits of a SyncManager's number
  */
class StatePort(indexBits: Int) extends Bundle {

  /** An access to the area of SyncManager `number`. Granted to ECAT always, to the PDI if `granted` is set in the
    * same cycle (B-58). It acts in the next cycle; `answer` is there in the one after, for that cycle only.
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

  private val bank = Module(new SyncManagerBank(n))
  val states       = IO(chiselTypeOf(bank.states))
  val writeEvent   = IO(chiselTypeOf(bank.writeEvent))
  val readEvent    = IO(chiselTypeOf(bank.readEvent))
  val written      = IO(chiselTypeOf(bank.written))
  states        := bank.states
  writeEvent    := bank.writeEvent
  readEvent     := bank.readEvent
  written       := bank.written
  bank.settings := settings

  private val walks   = RegInit(false.B) // reset: no frame
  private val wasGood = Reg(Bool())
  private val walk    = Reg(UInt(indexBits.W))
  private val isLast  = walks && walk === (n - 1).U
  when(good || bad) {
    walks   := true.B
    wasGood := good
    walk    := 0.U
  }.elsewhen(walks) {
    walk  := walk + 1.U
    walks := !isLast
  }
  walking := walks || good || bad || RegNext(walks, false.B)
  settled := ShiftRegister(isLast && wasGood, 2, false.B, true.B)

  ecat.granted := true.B
  pdi.granted  := !walks && !good && !bad && !ecat.request
  private val accesses = (ecat.request || (pdi.request && pdi.granted)) && !walks
  bank.acts   := RegNext(walks || accesses, false.B)
  bank.number := RegNext(Mux(walks, walk, Mux(ecat.request, ecat.number, pdi.number)))
  bank.byPdi  := RegNext(!ecat.request)
  bank.good   := RegNext(walks && wasGood, false.B)
  bank.bad    := RegNext(walks && !wasGood, false.B)
  bank.access := {
    val access = WireDefault(Mux(ecat.request, ecat.access, pdi.access))
    when(!accesses) {
      access.touch := false.B
      access.close := false.B
    }
    RegNext(access)
  }
  private val answer = RegNext(bank.answer)
  ecat.answer := answer
  pdi.answer  := answer
}

/** The states and events of all SyncManagers, and the logic they share: one of them acts in a cycle. */
class SyncManagerBank(n: Int) extends Module {
  private val indexBits = log2Ceil(n) max 1

  val settings = IO(Input(Vec(n, new SyncManagerSettings)))

  /** Something happens to SyncManager `number`: an access, or the end of a frame. */
  val acts   = IO(Input(Bool()))
  val number = IO(Input(UInt(indexBits.W)))
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
  logic.state    := states(number)
  logic.settings := settings(number)
  logic.access   := access
  logic.byPdi    := byPdi
  logic.good     := good
  logic.bad      := bad
  answer         := logic.answer

  for (i <- 0 until n) {
    val mine  = acts && number === i.U
    val works = settings(i).works
    val state = RegInit(SyncManagerState.start).suggestName(s"state_$i")
    when(mine) { state := logic.after }
    when(!works) { state := SyncManagerState.start }
    states(i) := state

    // Reset: no event.
    def event(begin: Bool, end: Bool, name: String): Bool = {
      val flag = RegInit(false.B).suggestName(s"${name}_$i")
      when(mine && end) { flag := false.B }
      when(mine && begin) { flag := true.B }
      when(!works) { flag := false.B }
      flag
    }
    writeEvent(i) := event(logic.writeEvent, logic.writeEventEnd, "isWritten")
    readEvent(i)  := event(logic.readEvent, logic.readEventEnd, "isRead")
  }
  written.valid := acts && settings(number).works && logic.writeEvent
  written.bits  := number
}
