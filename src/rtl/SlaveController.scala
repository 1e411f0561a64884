package flyframe

import chisel3._
import chisel3.util._
import scala.reflect.ClassTag
import flyframe.application.{
  Application,
  GeneralPurposeIo,
  GeneralPurposePins,
  LedPins,
  Leds,
  ResetRequest,
  Watchdogs
}
import flyframe.clocks.LevelCrossing
import flyframe.dc.{ClockPins, DistributedClocks, PortActivity}
import flyframe.frame.{FrameProcessor, Stage}
import flyframe.host.{DigitalIo, DigitalPins, HostErrors, HostInterface, HostSequencer}
import flyframe.memory.{EscMemory, FrameEvents, HostPort, RegisterBus, RegisterUnit, WriteProtection}
import flyframe.mi.{LinkUnit, MiPins, MiUnit}
import flyframe.mii.Port
import flyframe.params.EscParams
import flyframe.port.{DataLink, SlotTimer}
import flyframe.registers.RegisterMap
import flyframe.sii.{SiiPins, SiiUnit}
import flyframe.syncmanager.SyncManagerUnit

/** An EtherCAT slave controller: 1 to 4 ports with MII or RMII, the processing unit, registers, memory and a
  * host port.
  *
  * The wire path, in the order of LP-07: port 0 - processing unit - port 3 - port 1 - port 2 - port 0; a
  * closed loop passes the stream on, an open one sends it out and goes on with what comes in. Each nibble
  * slot has three steps, one core cycle apart: receivers give a nibble, the processing unit takes it,
  * transmitters send.
  *
  * Its reset begins at any time, with the clock or without, and must end in step with it (B-119): the clear
  * of flip-flops costs no logic, unlike a reset at their inputs.
  *
  * @param p
  *   a parameter set without [[EscParams.problems]]
  * @param added
  *   units of a product beside those that the parameters ask for; made inside of the controller
  * @param besides
  *   what a product has at the host port beside the controller, likewise: takes its part of the port, and
  *   gives back the controller's
  */
