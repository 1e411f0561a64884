package flyframe.can

import chisel3._
import chisel3.util._

/** How a port runs (CAN-40, CAN-42, CB-06). */
class EngineMode extends Bundle {

  /** It takes part, with a possible bit timing. */
  val run           = Bool()
  val listenOnly    = Bool()
  val loopBack      = Bool()
  val recoverItself = Bool()
}

/** The frame on offer (CAN-41): whether there is one, its slot, and its first identifier bit. */
class Offer extends Bundle {
  val valid    = Bool()
  val slot     = UInt(4.W)
  val firstBit = Bool()
}

/** A bus error, as it is recorded (CAN-46). */
class ErrorRecord extends Bundle {
  val bit    = UInt(5.W)
  val field  = UInt(5.W)
  val sender = Bool()
  val kind   = UInt(3.W)
}

/** What happens in the bits of a bus, each a pulse. */
class EngineEvents extends Bundle {

  /** The frame on offer is begun; the attempt to send it is over, well or not. */
  val takes = Bool()
  val ends  = Bool()
  val sent  = Bool()

  /** If an attempt is over in this cycle, that is the stop's doing, not that of a sample. */
  val stops = Bool()

  /** A frame is valid for this node, to be received. */
  val received = Bool()

  val error   = Valid(new ErrorRecord)
  val lost    = Valid(UInt(6.W))
  val goesOff = Bool()

  /** The sample that is taken in this cycle is that of a SOF, if it is dominant. */
  val stamps = Bool()
}

/** The bits of the frame at hand that pass through [[FrameShift]]. */
class FrameBits extends Bundle {

  /** The bit is one of identifier, RTR, SRR, IDE or data; it was heard, and its level. */
  val passes = Bool()
  val shifts = Bool()
  val bit    = Bool()

  /** It was the last one of these in front of the DLC; this node is the sender still. */
  val identifierEnds = Bool()
  val sends          = Bool()

  /** It was the last one of a word of data, or of all data, and of this byte of them. */
  val wordEnds = Bool()
  val dataEnds = Bool()
  val byte     = UInt(3.W)

  /** Of the frame heard. */
  val isExtended = Bool()
  val isRemote   = Bool()
  val dlc        = UInt(4.W)
}

/** Sends and receives frames bit by bit: fields, arbitration, errors, overload frames (CAN-03 to CAN-35). One
  * register, `place`, tells where on the bus the node is; it is the same for sender and receiver.
  *
  * A sample is dealt with in the cycle behind it; the next bit may begin in that cycle. What the bit means is
  * worked out while it is sampled, see [[BitOutlook]].
  *
  * @param firstTec
  *   TEC at the beginning; 0 but in proofs
  * @param isTolerant
  *   a recessive FDF is a protocol exception (CAN-08), else a form error (FB-11)
  */
class ProtocolEngine(firstTec: Int = 0, isTolerant: Boolean = true) extends Module {
  import CanField._

  val mode = IO(Input(new EngineMode))

  /** The pin is to be recessive from the next cycle on (CAN-42, CB-04). */
  val silent = IO(Input(Bool()))

  /** Order to recover from bus-off (CAN-34). */
  val recover = IO(Input(Bool()))

  /** To [[BitTiming]]. */
  val sample   = IO(Input(Valid(Bool())))
  val bitEnds  = IO(Input(Bool()))
  val restarts = IO(Input(Bool()))
  val hard     = IO(Output(Bool()))

  /** What the node says, true for recessive; and what of it leaves by the pin. */
  val level = IO(Output(Bool()))
  val pin   = IO(Output(Bool()))

  /** To and from [[FrameShift]]. The next bit of the own frame, if it is one of those that pass there, and if
    * it is the first one of the second word of data; the DLC of the own frame, when it is there.
    */
  val bits     = IO(Output(new FrameBits))
  val ownBit   = IO(Input(Bool()))
  val ownAhead = IO(Input(Bool()))
  val ownDlc   = IO(Input(Valid(UInt(4.W))))

  val offer  = IO(Input(new Offer))
  val events = IO(Output(new EngineEvents))

  /** [[Confinement]]. */
  val tec     = IO(Output(UInt(9.W)))
  val rec     = IO(Output(UInt(8.W)))
  val warning = IO(Output(Bool()))
  val passive = IO(Output(Bool()))
  val busOff  = IO(Output(Bool()))

  /** Role (CB-13), and whether it takes no part yet. */
  val sending     = IO(Output(Bool()))
  val receiving   = IO(Output(Bool()))
  val integrating = IO(Output(Bool()))

