package flyframe.frame

import chisel3._
import chisel3.util._
import flyframe.fmmu.{Fmmus, Mapped}
import flyframe.memory.RegisterWrite
import flyframe.params.EscParams
import flyframe.registers.RegisterMap
import flyframe.syncmanager.{AreaHit, AreaPort, AreaScan}

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
  * The core cycle within a byte time is `cycle`; 0 is the first one after the last nibble of a byte.
  */
class TranslatedAccess(p: EscParams) extends DataAccessUnit(p.lanes) {
  require(p.cyclesPerNibble >= 4, "eight core cycles per byte")
  val registerWrite = IO(Input(Valid(new RegisterWrite(p.lanes))))
  val areas         = Option.when(p.syncManagers > 0)(IO(Flipped(new AreaPort(p))))

  private val inData                     = position.part === Part.data
  private val inHeader                   = position.part === Part.header
  private val active                     = step && in.valid && in.payload
  private val byteEnd                    = active && inData && position.high
  private def headerEnd(byte: Int): Bool = active && inHeader && position.high && position.byte === byte.U

  // Byte times.
  private val first = headerEnd(6)
  private val tick  = byteEnd || (active && inHeader && position.high && position.byte >= 6.U)
  private val cycle = RegInit(15.U(4.W)) // reset: long after any byte
  when(tick) { cycle := 0.U }.elsewhen(!cycle.andR) { cycle := cycle + 1.U }
  private def at(n: Int): Bool = cycle === n.U

  private val starting = Reg(Bool())
  when(first) { starting := true.B }.elsewhen(at(2)) { starting := false.B }

  // map: entries 0 to 7 in cycles 0 to 7, the result is there in cycle 2 of the next byte time.
  private class Local extends Bundle {
    val exists  = Bool()
    val address = UInt(16.W)
  }
  private val direct = Reg(
    UInt(17.W)
  ) // local address without FMMU; one bit more than 16, so that it cannot wrap (B-18)
  when(at(2)) { direct := Mux(starting, request.address, direct + 1.U) }

  private def local(mapped: Mapped): Local = {
    val l = Wire(new Local)
    l.exists  := Mux(request.logical, mapped.hit && !mapped.address(16), !direct(16))
    l.address := Mux(request.logical, mapped.address(15, 0), direct(15, 0))
    l
  }
  private val (readMapped, writeMapped) = if (p.fmmus > 0) {
    val fmmus   = Module(new Fmmus(p))
    val logical = Reg(UInt(32.W))
    val wrapped = Reg(Bool()) // past 0xFFFFFFFF
    when(at(0)) {
      logical := Mux(starting, request.logicalAddress, logical + 1.U)
      wrapped := !starting && (wrapped || logical.andR)
    }
    fmmus.write   := registerWrite
    fmmus.index   := Mux(cycle > 7.U, 7.U, cycle(2, 0))
    fmmus.logical := logical
    val past = RegEnable(wrapped, at(0))
    def existing(m: Mapped) = {
      val limited = WireDefault(m)
      limited.hit := m.hit && !past
      limited
    }
    (existing(fmmus.read), existing(fmmus.writes))
  } else {
    val none = 0.U.asTypeOf(new Mapped)
    (none, none)
  }

  // area: entries 0 to 7 in cycles 2 to 9, the result is there in cycle 4 of the next byte time.
  private val areaRead  = RegEnable(local(readMapped), at(2))
  private val areaWrite = RegEnable(local(writeMapped), at(2))
  private def noArea    = 0.U.asTypeOf(new AreaHit(p.smIndexBits))
  private val (readArea, writeArea) = areas match {
    case Some(port) =>
      val index = RegInit(7.U(3.W)) // reset: no search
      when(at(1)) { index := 0.U }.elsewhen(!index.andR) { index := index + 1.U }
      port.index := index
      val begins = RegNext(index === 0.U, false.B)
      def search(address: UInt): AreaHit = AreaScan.lowest(port.entries.map { entry =>
        val scan = Module(new AreaScan(p.smIndexBits))
        scan.entry        := entry
        scan.entry.begins := begins
        scan.address      := address
        scan.result
      })
      (search(areaRead.address), search(areaWrite.address))
    case None => (noArea, noArea)
  }

  // fetch.
  private class Target extends Bundle {
    val local        = new Local
    val area         = new AreaHit(p.smIndexBits)
    def single: Bool = area.first && area.last
  }
  private def target(l: Local, a: AreaHit): Target = {
    val t = Wire(new Target)
    t.local := l
    t.area  := a
    t
  }
  // The address in the area's first buffer has moved on since the search: keep that of the byte.
  private val searchedRead  = RegEnable(areaRead, at(2))
  private val searchedWrite = RegEnable(areaWrite, at(2))

  private val wanted = Reg(Bool()) // this byte exists in the datagram, and is one to process
  when(tick) {
    wanted := enable && !in.last && Mux(
      inHeader,
      (position.byte === 8.U && position.dataLeft =/= 0.U) || (position.byte === 9.U && position.dataLeft > 1.U),
      position.dataLeft > 2.U
    )
  }

