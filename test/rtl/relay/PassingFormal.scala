package flyframe.relay

import chisel3._
import chisel3.util._
import chiseltest._
import chiseltest.formal._
import chiseltest.formal.backends.Engines
import flyframe.Tier
import flyframe.can.CanName
import org.scalatest.flatspec.AnyFlatSpec

/** A receiver that reports anything that frames may do (EndProof): of each that has a header it says once
  * that it is good or bad.
  */
private class AnyInput extends LinkInputPins {
  val any = IO(Input(new BitReport))
  val own = IO(Input(Bool()))

  private val told     = RegInit(0.U.asTypeOf(new BitReport)) // reset: nothing came
  private val isOwnReg = RegInit(false.B)
  private val inFrame  = RegInit(false.B)                     // behind a header. Reset: no frame
  private val before   = inFrame && !restart
  inFrame := before
  when(tick) {
    assume(!(any.header && before))
    assume(!(any.bad || any.good) || before || any.header)
    assume(!any.good || !(any.bad || any.header))
    assume(!any.identified || before)
    told     := any
    isOwnReg := own
    inFrame  := (before || any.header) && !any.bad && !any.good
  }
  when(rests) {
    told    := 0.U.asTypeOf(new BitReport)
    inFrame := false.B
  }
  report    := told
  isOwn     := isOwnReg
  isLast    := false.B
  stuck     := false.B
  named     := 0.U.asTypeOf(Valid(new CanName))
  byte      := 0.U.asTypeOf(Valid(UInt(8.W)))
  index     := 0.U
  badHeader := false.B
  badFrame  := false.B
}

/** A sender whose frames take as long as they like; of one that is still coming it is behind (FR-46). */
private class AnySender extends LinkSenderPins {
  val ends   = IO(Input(Bool()))
  val silent = IO(Input(UInt(5.W)))

  private val busyReg  = RegInit(false.B) // reset: idle
  private val ownReg   = RegInit(false.B)
  private val quietReg = RegInit(0.U(5.W))
  when(step) {
    quietReg := Mux(busyReg && !ends, 0.U, silent)
    when(ends) { busyReg := false.B }
  }
  when(begin) {
    busyReg := true.B
    ownReg  := own
    assert(!busyReg && quietReg >= LinkFrame.EndBits.U && !abort, "a frame begins without a gap")
  }
  when(abort || silence) {
    busyReg  := false.B
    quietReg := 0.U
  }
  level := true.B
  quiet := Mux(busyReg, 0.U, quietReg)
  busy  := busyReg
  isOwn := ownReg
  fetch := 0.U.asTypeOf(Valid(UInt(5.W)))
}

/** Lists that give any slot that is free, and let any go that waits (TransitListsSpec). */
private class AnyLists extends TransitListsPins {
  import TransitLists._
  val slots = IO(Input(UInt(SlotBits.W)))
  val goes  = IO(Input(UInt(SlotBits.W)))
  val knows = IO(Input(UInt(CountBits.W)))

  /** What waits. */
  val waiting = IO(Output(Vec(2, UInt((Most + 1).W))))

  // More do not come together in so few bits.
  private val Few = 4

  private val lists    = RegInit(VecInit(Seq.fill(2)(0.U((Most + 1).W)))) // reset: nothing waits
  private val leavings = RegInit(VecInit(Seq.fill(2)(Most.U(SlotBits.W))))
  private val outThen  = RegNext(out)
  private val outAsked = RegEnable(out, asks) // no reset: nothing is put that was not asked for
  when(put) {
    assert(out === outAsked, "a slot is put into another list than was asked")
    assume(slots < Few.U && !lists(out)(slots) && slots =/= leavings(out))
    lists(out) := lists(out).bitSet(slots, true.B)
  }
  when(removes || ranks) { assert(lists(out)(it), "what is moved does not wait") }
  when(removes) { lists(out) := lists(out).bitSet(it, false.B) }
  when(take) {
    assume(goes < Few.U && lists(outThen)(goes))
    lists(outThen)    := lists(outThen).bitSet(goes, false.B)
    leavings(outThen) := goes
  }
  for (p <- 0 to 1) when(drop(p)) { lists(p) := 0.U }
  taken    := VecInit(false.B, false.B)
  size     := PopCount(lists(out))
  known    := knows
  isBefore := knows(0)
  first    := goes
  slot     := slots
  leaving  := leavings
  waiting  := lists
}

/** No bytes: what is in a frame does not matter here. */
private class NoStore extends FrameStorePins {
  taken   := VecInit(false.B, false.B)
  fetched := VecInit(false.B, false.B)
  granted := false.B
  data    := 0.U
}

/** What [[PassingOn]] orders, when receivers, senders and lists do anything that they may: what dies while it
  * leaves is ended in the same bit, and nothing else is; what dies while it waits never leaves (FR-47).
  */
