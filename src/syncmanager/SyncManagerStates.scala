package flyframe.syncmanager

import chisel3._
import chisel3.util._

/** How one side asks for the state of a SyncManager, and accesses its buffer.
  *
  * @param indexBits
  *   bits of a SyncManager's number
  */
class StatePort(indexBits: Int) extends Bundle {

  /** Asks for `view`, or for `access`, of SyncManager `number`. Granted to ECAT always, to the PDI if
    * `granted` is set, in the same cycle (B-58).
    */
  val request = Input(Bool())
  val granted = Output(Bool())
  val number  = Input(UInt(indexBits.W))
  val view    = Output(new SyncManagerView)

  /** An allowed access of this side, in the SyncManager's direction. */
  val access = Input(new BufferAccess)
}

/** The states and events of all SyncManagers. In each cycle one of them is at work with the logic they share:
  * for the end of a frame one after the other, else for ECAT, else for the PDI.
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

  val states     = IO(Output(Vec(n, new SyncManagerState)))
  val writeEvent = IO(Output(Vec(n, Bool())))
  val readEvent  = IO(Output(Vec(n, Bool())))

  /** A buffer has been written completely: that of this SyncManager. */
  val written = IO(Output(Valid(UInt(indexBits.W))))

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
  walking := walks || good || bad
  settled := RegNext(isLast && wasGood, false.B)

  private val number = Mux(walks, walk, Mux(ecat.request, ecat.number, pdi.number))
  private val logic  = Module(new SyncManager)
  ecat.granted := true.B
  pdi.granted  := !walking && !ecat.request
  private val acts = walks || ecat.request || (pdi.request && pdi.granted)

  logic.state    := states(number)
  logic.settings := settings(number)
  logic.good     := walks && wasGood
  logic.bad      := walks && !wasGood
  for ((port, access) <- Seq(ecat -> logic.ecat, pdi -> logic.pdi)) {
    val now = port.request && port.granted
    access       := port.access
    access.touch := port.access.touch && now
    access.close := port.access.close && now
    port.view    := logic.view
  }

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
