package flyframe.syncmanager

import chisel3._
import chisel3.util._
import flyframe.lanes.Lanes
import flyframe.memory.{RegisterWrite, RegisterWrites, TableWrite, WideTable}
import flyframe.params.EscParams
import flyframe.registers.{Register, RegisterMap, SyncManagerRegisters}

/** What an accessing side sees of the SyncManagers: the table of areas, an entry per cycle, and one state at
  * a time.
  */
class AreaPort(p: EscParams) extends Bundle {
  val index = Input(UInt(3.W))

  /** The entries with this number in each bank of eight, asked for in the cycle before; `begins` is the
    * caller's.
    */
  val entries = Output(Vec(p.smBanks, new AreaEntry(p.smIndexBits)))

  /** An access, see [[StatePort]]. */
  val turn    = Input(Bool())
  val request = Input(Bool())
  val granted = Output(Bool())
  val number  = Input(UInt(p.smIndexBits.W))
  val access  = Input(new BufferAccess(p.hasSequentialMode, p.acknowledgesByWrite))
  val answer  = Output(new BufferAnswer)

  /** With the answer: how far behind the byte's address the one in the buffer lies. */
  val offset = Output(UInt(17.W))

  /** The end of a frame is being carried out. */
  val changing = Output(Bool())

  /** Process data RAM is open. */
  val ramOpen = Output(Bool())
}

/** The addresses that SyncManagers act on (B-52).
  *
  * @param registers
  *   checked by [[RegisterMap]], so that those in front of the user RAM can be compared by whole words
  */
class ManagedSpace(p: EscParams, registers: Seq[Register]) {
  private val first   = RegisterMap.firstManaged(registers)
  private val managed = registers.filter(_.managed)
  private val others  = RegisterMap.unmanagedWords(registers)
  private def area    = 1 << log2Ceil(RegisterMap.ProcessRamStart - RegisterMap.UserRamStart)

  /** There are registers that SyncManagers do not act on, behind the first address that they act on. */
  def hasOthers: Boolean = others.nonEmpty

  /** A register that SyncManagers do not act on, behind the first address that they act on. */
  def isOther(address: UInt): Bool = others.map(w => address(15, 2) === w.U).foldLeft(false.B)(_ || _)

  /** They act on `address`. */
  def acts(address: UInt): Bool = address >= first.U && !isOther(address)

  /** There is memory, or a register for them, at an `address` that they act on. */
  def exists(address: UInt, ramOpen: Bool): Bool = {
    val inUserRam = address(log2Ceil(area))
    val inRegister = managed.map { r =>
      val low = log2Ceil(r.bytes)
      address(log2Ceil(area) - 1, low) === (r.address % area >> low).U
    }
    Mux(
      address < RegisterMap.ProcessRamStart.U,
      inRegister.foldLeft(inUserRam)(_ || _),
      ramOpen && address < (RegisterMap.ProcessRamStart + p.ramBytes).U
    )
  }
}

/** All SyncManagers with their configuration ([[SyncManagerRegisters]], 0x0800 on) and events. */
class SyncManagers(p: EscParams) extends Module {
  private val n = p.syncManagers

  val write = IO(Input(Valid(new RegisterWrite(p.lanes, p.hasBitWrites))))
  val table = IO(Input(new TableWrite)) // the same
  val ecat  = IO(new AreaPort(p))
  val pdi   = IO(new AreaPort(p))

  /** Process data RAM is open. */
  val ramOpen = IO(Input(Bool()))

  /** End of a frame; no frame is in the processing unit; and no access of the host is under way (B-59). */
  val good    = IO(Input(Bool()))
  val bad     = IO(Input(Bool()))
  val noFrame = IO(Input(Bool()))
  val quiet   = IO(Input(Bool()))

  /** All buffers the good frame has closed have changed hands: one pulse. */
  val settled = IO(Output(Bool()))

  /** 0x0806[0] of each. */
  val enable = IO(Input(Vec(n, Bool())))

  /** 0x0805 of one is read, by the host or not; a cycle later it is there. */
  val statusIndex = IO(Input(UInt(p.smIndexBits.W)))
  val statusByPdi = IO(Input(Bool()))
  val status      = IO(Output(UInt(8.W)))

  /** 0x0807[0] of each. */
  val deactivated = IO(Output(Vec(n, Bool())))

  /** 0x0807[6] and [7] of each, with the deactivation delay. */
  val delays      = IO(Input(Vec(if (p.hasDeactivationDelay) n else 0, Bool())))
  val delayActive = IO(Output(Vec(delays.size, Bool())))

  /** Events for the master (0x0210) and the host (0x0220). */
  val ecatEvent = IO(Output(Vec(n min 8, Bool()))) // 0x0210 has eight bits for them
  val alEvent   = IO(Output(Vec(n, Bool())))

  /** A buffer with watchdog trigger has been written (WD-04). */
  val trigger = IO(Output(Bool()))

  // The table of start and length, of SyncManagers that have the low seven bits of an address to themselves.
  require(
    SyncManagerRegisters.First % 128 == 0 && SyncManagerRegisters.Stride == 8,
    f"SyncManagerRegisters has First 0x${SyncManagerRegisters.First}%04x and Stride " +
      f"${SyncManagerRegisters.Stride} " +
      "but must have First at a multiple of 128 and Stride 8."
  )
  private val address   = write.bits.byteAddress
  private val isInTable = address(11, 7) === (SyncManagerRegisters.First >> 7).U
  private val hitsArea  = table.valid && isInTable && !address(2)
  private val tables = Seq.tabulate(p.smBanks) { bank =>
    val copy = Module(new WideTable(n min 8, Seq.fill(4)(8), copies = 3)).suggestName(s"table_$bank")
    copy.write      := hitsArea && address(6) === bank.U && address(5, 3) < (n min 8).U
    copy.writeIndex := address(5, 3)
    copy.writeMask  := table.mask
    copy.writeData  := table.data
    copy
  }

