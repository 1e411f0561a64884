package flyframe.board

import chisel3._
import chisel3.util._
import flyframe.clocks.{BoardLevelCrossing, ResetCrossing}
import flyframe.host.{MicrocontrollerInterface, MicrocontrollerPins}
import flyframe.memory.HostPort
import flyframe.params.EscParams

/** The reset of core and PHYs: while the PLL has not locked, and 10 to 20 ms after (HB-06). */
class BoardReset(coreClockMhz: Int) extends RawModule {
  val clock  = IO(Input(Clock()))
  val locked = IO(Input(Bool()))
  val reset  = IO(Output(Bool()))

  private val crossing = Module(new ResetCrossing)
  crossing.clock := clock
  crossing.in    := !locked

  // It is there without a clock, and comes from a register, as it clears flip-flops (B-119).
  withClockAndReset(clock, crossing.out.asAsyncReset) {
    val bits  = log2Ceil(BoardReset.LeastMs * 1000 * coreClockMhz)
    val count = RegInit(0.U((bits + 1).W)) // reset: the whole time again
    val over  = count(bits)
    when(!over) { count := count + 1.U }
    reset := RegNext(!over, true.B)
  }
}

object BoardReset {

  /** How long PHYs want to be reset. */
  val LeastMs = 10
}

/** Resets a PLL that has lost its lock: it does not come back in the right phase by itself. Runs on the
  * oscillator's clock, which needs no PLL: while there is no lock, a pulse of 0.7 ms every 5.2 ms at 50 MHz;
  * a PLL locks within 1 ms.
  *
  * No reset: whatever the counter begins with, it comes round, or a lock clears it.
  */
class PllReset extends RawModule {
  val clock  = IO(Input(Clock()))
  val locked = IO(Input(Bool()))
  val reset  = IO(Output(Bool()))

  withClockAndReset(clock, false.B) {
    val crossing = Module(new BoardLevelCrossing)
    crossing.in := locked
    val count = Reg(UInt(PllReset.CountBits.W))
    count := Mux(crossing.out, 0.U, count + 1.U)
    reset := RegNext(count.head(3).andR)
  }
}

object PllReset {
  private val CountBits = 18
}

/** What a board needs around a controller and is no part of the vendor's: its reset, and the bus of its host.
  * `board.v` of the boards in `fpga` connects it.
  *
  * @param lanes
  *   bytes of the data bus: 1, 2 or 4
  */
class BoardSupport(lanes: Int, coreClockMhz: Int) extends RawModule {
  override def desiredName = "board_support"

  val clock      = IO(Input(Clock()))
  val pll_locked = IO(Input(Bool()))
  val reset      = IO(Output(Bool()))

  /** The oscillator that the PLL is fed with, and the reset of the PLL. */
  val oscillator = IO(Input(Clock()))
  val pll_reset  = IO(Output(Bool()))
  val bus        = IO(new MicrocontrollerPins(lanes))
  val host       = IO(Flipped(new HostPort(lanes)))

  private val boardReset = Module(new BoardReset(coreClockMhz))
  boardReset.clock  := clock
  boardReset.locked := pll_locked
  reset             := boardReset.reset

  private val pllReset = Module(new PllReset)
  pllReset.clock  := oscillator
  pllReset.locked := pll_locked
  pll_reset       := pllReset.reset

  // A host that waits for all it does, as NWAIT of an STM32 wants it.
  private val p =
    EscParams(hostInterface = 5, dataBusWidth = 8 * lanes, coreClockMhz = coreClockMhz)
      .copy(busWriteEarly = 1, busBusyEarly = 1)
  private val hostBus =
    withClockAndReset(clock, boardReset.reset.asAsyncReset)(Module(new MicrocontrollerInterface(p)))
  hostBus.bus <> bus
  hostBus.port <> host
  hostBus.side.events := 0.U
}