  // Reset: stopped, as without `run`; what has no reset is set when a frame begins.
  private val place    = RegInit(0.U.asTypeOf(new BitPlace))
  private val sender   = RegInit(false.B)
  private val receiver = RegInit(false.B)
  private val attempts = RegInit(false.B)  // the frame of a slot is on the wire
  private val mayJoin  = RegInit(false.B)  // the last bit was the SOF of another (CAN-12)
  private val run      = Reg(new EqualBits)
  private val crc      = Reg(UInt(15.W))
  private val extended = Reg(Bool())
  private val remote   = Reg(Bool())
  private val dlc      = Reg(UInt(4.W))
  private val ackWaits = Reg(Bool())       // a missing ACK counts with a dominant bit in the flag (CAN-31)
  private val recovers = RegInit(false.B)
  private val elevens  = RegInit(0.U(7.W)) // of 128
  private val sampled  = RegNext(sample.valid, false.B)
  private val heard    = RegNext(sample.bits)
  private val crcWrong = RegNext(crc.orR)
  private val ownLevel = RegInit(true.B)
  private val pinLevel = RegInit(true.B)
  private val hardBit  = RegInit(true.B)
  private val maySend  = mode.loopBack || !mode.listenOnly
  private val mayCount = RegNext(maySend)  // when the sample was taken
  private val wasLooped  = RegNext(mode.loopBack)      // likewise
  private val mayRecover = RegNext(mode.recoverItself) // likewise

  // ---- what the bit heard is ----

  // Reset: no frame.
  private val isStuff  = RegNext(run.isFull && (place.isStuffed || place.is(CrcDelimiter)), false.B)
  private val counters = Module(new Confinement(firstTec))
  private val state    = Wire(new BitState)
  private val outlook  = Module(new BitOutlook(isTolerant))
  state.place         := place
  state.sent          := ownLevel
  state.sender        := sender
  state.run           := run
  state.isStuff       := isStuff
  state.crc           := crc(14, 13)
  state.crcIsWrong    := crcWrong
  state.isExtended    := extended
  state.isRemote      := remote
  state.dlc           := dlc
  state.ownBit        := ownBit
  state.ownAhead      := ownAhead
  state.wasLooped     := wasLooped
  state.mayCount      := mayCount
  state.passive       := counters.passive
  state.passiveBehind := counters.passiveBehind
  outlook.state       := state
  outlook.heard       := sample.bits
  private val meaning  = outlook.meaning
  private val verdict  = meaning.verdict
  private val isGood   = sampled && !verdict.error
  private val more     = run.and(heard)
  private val flagOver = more.count === 6.U

  // ---- error counters ----

  private val inPassiveFlag = place.is(PassiveErrorFlag) && !place.behindFlag
  private val isBehindFlag  = place.is(ActiveErrorFlag, PassiveErrorFlag, OverloadFlag) && place.behindFlag
  private val postpones     = verdict.kind === CanError.Ack.U && counters.passive
  private val wrongAsSender = verdict.error && !verdict.stuffInArbitration && !postpones
  private val eighth        = isBehindFlag && !heard && run.count === 7.U
  private val firstBehind   = isBehindFlag && !heard && !place.bit(0) && !place.is(OverloadFlag)
  private val ackCounts     = ackWaits && inPassiveFlag && !heard
  private val counts        = sampled && mayCount // a listener's stand
  private val sent          = isGood && sender && place.is(Eof) && place.bit === 6.U
  private val inVain        = sampled && (verdict.error || verdict.lost)
  private val flagIsWrong   = verdict.error && verdict.inFlag
  counters.steps.tecUp8   := counts && ((sender && (wrongAsSender || eighth)) || ackCounts)
  counters.steps.tecDown1 := counts && sent
  counters.steps.recUp1   := counts && !sender && verdict.error && !verdict.inFlag
  counters.steps.recUp8   := counts && !sender && (flagIsWrong || eighth || firstBehind)
  counters.steps.recDown1 := counts && !sender && place.is(AckSlot) && !verdict.error && !crcWrong
  private val goesOff = counters.busOffNext && !counters.busOff

  // ---- recovery ----

  private val inBusOff  = place.is(BusOff)
  private val goesOn    = inBusOff && (recovers || mayRecover) // to its end, once begun (CB-14)
  private val isEleven  = inBusOff && sampled && heard && place.bit === 10.U
  private val recovered = isEleven && elevens.andR
  counters.clear := recovered
  // An order counts behind the sample of its cycle, which may be the one that leads to bus-off. Reset: none.
  private val ordered = RegNext(recover, false.B) && counters.busOffNext
  when(ordered || (sampled && goesOn)) { recovers := true.B }
  when(isEleven) { elevens := elevens + 1.U }
  when(recovered) { recovers := false.B }

  // ---- the next bit ----

  private val next = WireInit(place)
  when(sampled) {
    when(verdict.error) {
      next := Mux(meaning.level, BitPlace(PassiveErrorFlag), BitPlace(ActiveErrorFlag))
    }.elsewhen(verdict.overload) { next := BitPlace(OverloadFlag) }
      .elsewhen(verdict.exception) { next := BitPlace(Integrating) }
      .elsewhen(!inBusOff || goesOn) { next := meaning.next }
    when(goesOff) { next := BitPlace(BusOff) }
    when(recovered) { next := BitPlace(Idle) }
  }
  when(restarts && next.is(Integrating, BusOff)) { next.bit := 0.U } // CB-03

