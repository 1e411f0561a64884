package flyframe.relay

import chisel3._
import chisel3.util._
import flyframe.params.CanParams
import flyframe.ram.DualPortRam

/** A frame of the own address that came whole. */
class HomeFrame extends Bundle {
  val kind     = UInt(2.W)
  val leftBy   = UInt(1.W) // the port by which this copy was sent
  val sequence = UInt(14.W)
}

/** What the sender of a port needs of an own frame. */
class OwnHeader(slotBits: Int) extends Bundle {
  val valid    = Bool()
  val isLife   = Bool() // the start of a life
  val slot     = UInt(slotBits.W)
  val sequence = UInt(14.W)
}

/** What the host sets for own frames. */
class OwnSetting extends Bundle {
  val on      = Bool()
  val address = UInt(7.W)
  val life    = UInt(7.W)
  val confirm = UInt(16.W) // units of 10 us
  val retries = UInt(8.W)
  val oneShot = Bool()
}

/** What relay mode counts of own frames, each a pulse. */
class OwnCounts extends Bundle {
  val sent      = Bool()
  val confirmed = Bool()
  val failed    = Bool()
  val repeated  = Bool()
}

/** Own frames on their way: lives, sequences, copies, confirming and repeating (FR-55 to FR-58, FR-61,
  * FR-62).
  *
  * All that has happened within a bit is done by one walk through the list of slots behind its end; at the
  * end of the walk it is known what is next at each port.
  *
  * @param schedule
  *   that of [[PassingOn]]
  */
class OwnFrames(p: CanParams, schedule: Schedule) extends Module {
  import OwnFrames._
  import schedule.{decisions => Decides, rest => Rest}
  import OwnRecord._
  private val slotBits = log2Ceil(p.slots)
  private val Looks    = Decides.map(_ - 2) // the walk is over: keys are looked up

  val setting = IO(Input(new OwnSetting))
  val onNext  = IO(Input(Bool())) // relay mode is on in the next cycle

  /** The node starts anew (RB-13). */
  val restart = IO(Input(Bool()))

  /** 10 us are over; the last cycle of a bit; ports that are up, from the cycle behind it on. */
  val unit = IO(Input(Bool()))
  val tick = IO(Input(Bool()))
  val isUp = IO(Input(Vec(2, Bool())))

  /** A frame came whole by a port, see [[PassingOn]]; it is of the own address, soon behind that. */
  val received = IO(Input(Vec(2, Bool())))
  val home     = IO(Input(Vec(2, Valid(new HomeFrame))))

  /** Slots that wait or are on their way; those that are to be repeated no more. */
  val pending = IO(Input(UInt(p.slots.W)))
  val abort   = IO(Input(UInt(p.slots.W)))

  /** Slots on their way; it is decided what begins; a slot that is done, and whether it was sent. */
  val begun = IO(Output(UInt(p.slots.W)))
  val holds = IO(Output(Bool()))
  val ends  = IO(Output(Valid(UInt(slotBits.W))))
  val sent  = IO(Output(Bool()))

  /** To [[SlotList]]. */
  val walk   = IO(Output(Bool()))
  val coming = IO(Input(UInt(slotBits.W)))
  val nears  = IO(Input(Valid(UInt(slotBits.W)))) // it comes by next
  val entry  = IO(Input(Valid(new ListedSlot(slotBits))))
  val keeps  = IO(Output(Bool()))
  val look   = IO(Output(UInt(slotBits.W)))
  val looked = IO(Input(UInt(SlotList.KeyBits.W)))

  /** To [[PassingOn]]: a frame wants to leave next; its order, in front of the decision. */
  val offer  = IO(Output(Vec(2, Bool())))
  val order  = IO(Output(UInt(SlotList.KeyBits.W)))
  val begins = IO(Input(Vec(2, Bool())))

  /** An own frame is being sent by a port; what it is. */
  val sending = IO(Input(Vec(2, Bool())))
  val leaves  = IO(Output(Vec(2, new OwnHeader(slotBits))))

  val conflict = IO(Output(Bool()))
  val counts   = IO(Output(new OwnCounts))

  // ---- lives and sequences ----

  private object State extends ChiselEnum { val listens, announces, runs = Value }

