package flyframe

import chisel3._
import chisel3.util._
import flyframe.clocks.LevelCrossing
import flyframe.ethernet.NetworkSettings
import flyframe.host.HostInterface
import flyframe.master._
import flyframe.mii.Port
import flyframe.params.EscParams
import flyframe.port.SlotTimer
import flyframe.protocol.{AnswerLayout, MasterStatus}
import flyframe.registers.MasterRegisters

/** The signals of an alarm master, and what its device says of itself. */
class SignalPins extends Bundle {

  /** There was smoke since the last reset; an alarm is not silenced yet. */
  val fire    = Output(Bool())
  val sounder = Output(Bool())

  /** Low when there is a fault, so that a master without power or configuration shows one, too. */
  val fault_n = Output(Bool())

  /** A detector is disabled or tested. */
  val disabled = Output(Bool())

  /** The device has found its configuration damaged; a level, asynchronous. */
  val config_fault = Input(Bool())
}

/** The master of a line of alarm slaves: port 0 leads to the first of them, port 1 to the plant network with
  * the server; of a ring the far end comes back to port 2. A host sets it up and shows what it knows (HOST-01
  * to HOST-14). Its reset is that of a [[SlaveController]].
  *
  * @param p
  *   a parameter set of role 1 without [[EscParams.problems]]
  */
class MasterController(p: EscParams) extends Module with RequireAsyncReset {
  import MasterController._
  override def desiredName = p.topName

  // Ports to the slaves, see PlantPort.
  private val linePorts = Seq(0, 2).take(p.linePorts)

  val phy_clk_ref = IO(Input(Bool()))
  val mii_tx_tick = IO(Output(Bool()))

  /** Low active, as PHYs want it. */
  val phy_reset_n = IO(Output(Bool()))

  /** Where the host is connected. */
  private val connection = HostInterface(p)
  val hostPins: Bundle   = connection.pins

  /** An order of the server waits, or a datagram of the host is back; a level. */
  val irq   = IO(Output(Bool()))
  val alarm = IO(new SignalPins)
  phy_reset_n := !reset.asBool

  // The three steps of a nibble slot, as in a slave.
  private val slot                    = Module(new SlotTimer(p.cyclesPerNibble))
  private def later(step: Bool): Bool = if (p.cyclesPerNibble == 1) step else RegNext(step, false.B)
  private val receiveStep             = slot.tick
  private val processStep             = later(receiveStep)
  private val transmitStep            = later(processStep)
  slot.reference := phy_clk_ref

  private val registers = Module(new MasterHost(p))
  private val value     = registers.value
  registers.host <> connection.port
  connection.side.foreach(_.events := irq)

  private val ports = Seq.tabulate(p.portCount)(Port(p, _))

  /** Pins of the ports, by their numbers. */
  val phys: Seq[Bundle] = Port.pins(ports)
  for (port <- ports) {
    port.core.receiveStep  := receiveStep
    port.core.transmitStep := transmitStep
    port.core.enable       := true.B
    port.core.shortMargin  := false.B
  }
  mii_tx_tick := ShiftRegister(transmitStep, p.txShift + 1)

  // Time. Reports are made of it for less than a microsecond: meanwhile it stands still.
  private def every(event: Bool, count: Int): Bool = Counter(event, count)._2
  private val plant                                = Module(new PlantSide)
  private val microsecond                          = every(processStep, SlotsPerUs)
  private val millisecond                          = every(microsecond, 1000)
  private def counter(width: Int, event: Bool): UInt = {
    val counter = Module(new HeldCounter(width))
    counter.count := event
    counter.holds := plant.holds
    counter.value
  }
  private val time = counter(64, microsecond) // us

  // What the host asks for: each bit that starts something returns to 0 at once.
  private def action(name: String): Bool = {
    registers.set.load(name).valid := value.bool(name)
    registers.set.load(name).bits  := 0.U
    value.bool(name)
  }

