package flyframe.master

import chisel3._
import chiseltest._
import flyframe.{MasterController, SignalPins}
import flyframe.host.HostOf
import flyframe.memory.HostPort
import flyframe.mii.MiiPins
import flyframe.model._
import flyframe.params.EscParams

/** The master with its receive clocks as plain inputs, as chiseltest needs them. */
class MasterUnderTest(p: EscParams) extends Module {
  val rxClock = IO(Input(Bool()))
  val rxDv    = IO(Input(Vec(p.linePorts + 1, Bool())))
  val rxd     = IO(Input(Vec(p.linePorts + 1, UInt(4.W))))
  val txEn    = IO(Output(Vec(p.linePorts + 1, Bool())))
  val txd     = IO(Output(Vec(p.linePorts + 1, UInt(4.W))))
  val txTick  = IO(Output(Bool()))
  val link    = IO(Input(Bool()))
  val host    = IO(new HostPort(p.lanes))
  val irq     = IO(Output(Bool()))
  val alarm   = IO(new SignalPins)

  private val dut = withReset(reset.asAsyncReset)(Module(new MasterController(p)))
  dut.phy_clk_ref := false.B
  HostOf(p, dut.hostPins, host)
  dut.alarm <> alarm
  irq    := dut.irq
  txTick := dut.mii_tx_tick
  dut.phys.zipWithIndex.foreach { case (mii: MiiPins, y) =>
    mii.rx_clk := rxClock.asClock
    mii.rx_dv  := rxDv(y)
    mii.rx_er  := false.B
    mii.rxd    := rxd(y)
    mii.link   := link
    txEn(y)    := mii.tx_en
    txd(y)     := mii.txd
  }
}

/** Drives a [[MasterUnderTest]]: frames to and from both ports, the host port, and the passing of time.
  *
  * @param onLine
  *   takes a frame that has left to the line; the frame that comes back, and how many slots later its
  *   preamble begins
  * @param onPlant
  *   takes a whole frame that has left to the plant network, from the destination address on, with FCS
  * @param eachSlot
  *   called every nibble slot with its number
  */
class MasterBench(
    dut: MasterUnderTest,
    p: EscParams,
    onLine: SentFrame => Option[(SentFrame, Int)],
    onPlant: Seq[Int] => Unit,
    eachSlot: Long => Unit = _ => ()
) {
  private val cycles      = p.cyclesPerNibble
  private val ports       = p.linePorts + 1
  private def is(b: Bool) = b.peekBoolean()

  /** Nibbles that are to come at a port; None: idle. */
  private val coming  = Array.fill(ports)(scala.collection.mutable.Queue.empty[Option[Int]])
  private val leaving = Array.fill(ports)(Vector.empty[Int])
  private val before  = Array.fill(ports)(Option(-1))
  var slots           = 0L

  dut.clock.setTimeout(0)
  dut.link.poke(true)
  dut.host.req.poke(false)
  dut.alarm.config_fault.poke(false)
  for (y <- 0 until ports) {
    dut.rxDv(y).poke(false)
    dut.rxd(y).poke(0)
  }

  private def bytes(nibbles: Seq[Int]) = nibbles.grouped(2).map(n => n.head | n.last << 4).toVector

  private def left(port: Int, nibbles: Vector[Int]): Unit = {
    val (preamble, rest) = nibbles.span(_ == 5)
    assert(rest.headOption.contains(0xd), s"port $port sent no SFD")
    if (port == 1) onPlant(bytes(rest.tail))
    else
      for ((frame, delay) <- onLine(SentFrame(preamble.size, rest.tail)))
        enqueue(0, frame.payload, delay, frame.preamble)
  }
  private def enqueue(port: Int, payload: Seq[Int], delay: Int, preamble: Int): Unit = {
    coming(port) ++= Seq.fill(delay)(None)
    coming(port) ++= (Seq.fill(preamble)(5) ++ (0xd +: payload)).map(Some(_))
    coming(port) ++= Seq.fill(24)(None)
  }

  /** A frame from the plant network, FCS included. */
  def fromPlant(frame: Seq[Int]): Unit =
    enqueue(1, frame.flatMap(b => Seq(b & 15, b >> 4)), 0, 15)

  private def step(): Unit = {
    dut.clock.step()
    if (is(dut.txTick)) for (y <- 0 until ports) {
      if (is(dut.txEn(y))) leaving(y) :+= dut.txd(y).peekInt().toInt
      else if (leaving(y).nonEmpty) {
        val frame = leaving(y)
        leaving(y) = Vector.empty
        left(y, frame)
      }
    }
  }

  private var phase = 0

  // The receive clock has a phase of its own.
  private var rxPhase = 0
  private var held    = 0

  /** The receive clock stands still for a core cycle: from now on it is later by that much. */
  def slip(): Unit = held += 1

  /** One core cycle. Receive clocks rise in the middle of a slot, before they slip. */
  private def cycle(): Unit = {
    val moves = held == 0
    if (moves && rxPhase == 0) for (y <- 0 until ports) {
      val now = if (coming(y).isEmpty) None else coming(y).dequeue()
      if (now != before(y)) {
        dut.rxDv(y).poke(now.isDefined)
        dut.rxd(y).poke(now.getOrElse(0))
        before(y) = now
      }
    }
    dut.rxClock.poke(moves && rxPhase == cycles / 2)
    step()
    if (cycles == 1) {
      dut.rxClock.poke(false)
      dut.txTick.peek() // lets the simulator see the falling edge
    }
    if (moves) rxPhase = (rxPhase + 1) % cycles else held -= 1
    phase = (phase + 1) % cycles
    if (phase == 0) {
      slots += 1
      eachSlot(slots)
    }
  }
  def run(slots: Int): Unit = for (_ <- 1 to slots * cycles) cycle()

  private def access(address: Int, isWrite: Boolean, data: BigInt, lanes: Int): BigInt = {
    dut.host.addr.poke(address)
    dut.host.write.poke(isWrite)
    dut.host.wdata.poke(data)
    dut.host.be.poke(lanes)
    dut.host.req.poke(true)
    var waits = 0
    while (!is(dut.host.ack)) {
      cycle()
      waits += 1
      assert(waits < 270, "no acknowledgement") // HOST-10
    }
    val result = dut.host.rdata.peekInt()
    cycle()
    dut.host.req.poke(false)
    cycle()
    result
  }
  def read(address: Int): Int = {
    val lane = address % p.lanes
    (access(address - lane, isWrite = false, 0, 1 << lane) >> (8 * lane)).toInt & 0xff
  }
  def read(address: Int, bytes: Int): BigInt =
    (0 until bytes).map(i => BigInt(read(address + i)) << (8 * i)).sum
  def write(address: Int, bytes: Int*): Unit = for ((b, i) <- bytes.zipWithIndex) {
    val lane = (address + i) % p.lanes
    access(address + i - lane, isWrite = true, BigInt(b) << (8 * lane), 1 << lane)
  }
  def irq: Boolean = is(dut.irq)

  /** The signals: fire, sounder, disabled; there is a fault. */
  def fire: Boolean     = is(dut.alarm.fire)
  def sounder: Boolean  = is(dut.alarm.sounder)
  def disabled: Boolean = is(dut.alarm.disabled)
  def fault: Boolean    = !is(dut.alarm.fault_n)
}
