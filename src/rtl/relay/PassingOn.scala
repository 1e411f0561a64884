package flyframe.relay

import chisel3._
import chisel3.util._

/** What relay mode counts in passing on, each a pulse. */
class PassingCounts extends Bundle {
  val badHeader = Vec(2, Bool())
  val badFrame  = Vec(2, Bool())
  val stray     = Bool()
  val aborted   = Bool()
  val wrapped   = Bool()
  val passed    = Vec(2, Bool()) // 1 to 2, 2 to 1
}

/** What [[PassingOn]] is made of: a proof has others, which do whatever may be. */
class PassingUnits(schedule: Schedule) {
  def input: LinkInputPins    = new LinkInput
  def sender: LinkSenderPins  = new LinkSender
  def lists: TransitListsPins = new TransitLists(schedule)
  def store: FrameStorePins   = new FrameStore
}

/** The links of a node and the frames that pass (FR-40 to FR-49), ports 0 and 1.
  *
  * What came within a bit is looked at behind its end, by a schedule of core cycles that is over before the
  * next end (RB-19, RB-21): port changes, then what the receivers report, then what leaves.
  *
  * @param schedule
  *   its cycles
  * @param units
  *   what it is made of
  */
class PassingOn(schedule: Schedule, units: PassingUnits) extends Module {
  def this(schedule: Schedule) = this(schedule, new PassingUnits(schedule))

  /** Core cycles of a bit, as many as `schedule` has at least, up to 250. */
  val bitCycles = IO(Input(UInt(8.W)))

  /** Relay mode is on; own address, 0: none. */
  val on      = IO(Input(Bool()))
  val address = IO(Input(UInt(7.W)))

  /** Levels heard and sent, true for recessive; ports that are up; links without signal (FR-63). */
  val heard = IO(Input(Vec(2, Bool())))
  val up    = IO(Input(Vec(2, Bool())))
  val level = IO(Output(Vec(2, Bool())))
  val stuck = IO(Output(Vec(2, Bool())))

  /** The last core cycle of a bit, in which everything counts that follows. */
  val tick = IO(Output(Bool()))

  /** The ports as they count from the cycle behind `tick` on. */
  val isUp = IO(Output(Vec(2, Bool())))

  /** Own frames: one wants to leave by a port next, in the cycle in which that `decides`; its CAN order, in
    * the cycle before. If it begins in the cycle behind that, its bytes are fetched, as those of
    * [[FrameStore]], one at a time.
    */
  val offer   = IO(Input(Vec(2, Bool())))
  val order   = IO(Input(UInt(32.W)))
  val decides = IO(Output(Vec(2, Bool())))
  val begins  = IO(Output(Vec(2, Bool())))
  val fetch   = IO(Output(Vec(2, Valid(UInt(5.W)))))
  val fetched = IO(Input(Vec(2, Valid(UInt(8.W)))))

  /** An own frame is being sent, as it was at the end of the bit that is over. */
  val sending = IO(Output(Vec(2, Bool())))

  /** Pulses: a frame began to come; the identifier of one is there; one has come whole and good, whose bytes
    * can be read until the ninth bit of the next one. Both at once: the frame that is whole was first.
    */
  val starts     = IO(Output(Vec(2, Bool())))
  val identified = IO(Output(Vec(2, Bool())))
  val received   = IO(Output(Vec(2, Bool())))
  val read       = IO(Input(Valid(UInt(5.W))))
  val from       = IO(Input(UInt(1.W)))
  val granted    = IO(Output(Bool()))
  val data       = IO(Output(UInt(8.W)))

  val counts = IO(Output(new PassingCounts))

  protected val inputs: Seq[LinkInputPins]   = Seq.fill(2)(Module(units.input))
  protected val senders: Seq[LinkSenderPins] = Seq.fill(2)(Module(units.sender))
  protected val lists: TransitListsPins      = Module(units.lists)
  private val store                          = Module(units.store)

  // ---- bits and ports ----

  // Another length of bits counts a cycle later. Reset: a bit begins, ports are down.
  private val setting = LinkSetting.of(bitCycles)
  private val renew   = RegNext(bitCycles =/= RegNext(bitCycles), false.B)
  private val cycle   = RegInit(0.U(8.W))
  private val isTick  = RegInit(false.B) // the last cycle of it
  private val isFirst = renew || RegNext(tick, true.B)
  private val upReg   = RegInit(VecInit(false.B, false.B))
  private val upNow   = VecInit((0 to 1).map(p => Mux(isFirst, up(p), upReg(p))))
  private val changed = (0 to 1).map(p => upNow(p) =/= upReg(p))
  upReg := upNow
  private val nextCycle = Mux(tick, 0.U, Mux(renew, 0.U, cycle) + 1.U)
  tick   := !renew && isTick
  isTick := nextCycle === setting.last
  cycle  := nextCycle

  private val phase = RegInit(schedule.rest.U(5.W)) // cycles since `tick`; reset: nothing is to be done
  when(phase =/= schedule.rest.U) { phase := phase + 1.U }
  when(tick) { phase := 1.U }
  private def isPhase(n: Int) = phase === n.U