  /** The side that ECAT is on may touch the byte; in the direction of the SyncManager. */
  private def permission(t: Target, writing: Boolean): (Bool, Bool) = areas match {
    case None => (t.local.exists, false.B)
    case Some(port) =>
      val view  = port.views(t.area.index)
      val right = view.ecatWrites === writing.B
      val hit   = t.area.hit && port.acts(t.local.address)
      val may = view.works && port.exists(t.local.address) &&
        (t.single || (right && (view.ecatOpen || (t.area.first && view.ecatMayOpen))))
      (t.local.exists && (!hit || may), t.local.exists && hit && may && right)
  }
  private def buffer(t: Target, writing: Boolean): UInt = areas match {
    case None => t.local.address.pad(17)
    case Some(port) =>
      val view   = port.views(t.area.index)
      val number = if (writing) view.writerBuffer else view.readerBuffer
      val offset = Mux(number(1), t.area.length << 1, Mux(number(0), t.area.length, 0.U))
      val sum    = t.local.address +& Mux(t.area.hit && port.acts(t.local.address) && !t.single, offset, 0.U)
      Cat(sum(sum.getWidth - 1, 16).orR, sum(15, 0))
  }

  private val reading                = target(searchedRead, readArea)
  private val (mayRead, readsBuffer) = permission(reading, writing = false)
  private val opens                  = at(4) && wanted && request.read && readsBuffer
  private val fetched                = RegEnable(reading, at(4))
  private val writeTarget            = RegEnable(target(searchedWrite, writeArea), at(4))
  private val fetchedMay             = RegEnable(mayRead && wanted && request.read, at(4))
  private val fetchedCloses          = RegEnable(readsBuffer && reading.area.last, at(4))
  private val readAddress            = RegEnable(buffer(fetched, writing = false), at(5))

  // move: reading.
  private val readMay     = RegEnable(fetchedMay, tick)
  private val readCloses  = RegEnable(fetchedCloses, tick)
  private val readIndex   = RegEnable(fetched.area.index, tick)
  private val readSingle  = RegEnable(fetched.single, tick)
  private val readLane    = lane(readAddress)
  private val lookUpRead  = at(0) && inData
  private val readArrives = RegNext(lookUpRead, false.B)
  private val readByte    = RegEnable(laneOf(memory.readData, readLane, 8), readArrives)
  private val readable    = RegEnable(laneOf(memory.readable, readLane, 1).asBool, readArrives)
  readNow    := inData && readMay && readable
  readNibble := Mux(position.high, readByte(7, 4), readByte(3, 0))

  // move: writing. Asked when all before this byte has been done.
  private val (mayWrite, writesBuffer) = permission(writeTarget, writing = true)
  private val writeAddress             = RegEnable(buffer(writeTarget, writing = true), at(2))
  private val writeMay                 = RegEnable(mayWrite, at(2))
  private val writesArea               = RegEnable(writesBuffer, at(2))
  private val writeArea2               = RegEnable(writeTarget.area, at(2))
  private val writeSingle              = RegEnable(writeTarget.single, at(2))
  private val lookUpWrite              = at(3) && inData
  private val writeArrives             = RegNext(lookUpWrite, false.B)
  private val writable   = RegEnable(laneOf(memory.writable, lane(writeAddress), 1).asBool, writeArrives)
  private val toRegister = writeAddress < RegisterMap.UserRamStart.U
  private val low        = RegEnable(in.data, step)
  private val passed     = RegEnable(Cat(in.data, low), byteEnd)
  private val written    = RegNext(byteEnd && enable && request.write, false.B)
  private val accept     = written && writeMay && writable && !(toRegister && memory.logFull)

  memory.read         := lookUpRead || lookUpWrite
  memory.readAddress  := Mux(lookUpRead, readAddress, writeAddress)
  memory.logByte      := accept && toRegister
  memory.write        := accept
  memory.writeAddress := writeAddress(15, 0)
  memory.writeMask    := UIntToOH(lane(writeAddress), p.lanes)
  memory.writeData    := Fill(p.lanes, passed)

  areas.foreach { port =>
    // In cycle 0 the byte written, in cycle 1 the end of the buffer read, in cycle 4 the beginning of one to be read.
    // Whether the buffer in use has memory there does not matter (B-52).
    val readClosed   = RegNext(RegNext(byteEnd && readMay && readCloses, false.B), false.B)
    val closedIndex  = RegEnable(readIndex, tick)
    val closedSingle = RegEnable(readSingle, tick)
    val writes       = written && writeMay && writesArea
    port.access.touch  := writes || opens
    port.access.first  := Mux(writes, writeArea2.first, reading.area.first)
    port.access.single := Mux(writes, writeSingle, Mux(opens, reading.single, closedSingle))
    port.access.close  := (writes && writeArea2.last) || readClosed
    port.accessIndex   := Mux(writes, writeArea2.index, Mux(opens, reading.area.index, closedIndex))
  }

  private val anyRead  = Reg(Bool())
  private val anyWrite = Reg(Bool())
  when(first) {
    anyRead  := false.B
    anyWrite := false.B
  }.otherwise {
    when(byteEnd && readNow) { anyRead := true.B }
    when(accept) { anyWrite := true.B }
  }
  readSuccess  := anyRead
  readDlStatus := byteEnd && readNow && RegEnable(readAddress(16, 1) === (0x0110 >> 1).U, at(0))
  readAlStatus := byteEnd && readNow && RegEnable(readAddress(16, 1) === (0x0130 >> 1).U, at(0))
  writeSuccess := anyWrite

  memory.frameStart := step && in.valid && !in.payload
  memory.commit     := false.B // the frame processor knows; see there
}
