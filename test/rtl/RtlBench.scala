package flyframe

import chisel3._
import chiseltest._
import flyframe.application.{GeneralPurposePins, LedPins}
import flyframe.dc.ClockPins
import flyframe.host.{DigitalPins, HostOf}
import flyframe.mi.{PhyRegisters, Phys}
import flyframe.mii.{MiiPins, RmiiPins}
import flyframe.sii.SiiPins
import flyframe.model.{SentFrame, Symbol, WireFrame}
import flyframe.params.EscParams
import flyframe.protocol.DetectorState
import flyframe.rules.{Bench, EepromImage, Line}
import flyframe.sii.I2cEeprom

/** The controller with its receive clocks as plain inputs, as chiseltest needs them.
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
  val rxClock = IO(Input(Vec(p.ports, Bool())))
  val rxDv    = IO(Input(Vec(p.ports, Bool())))
  val rxEr    = IO(Input(Vec(p.ports, Bool())))
  val rxd     = IO(Input(Vec(p.ports, UInt(4.W))))
  val link    = IO(Input(Vec(p.ports, Bool())))
  val txEn    = IO(Output(Vec(p.ports, Bool())))
  val txd     = IO(Output(Vec(p.ports, UInt(4.W))))
  val txTick  = IO(Output(Bool()))
  val loaded  = IO(Input(Bool()))

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
  txTick    := dut.mii_tx_tick
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
  for (y <- 0 until p.ports) {
    dut.phys(y) match {
      case mii: MiiPins =>
        mii.rx_clk := rxClock(y).asClock
        mii.rx_dv  := rxDv(y)
        mii.rx_er  := rxEr(y)
        mii.rxd    := rxd(y)
        mii.link   := link(y)
        txEn(y)    := mii.tx_en
        txd(y)     := mii.txd
      case rmii: RmiiPins =>
        val phy = Module(new RmiiPhy(p.cyclesPerNibble))
        phy.rxClock := rxClock(y)
        phy.rx.dv   := rxDv(y)
        phy.rx.er   := rxEr(y)
        phy.rx.data := rxd(y)
        phy.rmii <> rmii
        phy.txTick := txTick
        phy.linkUp := link(y)
        txEn(y)    := phy.tx.valid
        txd(y)     := phy.tx.bits
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

/** Drives a [[ControllerUnderTest]] with nominal clocks. */
class RtlBench(dut: ControllerUnderTest, val p: EscParams) extends Bench {
  private val cycles = p.cyclesPerNibble
  dut.clock.setTimeout(0)

  /** Called before every core cycle with its number. */
  var eachCycle: Long => Unit = _ => ()
  def now: Long               = cycle

  private var cycle    = 0L
  private var running  = Map.empty[Int, Vector[Int]] // nibbles of the frame that is leaving a port
  private var finished = Vector.empty[(Int, SentFrame)]
  private var eeprom   = Option.empty[I2cEeprom]

  reset()

  /** Back to the state after power-on, all links up; an EEPROM holds zeros with a right checksum. */
  def reset(): Unit = if (p.hasI2c) {
    powerOn(EepromImage())
    if (p.isDigitalIo) while (!dut.eepromLoaded.get.peek().litToBoolean) idle(100)
    else while ((hostRead(0x0503) & 0x80) != 0) idle(100)
  } else restart()

  def powerOn(image: Seq[Int]): Unit = {
    eeprom = Some(new I2cEeprom(image.toArray, twoByte = image.size > 2048))
    dut.sii.get.two_byte.poke(image.size > 2048)
    restart()
  }

  private def restart(): Unit = {
    for (y <- 0 until p.ports) {
      dut.link(y).poke(!p.isLinkLow(y))
      dut.rxDv(y).poke(false)
      dut.rxEr(y).poke(false)
    }
    dut.loaded.poke(true)
    setLine(DetectorState.Normal)
    dut.damaged.foreach(_.poke(false))
    dut.host.req.poke(false)
    for (pins <- dut.general; inputs <- pins.input) inputs.poke(0)
    for (pins <- dut.digital) {
      pins.input.foreach(_.poke(0))
      pins.latch.foreach(_.poke(false))
      pins.output_enable.foreach(_.poke(true))
    }
    for (pins <- dut.clockSignals; latch <- pins.latch) latch.poke(false)
    dut.reset.poke(true.B)
    idle(4)
    if (p.hasMi) powerOnPhys()
    dut.reset.poke(false.B)
    idle(if (p.hasRegisterRam) 560 / p.cyclesPerNibble + 40 else 40)
    running = Map.empty
  }

