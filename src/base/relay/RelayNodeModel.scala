package flyframe.relay

import flyframe.can.{CanFiltersModel, CanFifoModel, CanFrame, CanRecords}
import flyframe.params.CanParams
import scala.collection.mutable

/** The link senders of a node, as the node uses them. */
trait LinkSenders {

  /** Recessive bits sent since the last frame; 0 within a frame. */
  def quiet(port: Int): Long

  /** A frame begins with the coming bit. */
  def begin(port: Int, header: LinkHeader, body: LinkBody): Unit

  /** What is being sent is ended by an abort. */
  def abort(port: Int): Unit

  /** A port has gone down. */
  def silence(port: Int): Unit
}

/** What a node does with frames: passing on, own frames, receiving (FR-44 to FR-62). It hears of the bits of
  * its links by their receivers ([[listener]]), and is asked once for each bit that it sends ([[tick]]).
  */
class RelayNodeModel(p: CanParams, senders: LinkSenders) extends OwnHost {
  import RelayNodeModel._

  // ---- what the host sets: RelayHostModel ----

  /** Own address; 0: not set. */
  var address: Int = 0

  /** Relay mode is on. */
  var isOn: Boolean = false
  var confirm: Int  = 0 // in units of 10 us

  /** Core cycles of a bit. */
  var linkBit: Int       = 0
  var retries: Int       = 15
  var life: Int          = 0
  var isOneShot: Boolean = false

  val records: CanRecords = new CanRecords

  /** What filters 8 to 15 accept goes to the other port (BR-01). */
  var isBridge: Boolean          = false
  var bridges: CanFrame => Unit  = _ => ()
  val counters: RelayCounters    = new RelayCounters
  val fifo: CanFifoModel         = new CanFifoModel(p.rxFrames)
  var slots: RelaySlotsModel     = _
  var filters: CanFiltersModel   = _
  var stamps: (Int, Int) => Unit = (_, _) => () // slot, time of its last copy

  /** The present core cycle. */
  def cycleNow: Long = cycle

  /** For tests: each frame that is new, before the filters. */
  var delivers: (LinkHeader, CanFrame) => Unit = (_, _) => ()

  /** For tests: the order of the own frame on offer at each port when it was decided what leaves; and own
    * frames that begin.
    */
  val offered: Array[Option[Long]]                = Array(None, None)
  var begins: (Int, LinkHeader, LinkBody) => Unit = (_, _, _) => ()

  /** For tests: a frame of the own address came whole by a port. */
  var comesHome: (LinkHeader, Int) => Unit = (_, _) => ()

  private def unitCycles = 10L * p.coreClockMhz
  def unit: Long         = cycle / unitCycles

  val own: OwnFramesModel         = new OwnFramesModel(this)
  val sources: SourcesModel       = new SourcesModel(() => confirm, 64 * unitCycles)
  val transits: Seq[TransitModel] = Seq.fill(2)(new TransitModel)
  private val up                  = Array(false, false)
  private val coming              = Array.fill(2)(Option.empty[Incoming])
  private val leaving             = Array.fill(2)(Option.empty[Incoming])
  private val starts              = Array(0, 0)
  private var state               = Listens
  private var listenEnd           = Option.empty[Long]                    // the unit
  private val homes               = mutable.Queue.empty[(Long, Incoming)] // and when they count
  private val passed     = Array(0, 0)       // since the last own one of the second half
  private var turns      = 0L                // identifiers that came
  private val sending    = Array.fill(2)(Option.empty[Flight])
  private var begun      = Vector.empty[Int] // what counts for frames that begin with the coming bit
  private var begunAt    = 0L
  private var inConflict = false
  private var cycle      = 0L

  def isUp(port: Int): Boolean   = up(port)
  def isAlone: Boolean           = !up(0) && !up(1)
  def isConflict: Boolean        = inConflict
  def counts(counter: Int): Unit = counters.count(counter)

  /** Until that bit it has not left. */
  def leaves(counter: Int): Unit = {
    counts(counter)
    begun :+= counter
    begunAt = cycle
  }
  def lifeSettled(): Unit = if (state == Announces) state = if (isAlone) Listens else Runs

