package flyframe.frame

import chisel3._
import chisel3.util._
import flyframe.fmmu.{Fmmus, Mapped}
import flyframe.lanes.Lanes
import flyframe.memory.{EscMemory, TableWrite}
import flyframe.params.EscParams
import flyframe.protocol.DatagramLayout.{Ado, Irq, Length}
import flyframe.registers.{Register, RegisterMap}
import flyframe.syncmanager.AreaPort

/** Moves the data of a datagram between wire and memory like [[DataAccess]], through FMMUs and SyncManagers.
  *
  * A byte is on its way for four byte times of eight core cycles and more. The bytes of the datagram follow
  * each other, so all four work at once, each on its own byte:
  *
  *   - *map*, three bytes ahead: the FMMUs are searched for the logical address ([[Fmmus]]); what is found is
  *     kept there until the byte has passed;
  *   - *area*, two bytes ahead: the SyncManagers are searched for the local addresses found ([[AreaSearch]]);
  *   - *fetch*, one byte ahead: the SyncManager is asked, the buffer chosen ([[Fetch]]);
  *   - *move*: the byte is read when its time begins, passes, and is written when it has passed
  *     ([[ByteMover]]).
  *
  * All begin a byte before the first one, which may need a local byte that early ([[Mapped.early]]). What
  * happens in which core cycle stands in [[Schedule]].
  *
  * @param registers
  *   all of the controller
  * @param acknowledged
  *   those whose reading by the bus is told of
  */