  private val states = Module(new SyncManagerStates(p))

  /** For their times (DC-42). */
  val events = states.events.map(of => IO(chiselTypeOf(of)))
  for ((outside, inside) <- events.zip(states.events)) outside := inside
  val latchEcat = IO(chiselTypeOf(states.latchEcat))
  val latchPdi  = IO(chiselTypeOf(states.latchPdi))
  states.latchEcat := latchEcat
  states.latchPdi  := latchPdi

  // What acts all the time is in flip-flops, reset as the registers.
  private val writes = new RegisterWrites(SyncManagerRegisters(p), write)
  private val isMailbox = VecInit((0 until n).map { i =>
    val written = writes.written(s"sm${i}_control")
    RegEnable(written.bits(1), false.B, written.valid).suggestName(s"isMailbox_$i")
  })
  private val wantsOff = (0 until n).map { i => // as written
    val written = writes.written(s"sm${i}_deactivated")
    RegEnable(written.bits.asBool, false.B, written.valid).suggestName(s"deactivate_$i")
  }
  private val isOff = wantsOff.zipWithIndex.map { case (w, i) =>
    RegEnable(w, false.B, quiet && !states.walking).suggestName(s"deactivated_$i")
  }
  private val lingering = (0 until delayActive.size).map { i =>
    val unit = Module(new DeactivationDelay).suggestName(s"delay_$i")
    unit.isOn       := delays(i) && !isOff(i) && states.hasData(i)
    unit.noFrame    := noFrame
    unit.enable     := writes.written(s"sm${i}_enable")
    unit.wasEnabled := enable(i)
    unit.changes := Seq("start", "length", "control")
      .map(name => writes.writes(s"sm${i}_$name"))
      .reduce(_ || _)
    unit
  }
  private def lingers(i: UInt): Bool = if (p.hasDeactivationDelay) delayActive(i) else false.B
  for ((shown, unit) <- delayActive.zip(lingering)) shown := unit.active
  private val works = VecInit((0 until n).map { i =>
    if (!p.hasDeactivationDelay) enable(i) && !isOff(i)
    else (enable(i) || delayActive(i)) && !isOff(i) && !lingering(i).restarts
  })
  private val locked = VecInit((0 until n).map(i => enable(i) && isOff(i)))
  deactivated := VecInit(isOff)

  for ((port, i) <- Seq(ecat, pdi).zipWithIndex; bank <- 0 until p.smBanks) {
    val (table, entry) = (tables(bank), port.entries(bank))
    val word           = table.readData(i)
    val last           = RegNext(port.index)
    val number         = if (p.smBanks == 1) last else Cat(bank.U(1.W), last)
    val exists         = number < n.U
    val chosen         = number(p.smIndexBits - 1, 0)
    val isBlocked      = locked(chosen) || (if (port == ecat) lingers(chosen) else false.B)
    val threefold      = isBlocked && !isMailbox(chosen)
    table.readIndex(i) := port.index
    port.ramOpen       := ramOpen
    entry.index        := number
    entry.start        := word(15, 0)
    entry.takesPart    := exists && (enable(chosen) || lingers(chosen))
    entry.takesReads   := exists && enable(chosen)
    entry.extent       := word(31, 16) +& Mux(threefold, word(31, 16) << 1, 0.U(17.W))
    entry.begins       := false.B
  }

  // Of the SyncManager that is asked. The buffers follow each other.
  tables.foreach(_.readIndex(2) := states.asked)
  private val lengths = VecInit(tables.map(_.readData(2)(31, 16)))
  private val length  = if (p.smBanks == 1) lengths(0) else lengths(RegNext(states.asked(3)))
  private val offset  = RegNext(Mux(states.buffer(1), length << 1, Mux(states.buffer(0), length, 0.U)))

  private val controlAt = SyncManagerRegisters.Control
  states.works        := works
  states.locked       := locked
  states.isMailbox    := isMailbox
  states.controls     := write.valid && isInTable && address(2, 0) === controlAt.U && write.bits.mask(0)
  states.controlIndex := address(6, 3)
  states.control := SyncManagerControl(
    Lanes.byte(write.bits.data, controlAt % p.lanes),
    p.hasSequentialMode
  )
  states.statusIndex := statusIndex
  states.statusByPdi := statusByPdi
  states.lingers     := delayActive
  states.restarts    := lingering.map(_.restarts).foldLeft(false.B)(_ || _)
  status             := states.status
  for ((event, i) <- ecatEvent.zipWithIndex)
    event := (if (p.hasDeactivationDelay) states.ecatEvent(i) && !delayActive(i) else states.ecatEvent(i))
  alEvent := states.alEvent
  trigger := (if (p.hasWatchdogs) states.trigger else false.B)
  settled := states.settled

  states.good := good
  states.bad  := bad
  for ((port, side) <- Seq(ecat -> states.ecat, pdi -> states.pdi)) {
    side.turn     := port.turn
    side.request  := port.request
    side.number   := port.number
    side.access   := port.access
    port.granted  := side.granted
    port.changing := states.walking
    port.answer   := side.answer
    port.offset   := offset
  }
}
