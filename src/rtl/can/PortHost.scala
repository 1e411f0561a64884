package flyframe.can

import chisel3._
import chisel3.util._
import flyframe.lanes.Lanes
import flyframe.memory.HostPort
import flyframe.params.CanParams
import flyframe.registers.CanRegisters

/** What of a port its registers show. */
class PortStatus(p: CanParams) extends Bundle {
  val state       = UInt(2.W)
  val warning     = Bool()
  val integrating = Bool()
  val sending     = Bool()
  val receiving   = Bool()
  val impossible  = Bool()
  val tec         = UInt(9.W)
  val rec         = UInt(8.W)
  val level       = UInt(8.W)
  val pending     = UInt(p.slots.W)
  val sent        = UInt(p.slots.W)
  val failed      = UInt(p.slots.W)
}

/** What the host orders, each a pulse. */
class PortOrders(p: CanParams) extends Bundle {
  val recover       = Bool()
  val clearCounters = Bool()
  val abort         = UInt(p.slots.W)
  val clearSent     = UInt(p.slots.W)
  val clearFailed   = UInt(p.slots.W)
  val release       = Bool()

  /** Slots have been requested, one after the other before this. */
  val requested = Bool()
}

/** What the host has set. */
class PortControl extends Bundle {
  val bridge        = Bool()
  val threeSamples  = Bool()
  val recoverItself = Bool()
  val oneShot       = Bool()
  val loopBack      = Bool()
  val listenOnly    = Bool()
  val run           = Bool()
}

/** The registers of a port at a host port of 32 bits, see [[CanRegisters]]. Each access is a job of
  * [[PortMemory]], which holds what no logic looks at. What it does otherwise counts for the bus from the
  * cycle behind the acknowledgement on. Addresses that belong to nobody here read 0.
  *
  * @param port
  *   0 or 1: the addresses are those of this port
  * @param counters
  *   the first address of eight words of counters that are read here, too
  */
class PortHost(p: CanParams, port: Int, counters: Option[Int] = None) extends Module {
  private val slotBits = log2Ceil(p.slots)

  val host    = IO(new HostPort(4))
  val control = IO(Output(new PortControl))
  val timing  = IO(Output(new TimingSetting))
  val status  = IO(Input(new PortStatus(p)))
  val orders  = IO(Output(new PortOrders(p)))

  /** This slot is to become pending, as the youngest; the next one when it was taken. */
  val append   = IO(Output(Valid(UInt(slotBits.W))))
  val appended = IO(Input(Bool()))

  /** The oldest frame received: a word of it, in the next cycle. */
  val rxWord = IO(Output(UInt(2.W)))
  val rxData = IO(Input(UInt(32.W)))

  /** To [[PortMemory]], and to [[AcceptanceFilter]]: a filter is being changed. */
  val job  = IO(Output(Valid(new MemoryJob)))
  val done = IO(Input(Bool()))
  val data = IO(Input(UInt(32.W)))

  /** No job may begin: what was ordered is not done yet. */
  val waits = IO(Input(Bool()))

  /** Something is to be counted yet, so that no counter may be read. */
  val counting = IO(Input(Bool()))
  val hold     = IO(Output(Bool()))

  private val flags   = RegInit(0.U.asTypeOf(new PortControl)) // reset: as the register table says
  private val setting = RegInit(0.U.asTypeOf(new TimingSetting))
  control := flags
  timing  := setting

  // ---- what is accessed ----

  private val acknowledged = RegInit(false.B) // reset: no access is under way
  private val active       = host.req && !acknowledged

  private def isPage(start: Int)  = host.addr(15, 8) === (start >> 8).U
  private val inPort              = isPage(CanRegisters.PortStarts(port)) && host.addr(7, 6) === 0.U
  private val inSlots             = isPage(CanRegisters.SlotStarts(port))
  private val inFilter            = isPage(CanRegisters.FilterStarts(port)) && host.addr(7, 3) < p.filters.U
  private val inCounters          = counters.fold(false.B)(c => host.addr(15, 5) === (c >> 5).U)
  private val offset              = host.addr(7, 2)
  private def isAt(register: Int) = inPort && offset(3, 0) === (register / 4).U
  private def isWritten(register: Int)   = host.write && isAt(register) && host.be(register % 4)
  private def halfWritten(register: Int) = Mux(host.write && isAt(register), half(register), 0.U)
  private def half(register: Int): UInt = {
    val low = register % 4
    Cat(Seq(low + 1, low).map(i => Mux(host.be(i), Lanes.byte(host.wdata, i), 0.U(8.W))))
  }

  // ---- requests: slot after slot, in front of the job ----

  private val asking    = RegInit(0.U((slotBits + 1).W)) // the next slot; reset: no access is under way
  private val isRequest = host.write && isAt(CanRegisters.Requests)
  private val allAsked  = asking(slotBits)
  private val slotAsked = asking(slotBits - 1, 0)
  private val wants     = half(CanRegisters.Requests)(slotAsked) && !status.pending(slotAsked)
  private val anyWanted = RegInit(false.B)
  append.valid := active && isRequest && !allAsked && wants
  append.bits  := slotAsked
  when(active && isRequest && !allAsked && (!wants || appended)) { asking := asking + 1.U }
  when(appended) { anyWanted := true.B }

