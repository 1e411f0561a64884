package flyframe.syncmanager

import chisel3._
import chisel3.util._
import flyframe.memory.{RegisterWrite, WideTable}
import flyframe.params.EscParams
import flyframe.registers.RegisterMap

/** What an accessing side sees of the SyncManagers: the table of areas, an entry per cycle, and the states.
  */
class AreaPort(p: EscParams) extends Bundle {
  val index = Input(UInt(3.W))

  /** The entries with this number in each bank of eight, asked for in the cycle before; `begins` is the
    * caller's.
    */
  val entries = Output(Vec(p.smBanks, new AreaEntry(p.smIndexBits)))
  val views   = Output(Vec(p.syncManagers, new SyncManagerView))

  /** Process data RAM is open. */
  val ramOpen = Output(Bool())

  /** An allowed access of this side, in the SyncManager's direction. */
  val access      = Input(new BufferAccess)
  val accessIndex = Input(UInt(p.smIndexBits.W))

  /** SyncManagers act on `address`; there is memory (B-52). */
  def acts(address: UInt): Bool = address >= RegisterMap.UserRamStart.U
  def exists(address: UInt): Bool =
    address < RegisterMap.ProcessRamStart.U || (ramOpen && address < (RegisterMap.ProcessRamStart + p.ramBytes).U)
}

/** All SyncManagers with their configuration (0x0800 on) and events. */
class SyncManagers(p: EscParams) extends Module {
  private val n = p.syncManagers

  val write = IO(Input(Valid(new RegisterWrite(p.lanes))))
  val ecat  = IO(new AreaPort(p))
  val pdi   = IO(new AreaPort(p))

  /** Process data RAM is open. */
  val ramOpen = IO(Input(Bool()))

  /** End of a frame; no frame is in the processing unit, and no access of the host under way (B-59). */
  val good  = IO(Input(Bool()))
  val bad   = IO(Input(Bool()))
  val quiet = IO(Input(Bool()))

  /** 0x0806[0] of each. */
  val enable = IO(Input(Vec(n, Bool())))

  /** 0x0805 of each, without the reserved bits; 0x0807[0]. */
  val writeEvent  = IO(Output(Vec(n, Bool())))
  val readEvent   = IO(Output(Vec(n, Bool())))
  val full        = IO(Output(Vec(n, Bool())))
  val lastBuffer  = IO(Output(Vec(n, UInt(2.W))))
  val deactivated = IO(Output(Vec(n, Bool())))

  /** Events for the master (0x0210) and the host (0x0220). */
  val ecatEvent = IO(Output(Vec(n, Bool())))
  val alEvent   = IO(Output(Vec(n, Bool())))

  /** A buffer with watchdog trigger has been written (WD-04). */
  val trigger = IO(Output(Bool()))

  // The table of start and length.
  private val address  = write.bits.byteAddress
  private val hitsArea = write.valid && address(11, 7) === (0x800 >> 7).U && !address(2)
  private val views    = Wire(Vec(n, new SyncManagerView))
  private val tables = Seq.tabulate(p.smBanks) { bank =>
    val table = Module(new WideTable(n min 8, 4, copies = 2)).suggestName(s"table_$bank")
    table.write      := hitsArea && address(6) === bank.U && address(5, 3) < (n min 8).U
    table.writeIndex := address(5, 3)
    table.writeMask  := write.bits.maskIn(4)
    table.writeData  := write.bits.dataIn(4)
    table
  }

  for ((port, i) <- Seq(ecat, pdi).zipWithIndex; bank <- 0 until p.smBanks) {
    val (table, entry) = (tables(bank), port.entries(bank))
    val word           = table.readData(i)
    val last           = RegNext(port.index)
    val number         = if (p.smBanks == 1) last else Cat(bank.U(1.W), last)
    val exists         = number < n.U
    val view           = views(number(p.smIndexBits - 1, 0))
    table.readIndex(i) := port.index
    port.views         := views
    port.ramOpen       := ramOpen
    entry.index        := number
    entry.start        := word(15, 0)
    entry.length       := word(31, 16)
    entry.takesPart    := exists && (view.works || view.locked)
    entry.extent       := entry.length +& Mux(view.locked && view.buffered, entry.length << 1, 0.U(17.W))
    entry.begins       := false.B
  }

  private val triggers = Wire(Vec(n, Bool()))
  for (i <- 0 until n) {
    def byte(offset: Int): Valid[UInt] = write.bits.byteAt(write.valid, 0x800 + 8 * i + offset)
    // Control bits that act all the time; reset as the register.
    def control(bit: Int, name: String): Bool =
      RegEnable(byte(4).bits(bit), false.B, byte(4).valid).suggestName(s"${name}_$i")
    val isMailbox    = control(1, "mailbox")
    val ecatWrites   = control(2, "ecatWrites")
    val ecatEnable   = control(4, "ecatEventEnable")
    val alEnable     = control(5, "alEventEnable")
    val watchEnabled = control(6, "watchdogTrigger")
    val wanted =
      RegEnable(byte(7).bits(0), false.B, byte(7).valid).suggestName(s"deactivate_$i") // 0x0807[0] as written
    val now = RegEnable(wanted, false.B, quiet).suggestName(s"deactivated_$i")
    deactivated(i) := now

    val sm = Module(new SyncManager).suggestName(s"sm$i")
    sm.enabled     := enable(i)
    sm.deactivated := now
    sm.isMailbox   := isMailbox
    sm.ecatWrites  := ecatWrites
    sm.good        := good
    sm.bad         := bad
    for ((side, port) <- Seq(sm.ecat -> ecat, sm.pdi -> pdi)) {
      side       := port.access
      side.touch := port.access.touch && port.accessIndex === i.U
      side.close := port.access.close && port.accessIndex === i.U
    }
    views(i)      := sm.view
    writeEvent(i) := sm.writeEvent
    readEvent(i)  := sm.readEvent
    full(i)       := sm.full
    lastBuffer(i) := sm.lastBuffer
    ecatEvent(i)  := ecatEnable && Mux(ecatWrites, sm.readEvent, sm.writeEvent)
    alEvent(i)    := alEnable && Mux(ecatWrites, sm.writeEvent, sm.readEvent)
    triggers(i)   := watchEnabled && sm.written
  }
  trigger := triggers.asUInt.orR
}
