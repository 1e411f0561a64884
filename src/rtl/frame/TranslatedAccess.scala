package flyframe.frame

import chisel3._
import chisel3.util._
import flyframe.fmmu.{Fmmus, Mapped}
import flyframe.lanes.Lanes
import flyframe.memory.{EscMemory, RegisterWrite}
import flyframe.params.EscParams
import flyframe.protocol.DatagramLayout.{Ado, Irq, Length}
import flyframe.registers.{Register, RegisterMap}
import flyframe.syncmanager.{AreaHit, AreaPort, AreaScan, ManagedSpace}

/** Moves the data of a datagram between wire and memory like [[DataAccess]], through FMMUs and SyncManagers.
  *
  * A byte is on its way for four byte times of eight core cycles and more. The bytes of the datagram follow
  * each other, so all four work at once, each on its own byte:
  *
  *   - *map*, three bytes ahead: the FMMUs are searched for the logical address;
  *   - *area*, two bytes ahead: the SyncManagers are searched for the local addresses found;
  *   - *fetch*, one byte ahead: the SyncManager is asked, the buffer chosen;
  *   - *move*: the byte is read when its time begins, passes, and is written when it has passed.
  *
  * All begin a byte before the first one, which may need a local byte that early ([[Mapped.early]]).
  *
  * The core cycle within a byte time is `cycle`; 0 is the first one after the last nibble of a byte. The
  * state of SyncManagers is asked for and changed in the cycles 0, 1, 2 and 4, with the answer two cycles
  * later.
  *
  * @param registers
  *   all of the controller
  * @param acknowledged
  *   those whose reading by the bus is told of
  */
