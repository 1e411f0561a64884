package flyframe.board

import chisel3._
import flyframe.clocks.ResetCrossing
import flyframe.memory.HostPort

/** The reset of core and PHYs: while the PLL has not locked, and for `HoldMs` after (HB-06). */
class BoardReset(coreClockMhz: Int) extends RawModule {
  val clock  = IO(Input(Clock()))
  val locked = IO(Input(Bool()))
  val reset  = IO(Output(Bool()))

  private val crossing = Module(new ResetCrossing)
  crossing.clock := clock
  crossing.in    := !locked

  withClockAndReset(clock, crossing.out) {
    val last  = BoardReset.HoldMs * 1000 * coreClockMhz - 1
    val count = RegInit(0.U(chisel3.util.log2Ceil(last + 1).W)) // reset: the whole time again
    val over  = RegInit(false.B)
    when(!over) {
      count := count + 1.U
      over  := count === last.U
    }
    reset := crossing.out || !over
  }
}

object BoardReset {

  /** PHYs want 10 ms; a little more, for those in doubt. */
  val HoldMs = 12
}

/** What a board needs around a controller and is no part of the vendor's: its reset, and the bus of its host.
  * `fpga/alarm/board.v` connects it.
  *
  * @param lanes
  *   bytes of the data bus: 1, 2 or 4
  */
class BoardSupport(lanes: Int, coreClockMhz: Int) extends RawModule {
  override def desiredName = "board_support"

  val clock      = IO(Input(Clock()))
  val pll_locked = IO(Input(Bool()))
  val reset      = IO(Output(Bool()))
  val bus        = IO(new MemoryBus(lanes, HostBus.AddressBits - chisel3.util.log2Ceil(lanes)))
  val host       = IO(Flipped(new HostPort(lanes)))

  private val boardReset = Module(new BoardReset(coreClockMhz))
  boardReset.clock  := clock
  boardReset.locked := pll_locked
  reset             := boardReset.reset

  private val hostBus = withClockAndReset(clock, boardReset.reset)(Module(new HostBus(lanes)))
  hostBus.bus <> bus
  hostBus.host <> host
}