  // Reset: nothing is known, no frame is on its way.
  private val state      = RegInit(State.listens)
  private val isCounting = RegInit(false.B) // the time of listening
  private val isAhead    = RegInit(false.B) // frames were sent in this life (RB-14)
  private val next       = RegInit(0.U(SequenceWidth.W))
  private val inConflict = RegInit(false.B)
  private val begunMap   = RegInit(0.U(p.slots.W))
  private val aborted    = RegInit(0.U(p.slots.W))
  private val listens    = state === State.listens
  private val announces  = state === State.announces
  // Of the start that is made (RB-30); no reset: first it listens.
  private val life = RegEnable(setting.life, listens)
  aborted := (aborted | (abort & (begunMap | Fill(p.slots, holds)))) & pending

  // ---- when ----

  private val phase = RegInit(Rest.U(5.W)) // cycles since `tick`; reset: nothing is to be done
  when(phase =/= Rest.U) { phase := phase + 1.U }
  when(tick) { phase := 1.U }
  private val isDeciding = RegInit(false.B) // from the first decision on; reset: no
  when(phase === (Decides(0) - 1).U && setting.on) { isDeciding := true.B }
  when(tick || phase === (Rest - 1).U || !setting.on) { isDeciding := false.B }
  walk := phase === Walk.U

  // A restart waits until all is done that follows from a bit: else copies of one frame would get different
  // sequences, or new frames begin in front of the start of the life. Reset: none waits.
  private val isResting = phase === Rest.U
  private val lateStart = RegInit(false.B)
  private val starts    = (restart || lateStart) && isResting
  lateStart := (restart || lateStart) && !isResting && setting.on
  private val nearsFirst = phase === (Walk + 1).U // the start of a life, in front of the list
  private val isFirst    = RegNext(nearsFirst, false.B)

  private val unitSeen = RegInit(false.B) // in this bit; reset: not yet
  private val unitNow  = RegInit(false.B) // in the one behind which we are; reset: likewise
  unitSeen := !tick && (unitSeen || unit)
  when(tick) { unitNow := unitSeen || unit }

  // Ports before and behind what happened to them in this bit.
  private val wereUp = RegInit(VecInit(false.B, false.B)) // reset: down
  private val down   = (0 to 1).map(p => RegNext(wereUp(p) && !isUp(p)))
  private val rises  = (0 to 1).map(p => RegNext(!wereUp(p) && isUp(p)))
  private val alone  = RegNext(!isUp(0) && !isUp(1))

  // What is or was being sent last by each port. Reset: nothing.
  private val leavesReg = RegInit(0.U.asTypeOf(Vec(2, new OwnHeader(slotBits))))
  private val isSending = (0 to 1).map(q => RegNext(sending(q) && leavesReg(q).valid) && !down(q))
  leaves := leavesReg
  when(phase === Looks(0).U) { wereUp := isUp }

  // ---- copies that came home: they count two bits later (RB-22) ----

  private val homes   = Reg(Vec(2, new HomeFrame))
  private val hasHome = RegInit(VecInit(false.B, false.B)) // reset: none
  private val isNew   = RegInit(VecInit(false.B, false.B)) // it has just come
  private val isLate  = RegInit(VecInit(false.B, false.B)) // it came a bit ago
  private val isDue   = RegInit(VecInit(false.B, false.B)) // it is looked at by this walk
  private val isOwn   = RegInit(VecInit(false.B, false.B)) // one that is on its way; reset: none
  for (q <- 0 to 1) {
    when(tick) {
      isDue(q)  := isLate(q)
      isLate(q) := isNew(q)
      isNew(q)  := false.B
    }
    when(received(q)) { isNew(q) := true.B }
    when(phase === Looks(0).U && isDue(q)) { hasHome(q) := false.B }
    when(home(q).valid) {
      homes(q)   := home(q).bits
      hasHome(q) := true.B
    }
  }

