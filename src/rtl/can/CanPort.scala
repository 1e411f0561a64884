package flyframe.can

import chisel3._
import chisel3.util._
import flyframe.memory.HostPort
import flyframe.params.CanParams
import flyframe.ram.{DualPortRam, RamUse}

/** What a host may want to be told, each a pulse. */
class PortEvents extends Bundle {
  val received = Bool()
  val slotDone = Bool()
  val state    = Bool()
  val busError = Bool()
  val overrun  = Bool()
}

/** The nominal bit of a port: core cycles of a quantum, less one, and quanta. */
class NominalBit extends Bundle {
  val prescaler = UInt(11.W)
  val quanta    = UInt(7.W)
}

/** Relay mode, as it uses the slots, filters and FIFO of a port; from its side. While it is on, the port's
  * engine rests.
  */
class RelaySide(p: CanParams) extends Bundle {
  private val slotBits = log2Ceil(p.slots)
  val on               = Output(Bool())

  /** A slot that is to become pending, until it is `appended`, as in [[SlotOrder]]. */
  val append   = Input(Valid(UInt(slotBits.W)))
  val appended = Output(Bool())
  val pending  = Input(UInt(p.slots.W))
  val abort    = Input(UInt(p.slots.W))
  val oneShot  = Input(Bool())

  /** The block RAM in which [[SlotOrder]] has its list in bus mode. */
  val list  = new RamUse(SlotOrder.words(p), RelaySide.listBits(p))
  val slots = Output(new RelaySlots(p))

  /** A slot's time stamp is to be written, until it is `stamped`. */
  val stamp   = Output(Valid(UInt(slotBits.W)))
  val time    = Output(UInt(16.W))
  val stamped = Input(Bool())

  /** Reads of [[PortMemory]]: a word of a slot at once, and its identifier word when there is room. */
  val load       = Output(Valid(UInt((slotBits + 2).W)))
  val order      = Output(Valid(UInt(slotBits.W)))
  val orderReady = Input(Bool())
  val data       = Input(UInt(32.W))

  /** To [[AcceptanceFilter]]. */
  val start      = Output(Bool())
  val identifier = Output(UInt(32.W))
  val done       = Input(Bool())
  val matches    = Input(Bool())
  val entry      = Input(UInt(log2Ceil(p.filters).W))

  /** To [[ReceiveFifo]]. */
  val store  = Output(Valid(UInt(2.W)))
  val word   = Output(UInt(32.W))
  val accept = Output(Bool())
  val second = Output(UInt(32.W))
  val drops  = Input(Bool())

  /** No frame may be stored now. */
  val busy = Option.when(p.bridge)(Input(Bool()))
}

object RelaySide {

  /** Bits of a word of its list of slots: a key and a slot. */
  def listBits(p: CanParams): Int = 32 + log2Ceil(p.slots)
}

/** A CAN controller with its slots, filters and FIFO (CAN-01 to CAN-46). It only connects.
  *
  * @param port
  *   0 or 1: whose addresses its registers have
  * @param hasRelay
  *   relay mode uses it, too
  * @param isTolerant
  *   a recessive FDF is a protocol exception (CAN-08); on the ring it is a form error (FB-11)
  * @param countersAt
  *   first address of `counters`
  * @param counters
  *   of others, in words that its memory has room for
  */
