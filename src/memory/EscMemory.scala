package flyframe.memory

import chisel3._
import chisel3.util._
import flyframe.params.EscParams
import flyframe.registers.{RegisterFile, RegisterMap}

/** The 64 KiB address space of the controller (GEN-04): registers, user RAM, process data RAM, and the
  * arbiter between the frame processor and the host.
  *
  * Registers and RAM have one read and one write port each. The frame processor always comes first; the host
  * gets the cycles it leaves, at the latest after four, since the frame processor takes at most every second
  * cycle.
  */
class EscMemory(p: EscParams) extends Module {
  private val lanes    = p.lanes
  private val laneBits = log2Ceil(lanes)

  val ecat = IO(Flipped(new EcatAccess(lanes)))
  val host = IO(new HostPort(lanes))

  /** Process data RAM is open (FP-31). */
  val ramOpen = IO(Input(Bool()))

  private val file = Module(new RegisterFile(p))
  val value        = IO(chiselTypeOf(file.value))
  val set          = IO(chiselTypeOf(file.set))
  val status       = IO(chiselTypeOf(file.status))
  val event        = IO(chiselTypeOf(file.event))
  value       := file.value
  file.set    := set
  file.status := status
  file.event  := event

  /** A register write of a frame or the host takes effect in this cycle; for units that react to the writing
    * itself.
    */
  val registerWrite = IO(Output(Valid(new RegisterWrite(lanes))))

  /** The register writes of a frame are about to take effect. */
  val commitStarts = IO(Output(Bool()))

  /** Where an address leads. */
  private class Target extends Bundle {
    val register = Bool()
    val ram      = Bool()
    val index    = UInt(ramIndexBits.W)
  }
  private lazy val ramWords     = (p.ramBytes + 128) / lanes
  private lazy val ramIndexBits = log2Ceil(ramWords)

  private def target(address: UInt, pastEnd: Bool): Target = {
    val t       = Wire(new Target)
    val user    = address(15, 7) === (RegisterMap.UserRamStart >> 7).U
    val process = address(15, 12) =/= 0.U && address < (RegisterMap.ProcessRamStart + p.ramBytes).U(17.W)
    // Process data RAM comes first in the block RAM, the 128 bytes of user RAM behind it.
    val processOffset = Cat(address(15, 12) - 1.U, address(11, 0))
    val offset        = Mux(user, p.ramBytes.U | address(6, 0), processOffset)
    t.register := !pastEnd && address(15, 12) === 0.U && !user
    t.ram      := !pastEnd && (user || (process && ramOpen))
    t.index    := (offset >> laneBits)
    t
  }

  private val ram = Seq.fill(lanes)(DualPortRam(ramWords, 8)(clock))

  // Reading: one address for registers and RAM, answer in the next cycle.
  private val hostRead    = host.req && !host.write && !ecat.read && !host.ack
  private val readAddress = Mux(ecat.read, ecat.readAddress(15, 0), host.addr)
  private val readTarget  = target(readAddress, ecat.read && ecat.readAddress(16))
  file.readAddress := readAddress(11, laneBits)
  ram.foreach(_.io.readAddress := readTarget.index)

  private val registerHit = RegNext(readTarget.register)
  private val ramHit      = RegNext(readTarget.ram)
  private def latched(bits: UInt) = {
    val register = Reg(chiselTypeOf(bits))
    register := bits
    register
  }
  private val ramData      = VecInit(ram.map(_.io.readData)).asUInt
  private val registerData = latched(file.readData)
  private val everyLane    = Fill(lanes, ramHit)
  private val readData     = Mux(ramHit, ramData, Fill(8 * lanes, registerHit) & registerData)
  ecat.readData := readData
  ecat.readable := everyLane | (Fill(lanes, registerHit) & latched(file.readableByEcat))
  ecat.writable := everyLane | (Fill(lanes, registerHit) & latched(file.writableByEcat))
  private val forHost = FillInterleaved(8, latched(file.readableByPdi))
  host.rdata := Mux(ramHit, ramData, Fill(8 * lanes, registerHit) & registerData & forHost)

  // Register writes: those of frames from the log, then the host's.
  private val log        = Module(new WriteLog(lanes, p.writeLogDepth))
  private val ecatTarget = target(ecat.writeAddress, false.B)
  log.frameStart         := ecat.frameStart
  log.commit             := ecat.commit
  log.byteAccepted       := ecat.logByte
  log.write.valid        := ecat.write && ecatTarget.register
  log.write.bits.address := ecat.writeAddress(11, laneBits)
  log.write.bits.mask    := ecat.writeMask
  log.write.bits.data    := ecat.writeData
  ecat.logFull           := log.full
  commitStarts           := log.replayStarts

  // A host write takes two cycles: the first looks up what the host may write, the second writes.
  private val hostTarget    = target(host.addr, false.B)
  private val ecatToRam     = ecat.write && ecatTarget.ram
  private val lookedUp      = RegInit(false.B) // reset: no host access is under way
  private val hostMay       = latched(file.writableByPdi)
  private val hostLookUp    = host.req && host.write && !lookedUp && !ecat.read && !host.ack
  private val hostWrite     = lookedUp && Mux(hostTarget.register, !log.replay.valid, !ecatToRam)
  private val hostMask      = RegInit(0.U(lanes.W))
  private val lookUpArrived = RegNext(hostLookUp, false.B)
  when(hostLookUp) { lookedUp := true.B }
  when(hostWrite) { lookedUp := false.B }
  when(lookUpArrived) { hostMask := hostMay }
  private val mayWrite = Mux(lookUpArrived, hostMay, hostMask)

  // One register between the log's block RAM, which is slow to answer, and the decode of the registers.
  private val nextWrite = Wire(Valid(new RegisterWrite(lanes)))
  nextWrite.valid := log.replay.valid || (hostWrite && hostTarget.register)
  nextWrite.bits  := log.replay.bits
  when(!log.replay.valid) {
    nextWrite.bits.address := host.addr(11, laneBits)
    nextWrite.bits.mask    := host.be & mayWrite
    nextWrite.bits.data    := host.wdata
  }
  registerWrite.valid := RegNext(nextWrite.valid, false.B)
  registerWrite.bits  := RegNext(nextWrite.bits)

  file.write        := registerWrite.valid
  file.writeAddress := registerWrite.bits.address
  file.writeMask    := registerWrite.bits.mask
  file.writeData    := registerWrite.bits.data

  private val hostToRam = hostWrite && hostTarget.ram
  for ((bank, lane) <- ram.zipWithIndex) {
    bank.io.write        := Mux(ecatToRam, ecat.writeMask(lane), hostToRam && host.be(lane))
    bank.io.writeAddress := Mux(ecatToRam, ecatTarget.index, hostTarget.index)
    bank.io.writeData    := Mux(ecatToRam, ecat.writeData, host.wdata)(8 * lane + 7, 8 * lane)
  }

  host.ack := RegNext(hostRead || hostWrite, false.B)
}
