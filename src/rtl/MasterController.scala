package flyframe

import chisel3._
import chisel3.util._
import flyframe.clocks.LevelCrossing
import flyframe.master._
import flyframe.memory.HostPort
import flyframe.mii.MiiTransmitter
import flyframe.params.EscParams
import flyframe.port.SlotTimer
import flyframe.registers.MasterRegisters

/** What an alarm master sounds and lights. */
class SignalPins extends Bundle {

  /** From an alarm on until the host switches them off. */
  val buzzer = Output(Bool())
  val lamp   = Output(Bool())
}

/** The master of a line of alarm slaves: port 0 leads to the first of them, port 1 to the plant network with
  * the server; a host sets it up and hears of the server's messages (HOST-01 to HOST-07).
  *
  * @param p
  *   a parameter set of role 1 without [[EscParams.problems]]
  */
class MasterController(p: EscParams) extends Module {
  import MasterController._
  override def desiredName = p.topName

  val phy_clk_ref = IO(Input(Bool()))
  val mii         = IO(Vec(2, new MiiPort))
  val mii_tx_tick = IO(Output(Bool()))

  /** Low active, as PHYs want it. */
  val phy_reset_n = IO(Output(Bool()))
  val host        = IO(new HostPort(p.lanes))

  /** A message of the server waits, or a datagram of the host is back; a level. */
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
  private val status    = registers.status
  registers.host <> host

  // Ports.
  private val links = mii.map { port =>
    val crossing = Module(new LevelCrossing)
    crossing.in := port.link
    crossing.out
  }
  private val receivers = mii.zip(links).map { case (port, link) =>
    MiiPort.receiver(port, link, receiveStep, shortMargin = false.B, p.coreClockMhz)
  }
  private val transmitters = mii.map { port =>
    val transmitter = Module(new MiiTransmitter)
    transmitter.tick := transmitStep
    port.tx_en       := ShiftRegister(transmitter.txEn, p.txShift)
    port.txd         := ShiftRegister(transmitter.txd, p.txShift)
    transmitter
  }
  mii_tx_tick := ShiftRegister(transmitStep, p.txShift + 1)

  // Time.
  private def every(event: Bool, count: Int): Bool = Counter(event, count)._2
  private val microsecond                          = every(processStep, SlotsPerUs)
  private val millisecond                          = every(microsecond, 1000)
  private val time                                 = RegInit(0.U(32.W)) // us; reset: starts anew
  when(microsecond) { time := time + 1.U }

  // The line.
  private val line = Module(new LineMaster(p.maxSlaves, p.maxSubTelegrams))
  line.step          := processStep
  line.in            := receivers(0).out
  transmitters(0).in := line.out
  line.source        := Cat(value.uint("master_id"), LineSource.U(32.W))
  line.run           := value.bool("line_run")
  line.cycle         := value.uint("bus_cycle")
  line.timeout       := value.uint("answer_timeout")
  line.retries       := value.uint("retries")
  private val framesLost = RegInit(0.U(32.W)) // reset: none
  when(line.lost) { framesLost := framesLost + 1.U }

  // The plant network.
  private val receiver = Module(new EthernetReceiver)
  private val udp      = Module(new UdpReceiver)
  private val link     = Module(new ServerLink)
  private val arp      = Module(new ArpResponder)
  private val sender   = Module(new UdpSender)
  private val reports  = Module(new EventReporter(EventPlaces))
  private val plant    = Module(new EthernetSender)
  private val expected = Module(new ExpectedByte)
  private val settings = Module(new NetworkSettings(6))
  private val own      = Module(new HostEvent)
  receiver.step    := processStep
  receiver.in      := receivers(1).out
  udp.byte         := receiver.byte
  udp.first        := receiver.first
  udp.end          := receiver.end
  udp.at           := expected.at
  udp.same         := expected.same
  udp.mine         := expected.mine
  arp.byte         := receiver.byte
  arp.first        := receiver.first
  arp.end          := receiver.end
  arp.at           := expected.at
  arp.same         := expected.same
  arp.mine         := expected.mine
  link.data        := udp.data
  link.offset      := udp.offset
  link.received    := udp.received
  link.master      := value.uint("master_id")
  link.boot        := value.uint("boot_number")
  link.take        := value.bool("mailbox_done")
  link.readAddress := value.uint("mailbox_offset")