class CanPort(
    p: CanParams,
    port: Int,
    hasRelay: Boolean = false,
    isTolerant: Boolean = true,
    countersAt: Int = 0,
    counters: Seq[WordCounter] = Nil
) extends Module {

  /** Levels, true for recessive: of the bus, in the clock of this module, and what is driven. */
  val rx = IO(Input(Bool()))
  val tx = IO(Output(Bool()))

  /** The low half of the us counter. */
  val time = IO(Input(UInt(16.W)))

  val host   = IO(new HostPort(4))
  val events = IO(Output(new PortEvents))

  /** As the host has set it; valid if it is possible. */
  val bit = IO(Output(Valid(new NominalBit)))

  /** Something has happened that `counters` count. */
  val counts: Option[Vec[Bool]] = Option.when(counters.nonEmpty)(IO(Input(Vec(counters.size, Bool()))))

  val relay: Option[RelaySide] =
    Option.when(hasRelay)(IO(Flipped(new RelaySide(p))).suggestName("relay"))

  /** Frames to and from the other port, if there may be a bridge. */
  val bridgeFrom: Option[BridgeFrom] = Option.when(p.bridge)(IO(new BridgeFrom(p, waits = hasRelay)))
  val bridgeInto: Option[BridgeInto] = Option.when(p.bridge)(IO(new BridgeInto(p)))

  /** What relay mode says, if there is one and it is on. */
  private def relayed[T <: Data](own: T)(of: RelaySide => T): T = relay.fold(own)(r => Mux(r.on, of(r), own))

  private val timing    = Module(new BitTiming)
  private val engine    = Module(new ProtocolEngine(isTolerant = isTolerant))
  private val shift     = Module(new FrameShift)
  private val order     = Module(new SlotOrder(p))
  private val orderBits = if (hasRelay) RelaySide.listBits(p) else log2Ceil(p.slots)
  private val orderRam  = DualPortRam(SlotOrder.words(p), orderBits)(clock)
  private val states    = Module(new SlotStates(p, hasRelay))
  private val words     = Option.when(counters.nonEmpty)(Module(new WordCounters(counters)))
  private val memory    = Module(new PortMemory(Seq(words.nonEmpty, p.bridge).count(identity) + 3))
  private val filter    = Module(new AcceptanceFilter(p))
  private val fifo      = Module(new ReceiveFifo(p.rxFrames, hasBridge = p.bridge))
  private val recorder  = Module(new EventRecorder(p.bridge))
  private val front     = Module(new PortHost(p, port, words.map(_ => countersAt)))
  private val control   = front.control
  private val happens   = engine.events

  // ---- bits ----

  private val impossible = BitTiming.isImpossible(front.timing, control.threeSamples)
  private val runs       = control.run && !impossible && !relay.fold(false.B)(_.on)
  bit.valid          := !impossible
  bit.bits.prescaler := front.timing.prescaler
  bit.bits.quanta    := RegNext(front.timing.tseg1 +& front.timing.tseg2 + 3.U) // no reset: nothing is valid

  // What the host writes in a cycle counts for the bus from the next one on. Reset: as the registers.
  private val mode       = RegNext(control, 0.U.asTypeOf(control))
  private val isListener = mode.listenOnly && !mode.loopBack
  timing.setting      := front.timing
  timing.threeSamples := mode.threeSamples
  timing.run          := engine.mode.run
  timing.heard        := Mux(mode.loopBack, engine.level, rx && (engine.level || !isListener))
  timing.hard         := engine.hard
  timing.dominant     := !engine.level

  engine.mode.run           := RegNext(runs, false.B) // reset: stopped
  engine.mode.listenOnly    := mode.listenOnly
  engine.mode.loopBack      := mode.loopBack
  engine.mode.recoverItself := mode.recoverItself
  engine.silent             := !runs || control.listenOnly || control.loopBack
  engine.recover            := front.orders.recover
  engine.sample             := timing.sample
  engine.bitEnds            := timing.ends
  engine.restarts           := timing.restarts
  tx                        := engine.pin

  private val sofTime = Reg(UInt(16.W)) // CAN-45; no reset: a frame begins with its SOF
  when(timing.sample.valid && happens.stamps) { sofTime := time }

  // ---- frames to send ----

  // Whoever has begun to append a slot goes on until it is appended: the host, or a bridge, in turns, as in
  // relay mode a slot takes a bit or two, and the host may request all of them. Reset: the host.
  private val appended = relayed(order.appended)(_.appended)
  private val ofBridge = bridgeInto.fold(false.B) { b =>
    val turn = RegInit(false.B)
    when(appended || (!turn && !front.append.valid)) { turn := b.append.valid && !turn }
    turn
  }
  private val append = Wire(Valid(UInt(log2Ceil(p.slots).W)))
  append := front.append
  for (b <- bridgeInto) when(ofBridge) { append := b.append }
  private val bridged = appended && ofBridge

  engine.offer      := order.offer
  engine.ownBit     := shift.ownBit
  engine.ownAhead   := shift.ownAhead
  engine.ownDlc     := shift.ownDlc
  shift.bits        := engine.bits
  shift.begins      := RegNext(happens.takes, false.B) // reset: no frame
  shift.data        := memory.data
  memory.load.valid := relayed(shift.load.valid)(_.load.valid)
  memory.load.bits  := relayed(states.current ## shift.load.bits)(_.load.bits)

  // As it was when the sample was taken that ends an attempt, or as it is written with a stop.
  states.oneShot       := Mux(happens.stops, control.oneShot, RegNext(mode.oneShot))
  states.request.valid := front.appended || bridged
  states.request.bits  := append.bits
  states.abort         := front.orders.abort
  states.clearSent     := front.orders.clearSent
  states.clearFailed   := front.orders.clearFailed
  states.takes.valid   := happens.takes
  states.takes.bits    := order.offer.slot
  states.ends          := happens.ends
  states.sent          := happens.sent

  private val isRequested = RegNext(front.orders.requested || bridged, false.B) // reset: no slot is
  order.pending            := states.pending
  order.mayBegin           := states.mayBegin
  order.changedNow         := states.mayAbort || isRequested
  order.mayChange          := states.mayLeave || isRequested
  order.changedLate        := states.ended
  order.append.bits        := append.bits
  order.append.valid       := append.valid && !relay.fold(false.B)(_.on)
  order.ready              := memory.orderReady
  order.key                := CanOrder(memory.data)
  memory.order             := relayed(order.read)(_.order)
  order.rests              := relay.fold(false.B)(_.on)
  order.ram.readData       := orderRam.io.readData
  orderRam.io.readAddress  := relayed(order.ram.readAddress)(_.list.readAddress)
  orderRam.io.write        := relayed(order.ram.write)(_.list.write)
  orderRam.io.writeAddress := relayed(order.ram.writeAddress)(_.list.writeAddress)
  orderRam.io.writeData    := relayed(order.ram.writeData.pad(orderBits))(_.list.writeData)
  front.appended           := appended && !ofBridge

  // Reset: no stamp is to be written.
  private val stamps  = RegInit(false.B)
  private val stamp   = Wire(Valid(new MemoryJob))
  private val stamped = relayed(states.current)(_.stamp.bits)
  when(memory.done(1)) { stamps := false.B }
  when(happens.sent) { stamps := true.B }
  for (r <- relay) when(r.slots.drops) { stamps := false.B } // the mode has been switched
  stamp.valid       := relayed(stamps)(_.stamp.valid)
  stamp.bits.source := PortMemory.Slots.U(2.W) ## stamped ## 1.U(2.W)
  stamp.bits.target := stamp.bits.source
  stamp.bits.write  := stamp.valid // not if the mode has been switched since it was read: to another slot
  stamp.bits.counts := false.B
  stamp.bits.wide   := false.B
  stamp.bits.bytes  := "b1100".U
  stamp.bits.data   := relayed(sofTime)(_.time) ## 0.U(16.W)

  // ---- frames received ----

  filter.start      := relayed(shift.identified)(_.start)
  filter.identifier := relayed(shift.identifier)(_.identifier)
  filter.hold       := front.hold
  filter.ready      := memory.filterReady
  filter.data       := memory.data
  memory.filter     := filter.read

  private val valid    = RegInit(false.B) // a frame waits for its filter; reset: none
  private val accepted = valid && filter.done
  when(accepted) { valid := false.B }
  when(happens.received) { valid := true.B }
  fifo.store    := relayed(shift.store)(_.store)
  fifo.word     := relayed(shift.word)(_.word)
  fifo.accept   := relayed(accepted && filter.matches)(_.accept)
  fifo.second   := relayed(sofTime ## filter.entry.pad(8) ## engine.bits.dlc.pad(8))(_.second)
  fifo.releases := front.orders.release
  fifo.read     := front.rxWord
  front.rxData  := fifo.data

  // ---- registers ----

  recorder.error   := happens.error
  recorder.lost    := happens.lost
  recorder.overrun := fifo.drops
  recorder.busOff  := happens.goesOff
  recorder.clear   := front.orders.clearCounters
  recorder.done    := memory.done(0)
  memory.job(0)    := recorder.job
  memory.job(1)    := stamp
  memory.job(2)    := front.job
  front.waits      := recorder.clears
  front.counting   := words.fold(false.B)(_.waits)
  front.done       := memory.done(2)
  front.data       := memory.word
  front.host <> host

  private val state = Mux(
    !runs,
    CanState.Stopped.U(2.W),
    Mux(engine.busOff, CanState.BusOff.U, Mux(engine.passive, CanState.Passive.U, CanState.Active.U))
  )
  front.status.state       := state
  front.status.warning     := engine.warning
  front.status.integrating := engine.integrating && runs
  front.status.sending     := engine.sending
  front.status.receiving   := engine.receiving
  front.status.impossible  := impossible
  front.status.tec         := engine.tec
  front.status.rec         := engine.rec
  front.status.level       := fifo.level
  front.status.pending     := states.pending
  front.status.sent        := states.sentAll
  front.status.failed      := states.failedAll

  events.received := fifo.accept && !fifo.drops
  events.slotDone := states.ended || states.aborted
  events.state := state =/= RegNext(state, CanState.Stopped.U) || // reset: stopped
    engine.warning =/= RegNext(engine.warning, false.B)
  events.busError := happens.error.valid
  events.overrun  := fifo.drops

  for (w <- words) {
    val job = memory.job.size - 1
    w.events        := counts.get
    memory.job(job) := w.job
    w.done          := memory.done(job)
  }

  // ---- the other port ----

  // A read of the host reads the FIFO at its end. A write may take long, and needs nothing of it.
  for (from <- bridgeFrom; place <- fifo.place; instead <- fifo.instead) {
    val entry  = fifo.second(12, 8)
    val isMine = entry >= CanParams.BridgeFilters.start.U && entry < CanParams.BridgeFilters.end.U
    // An own frame comes in loop back only, which may be over when its filter has been found. In relay mode
    // none comes. No reset: a frame is received before it is accepted.
    val isOwn = RegEnable(engine.sending, happens.received) && !relay.fold(false.B)(_.on)
    from.taken.valid := fifo.accept && isMine && front.control.bridge && !isOwn
    from.taken.bits  := place
    from.ready       := !host.req || host.write || host.ack
    from.data        := fifo.data
    instead.valid    := from.read.valid && from.ready
    instead.bits     := from.read.bits
  }
  for (into <- bridgeInto; evict <- states.evict; held <- states.held) {
    evict         := into.evict
    into.held     := held
    into.pending  := states.pending >> CanParams.BridgeSlots.start
    memory.job(3) := into.job
    into.done     := memory.done(3)
    into.key      := CanOrder(memory.word)
    into.appended := bridged
  }

  // ---- relay mode ----

  for (r <- relay) {
    r.append.bits  := append.bits
    r.append.valid := append.valid && r.on
    for (to <- r.busy; from <- bridgeFrom; busy <- from.busy) to := busy
    r.pending       := states.pending
    r.list.readData := orderRam.io.readData
    r.abort         := RegNext(front.orders.abort, 0.U)
    r.oneShot       := control.oneShot
    r.stamped       := memory.done(1)
    r.orderReady    := memory.orderReady
    r.data          := memory.data
    r.done          := filter.done
    r.matches       := filter.matches
    r.entry         := filter.entry
    r.drops         := fifo.drops
  }
  for (slots <- states.relay; r <- relay) slots := r.slots
}