  // One behind the other.
  private val isSecond  = RegNext(phase === Judges(0).U)
  private val nearlyDue = Mux(phase === Judges(0).U, homes(1), homes(0))
  private val due       = RegNext(nearlyDue)
  private val isUsed    = Mux(isSecond, hasHome(1) && isDue(1), hasHome(0) && isDue(0)) && !listens
  private val ahead     = RegNext(nearlyDue.sequence - next) // below it by 1 to 16: on its way
  private val isData    = due.kind === LinkKind.Data.U
  private val isLife    = due.kind === LinkKind.Start.U
  private val isBehind  = ahead(SequenceWidth - 1) && ahead(SequenceWidth - 2, SequenceBits).andR
  private val isForeign = Mux(
    isData,
    isAhead && !ahead(SequenceWidth - 1) && !ahead(SequenceWidth - 2, 0).andR,
    isLife && due.sequence =/= life
  )
  for (q <- 0 to 1) when(phase === Judges(q).U) {
    isOwn(q) := isUsed && Mux(announces, isLife, isData && isBehind)
    when(isUsed && isForeign) { inConflict := true.B }
  }

  // ---- the frame that the walk comes by; first the start of a life ----

  private val records = DualPortRam(Words, (new OwnRecord).getWidth)(clock)
  records.io.readAddress := Mux(walk, Life.U, coming)

  // A cycle in front of that it is known which one it is, and its record is there. Behind the walk: the slot
  // that is next at a port.
  private val choice     = Module(new OwnChoice(p))
  private val asked1     = RegNext(phase === (Decides(1) - 1).U && !tick)
  private val chosen     = RegNext(choice.next) // it rests from the end of the walk on
  private val asked      = Mux(asked1, chosen(1).bits, chosen(0).bits)
  private val it         = RegNext(asked)       // it may begin
  private val second     = RegNext(asked1)      // at this port
  private val isPending  = pending(Mux(nears.valid, nears.bits, asked.slot))
  private val isBegun    = begunMap(Mux(nears.valid, nears.bits, it.slot))
  private val listed     = entry.bits.slot
  private val record     = records.io.readData.asTypeOf(new OwnRecord)
  private val was        = RegNext(record)
  private val wasWaiting = RegNext(isPending)
  private val wasBegun   = RegNext(isBegun)
  private val isAborted  = RegNext(aborted(nears.bits))
  private val isOnWay    = Mux(isFirst, announces, wasBegun)
  private val isItSoon =
    leavesReg.map(h => Mux(nearsFirst, h.isLife, !h.isLife && h.slot === nears.bits))
  private val isIt = isItSoon.map(RegNext(_))

  // What a port has begun with the last decision; and that it has got a sequence. Reset: nothing.
  private val began    = RegInit(VecInit(false.B, false.B))
  private val beganNew = RegInit(VecInit(false.B, false.B))
  private val hasBegun = (0 to 1).map(q => RegNext(began(q) && isItSoon(q)))
  private val isBegin  = RegNext((0 to 1).map(q => began(q) && isItSoon(q)).reduce(_ || _))
  private val isNewest = (0 to 1).map(q => beganNew(q) && isItSoon(q)).reduce(_ || _)
  private val isFresh  = RegNext(isNewest)

  // Whether the copies that came home are of it.
  private val latest = (next - 1.U)(SequenceBits - 1, 0)
  private val isTheirs = homes.map { h =>
    val low = h.sequence(SequenceBits - 1, 0)
    RegNext(Mux(isNewest, low === latest, low === record.sequence))
  }

