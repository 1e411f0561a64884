package flyframe.mii

import chisel3._
import chisel3.util._
import flyframe.clocks.MiiRxCrossingRead

/** What a receiver tells the error counters and the loop control, each a pulse of one cycle. */
class ReceiverEvents extends Bundle {

  /** A frame counted as invalid (column INV of ERR-02). */
  val invalidFrame = Bool()

  /** A symbol with RX_ER, inside or outside a frame (ERR-03). */
  val rxEr = Bool()

  /** A frame an earlier ESC has marked (ERR-08). */
  val forwardedError = Bool()

  /** A whole frame without error. */
  val goodFrame = Bool()
}

/** Finds the frames in the symbols of one port: SFD, odd nibbles, FCS, length, RX_ER (B-01 to B-03).
  *
  * A symbol leaves in the slot in which it is taken; the one that ends the frame becomes the end with its
  * verdict. Delay: one core cycle from taking a symbol to `out`.
  *
  * @param shortest
  *   whole bytes of the shortest good frame, a power of two; 64 but in proofs
  */
class MiiReceiver(shortest: Int = 64) extends Module {
  import MiiReceiver._

  /** Once per nibble slot. */
  val tick    = IO(Input(Bool()))
  val symbols = IO(Flipped(new MiiRxCrossingRead))

  /** The link went down: cut the frame off (B-30). */
  val cut    = IO(Input(Bool()))
  val out    = IO(Output(new NibbleStream))
  val events = IO(Output(new ReceiverEvents))

  /** No frame is being received or on its way out. */
  val idle = IO(Output(Bool()))

  private val state = RegInit(State.idle)

  // Data path registers need no reset: `state` says when they count.
  private val count      = Reg(UInt(13.W)) // nibbles of this part (preamble, then payload), up to 4096
  private val longEnough = Reg(Bool())     // `shortest` whole bytes have come
  private val crc        = Reg(UInt(32.W))
  private val crcWasGood = Reg(Bool())     // `crc` was right one nibble earlier

  private val output = RegInit(NibbleStream.idle)
  private val cutNow = RegInit(false.B) // a cut waits for the next slot
  out := output

  private val symbol   = symbols.symbol
  private val full     = count(12)
  private val longNow  = count(log2Ceil(2 * shortest)) // together with `longEnough`: at least that many
  private val crcRight = crc === Crc32.Residue
  private val behind   = state === State.payload
  private val odd      = count(0)
  private val inFrame  = state === State.preamble || behind

  // What the symbol at hand means for the running frame.
  private val isFive    = symbol.data === 5.U
  private val isSfd     = symbol.data === 0xd.U
  private val lost      = !symbols.available || symbols.overflow || cutNow || cut
  private val badInside = symbol.er || Mux(behind, full, !isSfd && (!isFive || full))
  private val faulty    = lost || (symbol.dv && badInside)
  private val ended     = !lost && !symbol.dv

  private val crcGood = Mux(odd, crcWasGood, crcRight)
  private val good    = ended && behind && crcGood && (longEnough || longNow)

  private val start      = state === State.idle && symbols.available && symbol.dv && symbols.settled
  private val startFault = symbol.er || (!isFive && !isSfd)

  symbols.take := tick && symbols.available && (state =/= State.idle || !symbol.dv || symbols.settled)

  private val endOfFrame = tick && inFrame && (faulty || ended)
  events.invalidFrame := (endOfFrame && (faulty || !behind || (!crcGood && !odd))) ||
    (tick && start && startFault)
  events.forwardedError := endOfFrame && ended && behind && !crcGood && odd
  events.goodFrame      := endOfFrame && good
  events.rxEr           := symbols.take && symbol.er
  idle                  := (state === State.idle || state === State.skip) && !output.busy

  when(tick) {
    val runs = !faulty && !ended
    output.valid   := start || (inFrame && runs)
    output.end     := (inFrame && !runs) || state === State.faultyStart
    output.payload := behind
    output.data    := Mux(start && startFault, 5.U, symbol.data)
    output.bad     := !good
    output.odd     := odd
    output.crcGood := crcGood
    cutNow         := false.B

    switch(state) {
      is(State.idle) {
        count := 1.U
        when(start) {
          state := Mux(startFault, State.faultyStart, Mux(isSfd, State.payload, State.preamble))
          when(isSfd) { count := 0.U }
        }
      }
      is(State.preamble, State.payload) {
        when(faulty) {
          state := State.skip
        }.elsewhen(ended) {
          state := State.idle
        }.elsewhen(state === State.preamble) {
          count := Mux(isSfd, 0.U, count + 1.U)
          when(isSfd) { state := State.payload }
        }.otherwise {
          count := count + 1.U
        }
      }
      is(State.faultyStart) {
        state := Mux(symbols.available && !symbol.dv, State.idle, State.skip)
      }
      is(State.skip) {
        when(symbols.available && !symbol.dv) { state := State.idle }
      }
    }

    when(behind) {
      crc        := Crc32.next(crc, symbol.data)
      crcWasGood := crcRight
      when(longNow) { longEnough := true.B }
    }.otherwise {
      crc        := Crc32.Start
      longEnough := false.B
    }
  }.elsewhen(cut && inFrame) {
    cutNow := true.B
  }
}

object MiiReceiver {
  private object State extends ChiselEnum {

    /** `faultyStart`: the very first symbol was in error, and the frame that has begun ends; `skip`: the rest
      * of a cut-off frame.
      */
    val idle, preamble, payload, faultyStart, skip = Value
  }
}
