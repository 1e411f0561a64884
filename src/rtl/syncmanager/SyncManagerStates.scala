package flyframe.syncmanager

import chisel3._
import chisel3.util._
import flyframe.memory.BufferEvents
import flyframe.params.EscParams
import flyframe.ram.DualPortRam

/** How one side accesses buffers. */
class StatePort(p: EscParams) extends Bundle {

  /** The side may make a request in this cycle; ECAT keeps the PDI away. */
  val turn = Input(Bool())

  /** An access to the area of SyncManager `number`. Granted to ECAT always, to the PDI if `granted` is set in
    * the same cycle (B-58). It acts in the next cycle; `answer` is there in the one after, for that cycle
    * only.
    */
  val request = Input(Bool())
  val granted = Output(Bool())
  val number  = Input(UInt(p.smIndexBits.W))
  val access  = Input(new BufferAccess(p.hasSequentialMode, p.acknowledgesByWrite))
  val answer  = Output(new BufferAnswer)
}

/** What of the control register (0x0804) acts when something happens to a SyncManager. */
class SyncManagerControl(sequential: Boolean) extends Bundle {
  val watchdogTrigger = Bool()
  val alEvent         = Bool()
  val ecatEvent       = Bool()
  val ecatWrites      = Bool()

  /** Where that is built. */
  val isSequential = UInt((if (sequential) 1 else 0).W)
}

object SyncManagerControl {

  /** Of the register as it is written. */
  def apply(register: UInt, sequential: Boolean): SyncManagerControl = {
    val control = Wire(new SyncManagerControl(sequential))
    control.watchdogTrigger := register(6)
    control.alEvent         := register(5)
    control.ecatEvent       := register(4)
    control.ecatWrites      := register(2)
    control.isSequential    := register(7)
    control
  }
}

/** What happens to the SyncManagers, one after the other: the ends of frames, else ECAT's accesses, else the
  * PDI's. Two steps, so that neither is long: choose, then act.
  */
class SyncManagerStates(p: EscParams) extends Module {
  private val n          = p.syncManagers
  private val indexBits  = p.smIndexBits
  private val sequential = p.hasSequentialMode

  /** Each: enabled and not deactivated; enabled and deactivated; a mailbox. */
  val works     = IO(Input(Vec(n, Bool())))
  val locked    = IO(Input(Vec(n, Bool())))
  val isMailbox = IO(Input(Vec(n, Bool())))

  /** Each, with the deactivation delay: it works for the host only. */
  val lingers = IO(Input(Vec(if (p.hasDeactivationDelay) n else 0, Bool())))

  /** One does not work in this cycle only, as it begins anew; the host must not see that. */
  val restarts = IO(Input(Bool()))

  /** The control register of one is written, which does not work. */
  val controls     = IO(Input(Bool()))
  val controlIndex = IO(Input(UInt(indexBits.W)))
  val control      = IO(Input(new SyncManagerControl(sequential)))

  val ecat = IO(new StatePort(p))
  val pdi  = IO(new StatePort(p))

  /** End of a frame. */
  val good = IO(Input(Bool()))
  val bad  = IO(Input(Bool()))

  /** The end of a frame is being carried out; it has been, for a good one: one pulse. */
  val walking = IO(Output(Bool()))
  val settled = IO(Output(Bool()))

  /** Which SyncManager the present request is for; a cycle later, a cycle before the answer, the buffer. */
  val asked  = IO(Output(UInt(indexBits.W)))
  val buffer = IO(Output(UInt(2.W)))

  /** The status register (0x0805) of one is read, by the host or not; a cycle later it is there. */
  val statusIndex = IO(Input(UInt(indexBits.W)))
  val statusByPdi = IO(Input(Bool()))
  val status      = IO(Output(UInt(8.W)))

  /** Events of each for ECAT and for the PDI; a buffer with watchdog trigger has been written (WD-04). */
  val ecatEvent = IO(Output(Vec(n, Bool())))
  val alEvent   = IO(Output(Vec(n, Bool())))
  val trigger   = IO(Output(Bool()))

  /** With the deactivation delay: what ECAT has written, and the host may read. */
  val hasData = IO(Output(Vec(lingers.size, Bool())))

  /** What happens to buffers, where its times are kept (DC-42): of those that are told to (0x0806[7:6]), for
    * ECAT and for the host.
    */
  val events    = Option.when(p.hasEventTimes)(IO(Output(new BufferEvents)))
  val latchEcat = IO(Input(Vec(if (p.hasEventTimes) n else 0, Bool())))
  val latchPdi  = IO(Input(Vec(latchEcat.size, Bool())))

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
  pdi.granted  := !walks && !good && !bad && !begins && !ecat.turn && !restarts
  private val accesses = (ecat.request || (pdi.request && pdi.granted)) && !walks
  private val number   = Mux(walks, walk, Mux(ecat.turn, ecat.number, pdi.number))

  // Of the one that is chosen. What does not work must not keep the state it had: it may work again in the
  // next cycle, and then begins anew.
  private val hidden = if (p.hasDeactivationDelay) !walks && ecat.turn && lingers(number) else false.B
  private val acts   = RegNext((walks || accesses) && works(number) && !hidden, false.B)
  private val memory = Module(new StateMemory(n, sequential))
  private val ram    = Module(new DualPortRam(StateMemory.Words, memory.state.getWidth)).suggestName("states")
  ram.io <> memory.ram
  memory.works  := works
  memory.number := number
  memory.acts   := acts