  // What was decided, then ports that have gone down.
  private val r0       = WireDefault(was)
  private val doubling = Mux(was.repeats > MostDoublings.U, MostDoublings.U, was.repeats(2, 0))
  private val confirm  = setting.confirm.pad(LeftBits)
  private val isZero   = Mux(isBegin, setting.confirm === 0.U, was.left === 0.U)
  private val isPast   = !isBegin && was.left.andR
  private val isTime   = isPast || (isZero && unitNow) // when a unit is taken off, all ones are left
  when(isBegin) { r0.left := Mux(isFresh, confirm, (confirm << doubling)(LeftBits - 1, 0)) }
  when(isFresh) {
    r0.sequence := latest
    r0.repeats  := 0.U
    for (q <- 0 to 1) r0.copies(q) := Mux(wereUp(q), Waits.U, None.U)
  }
  private val isUseless = (isAborted && !isFirst) || setting.oneShot ||
    Mux(isFresh, setting.retries === 0.U, was.repeats >= setting.retries)
  // What a copy that is home has told does not hold any more if it is long ago: it goes again, as a repeat.
  // Without one its time runs (RB-29).
  private val isOld = Seq.fill(2)(WireDefault(false.B))
  private def forgets(r: OwnRecord, q: Int): Unit = {
    isOld(q)    := true.B
    r.copies(q) := Mux(isUseless, Sent.U, Waits.U)
  }
  for (q <- 0 to 1) {
    when(hasBegun(1 - q) && was.left.andR && was.copies(q) === Home.U && !isFresh) { forgets(r0, q) }
    when(hasBegun(q)) { r0.copies(q) := Sent.U }
  }
  private val r1 = WireDefault(r0)
  for (q <- 0 to 1) {
    when(rises(q) && r0.copies(q) === None.U) { r1.copies(q) := Waits.U }
    when(down(1 - q) && isTime && r0.copies(q) === Home.U) { forgets(r1, q) }
    when(down(q)) { r1.copies(q) := None.U }
  }
  private val isSent = (0 to 1).map(q => isSending(q) && isIt(q)).reduce(_ || _)
  private val acts   = setting.on && isOnWay && !isSent
  private val isOver = isTime && !r1.copies.map(_ === Waits.U).reduce(_ || _)
  private val again  = setting.on && isOnWay && isOld.reduce(_ || _) && !r0.isHome && !isUseless

  // ---- what becomes of it: in a long schedule a cycle later ----

  private def late[T <: Data](signal: T): T = ShiftRegister(signal, schedule.recordCycles)
  private def lateWalk(comes: Bool): Bool   = ShiftRegister(comes, schedule.recordCycles, false.B, true.B)
  private val r                             = late(r1)
  private val lateFirst                     = lateWalk(isFirst)     // reset: no walk
  private val lateSlot                      = lateWalk(entry.valid) // reset: likewise
  private val lateAborted                   = late(isAborted)
  private val lateActs                      = late(acts)
  private val lateUseless                   = late(isUseless)
  private val lateSent                      = late(isSent)
  private val lateOnWay                     = late(isOnWay)
  private val lateListed                    = late(listed)

  // Copies that came home.
  private val r2   = WireDefault(r)
  private val came = (0 to 1).map(q => isOwn(q) && (lateFirst || late(isTheirs(q))))
  for (q <- 0 to 1) when(came(q) && r.copies(q) === Sent.U) { r2.copies(q) := Home.U }
  private val allRound    = (0 to 1).map(q => came(q) && homes(q).leftBy =/= q.U).reduce(_ || _)
  private val isConfirmed = allRound || late(r0.isHome || r1.isHome) || r2.isHome

  private val expires   = lateActs && !isConfirmed && !alone && !listens && late(isOver) && !inConflict
  private val repeats   = expires && !lateUseless
  private val well      = lateActs && isConfirmed
  private val isWaiting = late(setting.on && !isFirst && !isOnWay && wasWaiting)
  private val isGivenUp = isWaiting && lateAborted
  private val isLost    = isGivenUp || (isWaiting && alone)
  private val fails  = (lateActs && !isConfirmed && (alone || listens)) || (expires && lateUseless) || isLost
  private val isDone = well || fails
  private val isMore = repeats || late(again)
  private val r3     = WireDefault(r2)
  when(isConfirmed) { r3.copies := VecInit(Home.U, Home.U) }
  when(isMore) { r3.repeats := r.repeats + 1.U }
  when(repeats || (lateFirst && listens)) {
    for (q <- 0 to 1) r3.copies(q) := Mux(isUp(q), Waits.U, None.U)
  }
  r3.left := r.left - late(unitNow && !isPast)