  expected.byte         := receiver.byte
  expected.end          := receiver.end
  settings.write        := registers.settingWrite
  settings.writeAddress := registers.settingAddress
  settings.writeData    := registers.settingData
  settings.readAddress := VecInit(
    registers.settingAddress,
    NetworkSettings.ofNetwork(expected.address),
    NetworkSettings.ofNetwork(sender.settingAddress),
    NetworkSettings.ofNetwork(arp.settingAddress),
    MasterRegisters.Request.U | line.requestAddress,
    MasterRegisters.HostEvent.U | own.readAddress
  )
  // What came back of the host's datagram; no setting has its address. Reset: nothing.
  private val requestAnswered = RegEnable(line.result.bits, false.B, line.result.valid)
  line.resultAddress := registers.settingAddress
  // The low bits of an address say which byte of the result it is.
  require(
    MasterRegisters.Result % 16 == 0,
    f"MasterRegisters.Result is 0x${MasterRegisters.Result}%02x but must be a multiple of 16."
  )
  private val isResult = RegNext(
    registers.settingAddress(6, 4) === (MasterRegisters.Result >> 4).U &&
      (registers.settingAddress(3) || registers.settingAddress(3, 1) === 2.U)
  )
  registers.setting := settings.readData(0) | Mux(isResult && requestAnswered, line.resultData, 0.U)
  expected.setting  := settings.readData(1)
  line.requestData  := settings.readData(4)
  own.readData      := settings.readData(5)
  sender.setting    := settings.readData(2)
  arp.setting       := settings.readData(3)

  reports.millisecond := millisecond
  reports.repeatMs    := value.uint("report_repeat")
  reports.heartbeatMs := value.uint("report_heartbeat")
  reports.acknowledge := link.acknowledge
  reports.busy        := sender.busy || !value.bool("report_run")
  reports.readAddress := sender.readAddress
  sender.readData     := reports.readData
  sender.start        := reports.start
  sender.length       := reports.length
  line.room           := reports.room
  line.firstEvent     := reports.firstEvent
  line.nextEvent      := reports.nextEvent

  private val frames = Module(new FrameArbiter)
  frames.in(0) <> sender.bytes
  frames.in(1) <> arp.bytes
  plant.bytes <> frames.out
  plant.step         := processStep
  transmitters(1).in := plant.out

  reports.status.master   := value.uint("master_id")
  reports.status.boot     := value.uint("boot_number")
  reports.status.selfTest := value.uint("master_self_test")
  reports.status.present  := line.present
  reports.status.known    := line.known
  reports.status.lost     := framesLost
  reports.status.time     := time

  // What the host asks for: each bit that starts something returns to 0 at once.
  private def action(name: String): Bool = {
    registers.set.load(name).valid := value.bool(name)
    registers.set.load(name).bits  := 0.U
    value.bool(name)
  }
  private val alarmOn = RegInit(false.B) // reset: quiet
  when(action("buzzer_off")) { alarmOn := false.B }
  when(line.alarm) { alarmOn := true.B }
  alarm.buzzer := alarmOn
  alarm.lamp   := alarmOn

  // A datagram of the host. Reset: none asked for, none back.
  private val requestWaits = RegInit(false.B)
  private val requestFlies = RegInit(false.B)
  private val requestDone  = RegInit(false.B)
  private val requestBusy  = requestWaits || requestFlies
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
  reports.event(0) <> line.event
  reports.event(1) <> own.event

  // The mailbox: reading a byte leads to the next.
  private val offset = registers.set.load("mailbox_offset")
  offset.valid := registers.reads(MasterRegisters.MailboxData) || action("mailbox_done")
  offset.bits  := Mux(value.bool("mailbox_done"), 0.U, value.uint("mailbox_offset") + 1.U)
  irq          := link.waiting || requestDone

  status.uint("slaves_present")   := line.present
  status.uint("slaves_known")     := line.known
  status.uint("line_link")        := links(0)
  status.uint("plant_link")       := links(1)
  status.uint("mailbox_waiting")  := link.waiting
  status.uint("request_done")     := requestDone
  status.uint("request_busy")     := requestBusy
  status.uint("alarm_latched")    := alarmOn
  status.uint("host_event_busy")  := own.busy
  status.uint("frames_lost")      := framesLost
  status.uint("master_time")      := time
  status.uint("request_answered") := requestAnswered
  status.uint("mailbox_length")   := Mux(link.waiting, link.length, 0.U)
  status.uint("mailbox_data")     := link.readData

  registers.event.pulse("refused_datagrams") := link.refused
  registers.event.pulse("dropped_messages")  := link.dropped
  for (y <- 0 until 2)
    registers.event.pulse(s"invalid_frame_port$y") := receivers(y).events.invalidFrame
}

object MasterController {
  private val SlotsPerUs = 25

  /** Source address of frames to the line, first byte in the low bits, behind it the master ID: bit 1 of the
    * first byte, which slaves set, must be 0.
    */
  private val LineSource = 0x796c6604

  /** Places for events until the server has them. */
  val EventPlaces = 256
}