class PassingProof(schedule: Schedule)
    extends PassingOn(
      schedule,
      new PassingUnits(schedule) {
        override def input  = new AnyInput
        override def sender = new AnySender
        override def lists  = new AnyLists
        override def store  = new NoStore
      }
    ) {
  private val reports = IO(Input(Vec(2, new BitReport)))
  private val own     = IO(Input(Vec(2, Bool())))
  private val ends    = IO(Input(Vec(2, Bool())))
  private val quiets  = IO(Input(Vec(2, UInt(5.W))))
  private val slots   = IO(Input(UInt(TransitLists.SlotBits.W)))
  private val chosen  = IO(Input(UInt(TransitLists.SlotBits.W)))
  private val names   = IO(Input(UInt(TransitLists.CountBits.W)))
  private val any     = lists.asInstanceOf[AnyLists]
  any.slots := slots
  any.goes  := chosen
  any.knows := names
  for (p <- 0 to 1) {
    val input  = inputs(p).asInstanceOf[AnyInput]
    val sender = senders(p).asInstanceOf[AnySender]
    input.any     := reports(p)
    input.own     := own(p)
    sender.ends   := ends(p)
    sender.silent := quiets(p)
  }
  assume(bitCycles === schedule.rest.U)

  // Two writes of a host are not in one cycle and the next but one. Reset: off.
  private val wasOn    = RegNext(on, false.B)
  private val wasOnToo = RegNext(wasOn, false.B)
  assume(!(on && !wasOn && wasOnToo))

  /** The frame that comes by a port: where it is, as the orders say. Reset: none comes. */
  private object State extends ChiselEnum {
    val none, waits, leaves, dead = Value // dead: to be removed before anything leaves
  }
  private val state = RegInit(VecInit(Seq.fill(2)(State.none)))
  private val place = Reg(Vec(2, UInt((1 + TransitLists.SlotBits).W)))
  private val phase = RegInit(schedule.rest.U(5.W))      // reset: as the schedule's own
  private val last  = RegInit(VecInit(false.B, false.B)) // ports as the schedule knows them
  when(phase =/= schedule.rest.U) { phase := phase + 1.U }
  when(tick) { phase := 1.U }

  private val outThen                  = RegNext(any.out)
  private def output(q: Int)           = place(q)(TransitLists.SlotBits)
  private def waitsIn(q: Int)          = any.waiting(output(q))(place(q)(TransitLists.SlotBits - 1, 0))
  private def isTaken(q: Int)          = any.take && place(q) === outThen ## any.first
  private def isTold(q: Int)           = phase === schedule.tells(q).U
  private def isBad(q: Int)            = isTold(q) && inputs(q).report.bad
  private def changes(q: Int)          = phase === schedule.changes(q).U && last(q) =/= isUp(q)
  private def ended(o: Int)            = senders(o).abort || senders(o).silence
  private def leavesBy(q: Int, o: Int) = state(q) === State.leaves && output(q) === o.U

  for (q <- 0 to 1) {
    val dies = isBad(q) || changes(q)
    for (o <- 0 to 1) {
      when(dies && leavesBy(q, o)) { assert(ended(o), "a frame that dies goes on") }
      // What is still coming has not left as a whole.
      assume(!(ends(o) && leavesBy(q, o)))
    }
    when(isBad(q) && state(q) === State.waits) { assert(!waitsIn(q), "a bad frame still waits") }
    when(state(q) === State.dead) { assert(!isTaken(q), "a dead frame leaves") }

    when(state(q) === State.waits && isTaken(q)) { state(q) := State.leaves }
    when(state(q) === State.dead && !waitsIn(q)) { state(q) := State.none }
    when(isTold(q) && inputs(q).report.good) { state(q) := State.none }
    when(isTold(q) && any.put) {
      state(q) := State.waits
      place(q) := any.out ## any.slot
    }
    when(dies) { state(q) := Mux(state(q) === State.waits && waitsIn(q), State.dead, State.none) }
    for (p <- 0 to 1) when(changes(p) && output(q) === p.U) { state(q) := State.none }
    when(changes(q)) { last(q) := isUp(q) }
    when(!on) { state(q) := State.none }
  }
  for (o <- 0 to 1) when(senders(o).abort) {
    assert(
      (0 to 1).map(q => leavesBy(q, o) && (isBad(q) || changes(q))).reduce(_ || _),
      "another frame is ended"
    )
  }
}

class PassingFormal extends AnyFlatSpec with ChiselScalatestTester with Formal {
  private val cycles = Tier("proof of what dies in passing", "core cycles", test = 65, soak = 90)

  // Behind a schedule of 100 MHz, and of 50 MHz: the sequence of orders is the same.
  for (isLong <- if (Tier.isSoak) Seq(true, false) else Seq(true)) {
    val schedule = Schedule(isLong)
    s"FR-47, bits of ${schedule.rest} cycles" should
      "hold: what dies as it leaves is ended, nothing else is; what dies before never leaves" in {
        assume(Engines.present, Engines.missing)
        cycles.run(s"bits of ${schedule.rest} cycles", cycles.size) {
          verify(new PassingProof(schedule), Seq(BoundedCheck(cycles.size.toInt), Engines.boolector))
        }
      }
  }
}
