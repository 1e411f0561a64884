package flyframe.host

import chisel3._
import chisel3.util._
import flyframe.clocks.SampleCrossing
import flyframe.memory.HostPort
import flyframe.registers.RegisterMap

/** Takes the levels of the digital inputs and writes them to 0x1000 on, as a host would (B-118): where a
  * SyncManager has them they are one buffer.
  *
  * @param bytes
  *   of inputs, 1 to 4
  * @param lanes
  *   bytes per word of the host port
  */
class DigitalInputs(bytes: Int, lanes: Int) extends Module {
  private val words = (bytes + lanes - 1) / lanes

  val port = IO(Flipped(new HostPort(lanes)))

  /** The levels at the pins, of any clock. */
  val levels = IO(Input(UInt((8 * bytes).W)))

  /** They are to be taken; while the ones before are being written it has no effect. */
  val take = IO(Input(Bool()))

  private val busy   = RegInit(false.B) // reset: there is nothing to write
  private val word   = Reg(UInt((log2Ceil(words) max 1).W))
  private val begins = take && !busy

  // The cycle behind `begins` lets the levels settle; the one behind an access is the pause of the port.
  private val rests = RegNext(begins || port.ack, false.B)
  when(begins) {
    busy := true.B
    word := 0.U
  }
  when(port.ack) {
    word := word + 1.U
    when(word === (words - 1).U) { busy := false.B }
  }

  private val crossing = Module(new SampleCrossing(words, 8 * lanes))
  crossing.in   := levels
  crossing.take := begins
  crossing.next := port.ack
  private val enables =
    VecInit(Seq.tabulate(words)(i => ((1 << ((bytes - i * lanes) min lanes)) - 1).U(lanes.W)))
  port.req   := busy && !rests
  port.write := true.B
  port.addr  := RegisterMap.ProcessRamStart.U | (word << log2Ceil(lanes)).asUInt
  port.wdata := crossing.out
  port.be    := (if (words == 1) enables(0) else enables(word))
}