class TranslatedAccess(p: EscParams, registers: Seq[Register], acknowledged: Seq[Register])
    extends DataAccessUnit(p.lanes, acknowledged) {
  require( // eight core cycles per byte
    p.cyclesPerNibble >= 4,
    s"coreClockMhz is ${p.coreClockMhz} but must be 100, 125 with FMMUs or SyncManagers."
  )
  val registerWrite = IO(Input(Valid(new RegisterWrite(p.lanes, p.hasBitWrites))))
  val areas         = Option.when(p.syncManagers > 0)(IO(Flipped(new AreaPort(p))))

  private val managed  = new ManagedSpace(p, registers)
  private val bitwise  = p.hasBitwiseFmmus
  private val inData   = position.part === Part.data
  private val inHeader = position.part === Part.header
  private val active   = step && in.valid && in.payload
  private val byteEnd  = active && inData && position.high

  // Byte times, the first one after the last byte of the address in the header.
  private val tick  = byteEnd || (active && inHeader && position.high && position.byte >= Ado.last.U)
  private val first = active && inHeader && position.high && position.byte === Ado.last.U
  private val cycle = RegInit(15.U(4.W)) // reset: long after any byte
  when(tick) { cycle := 0.U }.elsewhen(!cycle.andR) { cycle := cycle + 1.U }
  private def inCycle(n: Int): Bool = cycle === n.U

  // How far a byte of the datagram is away, counted in the header: byte 0 is mapped after the first byte of
  // the length.
  private val isEarly  = inHeader && position.byte <= Length.offset.U
  private val begins   = inHeader && position.byte <= Length.last.U
  private val newFrame = step && in.valid && !in.payload

  // map: entries 0 to 7 in cycles 0 to 7, the result is there in cycle 2 of the next byte time.
  private class Local extends Bundle {
    val exists  = Bool()
    val address = UInt(16.W)
  }

  /** Where the bits of a logical byte are, in `address` and the byte before; see [[Mapped]]. */
  private class Bits extends Bundle {
    val mask  = UInt(8.W) // mapped bits of the logical byte
    val turn  = UInt(3.W)
    val last  = Bool()    // no byte of the FMMU follows
    val early = Bool()

    /** Places from the local byte before to the logical bit 0. */
    def shift: UInt = !turn.orR ## turn
  }
  private object Bits {

    /** A whole byte. */
    def whole: Bits = {
      val b = WireDefault(0.U.asTypeOf(new Bits))
      b.mask := 0xff.U
      b.last := true.B
      b
    }
    def of(m: Mapped): Bits = {
      val b = Wire(new Bits)
      b.mask := Mux(m.early || !m.hit, 0.U, Mux(m.first, (0xff.U << m.startBit)(7, 0), 0xff.U)) &
        Mux(m.last, 0xff.U(8.W) >> (~m.stopBit), 0xff.U)
      b.turn  := m.turn
      b.last  := m.last
      b.early := m.early
      b
    }
  }

  private val direct =
    Reg(UInt(17.W)) // local address without FMMU; one bit more than 16, so that it cannot wrap (B-18)
  when(inCycle(2)) { direct := Mux(begins, request.address, direct + 1.U) }

  private def local(mapped: Mapped): Local = {
    val l = Wire(new Local)
    // The upper byte has mapped bits, if it is not the end of a run that ends in the one before.
    val needed = Mux(
      begins,
      mapped.turn.orR && (mapped.early || !mapped.last),
      mapped.early || !mapped.last || !mapped.turn.orR || (mapped.stopBit +& mapped.turn)(3)
    )
    l.exists  := Mux(request.logical, mapped.hit && !mapped.address(16) && needed, !direct(16) && !begins)
    l.address := Mux(request.logical, mapped.address(15, 0), direct(15, 0))
    l
  }
  private val (readMapped, writeMapped) = if (p.fmmus > 0) {
    val fmmus  = Module(new Fmmus(p))
    val behind = Reg(UInt(33.W))
    val past   = Reg(Bool()) // past 0xFFFFFFFF
    when(inCycle(0)) {
      behind := Mux(isEarly, request.logicalAddress, behind + 1.U)
      past   := !isEarly && (past || behind(32))
    }
    fmmus.write  := registerWrite
    fmmus.index  := Mux(cycle > 7.U, 7.U, cycle(2, 0))
    fmmus.behind := behind
    val mappedPast = RegEnable(past, inCycle(0))
    def existing(m: Mapped) = {
      val limited = WireDefault(m)
      limited.hit := m.hit && !mappedPast
      limited
    }
    (existing(fmmus.read), existing(fmmus.writes))
  } else {
    val none = 0.U.asTypeOf(new Mapped)
    (none, none)
  }

  // area: entries 0 to 7 in cycles 2 to 9, the result is there in cycle 4 of the next byte time.
  private val areaRead  = RegEnable(local(readMapped), inCycle(2))
  private val areaWrite = RegEnable(local(writeMapped), inCycle(2))
  private def noArea    = 0.U.asTypeOf(new AreaHit(p.smIndexBits))
  private val (readArea, writeArea) = areas match {
    case Some(port) =>
      val index = RegInit(7.U(3.W)) // reset: no search
      when(inCycle(1)) { index := 0.U }.elsewhen(!index.andR) { index := index + 1.U }
      port.index := index
      val scanBegins = RegNext(index === 0.U, false.B)
      def search(address: UInt): AreaHit = AreaScan.lowest(port.entries.map { entry =>
        val scan = Module(new AreaScan(p.smIndexBits))
        scan.entry        := entry
        scan.entry.begins := scanBegins
        scan.address      := address
        scan.result
      })
      (search(areaRead.address), search(areaWrite.address))
    case None => (noArea, noArea)
  }

  // fetch.
  private class Searched extends Bundle {
    val local     = new Local
    val inManaged = Bool() // where SyncManagers act
    val inMemory  = Bool() // there is memory for it
  }
  private def searched(l: Local): Searched = {
    val s = Wire(new Searched)
    s.local     := l
    s.inManaged := areas.fold(false.B)(_ => managed.acts(l.address))
    s.inMemory  := l.exists && areas.fold(true.B)(port => managed.exists(l.address, port.ramOpen))
    s
  }
  private class Target extends Bundle {
    val byte          = new Searched
    val area          = new AreaHit(p.smIndexBits)
    def single: Bool  = area.first && area.last
    def managed: Bool = area.hit && byte.inManaged // it belongs to a SyncManager
  }
  private def target(s: Searched, a: AreaHit): Target = {
    val t = Wire(new Target)
    t.byte := s
    t.area := a
    t
  }
  // The address in the area's first buffer has moved on since the search: keep that of the byte.
  private val searchedRead  = RegEnable(searched(areaRead), inCycle(2))
  private val searchedWrite = RegEnable(searched(areaWrite), inCycle(2))

  private def bits(mapped: Mapped): Bits = {
    val b = WireDefault(Bits.of(mapped))
    when(begins) { // not in the datagram itself
      b.mask  := 0.U
      b.early := true.B
    }
    when(!request.logical) { b := Bits.whole }
    b
  }
  private val areaReadBits      = RegEnable(bits(readMapped), inCycle(2))
  private val areaWriteBits     = RegEnable(bits(writeMapped), inCycle(2))
  private val searchedReadBits  = RegEnable(areaReadBits, inCycle(2))
  private val searchedWriteBits = RegEnable(areaWriteBits, inCycle(2))

  // The byte to be fetched is in the datagram; so is the one behind it, which an early byte is for.
  private val inDatagram     = Reg(Bool())
  private val nextInDatagram = Reg(Bool())
  when(tick) {
    // Data bytes that come before; -1 in the last byte of the length.
    val ahead                   = Mux(inHeader, position.byte - Irq.offset.U, 2.U)(1, 0)
    def more(count: UInt): Bool = position.dataLeft(10, 2).orR || position.dataLeft(1, 0) > count
    val goesOn                  = enable && (!inHeader || position.byte >= Length.last.U)
    inDatagram     := goesOn && !ahead.andR && more(ahead)
    nextInDatagram := goesOn && Mux(ahead === 2.U, position.dataLeft > 3.U, more(ahead + 1.U))
  }

  /** ECAT may access the byte; in the direction of its SyncManager. While the answer is there. */
  private def permission(t: Target): (Bool, Bool) = areas match {
    case None => (t.byte.local.exists, false.B)
    case Some(port) =>
      (
        t.byte.local.exists && (!t.managed || (t.byte.inMemory && port.answer.allowed)),
        t.managed && t.byte.inMemory && port.answer.inBuffer
      )
  }

  /** A buffer does not reach what is past the end, nor a register that SyncManagers do not act on. */
  private def nowhere(t: Target, address: UInt, pastEnd: Bool): Bool =
    if (managed.hasOthers) pastEnd || (t.managed && managed.isOther(address(15, 0))) else pastEnd
  private def buffer(t: Target): UInt = areas match {
    case None => t.byte.local.address.pad(17)
    case Some(port) =>
      val number = port.answer.buffer
      val offset = Mux(number(1), t.area.length << 1, Mux(number(0), t.area.length, 0.U))
      val sum    = t.byte.local.address +& Mux(t.managed && !t.single, offset, 0.U)
      Cat(nowhere(t, sum, sum(sum.getWidth - 1, 16).orR), sum(15, 0))
  }

  // Reading: asked in cycle 4, answered in 6.
  private val reading                = target(searchedRead, readArea)
  private val wanted                 = Mux(searchedReadBits.early, nextInDatagram, inDatagram)
  private val fetched                = RegEnable(reading, inCycle(4))
  private val fetchedBits            = RegEnable(searchedReadBits, inCycle(4))
  private val fetchedWanted          = RegEnable(wanted && request.read, inCycle(4))
  private val (mayRead, readsBuffer) = permission(fetched)
  private val fetchedMay             = RegEnable(mayRead && fetchedWanted, inCycle(6))
  private val fetchedCloses          = RegEnable(readsBuffer && fetched.area.last, inCycle(6))
  private val readAddress            = RegEnable(buffer(fetched), inCycle(6))
  private val writeTarget            = RegEnable(target(searchedWrite, writeArea), inCycle(4))
  private val writeTargetBits        = RegEnable(searchedWriteBits, inCycle(4))

  private def arrives(lookUp: Bool): Bool =
    ShiftRegister(lookUp, EscMemory.readCycles(p), false.B, true.B)

  // move: reading. The window holds this local byte and the one before.
  private val readMay     = RegEnable(fetchedMay, tick)
  private val readCloses  = RegEnable(fetchedCloses, tick)
  private val readIndex   = RegEnable(fetched.area.index, tick)
  private val readSingle  = RegEnable(fetched.single, tick)
  private val readBits    = RegEnable(fetchedBits, tick)
  private val lookUpRead  = inCycle(0) && readMay
  private val readArrives = arrives(lookUpRead)
  private val readByte =
    RegEnable(Lanes.bytes(memory.readData, p.lanes)(Lanes.of(readAddress, p.lanes)), readArrives)
  private val readable =
    RegEnable(Lanes.bits(memory.readable, p.lanes)(Lanes.of(readAddress, p.lanes)).asBool, readArrives)
  private val isRead = readMay && readable
  private val (readValue, readHere) = if (bitwise) {
    val byteBefore = RegEnable(readByte, tick)
    val okBefore   = RegEnable(isRead, tick)
    val value      = ((readByte ## byteBefore) >> readBits.shift)(7, 0)
    val ok         = ((Fill(8, isRead) ## Fill(8, okBefore)) >> readBits.shift)(7, 0) & readBits.mask
    (value, ok)
  } else (readByte, Fill(8, isRead))
  readMask   := Fill(4, inData) & Mux(position.high, readHere(7, 4), readHere(3, 0))
  readNibble := Mux(position.high, readValue(7, 4), readValue(3, 0))

  // move: writing. Asked in cycle 2, when all before this byte has been done, answered in 4.
  private val (mayWrite, writesBuffer) = permission(writeTarget)
  private val writeAddress             = RegEnable(buffer(writeTarget), inCycle(4))
  private val writeMay                 = RegEnable(mayWrite, inCycle(4))
  private val writesArea               = RegEnable(writesBuffer, inCycle(4))
  private val writeArea2               = RegEnable(writeTarget.area, inCycle(4))
  private val writeSingle              = RegEnable(writeTarget.single, inCycle(4))
  private val writeBits                = RegEnable(writeTargetBits, inCycle(4))
  private val lookUpWrite              = inCycle(5) && writeMay
  private val writeArrives             = arrives(lookUpWrite)
  private val writable =
    RegEnable(Lanes.bits(memory.writable, p.lanes)(Lanes.of(writeAddress, p.lanes)).asBool, writeArrives)

  when(newFrame) { // the last frame may have ended anywhere
    fetchedMay := false.B
    readMay    := false.B
    writeMay   := false.B
  }

  // The byte has passed: cycle 0 writes the local byte before, whose last bits have come, cycle 1 the upper
  // one, if no more bits of it are to come.
  private val low    = RegEnable(in.data, step)
  private val passed = RegEnable(Cat(in.data, low), byteEnd)
  private val isLast = RegEnable(Mux(inHeader, position.dataLeft === 0.U, position.dataLeft === 1.U), tick)
  private val has =
    RegNext(
      tick && enable && request.write && (inData || (inHeader && position.byte === Irq.last.U)),
      false.B
    )
  private val hasUpper = RegNext(has, false.B)

  private class Upper extends Bundle { // a local byte that gets bits
    val address = UInt(17.W)
    val may     = Bool()
    val data    = UInt(8.W)
    val mask    = UInt(8.W)
  }
  private val writeData = ((passed & writeBits.mask) << writeBits.shift)(15, 0)
  private val writeMask = (writeBits.mask << writeBits.shift)(15, 0)
  private val upper     = Wire(new Upper)
  upper.address := writeAddress
  upper.may     := writeMay && writable
  upper.data    := (if (bitwise) writeData(15, 8) else passed)
  upper.mask    := (if (bitwise) writeMask(15, 8) else 0xff.U)
  private val written =
    if (bitwise) {
      val upperBefore = RegEnable(upper, hasUpper)
      val lower       = WireDefault(upperBefore)
      lower.data := upperBefore.data | writeData(7, 0)
      lower.mask := upperBefore.mask | writeMask(7, 0)
      Mux(has, lower, upper)
    } else upper
  private val complete =
    if (bitwise)
      (has && writeMask(7, 0).orR) ||
      (hasUpper && writeMask(15, 8).orR && (!writeBits.turn.orR || writeBits.last || isLast))
    else hasUpper
  private val toRegister = written.address < RegisterMap.UserRamStart.U
  private val accept     = complete && written.may && !(toRegister && memory.logFull)

  memory.read         := lookUpRead || lookUpWrite
  memory.readAddress  := Mux(lookUpRead, readAddress, writeAddress)
  memory.logByte      := accept && toRegister
  memory.write        := accept
  memory.writeAddress := written.address(15, 0)
  memory.writeMask    := UIntToOH(Lanes.of(written.address, p.lanes), p.lanes)
  memory.writeData    := Fill(p.lanes, written.data)
  memory.writeBits    := written.mask

  // The byte addressed decides on the access, not the one in the buffer (B-52).
  areas.foreach { port =>
    val closes = RegEnable(readMay && readCloses, tick) && inCycle(0)
    val writes = hasUpper && writeMay && writesArea && !(writeBits.early && isLast)
    val single = RegEnable(readSingle, tick)
    val asks   = inCycle(2) && request.write && writeTarget.managed
    val opens  = inCycle(4) && wanted && request.read && reading.managed && reading.byte.inMemory
    port.turn    := inCycle(0) || inCycle(1) || inCycle(2) || inCycle(4)
    port.request := closes || writes || asks || opens
    port.number := Mux1H(
      Seq(
        inCycle(0) -> RegEnable(readIndex, tick),
        inCycle(1) -> writeArea2.index,
        inCycle(2) -> writeTarget.area.index,
        inCycle(4) -> reading.area.index
      )
    )
    port.access.first := Mux1H(
      Seq(
        inCycle(1) -> writeArea2.first,
        inCycle(2) -> writeTarget.area.first,
        inCycle(4) -> reading.area.first
      )
    )
    port.access.single := Mux1H(
      Seq(
        inCycle(0) -> single,
        inCycle(1) -> writeSingle,
        inCycle(2) -> writeTarget.single,
        inCycle(4) -> reading.single
      )
    )
    port.access.write := inCycle(1) || inCycle(2)
    port.access.touch := writes || opens
    port.access.close := closes || (writes && writeArea2.last)
  }

  private val anyRead  = Reg(Bool())
  private val anyWrite = Reg(Bool())
  when(first) {
    anyRead  := false.B
    anyWrite := false.B
  }.otherwise {
    when(byteEnd && readHere.orR) { anyRead := true.B }
    when(accept) { anyWrite := true.B }
  }
  readSuccess  := anyRead
  writeSuccess := anyWrite
  tellReads(tick && isRead, isAt => RegEnable(isAt(readAddress), inCycle(0)))

  memory.frameStart := newFrame
  memory.commit     := false.B // the frame processor knows; see there
}
