package flyframe.clocks

import chisel3._
import chisel3.util._

/** Every clock crossing of the project is one of the modules in this file; the constraint file finds them by
  * their names.
  */
object Crossings {

  /** Binary to Gray code, same width. */
  def toGray(binary: UInt): UInt = (binary ^ (binary >> 1))(binary.getWidth - 1, 0)

  /** Gray code to binary, same width. */
  def toBinary(gray: UInt): UInt =
    VecInit((0 until gray.getWidth).map(i => gray(gray.getWidth - 1, i).xorR)).asUInt
}

/** Two flip-flops that bring a slow level into the clock of the module. Latency 2 to 3 cycles.
  *
  * No reset: the level settles by itself within two cycles.
  */
class LevelCrossing extends Module {
  val in  = IO(Input(Bool()))
  val out = IO(Output(Bool()))

  private val meta   = RegNext(in)
  private val stable = RegNext(meta)
  out := stable
}

object LevelCrossing {

  /** A level in the clock of the module that asks for it. */
  def apply(level: Bool): Bool = {
    val crossing = Module(new LevelCrossing)
    crossing.in := level
    crossing.out
  }
}

/** The same outside the controller. Quartus gets the Verilog of both, where a module may stand once: the name
  * is another one.
  */
class BoardLevelCrossing extends LevelCrossing

/** Samples of a pin in the clock of the module: one a cycle, or with each of its edges (FR-03). Between the
  * rising edge that takes the last one and the cycle in which `out` has it lie two flip-flops. One that is
  * taken with the falling edge waits in a flip-flop of its own for the rising one, half a cycle later.
  *
  * No reset: the samples are there within two cycles.
  *
  * @param perCycle
  *   1 or 2
  */
class EdgeSampleCrossing(perCycle: Int) extends Module {
  val in = IO(Input(Bool()))

  /** The first one in bit 0. */
  val out = IO(Output(UInt(perCycle.W)))

  private val rising = LevelCrossing(in)
  if (perCycle == 1) out := rising
  else {
    val taken  = withClock((!clock.asBool).asClock)(RegNext(in))
    val meta   = RegNext(taken)
    val stable = RegNext(meta)
    out := rising ## stable
  }
}

/** Levels of any clock as they are when they are to be taken: of one that changes then, either. For those who
  * look at them two cycles later, not before: by then the flip-flops have settled. They are given part by
  * part, the lowest first.
  *
  * @param parts
  *   how many
  * @param width
  *   levels in each
  */
class SampleCrossing(parts: Int, width: Int) extends Module {
  val in   = IO(Input(UInt((parts * width).W)))
  val take = IO(Input(Bool()))

  /** On to the next part. */
  val next = IO(Input(Bool()))
  val out  = IO(Output(UInt(width.W)))

  private val taken = Reg(UInt((parts * width).W))
  when(next) { taken := taken >> width }
  when(take) { taken := in }
  out := taken(width - 1, 0)
}

/** One symbol as the PHY gives it: RX_DV, RX_ER and RXD. */
class MiiSymbol extends Bundle {
  val dv   = Bool()
  val er   = Bool()
  val data = UInt(4.W)
}

/** The read side of [[MiiRxCrossing]], in the core clock. */
class MiiRxCrossingRead extends Bundle {

  /** The oldest symbol; meaningful while `available`. */
  val symbol = Output(new MiiSymbol)

  /** At least one symbol is waiting. */
  val available = Output(Bool())

  /** The oldest symbol has waited long enough for a whole frame to follow without a gap, whatever the clocks
    * do within 100 ppm.
    */
  val settled = Output(Bool())

  /** Symbols have been, or are about to be, overwritten. */
  val overflow = Output(Bool())

  /** Take the oldest symbol. */
  val take = Input(Bool())
}

/** The RX_CLK side of [[MiiRxCrossing]]: writes symbols into a few registers and tells how far it got, in
  * Gray code.
  *
  * It has no reset: in reset the read side follows the write pointer, wherever that is.
  *
  * @param depth
  *   symbols stored, a power of two
  */
class MiiRxWriteSide(depth: Int) extends Module {
  private val pointerBits = log2Ceil(depth) + 1

  val pins = IO(Input(new MiiSymbol))

  /** The pins have a symbol in this cycle; the formal proof uses it as the clock edge. */
  val valid = IO(Input(Bool()))

  val slots     = IO(Output(Vec(depth, new MiiSymbol)))
  val writeGray = IO(Output(UInt(pointerBits.W)))

