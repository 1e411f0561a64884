package flyframe.relay

import chisel3._
import chisel3.util._
import flyframe.ram.DualPortRam

/** What relay mode counts in passing on, each a pulse. */
class PassingCounts extends Bundle {
  val badHeader = Vec(2, Bool())
  val badFrame  = Vec(2, Bool())
  val stray     = Bool()
  val aborted   = Bool()
  val wrapped   = Bool()
  val passed    = Vec(2, Bool()) // 1 to 2, 2 to 1
}

/** The links of a node and the frames that pass (FR-40 to FR-49), ports 0 and 1.
  *
  * What came within a bit is looked at behind its end, by a schedule of core cycles that is over before the
  * next end (RB-19, RB-21): port changes, then what the receivers report, then what leaves.
  */
class PassingOn extends Module {
  import PassingOn._

  /** Core cycles of a bit, 25 to 250. */
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

  /** The ports as they count; they change in front of all else. */
  val isUp = IO(Output(Vec(2, Bool())))

  /** Own frames: one wants to leave by a port next, and its CAN order. It is looked at in the cycles of
    * `decides`; if it begins then, its bytes are fetched, as those of [[FrameStore]], one at a time.
    */
  val offer   = IO(Input(Vec(2, Valid(UInt(32.W)))))
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

  private val inputs  = Seq.fill(2)(Module(new LinkInput))
  private val senders = Seq.fill(2)(Module(new LinkSender))
  private val lists   = Seq.fill(2)(Module(new TransitList))
  private val store   = Module(new FrameStore)
  private val keys    = DualPortRam(1 << FrameStore.PlaceBits, 32)(clock)

  // ---- bits and ports ----

  // Reset: a bit begins, ports are down.
  private val cycle   = RegInit(0.U(8.W))
  private val renew   = bitCycles =/= RegNext(bitCycles, 0.U)
  private val isFirst = renew || cycle === 0.U
  private val place   = Mux(renew, 0.U, cycle)
  private val upReg   = RegInit(VecInit(false.B, false.B))
  private val upNow   = VecInit((0 to 1).map(p => Mux(isFirst, up(p), upReg(p))))
  private val changed = (0 to 1).map(p => upNow(p) =/= upReg(p))
  upReg := upNow
  tick  := place === bitCycles - 1.U
  cycle := Mux(tick, 0.U, place + 1.U)

  private val phase = RegInit(Rest.U(5.W)) // cycles since `tick`; reset: nothing is to be done
  when(phase =/= Rest.U) { phase := phase + 1.U }
  when(tick) { phase := 1.U }
  private def isPhase(n: Int) = phase === n.U

  private val setting = LinkSetting.of(bitCycles)
  for ((input, p) <- inputs.zipWithIndex) {
    input.setting       := setting
    input.renew         := renew
    input.restart       := changed(p)
    input.tick          := tick
    input.heard         := heard(p) || !upNow(p)
    input.address       := address
    stuck(p)            := input.stuck
    counts.badHeader(p) := input.badHeader
    counts.badFrame(p)  := input.badFrame
  }

  // What the schedule knows of ports and frames. Reset: no port is up, nothing comes or leaves.
  private val isUpReg = RegInit(VecInit(false.B, false.B))
  private val wasUp   = Reg(Vec(2, Bool()))                         // at `tick`
  private val comes   = RegInit(VecInit(false.B, false.B))          // a frame with a good header
  private val passes  = RegInit(VecInit(false.B, false.B))          // it is passed on
  private val target  = Reg(Vec(2, UInt(FrameStore.PlaceBits.W)))
  private val leaves  = RegInit(VecInit(false.B, false.B))          // a frame that passes, by an output
  private val wraps   = Reg(Vec(2, UInt((TransitList.Most + 1).W))) // slots whose frame came by the same port
  when(tick) { wasUp := upNow }
  isUp := isUpReg

  private def output(p: Int)         = target(p)(FrameStore.PlaceBits - 1)
  private def slotOf(p: Int)         = target(p)(TransitList.SlotBits - 1, 0)
  private def goes(p: Int, out: Int) = passes(p) && output(p) === out.U

  for (list <- lists) {
    list.put    := false.B
    list.ranks  := 0.U.asTypeOf(list.ranks)
    list.remove := false.B
    list.take   := false.B
    list.drop   := false.B
  }
  for (sender <- senders) {
    sender.begin   := false.B
    sender.own     := false.B
    sender.abort   := false.B
    sender.silence := false.B
    sender.step    := tick
  }
  counts.stray   := false.B
  counts.aborted := false.B
  counts.wrapped := false.B
  counts.passed  := VecInit(false.B, false.B)
  received       := VecInit(false.B, false.B)
  starts         := VecInit(false.B, false.B)
  identified     := VecInit(false.B, false.B)
  begins         := VecInit(false.B, false.B)
  store.copies   := 0.U.asTypeOf(store.copies)

  // The port whose frame is meant: the first one up to the middle of the schedule.
  private val isSecond = phase >= Reports(1).U || isPhase(Changes(1))
  for (list <- lists) list.slot := Mux(isSecond, slotOf(1), slotOf(0))

  /** The frame that comes by a port turns out bad, or breaks off (FR-47). */
  private def bad(p: Int): Unit = when(comes(p)) {
    comes(p)  := false.B
    passes(p) := false.B
    for ((list, out) <- lists.zipWithIndex) when(goes(p, out)) {
      list.remove := true.B
      when(!list.waits && leaves(out) && list.leaving === slotOf(p)) {
        leaves(out)        := false.B
        senders(out).abort := true.B
        counts.aborted     := true.B
      }
    }
  }

