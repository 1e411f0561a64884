package flyframe.relay

import chisel3._
import chisel3.util._
import flyframe.can.{EqualBits, SerialCrc}

/** What a receiver tells in the cycle of a sample, each a pulse. */
class LinkEvents extends Bundle {
  val starts     = Bool()
  val header     = Bool() // it is there, and its check right
  val identified = Bool() // so is the identifier
  val good       = Bool() // the frame whose header was told is over, and good
  val bad        = Bool() // or not
  val badHeader  = Bool() // to be counted
  val badFrame   = Bool()
  val byte       = Bool() // another byte is complete, which is not the check
}

/** Reads link frames out of sampled bits (FR-41 to FR-43, FR-45, RB-01 to RB-03). What it has read stands
  * still from one sample to the next.
  */
class LinkReceiver extends Module {
  import LinkReceiver._
  val sample = IO(Input(Valid(Bool())))

  /** The port comes up or goes down. */
  val restart = IO(Input(Bool()))

  /** Own address, to compare the source with. */
  val address = IO(Input(UInt(7.W)))

  /** Edges synchronise hard; the link has no signal (FR-63, RB-04). */
  val idle  = IO(Output(Bool()))
  val stuck = IO(Output(Bool()))

  val events = IO(Output(new LinkEvents))

  /** The last 32 bits, and the number of the byte that is complete, the check left out. */
  val word  = IO(Output(UInt(32.W)))
  val index = IO(Output(UInt(5.W)))

  /** The source is this node. */
  val isOwn = IO(Output(Bool()))

  // Reset: nothing counts before idle.
  private val state      = RegInit(Waits)
  private val recessives = RegInit(0.U(3.W)) // in a row
  private val dominants  = RegInit(0.U(9.W)) // likewise
  private val isStuck    = RegInit(false.B)
  private val broken     = RegInit(false.B)  // with a dominant bit, just now: counts if this is no abort
  private val byCheck    = Reg(Bool())       // a wrong one
  private val run        = Reg(new EqualBits)
  private val count      = Reg(UInt(8.W))    // bits since start, without stuff bits
  private val ends       = Reg(UInt(3.W))    // bits of the end
  private val shift      = Reg(UInt(32.W))
  private val crc8       = Reg(UInt(8.W))
  private val crc32      = Reg(UInt(32.W))
  private val isRemote   = Reg(Bool())
  private val lastByte   = Reg(UInt(5.W))    // its number
  private val own        = Reg(Bool())

  private val takes   = sample.valid
  private val bit     = sample.bits
  private val byteEnd = count(2, 0) === 7.U
  private val byte    = count(7, 3)

  idle   := state === Idle
  stuck  := isStuck
  word   := shift
  isOwn  := own
  index  := byte - Mux(byte > 4.U, 2.U, 1.U) // behind the byte
  events := 0.U.asTypeOf(new LinkEvents)

  // ---- equal bits ----

  private val isSeventh = bit && recessives >= 6.U
  when(takes) {
    recessives := Mux(bit, Mux(recessives === 7.U, 7.U, recessives + 1.U), 0.U)
    dominants  := Mux(bit, 0.U, Mux(dominants === Stuck.U, dominants, dominants + 1.U))
    when(bit || dominants >= (LinkFrame.AbortBits - 1).U) { broken := false.B }
    when(!bit && dominants >= (Stuck - 1).U) { isStuck := true.B }
    when(isSeventh) { isStuck := false.B }
    // An abort was counted where the frame broke first (RB-02).
    when(broken && bit) {
      events.badHeader := byCheck
      events.badFrame  := !byCheck
    }
  }

  // ---- frames ----

  private val inFrame  = state === Header || state === Body
  private val isStuff  = inFrame && run.isFull
  private val isBreak  = takes && isStuff && bit === run.level
  private val takesBit = takes && inFrame && !run.isFull
  private val next8    = Crc8.and(crc8, bit)
  private val next32   = Crc32.and(crc32, bit)
  private val isWhole  = state === Body && byte > lastByte // but for a stuff bit

  private val headerEnds = takesBit && state === Header && count === 39.U
  private val bodyEnds   = takesBit && state === Body && byte === lastByte && byteEnd
  private val isBadBody  = bodyEnds && next32 =/= Residue32.U
  private val isBadEnd   = takes && state === End && !bit
  private val nextRun    = run.and(bit)

  when(takesBit) {
    shift := shift(30, 0) ## bit
    count := count + 1.U
    crc8  := next8
    when(count < 24.U || state === Body) { crc32 := next32 }
    when(count === 9.U) { own := address =/= 0.U && (shift(5, 0) ## bit) === address }
    when(count === 41.U) { isRemote := bit }
    when(count === 79.U) {
      val dlc = shift(2, 0) ## bit
      lastByte := 13.U +& Mux(isRemote, 0.U, Mux(dlc(3), 8.U, dlc))
    }
    when(count === 40.U) { lastByte := 31.U } // none yet
    events.byte := byteEnd && byte =/= 4.U
  }
  when(takes && inFrame) { run := nextRun }
  when(takes && state === Idle && !bit) {
    state         := Header
    run           := EqualBits.start
    count         := 0.U
    crc8          := LinkCrc.Start8.U
    crc32         := "hffffffff".U
    events.starts := true.B
  }
  when(takes && state === Waits && isSeventh) { state := Idle }
  when(headerEnds) {
    state         := Mux(next8 === Residue8.U, Body, Waits)
    events.header := next8 === Residue8.U
    when(next8 =/= Residue8.U) {
      broken           := !bit
      byCheck          := true.B
      events.badHeader := bit
    }
  }
  events.identified := takesBit && state === Body && count === 71.U
  when(bodyEnds && !nextRun.isFull || takes && isStuff && isWhole) {
    state := End
    ends  := 0.U
  }
  when(takes && state === End && bit) {
    ends := ends + 1.U
    when(ends === (LinkFrame.EndBits - 1).U) {
      state       := Idle
      events.good := true.B
    }
  }
  when(isBreak || isBadBody || isBadEnd) {
    state      := Waits
    events.bad := state =/= Header
    when(isBreak && !bit) {
      broken  := true.B
      byCheck := false.B
    }.otherwise { events.badFrame := true.B }
  }
  when(restart) {
    state      := Waits
    recessives := 0.U
    dominants  := 0.U
    broken     := false.B
  }
}

object LinkReceiver {
  private val Waits  = 0.U(3.W)
  private val Idle   = 1.U(3.W)
  private val Header = 2.U(3.W)
  private val Body   = 3.U(3.W)
  private val End    = 4.U(3.W)

  /** Dominant bits after which a link has no signal. */
  private val Stuck = 320

  /** The CRCs of FR-41, and what they are behind their own inverted field. */
  val Crc8: SerialCrc         = SerialCrc(8, 0x2f)
  val Crc32: SerialCrc        = SerialCrc(32, 0x04c11db7L)
  private val Residue8: Int   = Seq.fill(8)(true).foldLeft(0)(LinkCrc.next8)
  private val Residue32: Long = Seq.fill(32)(true).foldLeft(0)(LinkCrc.next32) & 0xffffffffL
}
