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
  private val state    = RegInit(Waits)
  private val equals   = RegInit(0.U(9.W)) // bits of the level of the last one in a row, modulo 512
  private val last     = Reg(Bool())
  private val isStuck  = RegInit(false.B)
  private val broken   = RegInit(false.B)  // with a dominant bit, just now: counts if this is no abort
  private val byCheck  = Reg(Bool())       // a wrong one
  private val count    = Reg(UInt(8.W))    // bits since start, without stuff bits and check
  private val left     = Reg(UInt(5.W))    // bytes behind the one at hand; before the length: enough
  private val isWhole  = Reg(Bool())       // but for a stuff bit
  private val ends     = Reg(UInt(3.W))    // bits of the end
  private val shift    = Reg(UInt(32.W))
  private val crc8     = Reg(UInt(8.W))
  private val crc32    = Reg(UInt(32.W))
  private val isRemote = Reg(Bool())
  private val own      = Reg(Bool())

  private val takes   = sample.valid
  private val bit     = sample.bits
  private val byteEnd = count(2, 0) === 7.U
  private val byte    = count(7, 3)

  idle   := state === Idle
  stuck  := isStuck
  word   := shift
  isOwn  := own
  index  := byte - 1.U // behind the byte
  events := 0.U.asTypeOf(new LinkEvents)

  // ---- equal bits ----

  private val isSame    = bit === last
  private val areSix    = isSame && equals >= 6.U           // and this one
  private val isSeventh = bit && areSix
  private val isFull    = equals(2, 0) === EqualBits.Most.U // within a frame
  private val nextFull  = isSame && equals(2, 0) === (EqualBits.Most - 1).U
  when(takes) {
    last   := bit
    equals := Mux(isSame, equals + 1.U, 1.U)
    when(bit || areSix) { broken := false.B }
    when(!bit && isSame && equals === (Stuck - 1).U) { isStuck := true.B }
    when(isSeventh) { isStuck := false.B }
    // An abort was counted where the frame broke first (RB-02).
    when(broken && bit) {
      events.badHeader := byCheck
      events.badFrame  := !byCheck
    }
  }

  // ---- frames ----

  private val inFrame  = state === Header || state === Body
  private val isStuff  = inFrame && isFull
  private val isBreak  = takes && isStuff && isSame
  private val takesBit = takes && inFrame && !isFull
  private val next8    = Crc8.and(crc8, bit)
  private val next32   = Crc32.and(crc32, bit)

  private val headerEnds = takesBit && state === Header && count === 39.U
  private val bodyEnds   = takesBit && state === Body && left === 0.U && byteEnd
  private val isBadBody  = bodyEnds && next32 =/= Residue32.U
  private val isBadEnd   = takes && state === End && !bit

  when(takesBit) {
    shift := shift(30, 0) ## bit
    count := count + 1.U
    crc8  := next8
    when(count < 24.U || state === Body) { crc32 := next32 }
    when(count === 9.U) { own := address =/= 0.U && (shift(5, 0) ## bit) === address }
    when(state === Body) {
      when(count === 33.U) { isRemote := bit }
      when(byteEnd) {
        val dlc = shift(2, 0) ## bit
        left := Mux(byte === 8.U, 3.U +& Mux(isRemote, 0.U, Mux(dlc(3), 8.U, dlc)), left - (byte > 8.U))
      }
    }
    events.byte := byteEnd && !(state === Header && byte === 4.U)
  }
  when(takes && state === Idle && !bit) {
    state         := Header
    count         := 0.U
    left          := 31.U
    isWhole       := false.B
    crc8          := LinkCrc.Start8.U
    crc32         := "hffffffff".U
    events.starts := true.B
  }
  when(takes && state === Waits && isSeventh) { state := Idle }
  when(headerEnds) {
    state         := Mux(next8 === Residue8.U, Body, Waits)
    count         := 32.U
    events.header := next8 === Residue8.U
    when(next8 =/= Residue8.U) {
      broken           := !bit
      byCheck          := true.B
      events.badHeader := bit
    }
  }
  events.identified := takesBit && state === Body && count === 63.U
  when(bodyEnds) { isWhole := true.B }
  when(bodyEnds && !nextFull || takes && isStuff && isWhole) {
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
    state  := Waits
    equals := 0.U
    broken := false.B
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