  // ---- ports that come up or go down (FR-49, RB-15) ----

  for (p <- 0 to 1) when(isPhase(Changes(p)) && isUpReg(p) =/= wasUp(p)) {
    bad(p)
    isUpReg(p)         := wasUp(p)
    lists(p).drop      := true.B
    leaves(p)          := false.B
    senders(p).silence := true.B
    for (q <- 0 to 1) when(output(q) === p.U) { passes(q) := false.B }
  }

  // ---- what came (FR-45, FR-48) ----

  private val searches = RegInit(false.B) // for the place of a frame; reset: it does not
  private val looked =
    phase - Mux(isSecond, (Reports(1) + 1).U, (Reports(0) + 1).U) // the place that is looked at
  private val order = Mux(isSecond, inputs(1).order, inputs(0).order)
  private val out   = Mux(isSecond, output(1), output(0))
  private val known = Mux(out.asBool, lists(1).known, lists(0).known)
  // By the other port if that is up, else back; and where.
  private val outputs = Seq(isUpReg(1), !isUpReg(0)).map(_.asUInt)
  private val places  = outputs.map(n => n ## Mux(n.asBool, lists(1).fresh, lists(0).fresh))
  private val isPlace = looked(3, 0) === known || order < keys.io.readData
  for (p <- 0 to 1; report = inputs(p).report) {
    when(isPhase(Reports(p))) {
      when(report.header && on) {
        comes(p) := true.B
        for ((list, n) <- lists.zipWithIndex) when(outputs(p) === n.U && !inputs(p).isOwn) {
          when(inputs(p).isLast || list.size === TransitList.Most.U) { counts.stray := true.B }.otherwise {
            passes(p)          := true.B
            target(p)          := places(p)
            list.put           := true.B
            counts.wrapped     := (n == p).B
            wraps(n)           := wraps(n).bitSet(list.fresh, (n == p).B)
            store.copies.valid := true.B
          }
        }
      }
      searches := report.identified && !report.bad && passes(p)
    }
    when(isPhase(Reports(p) + 1)) {
      when(report.bad) { bad(p) }
      when(report.good && comes(p)) {
        received(p) := true.B
        comes(p)    := false.B
        passes(p)   := false.B
      }
      identified(p) := report.identified && comes(p)
      starts(p)     := report.starts
    }
  }
  store.copies.bits := isSecond
  store.copiesTo    := Mux(isSecond, places(1), places(0))
  when(searches && !isPhase(Reports(0)) && !isPhase(Reports(1)) && isPlace) {
    searches := false.B
    for ((list, n) <- lists.zipWithIndex) when(out === n.U) {
      list.ranks.valid := true.B
      list.ranks.bits  := looked
    }
  }
  keys.io.write        := searches && isPlace
  keys.io.writeAddress := Mux(isSecond, target(1), target(0))
  keys.io.writeData    := order

  // ---- what leaves (FR-44, FR-48, RB-07 to RB-09) ----

  for ((list, p) <- lists.zipWithIndex) {
    val isOwn = offer(p).valid && list.size < LinkFrame.Many.U &&
      (list.known === 0.U || offer(p).bits < keys.io.readData)
    val gap = Mux(
      isOwn,
      (LinkFrame.EndBits + LinkFrame.OwnGap).U,
      LinkFrame.EndBits.U +& (list.size < LinkFrame.Many.U) * LinkFrame.PassingGap.U
    )
    decides(p) := isPhase(Decisions(p))
    when(decides(p) && on && isUpReg(p) && (isOwn || list.size =/= 0.U) && senders(p).quiet >= gap) {
      senders(p).begin     := true.B
      senders(p).own       := isOwn
      begins(p)            := isOwn
      leaves(p)            := !isOwn
      list.take            := !isOwn
      counts.passed(1 - p) := !isOwn && !wraps(p)(list.slots(0))
    }
  }

  // The key that is looked at in the next cycle.
  private val next  = looked + 1.U
  private val asked = Mux(isPhase(Reports(0)) || isPhase(Reports(1)), 0.U, next(2, 0))
  keys.io.readAddress := Mux(
    phase >= (Decisions(0) - 1).U,
    Mux(isPhase(Decisions(0) - 1), 0.U(1.W) ## lists(0).slots(0), 1.U(1.W) ## lists(1).slots(0)),
    out ## Mux(out.asBool, lists(1).slots(asked), lists(0).slots(asked))
  )

  // ---- relay mode is off (RB-25) ----

  when(!on) {
    comes  := VecInit(false.B, false.B)
    passes := VecInit(false.B, false.B)
    leaves := VecInit(false.B, false.B)
    for (list   <- lists) { list.drop := true.B }
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
    store.slot(p)          := p.U(1.W) ## lists(p).leaving
    sender.byte.valid      := store.fetched(p) || fetched(p).valid
    sender.byte.bits       := Mux(sender.isOwn, fetched(p).bits, store.data)
    store.byte(p)          := inputs(p).byte
    store.index(p)         := inputs(p).index
    store.transit(p).valid := passes(p)
    store.transit(p).bits  := target(p)
    inputs(p).takes        := store.taken(p)
  }
  store.read := read
  store.from := from
  granted    := store.granted
  data       := store.data
}

object PassingOn {

  // The schedule, in core cycles behind the end of a bit; each report takes nine, for up to eight keys.
  private val Changes   = Seq(1, 2)
  private val Reports   = Seq(3, 12)
  private val Decisions = Seq(22, 23)
  private val Rest      = 24
}