  private val wasActive = Reg(Bool())
  private val gray      = Reg(UInt(pointerBits.W)) // the only pointer, so that no two can disagree
  private val storage   = Reg(Vec(depth, new MiiSymbol))
  private val pointer   = Crossings.toBinary(gray)
  when(valid) {
    wasActive := pins.dv || pins.er
    when(pins.dv || pins.er || wasActive) {
      storage(pointer(pointerBits - 2, 0)) := pins
      gray                                 := Crossings.toGray(pointer + 1.U)
    }
  }
  slots     := storage
  writeGray := gray
}

/** The core clock side of [[MiiRxCrossing]]: two flip-flops bring the Gray pointer over; what it points to is
  * stable by then.
  *
  * @param margin
  *   core cycles a symbol that starts a frame waits
  */
class MiiRxReadSide(depth: Int, margin: Int) extends Module {
  private val pointerBits = log2Ceil(depth) + 1

  val slots       = IO(Input(Vec(depth, new MiiSymbol)))
  val writeGray   = IO(Input(UInt(pointerBits.W)))
  val shortMargin = IO(Input(Bool()))
  val read        = IO(new MiiRxCrossingRead)

  private def delayed(pointer: UInt): UInt = {
    val register = Reg(UInt(pointerBits.W))
    register := pointer
    register
  }
  private val meta    = delayed(writeGray)
  private val visible = delayed(meta)
  private val earlier = Seq.iterate(visible, margin + 1)(delayed) // earlier(m): `visible` m cycles ago

  private val pointer = Reg(UInt(pointerBits.W))
  private val begins  = RegNext(false.B, true.B) // in reset, and a cycle longer
  when(begins) {
    pointer := Crossings.toBinary(visible)
  }.elsewhen(read.take) {
    pointer := pointer + 1.U
  }

  private val pointerGray = Crossings.toGray(pointer)
  private val waiting     = Crossings.toBinary(visible) - pointer
  read.symbol    := slots(pointer(pointerBits - 2, 0))
  read.available := visible =/= pointerGray
  read.settled   := Mux(shortMargin, earlier(1), earlier(margin)) =/= pointerGray
  read.overflow  := waiting(pointerBits - 1)
}

/** Brings the symbols of one receiver from RX_CLK into the core clock (PHY-03): a small FIFO with Gray-coded
  * write pointer. With MII each cycle of RX_CLK has a `valid` symbol; with RMII the clock is twice as fast.
  *
  * Symbols are written only while RX_DV or RX_ER is high, and once more behind them, so that the end is seen.
  * No clock difference can add up between frames. A frame may start to be read when its first symbol has been
  * visible for `margin` core cycles: over the longest frame (122 us) clocks 100 ppm apart slip 12 ns, so
  * `margin` covers 12.2 ns, and 6.1 ns where the master asks for less (LP-12).
  *
  * @param coreClockMhz
  *   core clock in MHz: 25, 50, 100 or 125
  */
class MiiRxCrossing(coreClockMhz: Int) extends Module {
  private val depth = MiiRxCrossing.depth(coreClockMhz)

  val rxClock     = IO(Input(Clock()))
  val pins        = IO(Input(new MiiSymbol))
  val valid       = IO(Input(Bool()))
  val shortMargin = IO(Input(Bool()))
  val read        = IO(new MiiRxCrossingRead)

  private val writeSide = withClock(rxClock)(Module(new MiiRxWriteSide(depth)))
  private val readSide  = Module(new MiiRxReadSide(depth, MiiRxCrossing.margin(coreClockMhz)))
  writeSide.pins       := pins
  writeSide.valid      := valid
  readSide.slots       := writeSide.slots
  readSide.writeGray   := writeSide.writeGray
  readSide.shortMargin := shortMargin
  read <> readSide.read
}

object MiiRxCrossing {

  /** Core cycles that cover `ns`. */
  private def cycles(ns: Double, coreClockMhz: Int): Int = math.ceil(ns * coreClockMhz / 1000).toInt

  /** Core cycles the first symbol of a frame waits (LP-12). */
  def margin(coreClockMhz: Int): Int = cycles(12.2, coreClockMhz)

  /** Symbols stored: a symbol stays 40 ns times this; at 25 MHz the synchroniser alone takes 80 ns. */
  def depth(coreClockMhz: Int): Int = if (coreClockMhz == 25) 8 else 4
}

