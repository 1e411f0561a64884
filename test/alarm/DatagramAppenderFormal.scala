package flyframe.alarm

import chisel3._
import chisel3.util._
import chiseltest._
import chiseltest.formal._
import chiseltest.formal.backends.Engines
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.frame.{FrameParser, FramePosition}
import flyframe.memory.DualPortRamIO
import flyframe.mii.NibbleStream

/** What [[flyframe.memory.DualPortRam]] does, as the solver can see it. */
class RamModel(depth: Int, width: Int) extends Module {
  val io            = IO(new DualPortRamIO(depth, width))
  private val words = Mem(depth, UInt(width.W))
  when(io.write) { words(io.writeAddress) := io.writeData }
  io.readData := RegNext(words(io.readAddress))
}

object AppenderUnderProof {

  /** Its datagram has two bytes. */
  def apply(): DatagramAppender = Module(new DatagramAppender(bytes = 2, maxSubTelegrams = 15, newRam))
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
  private val datagram = IO(Input(Vec(4, UInt(4.W))))
  private val dut      = AppenderUnderProof()
  assume(!pending)
  dut.step     := step
  dut.in       := in
  dut.position := position
  dut.pending  := pending
  dut.datagram := datagram
  assert(dut.out.asUInt === in.asUInt, "something changed")
  assert(!dut.busy, "the datagram is in use")
}

/** One frame, with the Ethernet header of an EtherCAT frame and everything behind it free; it may end
  * anywhere from the nineteenth byte on, good or bad. The datagram, two bytes of anything, may be pending or
  * not. A nibble per cycle.
  */
class ExtensionProof extends Module {
  private val nibble   = IO(Input(UInt(4.W)))
  private val last     = IO(Input(Bool()))
  private val bad      = IO(Input(Bool()))
  private val pending  = IO(Input(Bool()))
  private val datagram = IO(Input(Vec(4, UInt(4.W))))

  private val parser = Module(new FrameParser)
  private val dut    = AppenderUnderProof()

  // Nibble 0 is the SFD, 1 the low half of byte 0, 29 the low half of the EtherCAT header.
  private val number  = RegInit(0.U(7.W))
  private val running = RegInit(true.B)
  private val ends    = running && last && number > 36.U
  when(!number.andR) { number := number + 1.U }
  when(ends) { running := false.B }
  private val fixed = VecInit((Seq(0xd) ++ Seq.fill(24)(0) ++ Seq(8, 8, 4, 10)).map(_.U(4.W)))
  private val in    = Wire(new NibbleStream)
  in.valid       := running
  in.payload     := number =/= 0.U
  in.data        := Mux(number < fixed.size.U, fixed(number(4, 0)), nibble)
  in.last        := ends
  in.bad         := bad
  in.odd         := number(0)
  in.crcGood     := true.B
  parser.step    := true.B
  parser.in      := in
  parser.abandon := false.B
  dut.step       := true.B
  dut.in         := RegNext(in, NibbleStream.idle)
  dut.position   := RegNext(parser.position)
  dut.pending    := pending
  // Both stay as they are while the datagram is in use.
  private val kept = RegNext(dut.datagram)
  dut.datagram := Mux(dut.busy, kept, datagram)

  private val out     = dut.out
  private val inside  = RegInit(false.B) // a frame is leaving
  private val leaving = RegInit(false.B) // one has begun to leave
  private val left    = RegInit(false.B) // it has left
  private val cameBad = RegInit(false.B)
  when(dut.in.valid && dut.in.last && dut.in.bad) { cameBad := true.B }
  when(out.valid) {
    inside  := !out.last
    leaving := true.B
    assert(!left, "more than one frame leaves")
    when(out.last) { left := true.B }
  }
  when(inside) { assert(out.valid, "a hole in a frame") }
  when(out.valid && out.last && (cameBad || (dut.in.last && dut.in.bad))) {
    assert(out.bad, "a bad frame leaves as good")
  }

  // It has left at last: no frame gets stuck.
  private val over = RegInit(0.U(6.W))
  when(!dut.in.valid && number > 1.U && !over.andR) { over := over + 1.U }
  when(over === 20.U) { assert(left, "the frame is still here") }

  // The nibbles that came, 10 slots ago, or now.
  private val came   = ShiftRegister(dut.in.data, DatagramAppender.Delay)
  private val direct = RegInit(false.B)
  when(out.valid && !leaving) { direct := dut.in.valid && !dut.busy }
  private val isDirect = Mux(leaving, direct, dut.in.valid && !dut.busy)
  when(out.valid && isDirect) {
    assert(out.asUInt === dut.in.asUInt, "a frame that is not delayed is changed")
  }
  // Before the EtherCAT header nothing changes.
  private val at = RegInit(0.U(7.W))
  when(out.valid) { at := at + 1.U }
  when(out.valid && at < 29.U && !isDirect) { assert(out.data === came, "the Ethernet header is changed") }
}

class DatagramAppenderFormal extends AnyFlatSpec with ChiselScalatestTester with Formal {
  private def prove(dut: => Module, steps: Int): Unit = {
    assume(Engines.present, Engines.missing)
    verify(dut, Seq(BoundedCheck(steps), Engines.boolector))
  }
  "AP-01" should "hold: with nothing pending the appender is a wire" in prove(new WireProof, 30)

  "AP-02, AP-07" should "hold: one whole frame leaves, bad if it came bad, with its Ethernet header" in
    prove(new ExtensionProof, 54)
}