  /** One nibble slot with the given symbol at one port. */
  private def slot(port: Int, dv: Boolean, er: Boolean, data: Int): Unit =
    slot(dv, Map(port -> Symbol(data, er)))

  /** One nibble slot with the given symbols, by port. Receive clocks rise in the middle of the slot. */
  private def slot(dv: Boolean, symbols: Map[Int, Symbol]): Unit = {
    for (y <- 0 until p.ports) {
      val symbol = symbols.get(y)
      dut.rxDv(y).poke(dv && symbol.isDefined)
      dut.rxEr(y).poke(symbol.exists(_.error))
      dut.rxd(y).poke(symbol.fold(0)(_.nibble))
    }
    for (c <- 0 until cycles) {
      for (y <- 0 until p.ports) dut.rxClock(y).poke(c == cycles / 2)
      step()
    }
    for (y <- 0 until p.ports) dut.rxClock(y).poke(false)
    dut.txTick.peek() // lets the simulator see the falling edge, where a slot is only one cycle long
  }

  private def step(): Unit = {
    eachCycle(cycle)
    for (e <- eeprom; pins <- dut.sii) {
      val sda = !pins.sda_low.peek().litToBoolean
      e.step(!pins.scl_low.peek().litToBoolean, sda && !e.pulls)
      pins.sda.poke(sda && !e.pulls)
    }
    dut.clock.step()
    cycle += 1
    if (dut.txTick.peek().litToBoolean)
      for (y <- 0 until p.ports) {
        val soFar = running.getOrElse(y, Vector.empty)
        if (dut.txEn(y).peek().litToBoolean) running += y -> (soFar :+ dut.txd(y).peek().litValue.toInt)
        else if (soFar.nonEmpty) {
          val (preamble, rest) = soFar.span(_ == 5)
          assert(rest.headOption.contains(0xd), s"port $y sent no SFD: $soFar")
          finished :+= y -> SentFrame(preamble.size, rest.tail)
          running -= y
        }
      }
  }

  /** Lets `slots` nibble slots pass without a frame. */
  def idle(slots: Int): Unit = (0 until slots).foreach(_ => slot(0, dv = false, er = false, 0))

  def setLink(port: Int, up: Boolean): Unit = {
    dut.link(port).poke(up != p.isLinkLow(port))
    idle(20)
  }

  def setLoaded(loaded: Boolean): Unit = {
    dut.loaded.poke(loaded)
    idle(4)
  }

  /** Frames at several ports at the same time, each beginning `delay` slots from now: what left, and where,
    * in the order in which it ended.
    */
  def sendTogether(frames: (Int, Int, WireFrame)*): Seq[(Int, SentFrame)] = {
    finished = Vector.empty
    for (now <- 0 until frames.map { case (_, delay, frame) => delay + frame.symbols.size }.max)
      slot(
        dv = true,
        frames.flatMap { case (port, delay, frame) => frame.symbols.lift(now - delay).map(port -> _) }.toMap
      )
    idle(24 + p.writeLogDepth / cycles + 8)
    finished
  }

  def send(port: Int, frame: WireFrame): Option[(Int, SentFrame)] = {
    finished = Vector.empty
    frame.symbols.foreach(s => slot(port, dv = true, s.error, s.nibble))
    idle(24 + p.writeLogDepth / cycles + 8 + (if (p.hasAlarm) 64 else 0))
    assert(finished.size <= 1, s"one frame in, ${finished.size} frames out")
    finished.headOption
  }

  /** The receive clocks rest meanwhile, which saves time. */
  def advanceMs(ms: Int): Unit = {
    dut.clock.step(ms * 25000 * cycles)
    idle(8)
  }
  def advanceUs(us: Int): Unit = {
    idle(us * 25)
    dut.phys.foreach(control => assert(!control.collided.peek().litToBoolean, "both ends drive MDIO"))
  }

