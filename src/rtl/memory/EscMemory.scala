package flyframe.memory

import chisel3._
import chisel3.util._
import flyframe.lanes.Lanes
import flyframe.params.EscParams
import flyframe.registers.{
  FmmuRegisters,
  KeptRead,
  Register,
  RegisterFile,
  RegisterMap,
  RegisterRam,
  SiiRegisters
}

/** The 64 KiB address space of the controller (GEN-04): registers, user RAM, process data RAM, and the
  * arbiter between the frame processor and the host.
  *
  * Registers and RAM have one read and one write port each. The frame processor always comes first; the host
  * gets the cycles it leaves, at the latest after four, since the frame processor takes at most every second
  * cycle.
  *
  * @param added
  *   registers beside those of the units
  */
class EscMemory(p: EscParams, added: Seq[Register] = Nil) extends Module with RegisterPort {
  private val lanes    = p.lanes
  private val laneBits = log2Ceil(lanes)

  val ecat = IO(Flipped(new EcatAccess(lanes)))
  val host = IO(new HostPort(lanes))

  /** Process data RAM is open (FP-31). */
  val ramOpen = IO(Input(Bool()))

  private val file = Module(new RegisterFile(p, added))
  val value        = IO(chiselTypeOf(file.value))
  val guard        = IO(chiselTypeOf(file.guard))
  val set          = IO(chiselTypeOf(file.set))
  val status       = IO(chiselTypeOf(file.status))
  val event        = IO(chiselTypeOf(file.event))
  value       := file.value
  file.guard  := guard
  file.set    := set
  file.status := status
  file.event  := event
  override val kept: Map[Int, KeptRead] = file.kept.map { case (page, port) =>
    val outside = IO(chiselTypeOf(port)).suggestName(f"kept_$page%x00")
    outside <> port
    page -> outside
  }

  /** A register write of a frame or the host takes effect in this cycle; for units that react to the writing
    * itself.
    */
  val registerWrite = IO(Output(Valid(new RegisterWrite(lanes, p.hasBitWrites))))

  /** That write comes from the host. */
  val registerWriteByHost = IO(Output(Bool()))

  /** A unit of the controller writes a register, whatever its access. */
  val unitWrite = IO(Flipped(Decoupled(new UnitWrite)))

  /** A unit reads the register RAM: byte address, and in a later cycle the byte. */
  val unitRead = IO(Flipped(Decoupled(UInt(12.W))))
  val unitData = IO(Output(Valid(UInt(8.W))))

  /** Register writes are on their way. */
  val registersBusy = IO(Output(Bool()))

  /** The register RAM is being cleared after reset. */
  val clearing = IO(Output(Bool()))

  /** The register writes of a frame are about to take effect. */
  val commitStarts = IO(Output(Bool()))

  /** Where an address leads: to a register, to a place in RAM, or (neither) to nothing. */
  private class Target extends Bundle {
    val register = Bool()
    val ram      = Bool()
    val place    = new RamPlace(p)
  }

  private def target(address: UInt, pastEnd: Bool): Target = {
    val t       = Wire(new Target)
    val user    = address(15, 7) === (RegisterMap.UserRamStart >> 7).U
    val process = address(15, 12) =/= 0.U && address < (RegisterMap.ProcessRamStart + p.ramBytes).U(17.W)
    // If its size is a power of 2, the RAM may begin at any of its words.
    val processOffset =
      if (isPow2(p.ramBytes max 1)) address else Cat(address(15, 12) - 1.U, address(11, 0))
    val localOffset =
      if (p.hasRegisterRam) Mux(user, address(6, 0), EscRam.RegisterStart.U | RegisterPlace(address(11, 0)))
      else address(6, 0)
    t.register      := !pastEnd && address(15, 12) === 0.U && !user
    t.ram           := !pastEnd && (user || (process && ramOpen))
    t.place.process := address(15, 12) =/= 0.U
    t.place.index   := Mux(t.place.process, processOffset, localOffset) >> laneBits
    t
  }

