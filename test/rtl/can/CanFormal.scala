package flyframe.can

import chisel3._
import chisel3.util._
import chiseltest._
import chiseltest.formal._
import chiseltest.formal.backends.Engines
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.params.CanParams
import flyframe.ram.DualPortRamIO

/** Samples and ends of bits as [[BitTiming]] may give them at the most: in turn, and as far apart as CB-15
  * has it. All else is free, so that anything may be heard, offered and sent.
  */
abstract class EngineProof(tec: Int) extends Module {
  private val moment    = IO(Input(Bool())) // of a sample or an end
  private val heard     = IO(Input(Bool()))
  private val restarts  = IO(Input(Bool()))
  private val recover   = IO(Input(Bool()))
  private val ownBit    = IO(Input(Bool()))
  private val ownAhead  = IO(Input(Bool()))
  private val ownDlc    = IO(Input(Valid(UInt(4.W))))
  private val offer     = IO(Input(new Offer))
  private val runs      = IO(Input(Bool()))
  private val silences  = IO(Input(Bool()))
  protected val mode    = IO(Input(new EngineMode))
  protected val silent  = !runs || silences // as CanPort has it
  protected val dut     = Module(new ProtocolEngine(tec))
  private val isBehind  = RegInit(false.B)  // the sample of this bit was taken; reset: not
  private val begun     = RegInit(0.U(2.W)) // cycles of this bit, up to 3; reset: none
  private val since     = RegInit(0.U(2.W)) // cycles since the last sample, up to 3; reset: none
  private val samples   = moment && !isBehind && begun === 3.U && since === 3.U
  protected val bitEnds = moment && isBehind
  when(begun =/= 3.U) { begun := begun + 1.U }
  when(since =/= 3.U) { since := since + 1.U }
  when(samples) {
    isBehind := true.B
    since    := 0.U
  }
  when(bitEnds) {
    isBehind := false.B
    begun    := 0.U
  }
  when(!dut.mode.run) {
    isBehind := false.B
    begun    := 0.U
    since    := 0.U
  }
  dut.mode         := mode
  dut.mode.run     := RegNext(runs, false.B) // reset: stopped
  dut.silent       := silent
  dut.sample.valid := samples && dut.mode.run
  dut.sample.bits  := heard
  dut.bitEnds      := bitEnds && dut.mode.run
  dut.restarts     := restarts
  dut.recover      := recover
  dut.ownBit       := ownBit
  dut.ownAhead     := ownAhead
  dut.ownDlc       := ownDlc
  dut.offer        := offer
}

/** Nothing dominant leaves a port that shall be silent, or that is off the bus: from the end of the bit on in
  * which it goes off, until it has recovered. It begins a step before that.
  */
class SilenceProof extends EngineProof(tec = 248) {
  assert(dut.pin || !RegNext(silent, false.B), "a port that is silent drives")

  private val isOff = RegInit(false.B) // a bit has ended since it has gone off; reset: it has not
  when(dut.busOff && bitEnds) { isOff := true.B }
  when(!dut.busOff) { isOff := false.B }
  assert(dut.pin || !isOff || !dut.busOff, "a port that is off the bus drives")
  assert(!(dut.busOff && dut.sending), "a port that is off the bus sends")
}

/** A listener's engine: what it would drive is heard by nobody, its counters stand, and it sends nothing. */
class ListenerProof extends EngineProof(tec = 0) {
  assume(mode.listenOnly && !mode.loopBack)
  assert(!dut.events.takes && !dut.sending, "a listener sends")
  assert(dut.tec === 0.U && dut.rec === 0.U, "a listener counts")
}

/** Any orders of the host and any ends of attempts, as [[PortHost]] and [[ProtocolEngine]] may give them;
  * with relay mode, those of [[flyframe.relay.OwnFrames]], too.
  */
class SlotStatesProof(hasRelay: Boolean) extends Module {
  private val p           = CanParams()
  private val oneShot     = IO(Input(Bool()))
  private val request     = IO(Input(Valid(UInt(4.W))))
  private val abort       = IO(Input(UInt(p.slots.W)))
  private val clearSent   = IO(Input(UInt(p.slots.W)))
  private val clearFailed = IO(Input(UInt(p.slots.W)))
  private val takes       = IO(Input(Valid(UInt(4.W))))
  private val ends        = IO(Input(Bool()))
  private val sent        = IO(Input(Bool()))
  private val dut         = Module(new SlotStates(p, hasRelay))
  dut.oneShot     := oneShot
  dut.request     := request
  dut.abort       := abort
  dut.clearSent   := clearSent
  dut.clearFailed := clearFailed
  dut.takes       := takes
  dut.ends        := ends
  dut.sent        := sent

  // An attempt ends once, behind its beginning; what is requested is not pending, what is taken is.
  private val onWire = RegInit(false.B) // reset: no attempt
  when(ends) { onWire := false.B }
  when(takes.valid) { onWire := true.B }
  dut.relay.foreach(r => when(r.drops) { onWire := false.B }) // the port stops
  assume(!takes.valid || (!onWire && dut.mayBegin(takes.bits)))
  assume(!ends || onWire)
  assume(!takes.valid || !RegNext(ends, false.B)) // an intermission is between them
  assume(!sent || ends)
  assume(!request.valid || !dut.pending(request.bits))

  // One of the slots, any.
  private val any    = IO(Input(UInt(4.W)))
  private val chosen = RegEnable(any, RegNext(false.B, true.B)) // reset: chosen in the first cycle

