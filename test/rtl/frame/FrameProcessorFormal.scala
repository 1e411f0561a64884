package flyframe.frame

import chisel3._
import chisel3.util._
import chiseltest._
import chiseltest.formal._
import chiseltest.formal.backends.Engines
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.Tier
import flyframe.mii.{MiiReceiver, NibbleStream}
import flyframe.params.EscParams
import flyframe.protocol.Command._
import flyframe.protocol.{DatagramLayout, Layout}

/** A frame processor fed by the solver with one EtherCAT frame: Ethernet addresses and type as they should
  * be, everything behind them free. One nibble per cycle; the frame may end anywhere, good or bad.
  */
class ProcessorUnderProof extends Module {
  protected val nibble   = IO(Input(UInt(4.W)))
  protected val last     = IO(Input(Bool()))
  protected val bad      = IO(Input(Bool()))
  protected val events   = IO(Input(UInt(16.W)))
  protected val station  = IO(Input(UInt(16.W)))
  protected val readData = IO(Input(UInt(8.W)))
  protected val access   = IO(Input(UInt(2.W)))

  protected val dut = Module(new FrameProcessor(EscParams(coreClockMhz = 25)))

  // Number of the nibble: 0 is the SFD, 1 the low half of byte 0; the datagrams start with byte 16.
  protected val Datagram                          = 1 + 2 * 16
  protected def firstOf(field: Layout.Field): Int = Datagram + 2 * field.offset
  protected def lastOf(field: Layout.Field): Int  = Datagram + 2 * field.end - 1
  protected val number                            = RegInit(0.U(8.W))
  protected val running                           = RegInit(true.B)
  protected val ends                              = running && last && number >= Datagram.U
  protected val over                              = RegNext(ends, false.B) // behind the last nibble
  number := number + 1.U
  when(ends) { running := false.B }

  // Up to the EtherCAT header the frame is fixed, so that the solver's work begins with the first datagram.
  private val start = Seq.fill(24)(0) ++ Seq(8, 8, 4, 10) ++ Seq(0, 0, 0, 1)
  private val fixed = VecInit((0xd +: start).map(_.U(4.W)))
  private val data  = Mux(number < fixed.size.U, fixed(number(5, 0)), nibble)

  dut.step            := true.B
  dut.in              := 0.U.asTypeOf(new NibbleStream)
  dut.in.valid        := running
  dut.in.payload      := number =/= 0.U
  dut.in.data         := data
  dut.in.end          := over
  dut.in.bad          := bad
  dut.in.odd          := !number(0)
  dut.in.crcGood      := !bad
  dut.memory.readData := readData
  dut.memory.readable := access(0)
  dut.memory.writable := access(1)
  dut.memory.logFull  := false.B
  // Settings do not change within the frame.
  private def steady(value: UInt): UInt = {
    val first = RegEnable(value, number === 0.U)
    Mux(number === 0.U, value, first)
  }
  protected val myStation = steady(station)
  protected val myEvents  = steady(events)
  dut.config.stationAddress     := myStation
  dut.config.stationAlias       := 0.U
  dut.config.aliasEnable        := false.B
  dut.config.destroyNonEtherCat := true.B
  dut.config.circulating        := false.B
  dut.config.ecatEvents         := myEvents
  dut.config.readWriteOffset    := 0.U
}

/** FP-33: nothing commits unless the frame ends, and ends well. */
class CommitProof extends ProcessorUnderProof {
  when(dut.memory.commit) { assert(RegNext(over && !bad, false.B), "commit without the good end of a frame") }
  when(RegNext(over && bad, false.B)) { assert(dut.error, "a bad frame is not counted") }
}

/** FP-14 to FP-24: in the first datagram, if it does not address this ESC, ADP, IRQ and nothing else changes.
  */
class UnaddressedProof extends ProcessorUnderProof {
  import DatagramLayout.{Adp, Index, Irq, Length}
  private def at(n: Int)            = running && number === n.U
  private val in                    = RegNext(dut.in, NibbleStream.idle)
  private val was                   = RegNext(number, 0.U)
  private def wasAt(nibbles: Range) = was >= nibbles.head.U && was <= nibbles.last.U

  // The header fields, as they come in.
  private val command = Reg(UInt(8.W))
  private val adp     = Reg(UInt(16.W))
  for (i <- 0 until 2)
    when(at(Datagram + i)) { command := (if (i == 0) nibble else Cat(nibble, command(3, 0))) }
  for (i <- 0 until 4) when(at(firstOf(Adp) + i)) { adp := Cat(nibble, adp(15, 4)) }

  // Unaddressed: NOP, logical and reserved commands always, others by ADP. ARMW and FRMW address everybody.
  private def isOneOf(codes: Int*) = codes.map(command === _.U).reduce(_ || _)
  private val incremented          = isOneOf(Aprd, Apwr, Aprw)
  private val byStation            = isOneOf(Fprd, Fpwr, Fprw)
  private val passive              = isOneOf(Nop, Lrd, Lwr, Lrw) || command > all.map(_.value).max.U
  private val unaddressed = passive || (incremented && adp =/= 0.U) || (byStation && adp =/= myStation)