  private val ram = Module(new EscRam(p))

  // The host holds its address and data until its access is done, and what it reads may come a cycle later.
  // With many registers we use that to take a cycle more.
  private def held(signal: UInt): UInt = if (twoCycles) RegNext(signal) else signal

  // Reading: registers and RAM have one address in common. With many registers the choice of the address
  // takes a cycle of its own.
  private val twoCycles                        = EscMemory.readCycles(p) == 2
  private def chosen[T <: Data](request: T): T = if (twoCycles) RegNext(request) else request
  private val hostReading = WireDefault(false.B) // a read of the host has been chosen and is not done
  // A host that reads right behind its write sees what this has caused, events included.
  private val settles =
    if (twoCycles) false.B
    else {
      val own = registerWrite.valid && registerWriteByHost
      own || RegNext(own, false.B)
    }
  private val hostRead =
    host.req && !host.write && !settles && file.keptForHost.fold(true.B)(
      _.ready
    ) && !ecat.read && !host.ack && !hostReading
  private val unitWaits   = RegInit(false.B) // reset: no request
  private val unitAddress = RegEnable(unitRead.bits, unitRead.fire)
  private val unitReads   = unitWaits && !ecat.read && !host.req
  unitRead.ready := !unitWaits
  when(unitReads) { unitWaits := false.B }
  when(unitRead.fire) { unitWaits := true.B }
  private val readAddress = chosen(
    Mux(ecat.read, ecat.readAddress, Mux(unitReads, unitAddress, host.addr))
  )
  private val readTarget = target(readAddress(15, 0), readAddress(16))
  file.readAddress := readAddress(11, laneBits)
  for (kept <- file.keptForHost) {
    kept.reads   := chosen(!ecat.read)
    kept.asks    := host.req && !host.write && host.addr < (1 << 12).U
    kept.address := host.addr(11, laneBits)
  }
  ram.readPlace := readTarget.place

  // All but the RAM's answer, which comes late, is ready at the end of this cycle.
  private def latched(bits: UInt) = {
    val register = Reg(chiselTypeOf(bits))
    register := bits
    register
  }
  private val ramHit       = RegNext(readTarget.ram)
  private val registerHit  = RegNext(readTarget.register)
  private val ramData      = ram.readData
  private val everyLane    = Fill(lanes, ramHit)
  private val inRegisters  = Fill(lanes, readTarget.register)
  private val registerData = latched(FillInterleaved(8, inRegisters) & file.readData)
  private val fromRam = latched(
    Fill(lanes, readTarget.ram) | (if (p.hasRegisterRam) inRegisters & file.inRam else 0.U)
  )
  private val fromCounters = latched(inRegisters & file.isCount)
  private val readData = (FillInterleaved(8, fromRam) & ramData) |
    (FillInterleaved(8, fromCounters) & file.countData) | registerData
  ecat.readData := readData
  ecat.readable := everyLane | (Fill(lanes, registerHit) & latched(file.readableByEcat))
  ecat.writable := everyLane | (Fill(lanes, registerHit) & latched(file.writableByEcat))
  private val forHost = Wire(UInt(lanes.W))
  forHost        := held(everyLane | latched(file.readableByPdi))
  host.rdata     := held(readData) & FillInterleaved(8, forHost)
  unitData.valid := RegNext(chosen(unitReads), false.B)
  unitData.bits := Lanes.bytes(ramData, lanes)(
    if (lanes == 1) 0.U else RegNext(chosen(unitAddress(laneBits - 1, 0)))
  )