/** Brings a reset into the clock of the module: it begins at once, with the clock or without, and ends with a
  * clock edge.
  */
class ResetCrossing extends RawModule {
  val clock = IO(Input(Clock()))
  val in    = IO(Input(Bool()))
  val out   = IO(Output(Bool()))

  withClockAndReset(clock, in.asAsyncReset) {
    val meta   = RegNext(false.B, true.B)
    val stable = RegNext(meta, true.B)
    out := stable
  }
}

/** The low active control pins of an asynchronous memory bus: chip enable, output enable, write enable. */
class MemoryBusStrobes extends Bundle {
  val ne  = Bool()
  val noe = Bool()
  val nwe = Bool()
}

/** Brings the accesses of an asynchronous memory bus into the clock of the module (HB-01).
  *
  * The strobes pass two flip-flops each, and an access begins when all three have stood for two cycles, as
  * two of them may change at once. What goes with an access has stood on the pins for two cycles more than a
  * flip-flop needs by then: `hold` takes it without synchroniser.
  *
  * @param payload
  *   address, byte enables and data as the pins have them
  */
class MemoryBusCrossing[T <: Data](payload: T) extends Module {
  val strobes = IO(Input(new MemoryBusStrobes))
  val pins    = IO(Input(payload))

  /** An access is under way: a write, or else a read. */
  val active = IO(Output(Bool()))
  val write  = IO(Output(Bool()))

  /** It has stood long enough. */
  val settled = IO(Output(Bool()))

  /** Take what goes with it; in `held` from the next cycle on. */
  val hold = IO(Input(Bool()))
  val held = IO(Output(payload))

  private val meta    = RegNext(strobes)
  private val stable  = RegNext(meta)
  private val earlier = RegNext(stable)
  active  := !stable.ne && !(stable.noe && stable.nwe)
  write   := !stable.nwe
  settled := stable.asUInt === earlier.asUInt

  private val taken = RegEnable(pins, hold)
  held := taken
}

/** What the side of an SPI slave in the host's clock gives and gets. A level that changes tells of an event;
  * what goes with it stays for seven clocks of the host.
  */
class SpiBytes extends Bundle {

  /** The first bit of a byte was sampled, and which; a whole byte was. */
  val begun    = Input(Bool())
  val firstBit = Input(Bool())
  val whole    = Input(Bool())
  val received = Input(UInt(8.W))

  /** `next` was taken, to be sent. */
  val taken = Input(Bool())
  val next  = Output(UInt(8.W))

  /** Bits that have come of the last byte, modulo 8. */
  val bits = Input(UInt(3.W))
}

/** Brings the bytes of an SPI slave from the host's clock into that of the module (B-115).
  *
  * A change is seen 2 to 3 cycles behind its edge, `taken` one cycle later, and the end of a selection two:
  * of two edges a cycle apart these are never seen in front of the byte that they follow. So selections must
  * be five cycles apart; what is less counts as one.
  */
class SpiCrossing extends Module {
  val bytes    = IO(new SpiBytes)
  val selected = IO(Input(Bool()))

  /** What the host wants to have sent next: may change from the `taken` of the byte in front of it on, and
    * must stand [[SpiCrossing.Margin]] cycles when it is taken.
    */
  val next = IO(Input(UInt(8.W)))

  /** The same in the clock of the module, one cycle each; `firstBit`, `received` and `bits` stand. */
  val begun    = IO(Output(Bool()))
  val whole    = IO(Output(Bool()))
  val taken    = IO(Output(Bool()))
  val firstBit = IO(Output(Bool()))
  val received = IO(Output(UInt(8.W)))
  val bits     = IO(Output(UInt(3.W)))

  /** The host has selected the slave. */
  val active = IO(Output(Bool()))

  private def changes(level: Bool): Bool = {
    val stable = LevelCrossing(level)
    stable =/= RegNext(stable) // no reset: during a reset it follows
  }
  private val ended = Seq.iterate(LevelCrossing(selected), 3)(RegNext(_))
  begun      := changes(bytes.begun)
  whole      := changes(bytes.whole)
  taken      := RegNext(changes(bytes.taken))
  active     := ended.reduce(_ || _)
  firstBit   := bytes.firstBit
  received   := bytes.received
  bits       := bytes.bits
  bytes.next := next
}

object SpiCrossing {

  /** Cycles from the edge that takes a byte until `taken` is high, at most. */
  val Margin = 5
}