  private val controlRam = DualPortRam(StateMemory.Words, control.getWidth)(clock)
  controlRam.io.write        := controls
  controlRam.io.writeAddress := controlIndex
  controlRam.io.writeData    := control.asUInt
  controlRam.io.readAddress  := number
  private val chosen = controlRam.io.readData.asTypeOf(control)

  private val logic = Module(new SyncManager(sequential, p.acknowledgesByWrite))
  logic.state                 := memory.state
  memory.after                := logic.after
  logic.settings.works        := RegNext(works(number) && !hidden)
  logic.settings.locked       := RegNext(locked(number))
  logic.settings.isMailbox    := RegNext(isMailbox(number))
  logic.settings.ecatWrites   := chosen.ecatWrites
  logic.settings.isSequential := (if (sequential) chosen.isSequential.asBool else false.B)
  logic.byPdi                 := RegNext(!ecat.turn)
  logic.good                  := RegNext(walks && wasGood, false.B)
  logic.bad                   := RegNext(walks && !wasGood, false.B)
  logic.access := {
    val access = WireDefault(Mux(ecat.turn, ecat.access, pdi.access))
    when(!accesses) {
      access.touch       := false.B
      access.close       := false.B
      access.acknowledge := 0.U
    }
    RegNext(access)
  }
  private val answer = RegNext(logic.answer)
  asked       := number
  buffer      := logic.answer.buffer
  ecat.answer := answer
  pdi.answer  := answer
  trigger     := acts && logic.written && chosen.watchdogTrigger

  // What comes of it is in flip-flops, if it is looked at all the time.
  private def each(name: String, to: Vec[Bool], now: Bool): Unit = for ((shown, i) <- to.zipWithIndex) {
    val flag = RegInit(false.B).suggestName(s"${name}_$i") // reset: nothing has happened
    when(acts && memory.acting === i.U) { flag := now }
    when(!works(i)) { flag := false.B }
    shown := flag
  }

  // A written buffer is an event for the side that reads, a read one for the side that writes.
  private val after             = logic.after
  private val (written, isRead) = (after.writeEvent, after.readEvent)
  private val mailbox           = logic.settings.isMailbox
  each("ecatEvent", ecatEvent, chosen.ecatEvent && Mux(chosen.ecatWrites, isRead, written))
  each("alEvent", alEvent, chosen.alEvent && Mux(chosen.ecatWrites, written, isRead))
  each("hasData", hasData, chosen.ecatWrites && Mux(mailbox, after.newer, after.anyWritten))

  for (shown <- events) {
    shown.byEcat := acts && logic.events.byEcat && latchEcat(memory.acting)
    shown.byPdi  := acts && logic.events.byPdi && latchPdi(memory.acting)
    shown.begun  := acts && logic.events.begun && latchPdi(memory.acting)
  }

  // The status of one to which nothing has happened depends on its mode only, and so does that of one which
  // has been switched off for ECAT.
  private val lastBuffer = Mux(after.anyWritten, Mux(after.newer, after.next, after.reader), 3.U(2.W))
  private val states     = Cat(Mux(mailbox, 0.U, lastBuffer), mailbox && after.newer, isRead, written)
  private val sequences  = if (sequential) logic.settings.isSequential ## after.violated else 0.U(0.W)
  private val (writerOpen, readerOpen) = {
    val (ecat, pdi) = (after.leftOpen, after.pdiOpen)
    (Mux(chosen.ecatWrites, ecat, pdi), Mux(chosen.ecatWrites, pdi, ecat))
  }
  private val open      = if (p.tellsOpenBuffers) writerOpen ## readerOpen else 0.U(0.W)
  private val statusNow = open ## sequences ## states
  private val statusRam = DualPortRam(StateMemory.Words, statusNow.getWidth)(clock)
  statusRam.io.write        := acts
  statusRam.io.writeAddress := memory.acting
  statusRam.io.writeData    := statusNow
  statusRam.io.readAddress  := statusIndex
  private val isHidden =
    if (!p.hasDeactivationDelay) false.B
    else {
      val here = RegNext(lingers(statusIndex) && !statusByPdi)
      if (sequential) here && !statusRam.io.readData(6) else here
    }
  private val fresh   = Mux(RegNext(isMailbox(statusIndex)), 0.U, SyncManagerStates.NoneWritten.U(5.W))
  private val isFresh = RegNext(memory.isFresh(statusIndex)) || isHidden
  private val shown   = Mux(isFresh, fresh, statusRam.io.readData)
  private val error   = if (sequential) !isFresh && statusRam.io.readData(5) else false.B
  private val isOpen  = if (p.tellsOpenBuffers) Mux(isFresh, 0.U, statusRam.io.readData.head(2)) else 0.U(2.W)
  status := Cat(isOpen, shown(4, 3), shown(2), error, shown(1, 0))
}

private object SyncManagerStates {

  /** Status of three buffers: none has been written yet. */
  val NoneWritten = 0x18
}