class SlaveController(
    p: EscParams,
    added: => Seq[RegisterUnit] = Nil,
    besides: HostPort => HostPort = identity
) extends Module
    with RequireAsyncReset {
  override def desiredName = p.topName

  val phy_clk_ref = IO(Input(Bool()))

  /** High when the local configuration is loaded: an input, or what the SII interface found. */
  val pdi_operational = Option.when(!p.hasSii)(IO(Input(Bool())))
  val eeprom_loaded   = Option.when(p.hasSii)(IO(Output(Bool())))
  val mii_tx_tick     = IO(Output(Bool()))

  /** Holds the PHYs in reset while the controller is, so that no link appears (PHY-01); low active, as PHYs
    * want it.
    */
  val phy_reset_n = IO(Output(Bool()))

  /** Where the host is connected. */
  private val connection = HostInterface(p)
  val hostPins: Bundle   = connection.pins
  private val host       = besides(connection.port)

  /** I2C EEPROM: 1 pulls a line low; high while the EEPROM has two address bytes. */
  val sii = Option.when(p.hasI2c)(IO(new SiiPins))

  /** MII management of the PHYs. */
  val mi = Option.when(p.hasMi)(IO(new MiPins))

  /** Resets of the ports' PHYs, low active: while the controller is reset, and when a PHY must begin anew. */
  val phy_port_reset_n = Option.when(p.resetsPhys)(IO(Output(Vec(p.ports, Bool()))))

  /** Bus or host ask for a reset of the whole chip, this controller included. */
  val reset_request = Option.when(p.hasResetRegisters)(IO(Output(Bool())))

  /** SYNC and LATCH signals of distributed clocks. */
  val clock_signals = Option.when(p.hasClockPins)(IO(new ClockPins(p)))

  /** LEDs, high = lit. */
  val led = Option.when(p.hasLeds)(IO(new LedPins(p.ports)))

  /** Digital outputs: their levels, and whether they are driven (SM-26); digital inputs. */
  val digital = Option.when(p.digitalOutputs + p.digitalInputs > 0)(IO(new DigitalPins(p)))

  /** General purpose outputs and inputs. */
  val general = Option.when(p.generalOutputs + p.generalInputs > 0)(IO(new GeneralPurposePins(p)))

  private val ports = Seq.tabulate(p.ports)(Port(p, _))

  /** Pins of the ports, by their numbers. */
  val phys: Seq[Bundle] = Port.pins(ports)

  phy_reset_n := !reset.asBool

  // The three steps of a nibble slot.
  private val slot                    = Module(new SlotTimer(p.cyclesPerNibble))
  private val receiveStep             = slot.tick
  private def later(step: Bool): Bool = if (p.cyclesPerNibble == 1) step else RegNext(step, false.B)
  private val processStep             = later(receiveStep)
  private val transmitStep            = later(processStep)
  slot.reference := phy_clk_ref

  // What a product adds, and its registers, as far as the parameters have not got them already.
  private val addedUnits     = added
  private val addedRegisters = addedUnits.flatMap(_.registers).diff(RegisterMap(p))

  /** The unit of this class among those added, which there must be. */
  protected def unit[U <: RegisterUnit: ClassTag]: U = addedUnits.collectFirst { case u: U => u }.get

  private val memory    = Module(new EscMemory(p, addedRegisters))
  private val processor = Module(new FrameProcessor(p, addedRegisters))
  private val bus = new RegisterBus(
    p,
    memory,
    RegisterMap(p, addedRegisters),
    FrameEvents(
      processor.memory.frameStart && !processor.busy,
      processor.frameGood,
      processor.frameBad,
      processor.busy,
      processor.error,
      processor.reads
    ),
    host.ack
  )

  for (port <- ports) {
    port.core.receiveStep  := receiveStep
    port.core.transmitStep := transmitStep
    port.core.enable       := !memory.clearing // the register RAM, after a reset: then frames may come
    port.core.shortMargin  := bus.value("rx_fifo_size") < 4.U
  }
  mii_tx_tick := ShiftRegister(transmitStep, p.txShift + 1)

  // Units, each with its registers.
  private val dataLink = new DataLink(p, ports.map(_.core), linkUnit.fold(ports.map(_.core.link))(_.physical))
  private val syncManagers = Option.when(p.syncManagers > 0)(new SyncManagerUnit(p))
  private val eeprom       = Option.when(p.hasSii)(new SiiUnit(p, sii))
  private val management   = mi.map(new MiUnit(p, _))
  private val linkUnit = Option.when(p.detectsLinks)(
    new LinkUnit(
      p,
      ports.map(_.core),
      management.flatMap(_.own),
      phy_port_reset_n,
      eeprom.map(e => (e.loading, e.loadFailed))
    )
  )
  private val resets     = reset_request.map(new ResetRequest(_))
  private val protection = processor.protection.map(new WriteProtection(_))
  private val watchdogs =
    Option.when(p.hasWatchdogs)(new Watchdogs(p, syncManagers.map(_.trigger)))
  private val application = Option.when(p.hasApplicationLayer)(new Application(p))
  private val purposes    = general.map(new GeneralPurposeIo(p, _))
  private val digitalIo = digital.map { pins =>
    val port = Option.when(p.isDigitalIo)(host)
    new DigitalIo(p, pins, port, clock_signals.fold(Seq.empty[Bool])(_.sync), watchdogs.get.triggers)
  }
  private val hostErrors = connection.side.map(new HostErrors(_))
  private val leds = led.map { pins =>
    val active = ports.map(port => !port.core.receiverIdle || !port.core.transmitterIdle)
    new Leds(p, pins, ports.map(_.core.link), active, eeprom, watchdogs)
  }
  private val clocks = processor.stamps.map { request =>
    val activity = ports.map(port => PortActivity(port.core.fromWire.valid, port.core.waited, port.core.link))
    new DistributedClocks(p, activity, request, clock_signals, syncManagers.flatMap(_.events))
  }
  private val units =
    Seq(dataLink) ++ syncManagers ++ eeprom ++ management ++ linkUnit ++ resets ++ protection ++ watchdogs ++
      application ++ purposes ++ digitalIo ++ hostErrors ++ leds ++ clocks ++ addedUnits
  private val unlisted = units.flatMap(_.registers).diff(RegisterMap(p, addedRegisters)).map(_.name)
  require(unlisted.isEmpty, s"registers ${unlisted.mkString(", ")} are of units but must be in RegisterMap.")
  units.foreach(_.connect(bus))

  connection.side.foreach { side =>
    side.events := (if (p.hasApplicationLayer) bus.whole("al_event_request") else 0.U)
  }

  /** Interrupt to the host, a level (IRQ-01). */
  val irq = bus.interruptLevel.filterNot(_ => p.isDigitalIo).map { level =>
    val pin = IO(Output(Bool()))
    pin := level
    pin
  }

  // The wire path. Behind the processing unit stands what units have there.
  private val stages = units.collect { case s: Stage => s }
  require(stages.size <= 1, s"there are ${stages.size} stages behind the frame processor but must be 0 or 1.")
  private val processed = stages.foldLeft(processor.out) { (stream, stage) =>
    stage.pass(processStep, stream, processor.outPosition)
  }
  private val order = Seq(3, 1, 2, 0).filter(_ < p.ports)
  processor.step := processStep
  processor.in   := order.foldLeft(processed)((stream, number) => dataLink.through(number, stream))

  // Processing unit and memory.
  processor.config.stationAddress     := bus.value("station_address")
  processor.config.stationAlias       := bus.value("station_alias")
  processor.config.aliasEnable        := bus.bool("alias_enable")
  processor.config.destroyNonEtherCat := bus.bool("destroy_non_ethercat")
  processor.config.circulating        := dataLink.circulating
  processor.config.ecatEvents         := application.fold(0.U)(_.irqField)
  processor.config.readWriteOffset    := (if (p.hasReadWriteOffset) bus.value("read_write_offset") else 0.U)
  processor.tableWrite.foreach(_ := bus.tableWrite)
  memory.ecat <> processor.memory

  // The host reaches memory through SyncManagers, where there are any.
  syncManagers match {
    case None => memory.host <> host
    case Some(sms) =>
      val sequencer = Module(new HostSequencer(p, addedRegisters)).suggestName("hostSequencer")
      sequencer.host <> host
      memory.host <> sequencer.memory
      sequencer.areas <> sms.pdi
      sms.hostIsQuiet := sequencer.quiet
      processor.areas.get <> sms.ecat
      processor.buffersSettled.get := sms.settled
  }

  // Configuration is loaded: the process data RAM opens.
  private val operational = eeprom.fold(LevelCrossing(pdi_operational.get))(_.loaded)
  bus.status("pdi_operational") := operational
  if (p.acknowledgesByWrite) {
    bus.status("pdi_active")     := operational
    bus.status("pdi_configured") := (if (p.hasSii) operational else false.B)
  }
  memory.ramOpen := operational
  eeprom_loaded.foreach(_ := operational)
}