  private val startsOther = sampled && place.isStart && !heard
  private val runNext     = WireInit(run)
  private val crcNext     = WireInit(crc)
  private val dlcNext     = WireInit(dlc)
  private val isOver      = place.is(Intermission) && place.bit === 2.U // the end of all roles (CB-13)
  private val senderNext  = sender && !(sampled && (verdict.lost || isOver))
  when(sampled) {
    when(verdict.error || verdict.overload) { runNext := EqualBits.none }
      .elsewhen(startsOther) {
        runNext := EqualBits.start
        crcNext := 0.U
      }
      .elsewhen(place.isStuffed || isStuff) {
        runNext := more
        when(!isStuff) { crcNext := SerialCrc.Can.and(crc, heard) }
      }
      .elsewhen(inPassiveFlag) { runNext := Mux(flagOver, EqualBits.none, more) }
      .elsewhen(isBehindFlag) { runNext.count := run.count + 1.U }
    when(!isStuff) {
      when(place.is(RtrOrSrr, Rtr)) { remote := heard }
      when(place.is(Ide)) { extended := heard }
      when(place.is(Dlc)) { dlcNext := dlc(2, 0) ## heard }
    }
    when(startsOther) { extended := false.B }
    when(verdict.error) { ackWaits := postpones }
    when(ackCounts) { ackWaits := false.B }
    sender := senderNext
    when(verdict.lost) { receiver := true.B }
    when(startsOther) { receiver := true.B }
    when(isOver) { receiver := !heard }
    when(verdict.exception || goesOff) {
      sender   := false.B
      receiver := false.B
    }
    when(inVain || sent) { attempts := false.B }
  }
  place := next
  run   := runNext
  crc   := crcNext
  dlc   := dlcNext
  when(ownDlc.valid) { dlc := ownDlc.bits }

  // ---- the level of the next bit, and frames that begin with it (CAN-12, CB-09) ----

  private val joinNext    = (sampled && startsOther && place.is(Intermission)) || mayJoin
  private val becomesIdle = Mux(sampled, (meaning.idles && heard) || recovered, place.isIdle)
  private val begins      = bitEnds && becomesIdle && offer.valid && maySend
  private val joins       = bitEnds && joinNext && offer.valid && maySend && !counters.passive

  private val comes     = RegInit(true.B) // the level behind the sample of this bit; reset: recessive
  private val levelNext = Mux(sampled, meaning.level, comes)
  private val levelNow  = WireInit(ownLevel)

  mayJoin := joinNext && !bitEnds
  when(bitEnds) {
    levelNow := levelNext
    hardBit  := next.isHard
    when(begins) {
      place    := BitPlace(Sof)
      run      := EqualBits.none
      crc      := 0.U
      levelNow := false.B
      hardBit  := false.B
    }
    when(joins) { levelNow := offer.firstBit }
    when(begins || joins) {
      sender   := true.B
      receiver := false.B
      attempts := true.B
      ackWaits := false.B
    }
  }
  comes    := levelNext
  ownLevel := levelNow
  pinLevel := levelNow || silent || !mode.run

  when(!mode.run) { // CB-04
    place    := Mux(counters.busOffNext, BitPlace(BusOff), BitPlace(Integrating))
    sender   := false.B
    receiver := false.B
    attempts := false.B
    mayJoin  := false.B
    elevens  := 0.U
    comes    := true.B
    ownLevel := true.B
    hardBit  := true.B
  }

  // ---- what others see ----

  level := ownLevel
  pin   := pinLevel
  hard  := hardBit

  bits.passes         := !isStuff && (place.isArbitration || place.is(Data))
  bits.shifts         := sampled && bits.passes
  bits.bit            := heard
  bits.identifierEnds := isGood && !isStuff && meaning.next.is(Fdf)
  bits.sends          := senderNext
  bits.wordEnds := isGood && !isStuff && place.is(Data) && place.bit === 7.U &&
    (place.byte === 3.U || meaning.isLastByte)
  bits.dataEnds   := meaning.isLastByte
  bits.byte       := place.byte
  bits.isExtended := extended
  bits.isRemote   := remote
  bits.dlc        := dlc

  events.takes    := begins || joins
  events.sent     := sent
  events.ends     := attempts && (!mode.run || inVain || sent)
  events.stops    := !mode.run && !inVain
  events.received := isGood && place.is(Eof) && place.bit === 5.U && (!sender || wasLooped)
  events.stamps   := place.isStart || place.is(Sof)

  events.error.valid       := sampled && verdict.error
  events.error.bits.kind   := verdict.kind
  events.error.bits.sender := sender
  events.error.bits.field  := place.recorded
  events.error.bits.bit    := place.bit
  events.lost.valid        := sampled && verdict.lost
  events.lost.bits         := place.lostBit
  events.goesOff           := sampled && goesOff

  tec         := counters.tec
  rec         := counters.rec
  warning     := counters.warning
  passive     := counters.passive
  busOff      := counters.busOff
  sending     := sender
  receiving   := receiver
  integrating := place.is(Integrating)
}
