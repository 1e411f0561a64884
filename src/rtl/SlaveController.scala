package flyframe

import chisel3._
import chisel3.util._
import flyframe.alarm.{AlarmPins, DatagramAppender}
import flyframe.application.{LedPins, LocalSide}
import flyframe.clocks.LevelCrossing
import flyframe.frame.FrameProcessor
import flyframe.memory.{EscMemory, HostPort}
import flyframe.mii.{MiiTransmitter, NibbleStream}
import flyframe.params.EscParams
import flyframe.port.{LoopControl, SlotTimer, TemporaryLoops}
import flyframe.protocol.AppendedLayout
import flyframe.registers.{DlRegisters, Register}
import flyframe.sii.SiiPins

/** An EtherCAT slave controller: 1 to 4 MII ports, the processing unit, registers, memory and a host port.
  *
  * The wire path, in the order of LP-07: port 0 - processing unit - port 3 - port 1 - port 2 - port 0; a
  * closed loop passes the stream on, an open one sends it out and goes on with what comes in. Each nibble
  * slot has three steps, one core cycle apart: receivers give a nibble, the processing unit takes it,
  * transmitters send.
  *
  * @param p
  *   a parameter set without [[EscParams.problems]]
  * @param added
  *   registers of a product beside those of the units; it is a subclass that connects them
  */
class SlaveController(p: EscParams, added: Seq[Register] = Nil) extends Module {
  override def desiredName = p.topName

  val phy_clk_ref = IO(Input(Bool()))

  /** High when the local configuration is loaded: an input, or what the SII interface found. */
  val pdi_operational = Option.when(!p.hasSii)(IO(Input(Bool())))
  val eeprom_loaded   = Option.when(p.hasSii)(IO(Output(Bool())))
  val mii             = IO(Vec(p.ports, new MiiPort))
  val mii_tx_tick     = IO(Output(Bool()))

  /** Holds the PHYs in reset while the controller is, so that no link appears (PHY-01); low active, as PHYs
    * want it.
    */
  val phy_reset_n = IO(Output(Bool()))
  val host        = IO(new HostPort(p.lanes))

  /** Interrupt to the host, a level (IRQ-01). */
  val irq = Option.when(p.hasApplicationLayer || p.hasAlarm)(IO(Output(Bool())))

  /** I2C EEPROM: 1 pulls a line low; high while the EEPROM has two address bytes. */
  val sii = Option.when(p.hasI2c)(IO(new SiiPins))

  /** LEDs, high = lit. */
  val led = Option.when(p.hasLeds)(IO(new LedPins(p.ports)))

  /** Digital outputs: their levels, and whether they are driven (SM-26). */
  val digital_output        = Option.when(p.digitalOutputs > 0)(IO(Output(UInt((8 * p.digitalOutputs).W))))
  val digital_output_driven = Option.when(p.digitalOutputs > 0)(IO(Output(Bool())))

  /** Smoke detector, buzzer and lamp. */
  val alarm = Option.when(p.hasAlarm)(IO(new AlarmPins))

  private val portNumbers = 0 until p.ports
  private val ready       = Wire(Bool()) // register RAM cleared after reset: frames may come
  phy_reset_n := !reset.asBool

  // The three steps of a nibble slot.
  private val slot                    = Module(new SlotTimer(p.cyclesPerNibble))
  private val receiveStep             = slot.tick
  private def later(step: Bool): Bool = if (p.cyclesPerNibble == 1) step else RegNext(step, false.B)
  private val processStep             = later(receiveStep)
  private val transmitStep            = later(processStep)
  slot.reference := phy_clk_ref

  /** Registers and RAM; a subclass connects what it has added. */
  protected val memory       = Module(new EscMemory(p, added))
  private val processor      = Module(new FrameProcessor(p, added))
  private val loops          = Module(new LoopControl(p))
  private val temporaryLoops = Module(new TemporaryLoops(p))
  private val value          = memory.value

  // Receivers.
  private val links = mii.map { port =>
    val crossing = Module(new LevelCrossing)
    crossing.in := port.link
    crossing.out && ready
  }
  private val receivers = mii.zip(links).map { case (port, link) =>
    MiiPort.receiver(port, link, receiveStep, value.uint("rx_fifo_size") < 4.U, p.coreClockMhz)
  }