  // Register writes: those of frames from the log, then the host's.
  private val log        = Module(new WriteLog(lanes, p.writeLogDepth, p.hasBitWrites))
  private val ecatTarget = target(ecat.writeAddress, false.B)
  log.frameStart         := ecat.frameStart
  log.commit             := ecat.commit
  log.byteAccepted       := ecat.logByte
  log.write.valid        := ecat.write && ecatTarget.register
  log.write.bits.address := ecat.writeAddress(11, laneBits)
  log.write.bits.mask    := ecat.writeMask
  log.write.bits.data    := ecat.writeData
  log.write.bits.bits    := Fill(lanes, ecat.writeBits)
  ecat.logFull           := log.full
  commitStarts           := log.replayStarts

  // A host write looks up what the host may write, then writes.
  private val (hostAddress, hostData, hostLanes) = (held(host.addr), held(host.wdata), held(host.be))
  private val hostTarget                         = target(hostAddress, false.B)
  private val ecatToRam                          = ecat.write && ecatTarget.ram
  private val looksUp    = RegInit(false.B) // a look-up is under way or done; reset: none
  private val known      = RegInit(false.B) // what the host may write is known; reset: not
  private val hostLookUp = host.req && host.write && !looksUp && !ecat.read && !host.ack
  private val arrives    = RegNext(chosen(hostLookUp), false.B)
  private val hostMay    = latched(file.writableByPdi)
  private val hostMask   = RegEnable(hostMay, 0.U, arrives)
  private val mayWrite   = Mux(arrives, hostMay, hostMask)
  private val hostWrite = (arrives || known) &&
    Mux(hostTarget.register, !log.replay.valid && !unitWrites, !ecatToRam && !registerToRam)
  // The write of a host that cannot wait goes in between: by up to five cycles of its 32 the log gets later
  // (`longestWriteLog`).
  log.hold := (if (p.hostCannotWait) arrives || known else false.B)
  when(hostLookUp) { looksUp := true.B }
  when(arrives) { known := true.B }
  when(hostWrite) {
    looksUp := false.B
    known   := false.B
  }

  // After reset every byte of the register RAM is written 0, FMMUs and SyncManagers by their addresses.
  private lazy val cleared =
    if (p.hasRegisterRam) RegInit(0.U(10.W)) else WireDefault(512.U(10.W)) // reset: none yet
  private lazy val isClear = cleared(9)
  private lazy val clearing0 =
    Mux(
      cleared(8),
      Mux(cleared(7), RegisterRam.Others.start.U, RegisterRam.SyncManagers.start.U) | cleared(6, 0),
      RegisterRam.Fmmus.start.U | cleared(7, 0)
    )
  if (p.hasRegisterRam) when(!isClear) { cleared := cleared + 1.U }
  clearing := !isClear

  // The log's block RAM is slow to answer, so that a register stands between it and the decode of the
  // registers.
  private lazy val unitWrites = unitWrite.fire || !isClear
  private val nextWrite       = Wire(Valid(new RegisterWrite(lanes, p.hasBitWrites)))
  unitWrite.ready := isClear && !log.replay.valid && !registerWrite.valid && !ramWrite.valid
  nextWrite.valid := log.replay.valid || unitWrites || (hostWrite && hostTarget.register)
  nextWrite.bits  := log.replay.bits
  when(!log.replay.valid) { nextWrite.bits.bits := Fill(8 * lanes, true.B) }
  when(unitWrites) {
    val address = Mux(isClear, unitWrite.bits.address, clearing0)
    nextWrite.bits.address := address >> laneBits
    nextWrite.bits.mask    := (if (lanes == 1) 1.U else UIntToOH(address(laneBits - 1, 0), lanes))
    nextWrite.bits.data    := Mux(isClear, Fill(lanes, unitWrite.bits.data), 0.U)
  }.elsewhen(!log.replay.valid) {
    nextWrite.bits.address := hostAddress(11, laneBits)
    nextWrite.bits.mask    := hostLanes & mayWrite
    nextWrite.bits.data    := hostData
  }
  registerWrite.valid := RegNext(nextWrite.valid, false.B)
  registerWrite.bits  := RegNext(nextWrite.bits)
  registerWriteByHost := RegNext(!log.replay.valid && !unitWrites)