  def isSending(flight: Flight): Boolean =
    (0 to 1).exists(port => sending(port).contains(flight) && senders.quiet(port) == 0)
  def time: Int = (cycle / p.coreClockMhz).toInt

  /** The core cycle in which everything happens until this is called again. */
  def now(cycle: Long): Unit = {
    this.cycle = cycle
    sources.pass(cycle)
  }

  /** The node begins a life (FR-61, RB-13). */
  def restart(): Unit = {
    state = Listens
    listenEnd = None
    inConflict = false
    own.restart()
  }

  /** The node starts: nothing is known, nothing is on its way (RB-13, RB-25). */
  def reset(): Unit = {
    restart()
    own.drop()
    slots.drop()
    homes.clear()
    if (cycle < begunAt + linkBit) begun.foreach(counters.takeBack)
    begun = Vector.empty
    for (port <- 0 to 1) {
      coming(port) = None
      passed(port) = 0
      quieten(port)
    }
    sources.clear()
  }

  // ---- links ----

  /** What the receiver at a port tells. */
  def listener(port: Int): LinkListener = new LinkListener {
    def starts(): Unit                                   = RelayNodeModel.this.starts(port) = time
    def header(header: LinkHeader, body: LinkBody): Unit = if (isOn) arrives(port, header, body)
    def identified(): Unit = for (f <- coming(port)) {
      f.order = Some(f.body.order)
      f.turn = turns
      turns += 1
    }
    def ended(isGood: Boolean): Unit = {
      for (f <- coming(port)) if (isGood) received(f) else bad(f)
      coming(port) = None
    }
    def badHeader(): Unit = if (isOn) counts(RelayCounter.BadHeader + port)
    def badFrame(): Unit  = if (isOn) counts(RelayCounter.BadFrame + port)
  }

  /** A port comes up or goes down; its receiver has been restarted. */
  def portChanges(port: Int, isUp: Boolean): Unit = {
    up(port) = isUp
    quieten(port)
    if (isUp) own.portUp(port) else own.portDown(port)
  }

  private def quieten(port: Int): Unit = {
    transits(port).drop()
    leaving(port) = None
    sending(port) = None
    senders.silence(port)
  }

  // FR-45
  private def arrives(port: Int, header: LinkHeader, body: LinkBody): Unit = {
    val f = new Incoming(port, header, body, starts(port))
    coming(port) = Some(f)
    if (!isOwn(header)) {
      val out = if (up(1 - port)) 1 - port else port
      if (header.hops == 0 || !transits(out).put(f)) counts(RelayCounter.Stray)
      else {
        f.output = Some(out)
        if (out == port) counts(RelayCounter.Wrapped)
      }
    }
  }

  private def isOwn(header: LinkHeader) = address != 0 && header.source == address

  // FR-47
  private def bad(f: Incoming): Unit =
    for (out <- f.output) if (!transits(out).remove(f) && leaving(out).contains(f)) {
      leaving(out) = None
      senders.abort(out)
      counts(RelayCounter.Aborted)
    }

  // ---- receiving ----

  private def received(f: Incoming): Unit = {
    import f.header
    if (isOwn(header)) { // RB-22
      homes += (cycle + HomeBits * linkBit) -> f
      comesHome(header, f.port)
    } else if (header.source != 0) {
      sources.hears(header, f.port)
      for (frame <- f.body.frame) // RB-06
        if (header.kind == LinkKind.Start) sources.starts(header.source, header.sequence)
        else if (header.kind == LinkKind.Data) {
          if (sources.takes(header.source, header.sequence)) deliver(f, frame)
          else counts(RelayCounter.Doubles)
        }
    }
  }

  private def deliver(f: Incoming, frame: CanFrame): Unit = {
    delivers(f.header, frame)
    for (filter <- filters.matching(frame)) {
      if (!fifo.put(frame.bytes(filter, f.time))) records.overrun()
      if (isBridge && CanParams.BridgeFilters.contains(filter)) bridges(frame)
    }
  }

  // FR-57, FR-62
  private def back(f: Incoming): Unit = {
    import f.header
    val isForeign = header.kind match {
      case LinkKind.Data  => own.isAhead(header.sequence)
      case LinkKind.Start => header.sequence != own.life
      case _              => false
    }
    if (isForeign) inConflict = true else own.home(header, f.port)
  }