  // The line.
  private val line = Module(new LineMaster(p.maxSlaves, p.maxSubTelegrams, p.linePorts))
  line.step           := processStep
  line.source         := Cat(value.uint("master_id"), LineSource.U(32.W))
  line.run            := value.bool("line_run")
  line.cycle          := value.uint("bus_cycle")
  line.timeout        := value.uint("answer_timeout")
  line.retries        := value.uint("retries")
  line.life           := value.uint("line_life")
  line.listed         := value.bool("line_listed")
  line.silence        := action("silence")
  line.resetAlarm     := action("reset_alarm")
  line.confirmed      := plant.firstEvent
  line.nextEvent      := plant.nextEvent
  line.roomForRecords := plant.roomForRecords
  line.roomForStates  := plant.roomForStates
  line.look           := plant.look
  line.window         := value.uint("slave_index")
  line.expect.valid   := registers.writes(MasterRegisters.ExpectedNode + 1)
  line.expect.bits    := value.uint("expected_node")
  for ((port, y) <- linePorts.zipWithIndex) {
    line.in(y)              := ports(port).core.fromWire
    ports(port).core.toWire := line.out(y)
  }
  private val framesLost = counter(16, line.lost)
  line.framesLost := framesLost

  // A datagram of the host. Reset: none asked for, none back.
  private val requestWaits = RegInit(false.B)
  private val requestFlies = RegInit(false.B)
  private val requestDone  = RegInit(false.B)

  // The plant network.
  private val settings = Module(new NetworkSettings(4))
  private val own      = Module(new HostEvent)
  plant.step                   := processStep
  plant.in                     := ports(PlantPort).core.fromWire
  ports(PlantPort).core.toWire := plant.out
  plant.run                    := value.bool("report_run")
  plant.repeatMs               := value.uint("report_repeat")
  plant.heartbeatMs            := value.uint("report_heartbeat")
  plant.serverTimeout          := value.uint("server_timeout")
  plant.millisecond            := millisecond
  plant.known                  := line.state.known
  plant.lookData               := line.lookData

  settings.write        := registers.settingWrite
  settings.writeAddress := registers.settingAddress
  settings.writeData    := registers.settingData
  settings.readAddress := VecInit(
    registers.settingAddress,
    plant.settingAddress(0),
    plant.settingAddress(1),
    Mux(
      requestFlies,
      MasterRegisters.Request.U | line.requestAddress,
      MasterRegisters.HostEvent.U | own.readAddress
    )
  )
  plant.setting    := VecInit(settings.readData(1), settings.readData(2))
  line.requestData := settings.readData(3)
  own.readData     := settings.readData(3)
  own.granted      := !requestFlies
  // What came back of the host's datagram; no setting has its address. Reset: nothing.
  private val requestAnswered = RegEnable(line.result.bits, false.B, line.result.valid)
  line.resultAddress := registers.settingAddress
  // The low bits of an address say which byte of the result it is.
  require(
    MasterRegisters.Result % 16 == 0,
    f"MasterRegisters.Result is 0x${MasterRegisters.Result}%02x but must be a multiple of 16."
  )
  private val isResult = RegNext(
    registers.settingAddress(7, 4) === (MasterRegisters.Result >> 4).U &&
      (registers.settingAddress(3) || registers.settingAddress(3, 1) === 2.U)
  )
  line.windowByte := registers.settingAddress
  private val isWindow =
    RegNext(registers.settingAddress(7, 3) === (MasterRegisters.SlaveState >> 3).U)
  registers.setting := settings.readData(0) | Mux(isResult && requestAnswered, line.resultData, 0.U) |
    Mux(isWindow, line.windowState, 0.U)

  // The heartbeat of the host (HOST-12).
  private val alive = value.uint("host_alive")
  registers.set.load("host_alive").valid := millisecond && alive =/= 0.U
  registers.set.load("host_alive").bits  := alive - 1.U