  // The node listens; when that is over it tells its life (FR-61).
  private val isListening = setting.on && listens && !alone && setting.address =/= 0.U
  private val tells       = isListening && isCounting && late(isTime) && begunMap === 0.U && !lateSent
  private val lifeWaits   = Reg(Vec(2, Bool()))
  when(lateFirst && listens) {
    r3.repeats := 0.U
    when(!isCounting) { r3.left := setting.confirm ## 0.U(1.W) }
  }
  when(lateFirst) {
    isCounting := isListening
    when(tells) { state := State.announces }
    when(announces && isDone) { state := Mux(alone, State.listens, State.runs) }
    for (q <- 0 to 1) lifeWaits(q) := (tells || (announces && !isDone)) && r3.waits(q)
  }

  keeps            := late(wasWaiting) && !isDone
  ends.valid       := RegNext(lateSlot && isDone && onNext, false.B)
  ends.bits        := RegNext(lateListed)
  sent             := RegNext(well)
  counts.confirmed := ends.valid && sent
  counts.failed    := ends.valid && !sent && !RegNext(isGivenUp)
  counts.repeated  := RegNext((lateSlot || lateFirst) && isMore && setting.on, false.B) // reset: none is

  records.io.write        := lateSlot || lateFirst
  records.io.writeAddress := Mux(lateFirst, Life.U, lateListed)
  records.io.writeData    := r3.asUInt

  // ---- what is next, and begins ----

  choice.begins              := walk
  choice.entry.valid         := lateSlot
  choice.entry.bits.listed   := late(entry.bits)
  choice.entry.bits.kept     := keeps
  choice.entry.bits.begun    := lateOnWay && !isDone
  choice.entry.bits.sequence := r3.sequence
  choice.entry.bits.waits    := VecInit((0 to 1).map(r3.waits))
  choice.mayBegin            := state === State.runs
  choice.nextSequence        := next
  look  := Mux(phase === Looks(0).U, choice.next(0).bits.place, choice.next(1).bits.place)
  order := Mux(Mux(phase === (Looks(0) + 1).U, lifeWaits(0), lifeWaits(1)), 0.U, looked)

  private val isAble    = setting.on && !inConflict && setting.address =/= 0.U && !listens
  private val isLife1   = Mux(second, lifeWaits(1), lifeWaits(0))
  private val nextIsNew = begins.asUInt.orR && !isLife1 && it.isNew && !isBegun
  private val nextLow   = next(SequenceBits - 1, 0)
  private val nextHigh  = next(SequenceWidth - 1, SequenceBits)
  when(phase === Looks(0).U) {
    began    := VecInit(false.B, false.B)
    beganNew := VecInit(false.B, false.B)
  }
  // Of sequences up to 16 below the next one the low bits are known. One that is new may have got the last
  // one in front of this cycle, by the other port.
  private val low      = Mux(it.isNew, nextLow - 1.U, it.sequence)
  private val sequence = Mux(nextIsNew, next, Mux(low >= nextLow, nextHigh - 1.U, nextHigh) ## low)
  for (q <- 0 to 1) {
    val header = leavesReg(q)
    offer(q) := isAble && (lifeWaits(q) || (chosen(q).valid && isPending))
    when(down(q) && phase === Looks(0).U) { header.valid := false.B }
    when(begins(q)) {
      header.valid    := true.B
      header.isLife   := isLife1
      header.slot     := it.slot
      header.sequence := Mux(isLife1, life, sequence)
      began(q)        := true.B
      beganNew(q)     := nextIsNew
    }
  }
  when(nextIsNew) {
    next    := next + 1.U
    isAhead := true.B
  }
  // It is sent once its bit is over: relay mode may end before that (RB-25).
  counts.sent := tick && beganNew.asUInt.orR
  private val oneSlot = UIntToOH(Mux(ends.valid, ends.bits, it.slot), p.slots)
  when(ends.valid) { begunMap := begunMap & ~oneSlot }
  when(nextIsNew) { begunMap := begunMap | oneSlot }

  begun    := begunMap
  holds    := isDeciding
  conflict := inConflict && !lateStart // for the host it is over at once
  when(starts || !setting.on) {
    state      := State.listens
    isCounting := false.B
    inConflict := false.B
    isAhead    := false.B
    next       := 0.U
  }
  when(!setting.on) { // RB-25
    hasHome  := VecInit(false.B, false.B)
    began    := VecInit(false.B, false.B)
    beganNew := VecInit(false.B, false.B)
    begunMap := 0.U
    for (q <- 0 to 1) leavesReg(q).valid := false.B
  }
}

object OwnFrames {

  // Cycles behind the end of a bit: copies that came home; ports have changed, so the walk begins.
  private val Judges = Seq(1, 2)
  private val Walk   = 1

  /** Where the start of a life has its record, behind those of the slots. */
  private val Life          = 16
  private val Words         = 64
  private val SequenceWidth = 14
  private val MostDoublings = 4
}