  // ---- sending ----

  /** Before each bit that is sent. */
  def tick(): Unit = if (isOn) {
    begun = Vector.empty
    val wasEmpty = own.isEmpty
    own.forget()
    while (homes.headOption.exists(_._1 <= cycle)) {
      val (_, f) = homes.dequeue()
      if (state != Listens) back(f)
    }
    own.settle()
    lives(wasEmpty)
    if (!inConflict) own.pass()
    for (port <- 0 to 1) {
      offered(port) = ownOrder(port)
      for (gap <- gap(port)) if (senders.quiet(port) >= gap) begin(port)
    }
  }

  private def lives(wasEmpty: Boolean): Unit = {
    if (isAlone || state == Listens) own.fail()
    if (isAlone || address == 0) listenEnd = None
    if (isAlone) {
      if (state == Announces) state = Listens
      if (slots.pending != 0) {
        val waiting = Integer.bitCount(slots.pending)
        slots.abort(slots.pending)
        for (_ <- 0 until waiting) counts(RelayCounter.Failed)
      }
    } else if (state == Listens && address != 0) {
      if (listenEnd.isEmpty) listenEnd = Some(unit + 2 * confirm)
      if (listenEnd.exists(_ < unit) && wasEmpty) {
        state = Announces
        own.announce(life)
      }
    }
  }

  /** When [[tick]] does something that no event before it causes. */
  def due: Option[Long] =
    if (!isOn) None
    else {
      val units = if (state == Listens) listenEnd.map(_ + 1) else if (inConflict) None else own.due
      val isNow = own.isSettling || (state == Listens && !own.isEmpty)
      (units.map(_ * unitCycles) ++ homes.headOption.map(_._1) ++ (if (isNow) Some(cycle)
                                                                   else None)).minOption
    }

  private def ownOrder(port: Int) =
    if (inConflict || address == 0 || state == Listens) None else own.order(port, state == Runs)

  // FR-48, RB-28
  private def isOwnFirst(port: Int) = transits(port).size < LinkFrame.Many &&
    ownOrder(port).exists(transits(port).isBefore(_, passed(port) >= Patience))

  /** How many recessive bits there must be before the frame that leaves next by a port; none: no frame. */
  def gap(port: Int): Option[Int] =
    if (!up(port)) None
    else if (isOwnFirst(port)) Some(LinkFrame.EndBits + LinkFrame.OwnGap)
    else if (transits(port).size >= LinkFrame.Many) Some(LinkFrame.EndBits)
    else if (transits(port).size > 0) Some(LinkFrame.EndBits + LinkFrame.PassingGap)
    else None

  private def begin(port: Int): Unit =
    if (isOwnFirst(port)) {
      val f      = own.begin(port, state == Runs)
      val header = LinkHeader(f.kind, port, address, f.sequence, LinkHeader.Hops)
      val frame  = f.slot.fold(Announcement)(slots.pendingFrame)
      leaving(port) = None
      sending(port) = Some(f)
      if (!TransitModel.isInFirstHalf(f.order)) passed(port) = 0
      f.slot.foreach(stamps(_, ((cycle + linkBit) / p.coreClockMhz).toInt)) // it leaves a bit later (RB-19)
      val body = LinkBody.of(header, frame)
      senders.begin(port, header, body)
      begins(port, header, body)
    } else
      for (f <- transits(port).first) {
        transits(port).remove(f)
        leaving(port) = Some(f)
        sending(port) = None
        passed(port) += 1
        if (f.port != port) leaves(RelayCounter.Passed + f.port)
        senders.begin(port, f.passed, f.body)
      }
}

object RelayNodeModel {
  private val Listens   = 0
  private val Announces = 1
  private val Runs      = 2

  /** Bits until a copy that has come home counts. */
  private val HomeBits = 2

  /** So many frames pass in front of an own one at most while others of the second half wait (RB-28). */
  private val Patience = 127

  /** The frame that stands in the start of a life. */
  private val Announcement = CanFrame(0, extended = false, remote = false, 0, Nil)
}
