package flyframe

import chisel3._
import chisel3.util.Cat
import flyframe.application.{GeneralPurposePins, LedPins}
import flyframe.dc.ClockPins
import flyframe.host.{DigitalPins, HostOf}
import flyframe.mi.Phys
import flyframe.mii.{MiiPins, RmiiPins}
import flyframe.sii.SiiPins
import flyframe.params.EscParams

/** The controller with a bench's part of each nibble slot ([[Slots]]).
  *
  * @param controller
  *   makes it, or that of a product
  * @param rawHost
  *   the test is at the pins of the host interface, and `host` is at nothing
  */
class ControllerUnderTest(
    p: EscParams,
    controller: EscParams => SlaveController = Controller.slave(_),
    rawHost: Boolean = false
) extends Module {

  /** RX_DV, RX_ER and RXD, six bits per port, port 0 at the right. */
  val rx = IO(Input(UInt((6 * p.ports).W)))

  /** Those of [[Slots]]. */
  val run  = IO(Input(Bool()))
  val seen = IO(Output(UInt(Seen.width(p).W)))

  val link   = IO(Input(Vec(p.ports, Bool())))
  val loaded = IO(Input(Bool()))

  /** `phy_reset_n` of the controller. */
  val phyResetN = IO(Output(Bool()))
  val host      = IO(new memory.HostPort(p.lanes))

  val irq = IO(Output(Bool()))

  /** The controller's, where it has them. */
  val sii          = Option.when(p.hasI2c)(IO(new SiiPins))
  val eepromLoaded = Option.when(p.hasSii)(IO(Output(Bool())))
  val led          = Option.when(p.hasLeds)(IO(new LedPins(p.ports)))

  val digital = Option.when(p.digitalOutputs + p.digitalInputs > 0)(IO(new DigitalPins(p)))

  /** The PHYs on the management bus; and the management data line is driven from both ends. */
  val phys         = Option.when(p.hasMi)(IO(new PhyControl))
  val resetRequest = Option.when(p.hasResetRegisters)(IO(Output(Bool())))
  val phyResetsN   = Option.when(p.resetsPhys)(IO(Output(UInt(p.ports.W))))

  val general      = Option.when(p.generalOutputs + p.generalInputs > 0)(IO(new GeneralPurposePins(p)))
  val clockSignals = Option.when(p.hasClockPins)(IO(new ClockPins(p)))

  /** The comparators of the smoke detector's current. */
  val current = Option.when(p.hasAlarm)(IO(Input(UInt(3.W))))

  /** The configuration of the device is damaged. */
  val damaged = Option.when(p.hasAlarm)(IO(Input(Bool())))

  private val dut = withReset(reset.asAsyncReset)(Module(controller(p)))
  dut match {
    case slave: AlarmSlave =>
      slave.alarm.current      := current.get
      slave.alarm.config_fault := damaged.get
    case _ =>
  }
  irq             := dut.irq.getOrElse(false.B)
  dut.phy_clk_ref := false.B
  dut.pdi_operational.foreach(_ := loaded)
  phyResetN := dut.phy_reset_n

  /** The pins of the host interface. */
  val hostPins = Option.when(rawHost)(IO(chiselTypeOf(dut.hostPins)))
  hostPins match {
    case Some(pins) =>
      pins <> dut.hostPins
      host.ack   := false.B
      host.rdata := 0.U
    case None => HostOf(p, dut.hostPins, host)
  }
  sii.foreach(dut.sii.get <> _)
  eepromLoaded.foreach(_ := dut.eeprom_loaded.get)
  led.foreach(_ := dut.led.get)
  digital.foreach(_ <> dut.digital.get)
  for (pins <- dut.mi; control <- phys) {
    val all = Module(
      new Phys(p.coreClockMhz)
    ) // with the controller in reset, but for what the PHYs' registers hold (PHY-01)
    all.mdc       := pins.mdc
    all.line      := pins.mdio_out || !pins.mdio_enable
    all.present   := control.present
    all.at        := control.at
    all.store     := control.store
    control.value := all.value
    val collided = RegInit(false.B)
    when(all.drives && pins.mdio_enable) { collided := true.B }
    control.collided := collided
    pins.mdio_in     := all.level
  }
  general.foreach(_ <> dut.general.get)
  clockSignals.foreach(_ <> dut.clock_signals.get)
  resetRequest.foreach(_ := dut.reset_request.get)
  phyResetsN.foreach(_ := dut.phy_port_reset_n.get.asUInt)

  private val slots = Module(new Slots(p))
  slots.run    := run
  slots.txTick := dut.mii_tx_tick
  slots.others := Cat(host.ack, sii.fold(false.B)(_.scl_low), sii.fold(false.B)(_.sda_low))
  seen         := slots.seen
  for (y <- 0 until p.ports) {
    val symbol = rx(6 * y + 5, 6 * y)
    dut.phys(y) match {
      case mii: MiiPins =>
        mii.rx_clk        := slots.rxClock.asClock
        mii.rx_dv         := symbol(5)
        mii.rx_er         := symbol(4)
        mii.rxd           := symbol(3, 0)
        mii.link          := link(y)
        slots.tx(y).valid := mii.tx_en
        slots.tx(y).bits  := mii.txd
      case rmii: RmiiPins =>
        val phy = Module(new RmiiPhy(p.cyclesPerNibble))
        phy.rxClock := slots.rxClock
        phy.rx.dv   := symbol(5)
        phy.rx.er   := symbol(4)
        phy.rx.data := symbol(3, 0)
        phy.rmii <> rmii
        phy.txTick  := dut.mii_tx_tick
        phy.linkUp  := link(y)
        slots.tx(y) := phy.tx
    }
  }
}

/** A test's access to [[flyframe.mi.Phys]]. */
class PhyControl extends Bundle {
  val present = Input(UInt(32.W))
  val at      = Input(UInt(10.W))
  val value   = Output(UInt(16.W))
  val store   = Input(chisel3.util.Valid(UInt(16.W)))

  /** The data line has been driven from both ends. */
  val collided = Output(Bool())
}