  for ((input, p) <- inputs.zipWithIndex) {
    input.setting       := setting
    input.renew         := renew
    input.restart       := changed(p)
    input.tick          := tick
    input.rests         := !on
    input.heard         := heard(p) || !upNow(p)
    input.address       := address
    stuck(p)            := input.stuck
    counts.badHeader(p) := input.badHeader
    counts.badFrame(p)  := input.badFrame
  }

  // What the schedule knows of ports and frames. Reset: no port is up, nothing comes or leaves.
  private val isUpReg = RegInit(VecInit(false.B, false.B))
  private val wasUp   = RegInit(VecInit(false.B, false.B)) // at `tick`
  private val comes   = RegInit(VecInit(false.B, false.B)) // a frame with a good header
  private val passes  = RegInit(VecInit(false.B, false.B)) // it is passed on
  private val waits   = RegInit(VecInit(false.B, false.B)) // and is in a list
  private val target  = Reg(Vec(2, UInt(FrameStore.PlaceBits.W)))
  private val leaves  = RegInit(VecInit(false.B, false.B)) // a frame that passes, by an output
  private val wraps = Reg(Vec(2, UInt((TransitLists.Most + 1).W))) // slots whose frame came by the same port
  when(tick) { wasUp := upNow }
  isUp := wasUp

  private def output(p: Int) = target(p)(FrameStore.PlaceBits - 1)

  for (sender <- senders) {
    sender.begin   := false.B
    sender.own     := false.B
    sender.abort   := false.B
    sender.silence := false.B
    sender.step    := tick
  }
  lists.asks     := false.B
  lists.put      := false.B
  lists.ranks    := false.B
  lists.removes  := false.B
  lists.take     := false.B
  lists.drop     := VecInit(false.B, false.B)
  counts.stray   := false.B
  counts.aborted := false.B
  counts.wrapped := false.B
  counts.passed  := VecInit(false.B, false.B)
  received       := VecInit(false.B, false.B)
  starts         := VecInit(false.B, false.B)
  identified     := VecInit(false.B, false.B)
  begins         := VecInit(false.B, false.B)
  store.copies   := 0.U.asTypeOf(store.copies)

  // ---- ports that come up or go down (FR-49, RB-15) ----

  /** The frame that comes by a port turns out bad, or breaks off (FR-47). If it waits it is removed. */
  private def bad(p: Int): Unit = {
    comes(p)  := false.B
    passes(p) := false.B
    for (out <- 0 to 1) when(passes(p) && !waits(p) && output(p) === out.U && leaves(out)) {
      leaves(out)        := false.B
      senders(out).abort := true.B
      counts.aborted     := true.B
    }
  }

  for (p <- 0 to 1) when(isPhase(schedule.changes(p)) && isUpReg(p) =/= wasUp(p)) {
    bad(p)
    isUpReg(p)         := wasUp(p)
    lists.drop(p)      := true.B
    leaves(p)          := false.B
    senders(p).silence := true.B
    for (q <- 0 to 1) when(output(q) === p.U) {
      passes(q) := false.B
      waits(q)  := false.B
    }
  }

  // ---- what came (FR-45, FR-48) ----

  // First what is asked of the lists, then what was answered. A port change and a header are never of one
  // bit: of what waits at most one frame is to be moved or removed.
  private val secondNext = phase >= (schedule.reports(1) - 1).U // in the next cycle
  private val second     = RegNext(secondNext)                  // the port whose frame is meant
  private val report     = Mux(second, inputs(1).report, inputs(0).report)
  private val isOwn      = Mux(second, inputs(1).isOwn, inputs(0).isOwn)
  private val isLast     = Mux(second, inputs(1).isLast, inputs(0).isLast)
  private val meant      = Mux(second, target(1), target(0))
  // The output: of a new frame the other port if that is up, else the same. All rests since the cycle before,
  // but for `isUpReg`, which may change in that one.
  private val to = RegNext(
    Mux(
      Mux(secondNext, inputs(1).report.header, inputs(0).report.header),
      Mux(secondNext, !wasUp(0), wasUp(1)),
      Mux(secondNext, output(1), output(0)).asBool
    )
  )
  private val asks  = schedule.reports.map(isPhase).reduce(_ || _)
  private val tells = schedule.tells.map(isPhase).reduce(_ || _)
  lists.port := second
  lists.it   := meant(TransitLists.SlotBits - 1, 0)
  when(asks) {
    lists.asks    := report.header
    lists.ranks   := report.identified && !report.bad && passes(second) && waits(second)
    lists.removes := waits(second) && (!passes(second) || report.bad)
  }
  private val isFull  = RegEnable(lists.size === TransitLists.Most.U, asks)
  private val canPass = report.header && on && !isOwn
  when(tells && canPass) {
    when(isLast || isFull) { counts.stray := true.B }.otherwise {
      // A frame may be over in the bit in which its header is told: a pulse makes the next sample early.
      lists.put      := !report.bad
      counts.wrapped := to === second
      for (out <- 0 to 1) when(to === (out == 1).B) {
        wraps(out) := wraps(out).bitSet(lists.slot, to === second)
      }
      store.copies.valid := true.B
    }
  }
  store.copies.bits := second
  store.copiesTo    := to ## lists.slot
  for (p <- 0 to 1) when(isPhase(schedule.tells(p))) {
    when(report.header && on) { comes(p) := true.B }
    when(report.bad || report.good || !passes(p)) { waits(p) := false.B }
    when(lists.put) {
      passes(p) := true.B
      waits(p)  := true.B
      target(p) := to ## lists.slot
    }
    when(report.bad) { bad(p) }
    when(report.good && comes(p)) {
      received(p) := true.B
      comes(p)    := false.B
      passes(p)   := false.B
    }
    identified(p) := report.identified && comes(p)
    starts(p)     := report.starts
  }
  // ---- what leaves (FR-44, FR-48, RB-07 to RB-09) ----