  private val expectedAdp = adp + incremented.asUInt
  // The nibble that leaves is that of the cycle before.
  when(in.valid && wasAt(Datagram to lastOf(Index))) {
    assert(dut.out.data === in.data, "command or index changed")
  }
  when(in.valid && wasAt(lastOf(Adp) + 1 to lastOf(Irq)) && unaddressed) {
    val irqNibble = (was - firstOf(Irq).U)(1, 0)
    val irq       = Mux(wasAt(firstOf(Irq) to lastOf(Irq)), (myEvents >> Cat(irqNibble, 0.U(2.W)))(3, 0), 0.U)
    // Behind the first datagram others may follow; only its own nibbles are looked at.
    assert(dut.out.data === (in.data | irq), "an unaddressed header changed")
  }
  // ADP itself, nibble by nibble, for position commands that do not match and for all others.
  private val outAdp = Reg(UInt(16.W))
  for (i <- 0 until 4) when(at(firstOf(Adp) + 1 + i)) { outAdp := Cat(dut.out.data, outAdp(15, 4)) }
  when(at(lastOf(Adp) + 2) && !isOneOf(Brd, Bwr, Brw, Armw)) {
    assert(outAdp === expectedAdp, "ADP")
  }
  // Data and working counter of a datagram with four data bytes.
  private val behind = lastOf(Irq) + 1 until lastOf(Irq) + 1 + 2 * (4 + DatagramLayout.CounterBytes)
  private val four   = RegInit(false.B)
  when(at(firstOf(Length))) { four := nibble === 4.U }
  when(at(firstOf(Length) + 1) && nibble =/= 0.U) { four := false.B }
  when(at(firstOf(Length) + 2) && nibble(2, 0) =/= 0.U) { four := false.B }
  when(in.valid && wasAt(behind) && four && unaddressed) {
    assert(dut.out.data === in.data, "data or working counter of an unaddressed datagram changed")
  }
  when(unaddressed && running && number >= behind.head.U && number <= behind.last.U && four) {
    assert(!dut.memory.write, "an unaddressed datagram writes")
  }
}

/** A receiver fed by the solver, and an FCS check of its own beside it. */
class ReceiverProof extends Module {
  private val symbol = IO(Input(new flyframe.clocks.MiiSymbol))
  private val ready  = IO(Input(Bool()))
  private val dut    = Module(new MiiReceiver(shortest = 4))
  dut.tick              := true.B
  dut.cut               := false.B
  dut.symbols.symbol    := symbol
  dut.symbols.available := ready
  dut.symbols.settled   := ready
  dut.symbols.overflow  := false.B

  // Bit by bit, over what leaves: the FCS of the frame so far is right when the state is the residue.
  private def bit(state: UInt, data: Bool): UInt =
    (state >> 1) ^ Mux(state(0) ^ data, "hedb88320".U(32.W), 0.U)
  private val state   = RegInit("hffffffff".U(32.W))
  private val nibbles = RegInit(0.U(8.W))
  private val even    = RegInit("hffffffff".U(32.W)) // the state over whole bytes
  private val next    = (0 until 4).foldLeft(state)((s, i) => bit(s, dut.out.data(i)))
  private val out     = dut.out
  when(out.valid && out.payload) {
    state   := next
    nibbles := nibbles + 1.U
    when(nibbles(0)) { even := next }
  }
  private val right = Mux(nibbles(0), even, state) === "hdebb20e3".U
  when(out.end && out.payload) {
    assert(out.bad || right, "a frame with a wrong FCS passes as good")
    assert(out.crcGood === right && out.odd === nibbles(0), "the mark of a bad frame would be wrong")
  }
  when(out.end || (out.valid && !out.payload)) {
    state   := "hffffffff".U
    even    := "hffffffff".U
    nibbles := 0.U
  }
  when(out.end && !out.payload) { assert(out.bad, "a frame without payload passes as good") }
}

class FrameProcessorFormal extends AnyFlatSpec with ChiselScalatestTester with Formal {
  private def prove(dut: => Module, steps: Int): Unit = {
    assume(Engines.present, Engines.missing)
    verify(dut, Seq(BoundedCheck(steps), Engines.boolector))
  }

  "FP-32, FP-33" should "hold: a commit needs the good end of a frame" in prove(new CommitProof, 75)

  "FP-14, FP-22, FP-23, FP-27" should "hold: an unaddressed datagram leaves unchanged but for ADP and IRQ" in
    prove(new UnaddressedProof, 68)

  // A frame of four bytes and its end need eleven slots. Beyond 14 it takes minutes, not seconds, as the
  // solver must find two CRCs equal.
  private val tier = Tier("proof that no frame with a wrong FCS is good", "slots", test = 14, soak = 16)

  "ERR-02, ERR-07, FP-33" should "hold: no frame with a wrong FCS leaves the receiver as good" in
    tier.run("all", tier.size)(prove(new ReceiverProof, tier.size.toInt))
}
