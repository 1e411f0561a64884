package flyframe.host

import chisel3._
import chisel3.util._
import flyframe.clocks.SpiBytes

/** The four wires of SPI, `sel` as its pin has it, and whether MISO is driven. */
class SpiPins extends Bundle {
  val sel        = Input(Bool())
  val clk        = Input(Bool())
  val mosi       = Input(Bool())
  val miso       = Output(Bool())
  val miso_drive = Output(Bool())
}

/** The side of an SPI slave that runs by the host's clock: makes bytes of bits, the highest one first
  * (B-115). Bytes go to and come from the core clock by way of [[flyframe.clocks.SpiCrossing]].
  *
  * @param mode
  *   0 to 3: bit 1 is the level of the clock at rest, and bit 0 says that bits change with the first edge of
  *   a clock pulse and not with the second
  * @param late
  *   MISO changes with the edge at which MOSI is sampled, half a clock later than without
  */
class SpiShift(mode: Int, late: Boolean) extends RawModule {
  private val secondEdge = mode % 2 == 1

  val selected = IO(Input(Bool()))
  val clk      = IO(Input(Bool()))
  val mosi     = IO(Input(Bool()))
  val miso     = IO(Output(Bool()))
  val bytes    = IO(Flipped(new SpiBytes))

  // MOSI is sampled with one edge of the clock; bits change with the other one.
  private val rises  = clk.asClock
  private val falls  = (!clk).asClock
  private val sample = if (mode == 0 || mode == 3) rises else falls
  private val shift  = if (mode == 0 || mode == 3) falls else rises

  // Where in its byte a bit is: the only thing that begins anew with each selection.
  private val bit = withClockAndReset(sample, (!selected).asAsyncReset)(RegInit(0.U(3.W)))
  bit := bit + 1.U
  private val isFirst = bit === 0.U

  // What comes in. No reset: the core clock's side sees changes only. The clock may also be there for another
  // slave.
  withClock(sample) {
    val earlier  = Reg(UInt(7.W))
    val received = Reg(UInt(8.W))
    val whole    = Reg(Bool())
    val begun    = Reg(Bool())
    val firstBit = Reg(Bool())
    val bits     = Reg(UInt(3.W))
    earlier := Cat(earlier(5, 0), mosi)
    when(selected) {
      bits := bit + 1.U
      when(isFirst) {
        begun    := !begun
        firstBit := mosi
      }
      when(bit === 7.U) {
        whole    := !whole
        received := Cat(earlier, mosi)
      }
    }
    bytes.received := received
    bytes.whole    := whole
    bytes.begun    := begun
    bytes.firstBit := firstBit
    bytes.bits     := bits
  }

  // What goes out is taken with the first bit of its byte.
  private val (held, taken) = withClock(if (late || !secondEdge) sample else shift) {
    val held  = Reg(UInt(8.W))
    val taken = Reg(Bool())
    when(selected && isFirst) {
      held  := bytes.next
      taken := !taken
    }
    (held, taken)
  }
  bytes.taken := taken
  private val out =
    withClock(if (late) sample else shift)(RegNext(Mux(isFirst, bytes.next(7), held(~bit))))
  // Without an edge in front of it, the first bit of a byte comes as it is: also that of the first data byte
  // of a read, for which the host may have stopped its clock.
  private val direct =
    withClockAndReset(shift, (!selected).asAsyncReset)(RegNext(isFirst, true.B))
  miso := (if (late || secondEdge) out else Mux(direct, bytes.next(7), out))
}
