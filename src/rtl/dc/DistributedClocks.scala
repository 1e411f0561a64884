package flyframe.dc

import chisel3._
import chisel3.util._
import flyframe.memory.{BufferEvents, RegisterBus, RegisterUnit, StampRequest}
import flyframe.params.EscParams
import flyframe.registers.ClockRegisters

/** What a port tells the clocks.
  *
  * @param receives
  *   a nibble of a frame comes in
  * @param waited
  *   cycles that its first one has waited
  * @param link
  *   there is one
  */
final case class PortActivity(receives: Bool, waited: UInt, link: Bool)

/** The pins of distributed clocks: as many SYNC and LATCH signals as there are. */
class ClockPins(p: EscParams) extends Bundle {
  val sync  = Output(Vec(p.syncSignals, Bool()))
  val latch = Input(Vec(p.latchSignals, Bool()))
}

/** Distributed clocks behind their registers: the receive times of frames (DC-03 to DC-08), the system time
  * (DC-16 to DC-23), SYNC signals (DC-26 to DC-35), LATCH signals (DC-37 to DC-41), and the times of
  * SyncManagers' buffers (DC-42).
  *
  * @param ports
  *   all, by their numbers
  * @param request
  *   what the frame in the processing unit asks for
  * @param pins
  *   where there are SYNC or LATCH signals
  * @param events
  *   what happens to buffers of SyncManagers, where its times are kept (DC-42)
  */
class DistributedClocks(
    p: EscParams,
    ports: Seq[PortActivity],
    request: StampRequest,
    val pins: Option[ClockPins],
    events: Option[BufferEvents] = None
) extends RegisterUnit(ClockRegisters(p)) {

  /** SYNC and LATCH units are on: always, or as the EEPROM says (DC-06). */
  private def switches(bus: RegisterBus): (Bool, Bool) = if (!p.savesClockPower) (true.B, true.B)
  else {
    val bits          = bus.value("esc_configuration") // 0x0141[7:1]
    val (sync, latch) = (bits(1), bits(2))
    bus.guard("clocks_on")                        := sync || latch
    if (p.syncSignals > 0) bus.guard("sync_on")   := sync
    if (p.latchSignals > 0) bus.guard("latch_on") := latch
    (sync, latch)
  }

  def connect(bus: RegisterBus): Unit = {
    val round = if (p.hasSystemTime) 8 else p.clockBytes
    val clock = Module(new LocalClock(p.clockPeriodNs, p.clockBytes, round)).suggestName("localClock")
    val times = Module(new ReceiveTimes(p.ports, p.clockPeriodNs, round, p.lanes, p.hasMeanWays))
      .suggestName("receiveTimes")
    times.timeByte := clock.timeByte
    times.place    := clock.place
    times.last     := clock.last

    // A frame at a port, and that frame in the processing unit behind it, begin in the same cycle.
    val begins = VecInit(ports.map(y => y.receives && !RegNext(y.receives, false.B)))
    // Frames may begin at several ports at once: that of the first open port comes to the processing unit.
    val order  = Seq(0, 2, 1, 3).filter(_ < p.ports)
    val waited = PriorityMux(order.map(y => begins(y) -> ports(y).waited))
    times.begins := VecInit(begins :+ bus.frame.begins)
    times.waited := VecInit(ports.map(_.waited) :+ waited)
    times.absent := VecInit(ports.map(!_.link))

    // What the frame has asked for counts when it ends well.
    val asked   = RegInit(false.B) // reset: no frame
    val ofPorts = RegInit(false.B) // reset: no frame
    when(request.written) {
      asked := true.B
      when(request.ofPorts) { ofPorts := true.B }
    }
    when(bus.frame.good || bus.frame.bad || bus.frame.begins) {
      asked   := false.B
      ofPorts := false.B
    }
    times.keep := VecInit(Seq.fill(p.ports)(bus.frame.good && ofPorts) :+ (bus.frame.good && asked))

    val read = bus.keptRead("receive_time_trigger")
    times.readWord := read.address
    if (p.hasSystemTime) {
      val engine = new ClockEngine(p, clock)
      new SystemTime(engine, waited, read, times.data).connect(bus)
      val (syncOn, latchOn) = switches(bus)
      for (pins <- pins) {
        if (p.syncSignals > 0) new SyncSignals(engine, pins.sync, syncOn).connect(bus)
        if (p.latchSignals > 0) new LatchSignals(engine, pins.latch, latchOn).connect(bus)
      }
      engine.connect(bus)
    } else {
      clock.more      := 0.S
      read.host.ready := true.B
      read.data       := times.data
    }
    for (e <- events) {
      val unit = Module(new EventTimes(p.clockPeriodNs, round, p.lanes)).suggestName("eventTimes")
      unit.timeByte         := clock.timeByte
      unit.place            := clock.place
      unit.last             := clock.last
      unit.begins           := bus.frame.begins
      unit.waited           := waited
      unit.events           := e
      unit.read.byHost      := read.host.reads
      unit.read.address     := read.address
      unit.read.hostAsks    := read.host.asks
      unit.read.hostAddress := read.host.address
      when(unit.isHere) { read.data := unit.data }
    }
  }
}