  // In relay mode there are no attempts. What is sent was on its way; what fails may have been given up while
  // that was found out.
  for (of <- dut.relay) {
    val relay = IO(Input(new RelaySlots(p)))
    val isOn  = RegInit(false.B)                                             // reset: bus mode
    val slot  = relay.ends.bits
    val isNew = request.valid && request.bits === slot
    val was   = RegNext(dut.pending, 0.U(p.slots.W))
    val again = RegNext(relay.ends.valid, false.B) && RegNext(slot) === slot // once in a walk
    of   := relay
    isOn := isOn ^ relay.drops
    assume(!relay.drops || !relay.ends.valid)
    assume(isOn || (!relay.ends.valid && !relay.holds && relay.begun === 0.U))
    assume(!isOn || (!takes.valid && !onWire && !ends))
    assume(!takes.valid || !relay.drops)
    assume((relay.begun & ~dut.pending) === 0.U)
    assume(
      !relay.ends.valid || Mux(
        relay.sent,
        relay.begun(slot),
        dut.pending(slot) || (RegNext(isOn, false.B) && was(slot) && !isNew && !again)
      )
    )
    val isKept = isOn && (relay.begun | Fill(p.slots, relay.holds))(chosen) && dut.pending(chosen) &&
      !relay.drops && !(relay.ends.valid && slot === chosen)
    when(RegNext(isKept && RegNext(isOn, false.B), false.B)) {
      assert(dut.pending(chosen), "a slot that is on its way, or may be, is given up")
    }
  }

  assert((dut.sentAll & dut.failedAll) === 0.U, "a slot was sent and has failed")
  assert((dut.pending & (dut.sentAll | dut.failedAll)) === 0.U, "a slot is pending and over")

  // It is over only behind a request, and with one end of the two.
  private val isOne   = RegNext(true.B, false.B)
  private val isOver  = dut.sentAll(chosen) || dut.failedAll(chosen)
  private val pending = RegNext(dut.pending(chosen), false.B)
  when(isOne && isOver && !RegNext(isOver, false.B) && RegNext(isOne, false.B)) {
    assert(pending, "a slot is over that was not pending")
  }
}

/** A FIFO of two frames, whose words come and go as they like: a frame that was accepted, any, is read as it
  * came until it is released.
  */
class ReceiveFifoProof extends Module {
  private val store   = IO(Input(Valid(UInt(2.W))))
  private val word    = IO(Input(UInt(32.W)))
  private val accept  = IO(Input(Bool()))
  private val second  = IO(Input(UInt(32.W)))
  private val release = IO(Input(Bool()))
  private val read    = IO(Input(UInt(2.W)))
  private val watch   = IO(Input(Bool())) // the frame that is accepted now
  private val frames  = 2
  private val dut     = Module(new ReceiveFifo(frames, newRam))
  private def newRam(depth: Int, width: Int, clock: Clock): DualPortRamIO = {
    val ram = Module(new RegisterRam(depth, width))
    ram.io.clock := clock
    ram.io
  }
  dut.store    := store
  dut.word     := word
  dut.accept   := accept
  dut.second   := second
  dut.releases := release
  dut.read     := read

  // The words of the frame that comes in; all of them have come when it is accepted, and none in that cycle.
  private val words = Reg(Vec(4, UInt(32.W)))
  private val come  = RegInit(0.U(4.W)) // reset: none
  assume(!store.valid || (store.bits =/= 1.U && !accept))
  assume(!accept || come === "b1101".U)
  when(store.valid) {
    words(store.bits) := word
    come              := come | UIntToOH(store.bits)
  }
  when(accept) { come := 0.U }

  private val watched = Reg(Vec(4, UInt(32.W)))
  private val ahead   = Reg(UInt(2.W))    // frames in front of it
  private val isThere = RegInit(false.B)  // reset: none is watched
  private val level   = RegInit(0.U(2.W)) // reset: empty
  private val takes   = accept && level < frames.U
  private val leaves  = release && level =/= 0.U
  level := level + takes - leaves
  assert(dut.level === level, "another level")
  assert(dut.drops === (accept && !takes), "dropped, or not")
  when(leaves && isThere) {
    ahead := ahead - 1.U
    when(ahead === 0.U) { isThere := false.B }
  }
  when(takes && watch && !isThere) {
    isThere    := true.B
    ahead      := level - leaves
    watched    := words
    watched(1) := second
  }
  private val mayRead = RegNext(isThere && ahead === 0.U, false.B)
  when(mayRead && isThere && ahead === 0.U) {
    assert(dut.data === watched(RegNext(read)), "a frame is torn")
  }
}

/** Flip-flops that are as a [[flyframe.ram.DualPortRam]], with contents that are undefined at the beginning.
  */
class RegisterRam(depth: Int, width: Int) extends Module {
  val io            = IO(new DualPortRamIO(depth, width))
  private val words = Reg(Vec(depth, UInt(width.W)))
  io.readData := RegNext(words(io.readAddress))
  when(io.write) { words(io.writeAddress) := io.writeData }
}

class CanFormal extends AnyFlatSpec with ChiselScalatestTester with Formal {
  private def prove(dut: => Module, cycles: Int): Unit = {
    assume(Engines.present, Engines.missing)
    verify(dut, Seq(BoundedCheck(cycles), Engines.boolector))
  }

  // 11 bits until it takes part, SOF, and the error in it, each of four cycles; then some bits off the bus.
  "CAN-34, CAN-42" should "hold: nothing dominant leaves a port that is silent or off the bus" in
    prove(new SilenceProof, 66)

  "CAN-42" should "hold: a listener neither sends nor counts" in prove(new ListenerProof, 66)

  "CAN-40, CB-12" should "hold: a slot is never both sent and failed" in
    prove(new SlotStatesProof(hasRelay = false), 10)
  it should "hold with relay mode, too" in prove(new SlotStatesProof(hasRelay = true), 10)

  "CAN-44" should "hold: no entry of the FIFO is torn" in prove(new ReceiveFifoProof, 16)
}
