package flyframe

import chisel3._
import chiseltest._
import flyframe.mi.{PhyRegisters, Phys}
import flyframe.model.{SentFrame, Symbol, WireFrame}
import flyframe.params.EscParams
import flyframe.protocol.DetectorState
import flyframe.rules.{Bench, EepromImage, Line}
import flyframe.sii.I2cEeprom

/** Drives a [[ControllerUnderTest]] with nominal clocks. */
class RtlBench(dut: ControllerUnderTest, val p: EscParams) extends Bench {
  private val cycles = p.cyclesPerNibble
  dut.clock.setTimeout(0)

  /** Called before every core cycle with its number; time passes slowly with it. */
  var eachCycle: Option[Long => Unit] = None
  def now: Long                       = cycle

  private var cycle    = 0L
  private var running  = Map.empty[Int, Vector[Int]] // nibbles of the frame that is leaving a port
  private var finished = Vector.empty[(Int, SentFrame)]
  private var eeprom   = Option.empty[I2cEeprom]
  private var seen     = Seen(0)
  private var brought  = -1L                         // what the pins have
  private var runs     = false

  reset()

  /** Back to the state after power-on, all links up; an EEPROM holds zeros with a right checksum. */
  def reset(): Unit = if (p.hasI2c) {
    powerOn(EepromImage())
    if (p.isDigitalIo) while (!dut.eepromLoaded.get.peekBoolean()) idle(100)
    else while ((hostRead(0x0503) & 0x80) != 0) idle(100)
  } else restart()

  def powerOn(image: Seq[Int]): Unit = {
    eeprom = Some(new I2cEeprom(image.toArray, twoByte = image.size > 2048))
    dut.sii.get.two_byte.poke(image.size > 2048)
    dut.sii.get.sda.poke(true)
    restart()
  }

  private def restart(): Unit = {
    for (y <- 0 until p.ports) dut.link(y).poke(!p.isLinkLow(y))
    bring(0)
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
    run(true)
    skip(4 * cycles)
    if (p.hasMi) powerOnPhys()
    dut.reset.poke(false.B)
    running = Map.empty
    idle(if (p.hasRegisterRam) 560 / p.cyclesPerNibble + 40 else 40)
  }

  private def run(on: Boolean): Unit = if (on != runs) {
    dut.run.poke(on)
    runs = on
  }
  private def bring(symbols: Long): Unit = if (symbols != brought) {
    dut.rx.poke(symbols)
    brought = symbols
  }
  private def packed(port: Int, dv: Boolean, symbol: Symbol): Long = {
    val bits = (if (dv) 0x20 else 0) | (if (symbol.error) 0x10 else 0) | symbol.nibble
    bits.toLong << 6 * port
  }

  /** One nibble slot with these symbols. */
  private def slot(symbols: Long): Unit = {
    run(true)
    bring(symbols)
    if (seesEachCycle) for (_ <- 0 until cycles) singly() else advance(cycles)
  }
  private def seesEachCycle = eachCycle.isDefined || eeprom.isDefined

  /** A core cycle between slots. */
  private def step(): Unit = {
    run(false)
    singly()
  }
  private def singly(): Unit = {
    eachCycle.foreach(_(cycle))
    for (e <- eeprom; pins <- dut.sii) {
      val sda = !seen.sdaLow
      e.step(!seen.sclLow, sda && !e.pulls)
      pins.sda.poke(sda && !e.pulls)
    }
    advance(1)
  }

  private def look(): Unit = seen = Seen(dut.seen.peekInt().toLong)

  /** Core cycles in which nothing is looked at. */
  private def skip(by: Int): Unit = {
    dut.clock.step(by)
    look()
  }

  /** At most a nibble's time. */
  private def advance(by: Int): Unit = {
    val last = seen
    skip(by)
    cycle += by
    val ticks = seen.ticks - last.ticks & 3
    assert(ticks <= 1, "a nibble has not been seen")
    if (ticks == 1)
      for (y <- 0 until p.ports) {
        val soFar = running.getOrElse(y, Vector.empty)
        seen.nibble(y) match {
          case Some(nibble) => running += y -> (soFar :+ nibble)
          case None if soFar.nonEmpty =>
            val (preamble, rest) = soFar.span(_ == 5)
            assert(rest.headOption.contains(0xd), s"port $y sent no SFD: $soFar")
            finished :+= y -> SentFrame(preamble.size, rest.tail)
            running -= y
          case None =>
        }
      }
  }