  // The wire path.
  private val transmitters = portNumbers.map(_ => Module(new MiiTransmitter))
  private def through(number: Int, stream: NibbleStream): NibbleStream = {
    val open = loops.open(number)
    transmitters(number).in := Mux(open, stream, NibbleStream.idle)
    loops.quiet(number)     := receivers(number).idle && !stream.valid
    Mux(open, receivers(number).out, stream)
  }
  private val order = Seq(3, 1, 2, 0).filter(_ < p.ports)
  processor.step := processStep
  // Behind the processing unit frames may get a datagram of this slave (AP-01).
  private val appender =
    Option.when(p.hasAlarm)(Module(new DatagramAppender(AppendedLayout.bytes, p.maxSubTelegrams)))
  appender.foreach { a =>
    a.step     := processStep
    a.in       := processor.out
    a.position := processor.outPosition.get
  }
  private val processed = appender.fold(processor.out)(_.out)
  processor.in := order.foldLeft(processed)((stream, number) => through(number, stream))

  for ((port, transmitter) <- mii.zip(transmitters)) {
    transmitter.tick := transmitStep
    port.tx_en       := ShiftRegister(transmitter.txEn, p.txShift)
    port.txd         := ShiftRegister(transmitter.txd, p.txShift)
  }
  mii_tx_tick := ShiftRegister(transmitStep, p.txShift + 1)

  // Processing unit and memory.
  processor.config.stationAddress     := value.uint("station_address")
  processor.config.stationAlias       := value.uint("station_alias")
  processor.config.aliasEnable        := value.bool("alias_enable")
  processor.config.destroyNonEtherCat := value.bool("destroy_non_ethercat")
  processor.config.circulating        := loops.circulating
  memory.ecat <> processor.memory
  ready := !memory.clearing

  // Local side: host port, SyncManagers, SII EEPROM, application layer.
  /** Tells a subclass when its registers are read and written. */
  protected val local = new LocalSide(p, memory, processor, added)
  local.host(host)
  private val operational = pdi_operational match {
    case Some(pin) =>
      val crossing = Module(new LevelCrossing)
      crossing.in := pin
      crossing.out
    case None => local.sii(sii)
  }
  memory.ramOpen := operational
  eeprom_loaded.foreach(_ := operational)
  private val dlStatus = Cat((3 to 0 by -1).flatMap { y =>
    if (y < p.ports) Seq(links(y), loops.reportClosed(y)) else Seq(false.B, true.B)
  } ++ (3 to 0 by -1).map(y => if (y < p.ports) links(y) else false.B) ++ Seq(false.B, false.B, operational))
  private val events = local.application(dlStatus)
  processor.config.ecatEvents := events.irqField
  private val messages = alarm.zip(appender).map { case (pins, a) => local.alarm(pins, a, links) }
  irq.foreach(_ := events.irq || messages.getOrElse(false.B))
  digital_output.foreach(_ := value.uint("digital_output"))
  digital_output_driven.foreach(_ := operational && local.processDataRuns)
  led.foreach(local.leds(_, links, receivers.zip(transmitters).map { case (r, t) => !r.idle || t.txEn }))

  // Loop control.
  private def setting(y: Int) = value.uint(s"loop_port$y")
  private val loopByte        = DlRegisters.LoopByte
  private val written         = memory.registerWrite
  loops.settingWritten := written.valid &&
    Cat(written.bits.address, 0.U(log2Ceil(p.lanes).W)) === (loopByte / p.lanes * p.lanes).U &&
    written.bits.mask(loopByte % p.lanes)
  temporaryLoops.commitStarts            := memory.commitStarts
  temporaryLoops.temporary               := value.bool("temporary_use")
  memory.set.load("temporary_use").valid := temporaryLoops.restore
  memory.set.load("temporary_use").bits  := 0.U
  for (y <- portNumbers) {
    loops.link(y) := links(y)
    // Not before all register writes of a frame are done, so that no loop moves to and fro. Reset: as the
    // register.
    loops.setting(y)                      := RegEnable(setting(y), 0.U, !memory.registersBusy)
    loops.goodFrame(y)                    := receivers(y).events.goodFrame
    temporaryLoops.setting(y)             := setting(y)
    memory.set.load(s"loop_port$y").valid := temporaryLoops.restore
    memory.set.load(s"loop_port$y").bits  := temporaryLoops.former(y)
  }

  // Status and counters.
  memory.status.uint("pdi_operational") := operational
  memory.event.pulse("epu_error")       := processor.error
  for (y <- portNumbers) {
    val events = receivers(y).events
    val counts = loops.open(y)
    memory.status.uint(s"physical_link_port$y")   := links(y)
    memory.status.uint(s"communication_port$y")   := links(y)
    memory.status.uint(s"loop_closed_port$y")     := loops.reportClosed(y)
    memory.event.pulse(s"invalid_frame_port$y")   := events.invalidFrame && counts
    memory.event.pulse(s"rx_er_port$y")           := events.rxEr && counts
    memory.event.pulse(s"forwarded_error_port$y") := events.forwardedError && counts
    memory.event.pulse(s"lost_link_port$y") := RegNext(links(y), false.B) && !links(y) && counts &&
      setting(y) === flyframe.protocol.LoopSetting.Auto.U
  }
}
