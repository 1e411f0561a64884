package flyframe.master

import chisel3._
import chisel3.util._
import flyframe.ethernet.NetworkSettings
import flyframe.lanes.Lanes
import flyframe.memory.HostPort
import flyframe.params.EscParams
import flyframe.registers.{MasterRegisters, Register, RegisterFile, RegisterMap, Source}

/** The host port of a master: its registers, see [[MasterRegisters]]. An access takes a cycle more than a
  * word has bytes; the first one after a reset waits until [[NetworkSettings]] have their reset values
  * (HOST-10).
  */
class MasterHost(p: EscParams) extends Module {
  private val laneBits = log2Ceil(p.lanes)
  private val file     = Module(new RegisterFile(p))

  val host   = IO(new HostPort(p.lanes))
  val value  = IO(chiselTypeOf(file.value))
  val set    = IO(chiselTypeOf(file.set))
  val status = IO(chiselTypeOf(file.status))
  val event  = IO(chiselTypeOf(file.event))
  val counts = IO(chiselTypeOf(file.count))
  value       := file.value
  file.set    := set
  file.status := status
  file.event  := event
  counts      := file.count

  /** To [[NetworkSettings]]. */
  val settingWrite   = IO(Output(Bool()))
  val settingAddress = IO(Output(UInt(NetworkSettings.AddressBits.W)))
  val settingData    = IO(Output(UInt(8.W)))
  val setting        = IO(Input(UInt(8.W)))

  /** The host reads the byte at `address`, one of [[MasterHost.Watched]]: a pulse with the acknowledgement.
    */
  private val watched =
    MasterHost.Watched.map(a => a -> IO(Output(Bool())).suggestName(f"reads_$a%02x")).toMap
  def reads(address: Int): Bool = watched(address)

  /** The host will take the byte of the mailbox in the next cycle. */
  val looks = IO(Output(Bool()))

  /** The host has written the byte at `address`, one of [[MasterHost.Noticed]]: a pulse when its register has
    * it.
    */
  private val noticed =
    MasterHost.Noticed.map(a => a -> IO(Output(Bool())).suggestName(f"writes_$a%02x")).toMap
  def writes(address: Int): Bool = noticed(address)

  private val registers = RegisterMap(p)
  // There is no check of what the host may do: it may read everything, and what it may not write stores
  // nothing.
  private def stores(r: Register) = r.stores && r.fields.exists(_.source != Source.Ram)
  for (r <- registers)
    require(
      r.pdi.readable && (r.pdi.writable || !stores(r)),
      s"register ${r.name} of the master has access ${r.pdi.code} of the host but must be readable " +
        "and, if it stores, writable."
    )

  // What the settings are after a reset, and which bits of them the host may change, by the register table.
  private val settings = registers.filter(r => r.inRam && r.pdi.writable)
  private def table(address: UInt, ofRegister: Register => BigInt): UInt = {
    val rows =
      for (r <- settings; i <- 0 until r.bytes)
        yield (address === (r.address + i).U) -> (ofRegister(r) >> (8 * i) & 0xff).U(8.W)
    Mux1H(rows)
  }

  // After a reset a byte of the settings is written in each cycle.
  private val next  = RegInit(0.U((NetworkSettings.AddressBits + 1).W)) // reset: the first one
  private val ready = next.head(1).asBool
  when(!ready) { next := next + 1.U }
  private val resetAddress = next.tail(1)

  // Settings are read and written byte by byte, then the other registers at once.
  private val count  = RegInit(0.U(log2Ceil(p.lanes + 1).W)) // cycles of this access; reset: none under way
  private val active = host.req && !host.ack && ready
  private val isLast = count === p.lanes.U
  private val inFile = !(host.addr >> RegisterMap.addressBits(p)).orR
  private val inSettings = !(host.addr >> NetworkSettings.AddressBits).orR
  private val address    = host.addr(RegisterMap.addressBits(p) - 1, laneBits)
  private val lane       = if (p.lanes == 1) 0.U(0.W) else count(laneBits - 1, 0)
  private val lanes      = Lanes.bytes(host.wdata, p.lanes)
  private val setAddress = Cat(host.addr(NetworkSettings.AddressBits - 1, laneBits), 0.U(laneBits.W)) | lane
  count             := Mux(active && !isLast, count + 1.U, 0.U)
  file.readAddress  := address
  file.write        := active && isLast && host.write && inFile
  file.writeAddress := address
  file.writeMask    := host.be
  file.writeData    := host.wdata
  settingWrite      := !ready || (active && !isLast && host.write && inSettings && host.be(lane))
  settingAddress    := Mux(ready, setAddress, resetAddress)
  settingData       := Mux(ready, lanes(lane) & table(setAddress, _.mask), table(resetAddress, _.reset))

  // The time stands still for a host that reads it in pieces: its first piece keeps those behind.
  private def isAt(byte: Int) = address === (byte >> laneBits).U
  if (p.lanes < 4) {
    val halves = Seq(0, 32).map(low => status.uint("master_time")(low + 31, low))
    val rest   = Reg(UInt((32 - 8 * p.lanes).W))
    for ((half, i) <- halves.zipWithIndex)
      when(active && isLast && inFile && isAt(MasterRegisters.MasterTime + 4 * i)) {
        rest := half >> (8 * p.lanes)
      }
    file.status.uint("master_time") := Cat(
      halves.reverse.flatMap(half => Seq(rest, half(8 * p.lanes - 1, 0)))
    )
  }

  // Settings that are not there are 0, as is all else in the file that is not there, and the key.
  require(MasterRegisters.MasterKey % 16 == 0, "the key is not where it is hidden")
  private val isKey = address >> (4 - laneBits) === (MasterRegisters.MasterKey >> 4).U
  private val read  = Cat((1 until p.lanes).scanLeft(setting)((later, _) => RegNext(later)))
  host.ack := RegNext(active && isLast, false.B)
  host.rdata := RegNext(
    (file.readData & Fill(8 * p.lanes, inFile)) | (read & Fill(8 * p.lanes, inSettings && !isKey))
  )
  looks := active && count === (p.lanes - 1).U && !host.write && inFile && isAt(MasterRegisters.MailboxData)
  for ((address, pulse) <- watched) {
    pulse := host.ack && !host.write && inFile && host.be(address % p.lanes) && isAt(address)
  }
  for ((address, pulse) <- noticed) {
    pulse := host.ack && host.write && inFile && host.be(address % p.lanes) && isAt(address)
  }
}

object MasterHost {

  /** Registers whose reading does something. */
  private val Watched = Seq(MasterRegisters.Answered, MasterRegisters.MailboxData)

  /** Registers whose writing does something beside what they store. */
  private val Noticed = Seq(MasterRegisters.ExpectedNode + 1)
}
