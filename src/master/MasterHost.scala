package flyframe.master

import chisel3._
import chisel3.util._
import flyframe.memory.HostPort
import flyframe.params.EscParams
import flyframe.registers.{MasterRegisters, RegisterFile}

/** The host port of a master: its registers, see [[MasterRegisters]]. An access takes two cycles more than it
  * has bytes.
  */
class MasterHost(p: EscParams) extends Module {
  private val laneBits = log2Ceil(p.lanes)
  private val file     = Module(new RegisterFile(p))

  val host   = IO(new HostPort(p.lanes))
  val value  = IO(chiselTypeOf(file.value))
  val set    = IO(chiselTypeOf(file.set))
  val status = IO(chiselTypeOf(file.status))
  val event  = IO(chiselTypeOf(file.event))
  value       := file.value
  file.set    := set
  file.status := status
  file.event  := event

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

  // The register is looked up and read or written in the second cycle, settings byte by byte.
  private val inFile  = !host.addr(15, 12).orR
  private val count   = RegInit(0.U(log2Ceil(p.lanes + 2).W)) // cycles of this access; reset: none under way
  private val active  = host.req && !host.ack
  private val isLast  = count === (p.lanes + 1).U
  private val data    = RegNext(file.readData)
  private val inRam   = Reg(UInt(p.lanes.W))
  private val may     = Reg(UInt(p.lanes.W))
  private val bytes   = Reg(Vec(p.lanes, UInt(8.W)))
  private val lane    = if (p.lanes == 1) 0.U else count(laneBits - 1, 0)
  private val address = host.addr(11, laneBits)
  inRam             := file.inRam
  count             := Mux(active && !isLast, count + 1.U, 0.U)
  may               := Mux(host.write, file.writableByPdi, file.readableByPdi) & Fill(p.lanes, inFile)
  file.readAddress  := address
  file.write        := active && count === 1.U && host.write
  file.writeAddress := address
  file.writeMask    := host.be & may
  file.writeData    := host.wdata
  settingWrite   := active && count < p.lanes.U && host.write && inFile && file.inRam(lane) && host.be(lane)
  settingAddress := (Cat(address, 0.U(laneBits.W)) - MasterRegisters.Settings.U) + lane
  settingData    := VecInit((0 until p.lanes).map(i => host.wdata(8 * i + 7, 8 * i)))(lane)
  for (i <- 0 until p.lanes) when(count === (i + 1).U) { bytes(i) := setting }
  host.ack   := RegNext(active && isLast, false.B)
  host.rdata := RegNext((data | (bytes.asUInt & FillInterleaved(8, inRam))) & FillInterleaved(8, may))
  for ((address, pulse) <- watched) {
    pulse := host.ack && !host.write && inFile && host.be(address % p.lanes) &&
      host.addr(11, laneBits) === (address >> laneBits).U
  }
}

object MasterHost {

  /** Registers whose reading does something. */
  private val Watched = Seq(MasterRegisters.Answered, MasterRegisters.MailboxData)
}
