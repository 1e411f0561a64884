package flyframe.master

import chisel3._
import chisel3.util._
import flyframe.memory.HostPort
import flyframe.params.EscParams
import flyframe.registers.{MasterRegisters, RegisterFile}

/** The host port of a master: its registers, see [[MasterRegisters]]. An access takes two cycles. */
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

  /** The host reads the byte at `address`, one of [[MasterHost.Watched]]: a pulse with the acknowledgement.
    */
  private val watched =
    MasterHost.Watched.map(a => a -> IO(Output(Bool())).suggestName(f"reads_$a%02x")).toMap
  def reads(address: Int): Bool = watched(address)

  private val inFile  = !host.addr(15, 12).orR
  private val looksUp = host.req && !host.ack
  private val found   = RegNext(looksUp, false.B) && looksUp // reset: no access
  private val data    = RegNext(file.readData)
  private val may     = Reg(UInt(p.lanes.W))
  may               := Mux(host.write, file.writableByPdi, file.readableByPdi)
  file.readAddress  := host.addr(11, laneBits)
  file.write        := found && host.write && inFile
  file.writeAddress := host.addr(11, laneBits)
  file.writeMask    := host.be & may
  file.writeData    := host.wdata
  host.ack          := RegNext(found, false.B)
  host.rdata        := RegNext(data & FillInterleaved(8, may & Fill(p.lanes, inFile)))
  for ((address, pulse) <- watched) {
    pulse := host.ack && !host.write && inFile && host.be(address % p.lanes) &&
      host.addr(11, laneBits) === (address >> laneBits).U
  }
}

object MasterHost {

  /** Registers whose reading does something. */
  private val Watched = Seq(MasterRegisters.Answered, MasterRegisters.MailboxData)
}
