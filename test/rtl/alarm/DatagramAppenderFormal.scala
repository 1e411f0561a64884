package flyframe.alarm

import chisel3._
import chiseltest._
import chiseltest.formal._
import chiseltest.formal.backends.Engines
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.frame.FramePosition
import flyframe.mii.NibbleStream
import flyframe.ram.DualPortRamIO

/** What [[flyframe.ram.DualPortRam]] does, as the solver can see it. */
class RamModel(depth: Int, width: Int) extends Module {
  val io            = IO(new DualPortRamIO(depth, width))
  private val words = Mem(depth, UInt(width.W))
  when(io.write) { words(io.writeAddress) := io.writeData }
  io.readData := RegNext(words(io.readAddress))
}

object AppenderUnderProof {

  /** Its datagram has four bytes. */
  def apply(): DatagramAppender = Module(new DatagramAppender(bytes = 4, maxSubTelegrams = 15, newRam))
  private def newRam(depth: Int, width: Int, clock: Clock): DualPortRamIO = {
    val ram = Module(new RamModel(depth, width))
    ram.io.clock := clock
    ram.io
  }
}

/** Whatever comes, with nothing pending what leaves is what comes, in the same slot. */
class WireProof extends Module {
  private val in       = IO(Input(new NibbleStream))
  private val position = IO(Input(new FramePosition))
  private val step     = IO(Input(Bool()))
  private val pending  = IO(Input(Bool()))
  private val data     = IO(Input(UInt(4.W)))
  private val dut      = AppenderUnderProof()
  assume(!pending)
  dut.step     := step
  dut.in       := in
  dut.position := position
  dut.pending  := pending
  dut.data     := data
  assert(dut.out.asUInt === in.asUInt, "something changed")
  assert(!dut.busy, "the datagram is in use")
}

class DatagramAppenderFormal extends AnyFlatSpec with ChiselScalatestTester with Formal {
  private def prove(dut: => Module, steps: Int): Unit = {
    assume(Engines.present, Engines.missing)
    verify(dut, Seq(BoundedCheck(steps), Engines.boolector))
  }
  "AP-01" should "hold: with nothing pending the appender is a wire" in prove(new WireProof, 30)
}