  // ---- the job, or two: a filter's value waits until its mask is complete (CB-11) ----

  private val isMask   = offset(0)
  private val isCommit = host.write && inFilter && isMask && host.be(3)
  private val second   = RegInit(false.B)                // of two jobs; reset: none under way
  private val copies   = isCommit && !second
  private val waiting  = PortMemory.Waiting.U(2.W) ## 0.U(5.W)
  private val isFree   = !status.pending(offset(5, 2))
  private val mayStore = host.write && Mux(inSlots, isFree, inFilter || !flags.run)
  private val isDlc    = inSlots && offset(1, 0) === 1.U // beside the time stamp
  private val stored   = Mux(mayStore, host.be & (Fill(3, !isDlc) ## true.B), 0.U)
  // Bits that are kept, of those words that do not keep all.
  private val kept = Mux(
    isDlc,
    0xf.U(32.W),
    Mux(
      (inSlots && offset(1, 0) === 0.U) || (inFilter && isMask),
      "hdfffffff".U(32.W),
      Mux(inPort, "hff3f07ff".U(32.W), "hffffffff".U(32.W))
    )
  )
  private val page = Mux1H(
    Seq(
      inSlots  -> PortMemory.Slots.U(2.W),
      inFilter -> PortMemory.Filters.U(2.W),
      inPort   -> PortMemory.Registers.U(2.W)
    )
  )
  private val place = Mux(
    inCounters,
    PortMemory.Counters.U(PortMemory.AddressBits.W) | offset(2, 0),
    page ## offset
  )
  job.valid       := active && !waits && !(inCounters && counting) && (!isRequest || allAsked)
  job.bits.source := Mux(host.write && inFilter, waiting ## (isMask && !copies), place)
  job.bits.target := Mux(
    isCommit,
    place(7, 1) ## second,
    Mux(inFilter, waiting ## isMask, place)
  )
  job.bits.write  := host.write && (inSlots || inFilter || isAt(CanRegisters.Timing))
  job.bits.counts := false.B
  job.bits.wide   := false.B
  job.bits.bytes  := Mux(copies, 0.U, stored)
  job.bits.data   := host.wdata & kept
  hold            := isCommit && active

  private val ends = done && !copies
  acknowledged := ends
  when(done) { second := copies }
  when(ends) { asking := 0.U }
  when(acknowledged) { anyWanted := false.B }

  // ---- in the cycle before the acknowledgement ----

  when(ends && isWritten(CanRegisters.Control)) { flags := host.wdata(6, 0).asTypeOf(flags) }
  when(ends && host.write && isAt(CanRegisters.Timing) && !flags.run) {
    val all = setting.asUInt
    val old = all(24, 17) ## 0.U(2.W) ## all(16, 11) ## 0.U(5.W) ## all(10, 0)
    val now = Cat((3 to 0 by -1).map { i =>
      Mux(host.be(i), Lanes.byte(host.wdata, i), Lanes.byte(old, i))
    })
    setting := (now(31, 24) ## now(21, 16) ## now(10, 0)).asTypeOf(setting)
  }

  // ---- with the acknowledgement ----

  private def ordered(bit: Int)    = acknowledged && isWritten(CanRegisters.Command) && host.wdata(8 + bit)
  private def slots(register: Int) = Mux(acknowledged, halfWritten(register), 0.U)
  orders.recover       := ordered(0)
  orders.clearCounters := ordered(1)
  orders.abort         := slots(CanRegisters.Aborts) | Fill(p.slots, ordered(2))
  orders.clearSent     := slots(CanRegisters.Sent)
  orders.clearFailed   := slots(CanRegisters.Failed)
  orders.release       := acknowledged && isWritten(CanRegisters.RxRelease)
  orders.requested     := acknowledged && anyWanted

  // Of a host with words of a byte: a read of the first byte of TEC keeps the other one (CB-16).
  private val tec =
    if (p.hostBytes > 1) status.tec
    else {
      val keeps = ends && !host.write && isAt(CanRegisters.ErrorCounters) && host.be(0)
      RegEnable(status.tec(8), keeps) ## status.tec(7, 0)
    }

  rxWord := offset(1, 0)
  private val inFrame = inPort && offset(3, 2).andR
  private val shown = Mux1H(
    Seq(
      isAt(CanRegisters.Control) -> Cat(
        status.impossible,
        status.receiving,
        status.sending,
        status.integrating,
        status.warning,
        status.state,
        0.U(9.W),
        flags.asUInt
      ),
      isAt(CanRegisters.ErrorCounters)                            -> status.rec ## 0.U(7.W) ## tec,
      isAt(CanRegisters.RxLevel)                                  -> status.level,
      isAt(CanRegisters.Requests)                                 -> status.pending,
      isAt(CanRegisters.Sent)                                     -> status.failed ## status.sent,
      (inFrame && status.level =/= 0.U)                           -> rxData,
      (inSlots || inFilter || inCounters || (inPort && !inFrame)) -> data
    )
  )
  host.ack   := acknowledged
  host.rdata := RegNext(shown)
}