  // The status (HOST-11), and the signals that follow from it.
  private val damaged = Module(new LevelCrossing)
  damaged.in := alarm.config_fault
  private val status = {
    import MasterStatus._
    val bits = Seq(
      Fire          -> line.state.fire,
      Sounding      -> line.state.sounding,
      Alarm         -> line.state.alarm,
      LineDead      -> line.state.dead,
      RingOpen      -> line.state.ringOpen,
      WrongLine     -> line.state.wrong,
      SlaveFault    -> line.state.slaveFault,
      Disabled      -> line.state.disabled,
      Testing       -> line.state.testing,
      ServerSilent  -> plant.serverSilent,
      HostDead      -> (alive === 0.U),
      Configuration -> damaged.out,
      Mains         -> value.bool("mains_failed"),
      Battery       -> value.bool("battery_low"),
      Earth         -> value.bool("earth_fault"),
      Storage       -> value.bool("storage_failed"),
      Unlisted      -> !value.bool("line_listed"),
      Full          -> plant.full,
      PlantDead     -> !ports(PlantPort).core.link
    )
    require(
      bits.map(_._1) == Seq.tabulate(Width)(1 << _),
      s"MasterStatus has Width $Width but its bits are ${bits.map(_._1).mkString(", ")}."
    )
    VecInit(bits.map(_._2)).asUInt
  }
  private def lit(on: Bool): Bool = on || value.bool("lamp_test")
  alarm.fire     := lit(line.state.fire)
  alarm.sounder  := lit(line.state.sounding)
  alarm.disabled := lit(line.state.disabled || line.state.testing)
  alarm.fault_n  := !lit((status & MasterStatus.Faults.U).orR)
  line.status    := status

  plant.master.status  := status
  plant.master.present := line.state.present
  plant.master.cut     := line.state.cut
  plant.master.refused := registers.counts.uint("refused_datagrams")
  plant.master.lost    := framesLost
  plant.master.time    := time

  // A datagram of the host.
  private val requestBusy = requestWaits || requestFlies
  line.request.valid := requestWaits
  when(registers.reads(MasterRegisters.Answered)) { requestDone := false.B }
  when(action("request_go") && !requestBusy) {
    requestWaits := true.B
    requestDone  := false.B
  }
  when(line.request.fire) {
    requestWaits := false.B
    requestFlies := true.B
  }
  when(line.result.valid && requestFlies) {
    requestFlies := false.B
    requestDone  := true.B
  }

  // Events; those of the line come first.
  own.go := action("host_event_go")
  plant.event(0) <> line.event
  plant.event(1) <> own.event

  // The mailbox: reading a byte leads to the next.
  private val offset = registers.set.load("mailbox_offset")
  plant.mailbox.take        := value.bool("mailbox_done")
  plant.mailbox.looks       := registers.looks
  plant.mailbox.readAddress := value.uint("mailbox_offset")
  offset.valid              := registers.reads(MasterRegisters.MailboxData) || action("mailbox_done")
  offset.bits               := Mux(value.bool("mailbox_done"), 0.U, value.uint("mailbox_offset") + 1.U)
  irq                       := plant.mailbox.waiting || requestDone

  private val shown = registers.status
  shown.uint("slaves_present")               := line.state.present
  shown.uint("slaves_known")                 := line.state.known
  shown.uint("line_link")                    := ports(linePorts.head).core.link
  shown.uint("plant_link")                   := ports(PlantPort).core.link
  shown.uint("mailbox_waiting")              := plant.mailbox.waiting
  shown.uint("request_done")                 := requestDone
  shown.uint("request_busy")                 := requestBusy
  shown.uint("ring_closed")                  := line.state.ringClosed
  shown.uint("host_event_busy")              := own.busy
  shown.uint("frames_lost")                  := framesLost
  shown.uint("master_state")                 := status
  shown.uint("master_time")                  := time
  shown.uint("request_answered")             := requestAnswered
  shown.uint("mailbox_length")               := Mux(plant.mailbox.waiting, AnswerLayout.bytes.U, 0.U)
  shown.uint("mailbox_data")                 := plant.mailbox.readData
  shown.uint("ring_cut")                     := line.state.cut
  registers.event.pulse("refused_datagrams") := plant.refused
  registers.event.pulse("dropped_messages")  := plant.dropped
  registers.event.pulse("invalid_frame_port0") := VecInit(
    linePorts.map(ports(_).core.events.invalidFrame)
  ).asUInt.orR
  registers.event.pulse("invalid_frame_port1") := ports(PlantPort).core.events.invalidFrame
}

object MasterController {
  private val SlotsPerUs = 25

  /** The plant network has this port, whether there is one port to the slaves or two. */
  private val PlantPort = 1

  /** Source address of frames to the line, first byte in the low bits, behind it the master ID: bit 1 of the
    * first byte, which slaves set, must be 0.
    */
  private val LineSource = 0x796c6604
}