  /** Lets `slots` nibble slots pass without a frame; frames may leave. */
  private def quiet(slots: Int): Unit = for (_ <- 0 until slots) slot(0)

  /** The same when no frame is left to leave. */
  def idle(slots: Int): Unit = {
    var left = slots
    while (left > 0 && (seesEachCycle || running.nonEmpty)) {
      slot(0)
      left -= 1
    }
    if (left > 0) {
      run(true)
      bring(0)
      val last = seen
      skip(left * cycles)
      cycle += left * cycles
      assert(seen.nibbles == last.nibbles, "a frame has left that nobody waited for")
    }
  }

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
      slot(frames.flatMap { case (port, delay, frame) =>
        frame.symbols.lift(now - delay).map(packed(port, dv = true, _))
      }.sum)
    quiet(24 + p.writeLogDepth / cycles + 8)
    finished
  }

  def send(port: Int, frame: WireFrame): Option[(Int, SentFrame)] = {
    finished = Vector.empty
    frame.symbols.foreach(symbol => slot(packed(port, dv = true, symbol)))
    quiet(24 + p.writeLogDepth / cycles + 8 + (if (p.hasAlarm) 64 else 0))
    assert(finished.size <= 1, s"one frame in, ${finished.size} frames out")
    finished.headOption
  }

  /** The receive clocks rest meanwhile, which saves time. */
  def advanceMs(ms: Int): Unit = {
    run(false)
    skip(ms * 25000 * cycles)
    idle(8)
  }
  def advanceUs(us: Int): Unit = {
    idle(us * 25)
    dut.phys.foreach(control => assert(!control.collided.peekBoolean(), "both ends drive MDIO"))
  }

  private def digital           = dut.digital.get
  def damage(): Unit            = dut.damaged.foreach(_.poke(true))
  def setLine(state: Int): Unit = dut.current.foreach(_.poke(Line.current(state)))
  def outputs: Option[Int] =
    Option.when(digital.output_driven.get.peekBoolean())(digital.output.get.peekInt().toInt)
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
  def generalOutputs: BigInt = dut.general.get.output.get.peekInt()
  def setGeneralInputs(levels: BigInt): Unit = {
    dut.general.get.input.get.poke(levels)
    idle(4) // they cross
  }
  def interrupt: Boolean         = dut.irq.peekBoolean()
  def syncLevel(n: Int): Boolean = dut.clockSignals.get.sync(n).peekBoolean()
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
      control.value.peekInt().toInt
    }
    def set(phy: Int, register: Int, value: Int): Unit = {
      point(phy, register)
      control.store.valid.poke(true)
      control.store.bits.poke(value)
      run(false)
      skip(1)
      control.store.valid.poke(false)
    }
    def remove(phy: Int): Unit = change(there.clearBit(phy))
    def insert(phy: Int): Unit = change(there.setBit(phy))
  }
  def resetRequested: Boolean = {
    step() // the request stands in a register
    dut.resetRequest.exists(_.peekBoolean())
  }
  def phyResets: Int = dut.phyResetsN.fold(0)(n => ~n.peekInt().toInt & (1 << p.ports) - 1)

  /** Symbols with RX_ER outside a frame. */
  def falseCarrier(port: Int, symbols: Int): Unit = {
    for (_ <- 0 until symbols) slot(packed(port, dv = false, Symbol(0xe, error = true)))
    idle(8)
  }

  private def access(write: Boolean, address: Int, data: BigInt, enable: Int): BigInt = {
    dut.host.req.poke(true)
    dut.host.write.poke(write)
    dut.host.addr.poke(address & ~(p.lanes - 1))
    dut.host.wdata.poke(data)
    dut.host.be.poke(enable)
    var waited = 0
    look()
    while (!seen.ack) {
      assert(waited < 1000, f"host port did not answer at 0x$address%04x")
      step()
      waited += 1
    }
    val result = dut.host.rdata.peekInt()
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