  registersBusy := log.busy || log.replay.valid || registerWrite.valid || ramWrite.valid

  // A write to registers in RAM is kept for a cycle or more, so that a byte of a frame comes first.
  private class RamWrite extends Bundle {
    val place = new RamPlace(p)
    val mask  = UInt(lanes.W)
    val data  = UInt((8 * lanes).W)
  }
  private lazy val ramWrite =
    if (p.hasRegisterRam) RegInit(0.U.asTypeOf(Valid(new RamWrite))) else 0.U.asTypeOf(Valid(new RamWrite))
  private lazy val registerToRam = ramWrite.valid && !ecatToRam
  if (p.hasRegisterRam) {
    val registers = RegisterMap(p, added)
    val mine      = registers.filter(_.inRam).flatMap(_.range)
    val scratch   = if (p.hasSii) SiiRegisters.Scratch else Nil
    val single =
      (registers.filter(r => r.inRam && r.block.isEmpty).flatMap(_.range) ++ scratch).map(_ / lanes).distinct
    val address = registerWrite.bits.byteAddress
    val area    = RegisterPlace.isApart(address)
    val exists = area || !isClear || single
      .map(w => registerWrite.bits.address === w.U)
      .reduceOption(_ || _)
      .getOrElse(false.B)
    // Reserved bits read 0: the bytes of an FMMU that have some. Those of the first one stand for all.
    val limits =
      mine.map(a => a -> RegisterRam.mask(registers, a)).filter { case (a, mask) =>
        mask != 0xff && a < FmmuRegisters.First + FmmuRegisters.Stride
      }
    val keep = VecInit((0 until lanes).map { lane =>
      limits.filter(_._1 % lanes == lane).foldLeft(0xff.U(8.W)) { case (mask, (a, bits)) =>
        Mux(
          RegisterPlace.isIn(RegisterRam.Fmmus, address) && address(3, laneBits) === ((a & 15) / lanes).U,
          bits.U,
          mask
        )
      }
    }).asUInt
    when(registerToRam) { ramWrite.valid := false.B }
    when(registerWrite.valid && exists) {
      ramWrite.valid              := true.B
      ramWrite.bits.place.process := false.B
      ramWrite.bits.place.index   := (EscRam.RegisterStart.U | RegisterPlace(address)) >> laneBits
      ramWrite.bits.mask          := registerWrite.bits.mask
      ramWrite.bits.data          := registerWrite.bits.data & keep
    }
  }

  file.write        := registerWrite.valid && isClear && RegNext(isClear, false.B)
  file.writeAddress := registerWrite.bits.address
  file.writeMask    := registerWrite.bits.mask
  file.writeData    := registerWrite.bits.data
  file.writeBits.foreach(_ := registerWrite.bits.bits)

  private val hostToRam = hostWrite && hostTarget.ram
  when(ecatToRam) {
    ram.writeMask  := ecat.writeMask
    ram.writePlace := ecatTarget.place
    ram.writeData  := ecat.writeData
  }.otherwise {
    ram.writeMask  := Mux(registerToRam, ramWrite.bits.mask, Fill(lanes, hostToRam) & hostLanes)
    ram.writePlace := Mux(registerToRam, ramWrite.bits.place, hostTarget.place)
    ram.writeData  := Mux(registerToRam, ramWrite.bits.data, hostData)
  }

  private val hostReadChosen = chosen(hostRead)
  private val hostReadDone   = if (twoCycles) RegNext(hostReadChosen, false.B) else hostReadChosen
  if (twoCycles) hostReading := hostReadChosen || hostReadDone
  host.ack                   := RegNext(hostReadDone || hostWrite, false.B)
}

object EscMemory {

  /** Cycles from a read to its answer. */
  def readCycles(p: EscParams): Int = if (p.translates) 2 else 1
}