class TranslatedAccess(p: EscParams, registers: Seq[Register], acknowledged: Seq[Register])
    extends DataAccessUnit(p.lanes, logical = p.fmmus > 0, acknowledged, p.hasWriteProtection) {
  require( // eight core cycles per byte
    p.cyclesPerNibble >= 4,
    s"coreClockMhz is ${p.coreClockMhz} but must be 100, 125 with FMMUs or SyncManagers."
  )
  val tableWrite = IO(Input(new TableWrite))
  val areas      = Option.when(p.syncManagers > 0)(IO(Flipped(new AreaPort(p))))

  /** See [[FrameProcessorConfig]]. */
  val readWriteOffset = IO(Input(UInt((if (p.hasReadWriteOffset) 16 else 0).W)))

  private val inData   = position.part === Part.data
  private val inHeader = position.part === Part.header
  private val active   = step && in.valid && in.payload
  private val byteEnd  = active && inData && position.high
  private val newFrame = step && in.valid && !in.payload

  // Byte times, the first one after the last byte of the address in the header.
  private val times = Module(new ByteTimes)
  times.ends := byteEnd || (active && inHeader && position.high && position.byte >= Ado.last.U)
  private val schedule = times.schedule
  private val number   = schedule.number

  // map. The byte before the datagram's first is mapped in the first byte of the length.
  private val isBefore = inHeader && position.byte <= Length.offset.U
  private val past     = Reg(Bool()) // past 0xFFFFFFFF
  // Counted before the search, which wants the address behind the byte, or after the byte's own is kept.
  advance := Mux(request.logical, schedule.countLogical, schedule.countLocal) && !isBefore
  when(schedule.countLogical) { past := !isBefore && (past || request.address.pad(33)(32)) }
  private val fmmus = Module(new Fmmus(p))
  fmmus.table         := tableWrite
  fmmus.search.index  := schedule.entry
  fmmus.search.behind := request.address
  fmmus.search.direct := !request.logical
  fmmus.search.slot   := number
  fmmus.search.before := isBefore
  fmmus.search.past   := RegNext(past)
  fmmus.search.offset := Mux(request.readWrite, readWriteOffset, 0.U)
  fmmus.readSlot      := Mux(schedule.askMapped, number - 1.U, number - 2.U)
  fmmus.writeSlot     := Mux(schedule.askMapped, number - 1.U, number - 3.U)

  // area.
  private def search(mapped: Mapped, reads: Boolean): AreaSearch = {
    val area = Module(new AreaSearch(p, registers, reads))
    area.schedule := schedule
    area.mapped   := mapped
    area.ramOpen  := areas.fold(true.B)(_.ramOpen)
    for (port <- areas; entries <- area.entries; (to, from) <- entries.zip(port.entries)) {
      to        := from
      to.begins := RegNext(port.index === 0.U, false.B)
    }
    area
  }
  for (port <- areas) {
    val index = RegInit(7.U(3.W)).suggestName("areaIndex") // reset: no search
    when(schedule.askMapped) { index := 0.U }.elsewhen(!index.andR) { index := index + 1.U }
    port.index := index
  }
  private val areaRead  = search(fmmus.read, reads = true).suggestName("areaRead")
  private val areaWrite = search(fmmus.write, reads = false).suggestName("areaWrite")

  // fetch. The byte is in the datagram; so is the one behind it, which an early byte is for.
  private val inDatagram     = Reg(Bool())
  private val nextInDatagram = Reg(Bool())
  when(schedule.ends) {
    // Data bytes that come before; -1 in the last byte of the length.
    val ahead                   = Mux(inHeader, position.byte - Irq.offset.U, 2.U)(1, 0)
    def more(count: UInt): Bool = position.dataLeft(10, 2).orR || position.dataLeft(1, 0) > count
    val goesOn                  = enable && (!inHeader || position.byte >= Length.last.U)
    inDatagram     := goesOn && !ahead.andR && more(ahead)
    nextInDatagram := goesOn && Mux(ahead === 2.U, position.dataLeft > 3.U, more(ahead + 1.U))
  }
  private val fetch = Module(new Fetch(p, registers))
  fetch.schedule     := schedule
  fetch.newFrame     := newFrame
  fetch.readTarget   := areaRead.target
  fetch.writeTarget  := areaWrite.target
  fetch.reads        := request.read && Mux(fmmus.read.early, nextInDatagram, inDatagram)
  fetch.writes       := request.write
  fetch.readAddress  := fmmus.read.address
  fetch.writeAddress := fmmus.write.address
  fetch.answer       := areas.fold(0.U.asTypeOf(fetch.answer))(_.answer)
  fetch.offset       := areas.fold(0.U)(_.offset)

  // move: reading.
  private def arrives(lookUp: Bool): Bool =
    ShiftRegister(lookUp, EscMemory.readCycles(p), false.B, true.B)
  private val lookUpRead  = schedule.lookUpRead && fetch.read.may
  private val readArrives = arrives(lookUpRead)
  private val reading     = RegEnable(fetch.read, schedule.lookUpRead)
  when(newFrame) { reading.may := false.B }
  private val readLane = Lanes.of(fetch.read.address, p.lanes)
  private val readByte = RegEnable(Lanes.bytes(memory.readData, p.lanes)(readLane), readArrives)
  private val readable = RegEnable(Lanes.bits(memory.readable, p.lanes)(readLane).asBool, readArrives)
  private val isRead   = reading.may && readable

  // move: writing.
  private val lookUpWrite = schedule.lookUpWrite && fetch.write.may
  private val writable = RegEnable(
    Lanes.bits(memory.writable, p.lanes)(Lanes.of(fetch.write.address, p.lanes)).asBool,
    arrives(lookUpWrite)
  )
  private val low    = RegEnable(in.data, step)
  private val isLast = RegEnable(position.dataLeft === Mux(inHeader, 0.U, 1.U), schedule.ends)
  private val passes = inData || (inHeader && position.byte === Irq.last.U)
  private val first  = RegNext(schedule.ends && enable && request.write && passes, false.B)
  private val second = RegNext(first, false.B)

  private val mover = Module(
    if (p.hasBitwiseFmmus) new BitMover(p.hasWriteProtection) else new WholeByteMover(p.hasWriteProtection)
  )
  mover.schedule   := schedule
  mover.readByte   := readByte
  mover.isRead     := isRead
  mover.readFrom   := RegEnable(fmmus.read, schedule.lookUpRead)
  mover.high       := position.high
  readNibble       := mover.readNibble
  readMask         := Fill(4, inData) & mover.readMask
  mover.passed     := RegEnable(Cat(in.data, low), byteEnd)
  mover.first      := first
  mover.second     := second
  mover.isLast     := isLast
  mover.address    := fetch.write.address
  mover.may        := fetch.write.may && writable
  mover.isRegister := fetch.write.isRegister
  mover.writeTo    := RegEnable(fmmus.write, schedule.keepWrite)

  private val written    = mover.written.bits
  private val toRegister = written.address < RegisterMap.UserRamStart.U
  private val accept =
    permitted(mover.written.valid && written.may && !(toRegister && memory.logFull))
  for (byte <- protection) {
    byte.address    := written.address
    byte.isRegister := written.isRegister
    byte.accepted   := accept
  }
  memory.read         := lookUpRead || lookUpWrite
  memory.readAddress  := Mux(lookUpRead, fetch.read.address, fetch.write.address)
  memory.logByte      := accept && toRegister
  memory.write        := accept
  memory.writeAddress := written.address(15, 0)
  memory.writeMask    := UIntToOH(Lanes.of(written.address, p.lanes), p.lanes)
  memory.writeData    := Fill(p.lanes, written.data)
  memory.writeBits    := written.mask
  memory.frameStart   := newFrame
  memory.commit       := false.B // the frame processor knows; see there

  // The SyncManagers are told of what has been read and written, each in its cycle. The byte addressed
  // decides on the access, not the one in the buffer (B-52).
  for (port <- areas) {
    val closes = schedule.close && reading.may && reading.inBuffer && reading.last
    val touches = permitted(
      second && fetch.write.may && fetch.write.inBuffer && !(mover.writeTo.early && isLast)
    )
    val told  = Mux(schedule.close, reading, fetch.write)
    val tells = schedule.close || schedule.touch
    port.turn    := schedule.turn
    port.request := closes || touches || fetch.ask.valid
    port.number  := Mux(tells, told.index, fetch.ask.number)
    port.access  := fetch.ask.access
    when(tells) {
      port.access.first  := told.first
      port.access.single := told.single
      port.access.write  := schedule.touch
      port.access.touch  := touches
      port.access.close  := closes || (touches && told.last)
    }
    port.access.address := fetch.write.local // of what is written
  }

  private val anyRead  = Reg(Bool())
  private val anyWrite = Reg(Bool())
  when(schedule.ends && inHeader && position.byte === Ado.last.U) {
    anyRead  := false.B
    anyWrite := false.B
  }.otherwise {
    when(active && readMask.orR) { anyRead := true.B }
    when(accept) { anyWrite := true.B }
  }
  readSuccess  := anyRead
  writeSuccess := anyWrite
  tellReads(schedule.ends && isRead, isAt => RegEnable(isAt(fetch.read.address), schedule.lookUpRead))
}