  // Cycles of either output, one behind the other. Reset: nothing is decided.
  private val looks             = schedule.looks.map(isPhase)
  private val asked             = schedule.decisions.map(isPhase)
  private val begin             = asked.map(RegNext(_, false.B))
  private val last              = begin(1) // of the outputs
  private val isMany            = lists.size >= LinkFrame.Many.U
  private val silent            = Mux(asked(1), senders(1).quiet, senders(0).quiet)
  private val isUpThen          = Mux(asked(1), isUpReg(1), isUpReg(0))
  private def isQuiet(gap: Int) = silent >= (LinkFrame.EndBits + gap).U
  // What is known a cycle before it is known whether the own frame is the first one.
  private val mayOwn = RegNext(isUpThen && isQuiet(LinkFrame.OwnGap))
  private val wants  = RegNext(offer(asked(1)) && !isMany)
  private val noName = RegNext(lists.known === 0.U)
  private val mayPass = RegNext(
    isUpThen && lists.size =/= 0.U && Mux(isMany, isQuiet(0), isQuiet(LinkFrame.PassingGap))
  )
  // Frames that have passed since the last own one of the second half, up to 127 (RB-28). Reset: none.
  private val passed    = RegInit(VecInit(Seq.fill(2)(0.U(7.W))))
  private val isLate    = passed.map(_.andR)
  private val isSecond  = ShiftRegister(order(TransitLists.KeyBits - 1), 2) // when it begins
  private val isOwnNext = wants && (noName || lists.isBefore)
  private val goes      = on && Mux(isOwnNext, mayOwn, mayPass)
  // What begins with the next bit passes between the ports. Reset: nothing.
  private val passesOn = RegInit(VecInit(false.B, false.B))
  lists.out         := Mux(asked.reduce(_ || _), asked(1), to)
  lists.looks.valid := looks.reduce(_ || _)
  lists.looks.bits  := looks(1)
  lists.order       := TransitLists.inTransit(order, Mux(asked(0), isLate(1), isLate(0)))
  for ((sender, p) <- senders.zipWithIndex) {
    decides(p) := asked(p)
    when(begin(p) && goes) {
      sender.begin := true.B
      sender.own   := isOwnNext
      begins(p)    := isOwnNext
      leaves(p)    := !isOwnNext
      lists.take   := !isOwnNext
      passesOn(p)  := !isOwnNext && !wraps(p)(lists.first)
      passed(p)    := Mux(isOwnNext, Mux(isSecond, 0.U, passed(p)), passed(p) + !isLate(p))
    }
    when(tick) {
      counts.passed(1 - p) := passesOn(p)
      passesOn(p)          := false.B
    }
  }
  for (q <- 0 to 1) when(lists.take && target(q) === last ## lists.first) { waits(q) := false.B }

  // ---- relay mode is off (RB-25) ----

  when(!on) {
    comes      := VecInit(false.B, false.B)
    passes     := VecInit(false.B, false.B)
    waits      := VecInit(false.B, false.B)
    leaves     := VecInit(false.B, false.B)
    passesOn   := VecInit(false.B, false.B)
    passed     := VecInit(0.U, 0.U)
    lists.drop := VecInit(true.B, true.B)
    for (sender <- senders) { sender.silence := true.B }
  }

  // ---- bytes ----

  for ((sender, p) <- senders.zipWithIndex) {
    level(p)               := sender.level
    sending(p)             := sender.isOwn && sender.quiet === 0.U
    fetch(p).valid         := sender.fetch.valid && sender.isOwn
    fetch(p).bits          := sender.fetch.bits
    store.fetch(p).valid   := sender.fetch.valid && !sender.isOwn
    store.fetch(p).bits    := sender.fetch.bits
    store.slot(p)          := p.U(1.W) ## lists.leaving(p)
    sender.byte.valid      := store.fetched(p) || fetched(p).valid
    sender.byte.bits       := Mux(sender.isOwn, fetched(p).bits, store.data)
    store.byte(p)          := inputs(p).byte
    store.index(p)         := inputs(p).index
    store.transit(p).valid := passes(p)
    store.transit(p).bits  := target(p)
    inputs(p).takes        := store.taken(p)
    inputs(p).takesName    := lists.taken(p)
    lists.names(p)         := inputs(p).named
  }
  store.read := read
  store.from := from
  granted    := store.granted
  data       := store.data
}