  private def digital           = dut.digital.get
  def damage(): Unit            = dut.damaged.foreach(_.poke(true))
  def setLine(state: Int): Unit = dut.current.foreach(_.poke(Line.current(state)))
  def outputs: Option[Int] =
    Option.when(digital.output_driven.get.peek().litToBoolean)(digital.output.get.peek().litValue.toInt)
  def setDigitalInputs(levels: Int): Unit =
    digital.input.get.poke(BigInt(levels) & ((BigInt(1) << 8 * p.digitalInputs) - 1))
  def setInputLatch(level: Boolean): Unit = {
    digital.latch.get.poke(level)
    idle(40) // it crosses, and the inputs are written
  }
  def setOutputEnable(level: Boolean): Unit = {
    digital.output_enable.get.poke(level)
    idle(4)
  }
  def generalOutputs: BigInt = dut.general.get.output.get.peek().litValue
  def setGeneralInputs(levels: BigInt): Unit = {
    dut.general.get.input.get.poke(levels)
    idle(4) // they cross
  }
  def interrupt: Boolean         = dut.irq.peek().litToBoolean
  def syncLevel(n: Int): Boolean = dut.clockSignals.get.sync(n).peek().litToBoolean
  def setLatch(n: Int, level: Boolean): Unit = {
    dut.clockSignals.get.latch(n).poke(level)
    idle(40) // it crosses, and its time is taken
  }

  private var there = BigInt(0) // addresses of the PHYs that answer
  private def powerOnPhys(): Unit = {
    there = 0
    for (y <- 0 until p.ports; a = p.phyAddress(y)) {
      phys.insert(a)
      for (r <- 0 until 32) phys.set(a, r, Phys.PowerOn.getOrElse(r, 0))
    }
  }
  object phys extends PhyRegisters {
    private val control                        = dut.phys.orNull
    private def point(phy: Int, register: Int) = control.at.poke(phy << 5 | register)
    private def change(now: BigInt): Unit = {
      there = now
      control.present.poke(now)
    }
    def get(phy: Int, register: Int): Int = {
      point(phy, register)
      control.value.peek().litValue.toInt
    }
    def set(phy: Int, register: Int, value: Int): Unit = {
      point(phy, register)
      control.store.valid.poke(true)
      control.store.bits.poke(value)
      dut.clock.step()
      control.store.valid.poke(false)
    }
    def remove(phy: Int): Unit = change(there.clearBit(phy))
    def insert(phy: Int): Unit = change(there.setBit(phy))
  }
  def resetRequested: Boolean = {
    step() // the request stands in a register
    dut.resetRequest.exists(_.peek().litToBoolean)
  }
  def phyResets: Int = dut.phyResetsN.fold(0)(n => ~n.peek().litValue.toInt & (1 << p.ports) - 1)

  /** Symbols with RX_ER outside a frame. */
  def falseCarrier(port: Int, symbols: Int): Unit = {
    (0 until symbols).foreach(_ => slot(port, dv = false, er = true, 0xe))
    idle(8)
  }

  private def access(write: Boolean, address: Int, data: BigInt, enable: Int): BigInt = {
    dut.host.req.poke(true)
    dut.host.write.poke(write)
    dut.host.addr.poke(address & ~(p.lanes - 1))
    dut.host.wdata.poke(data)
    dut.host.be.poke(enable)
    var waited = 0
    while (!dut.host.ack.peek().litToBoolean) {
      assert(waited < 1000, f"host port did not answer at 0x$address%04x")
      step()
      waited += 1
    }
    val result = dut.host.rdata.peek().litValue
    step()
    dut.host.req.poke(false)
    step()
    result
  }

  /** The byte at `address` as the host sees it. */
  def hostRead(address: Int): Int = {
    val lane = address % p.lanes
    ((access(write = false, address, 0, 1 << lane) >> (8 * lane)) & 0xff).toInt
  }

  def hostReadWord(address: Int): Seq[Int] = {
    val word = access(write = false, address, 0, (1 << p.lanes) - 1)
    (0 until p.lanes).map(lane => ((word >> (8 * lane)) & 0xff).toInt)
  }

  def hostWrite(address: Int, byte: Int): Unit = {
    val lane = address % p.lanes
    access(write = true, address, BigInt(byte) << (8 * lane), 1 << lane)
  }
}
