package flyframe

import chisel3._
import chisel3.util._
import flyframe.can.{Bridge, CanPort, WordCounter}
import flyframe.clocks.LevelCrossing
import flyframe.fibre.RingPorts
import flyframe.host.HostInterface
import flyframe.memory.HostPort
import flyframe.mii.Port
import flyframe.node._
import flyframe.params.{EscParams, FibreParams}
import flyframe.plant.PlantNetwork
import flyframe.port.SlotTimer
import flyframe.registers.{CanRegisters, PlantRegisters, RingRegisters}
import flyframe.relay.{RelayCounter, RelayMode}

/** The pins of an optical port, from and to its module. */
class OpticalPins extends Bundle {
  val rx     = Input(Bool())
  val signal = Input(Bool())
  val tx     = Output(Bool())
}

/** The pins of the transceiver on a twisted pair. */
class CanPins extends Bundle {
  val rx = Input(Bool())
  val tx = Output(Bool())
}

/** A node of a fibre ring (NODE): a CAN controller on the ring, one on a twisted pair if `canPorts` is 2,
  * with a bridge if that is 1, relay mode if `ring` is 2, a port to the plant network if `plant` is 1, and a
  * host. It only connects.
  *
  * @param p
  *   a parameter set of role 2 without [[EscParams.problems]]
  * @param fibre
  *   what its ports are built with: those of `p`, or with shorter times, for tests
  */
class RingNode(p: EscParams, fibre: FibreParams) extends Module with RequireAsyncReset {
  def this(p: EscParams) = this(p, p.fibre)

  override def desiredName = p.topName

  val optical_1 = IO(new OpticalPins)
  val optical_2 = IO(new OpticalPins)

  /** Of the twisted pair. */
  val can: Option[CanPins] = Option.when(p.canPorts == 2)(IO(new CanPins).suggestName("can"))

  /** What the PHY of the plant network needs beside the pins of its port. */
  private def phyPin(name: String, pin: => Bool) = Option.when(p.hasPlant)(IO(pin).suggestName(name))
  val phyClkRef: Option[Bool]                    = phyPin("phy_clk_ref", Input(Bool()))
  val miiTxTick: Option[Bool]                    = phyPin("mii_tx_tick", Output(Bool()))
  val phyResetN: Option[Bool]                    = phyPin("phy_reset_n", Output(Bool()))
  private val ports                              = Seq.tabulate(p.portCount)(Port(p, _))
  val phys: Seq[Bundle]                          = Port.pins(ports)

  private val connection = HostInterface(p)
  val hostPins: Bundle   = connection.pins
  val irq                = IO(Output(Bool()))

  private val time = Module(new NodeTime(p.coreClockMhz))
  private val ring = Module(new RingPorts(fibre, p.nodeIdWidth, p.hasRelay))
  private val portF = Module(
    new CanPort(
      p.can,
      0,
      p.hasRelay,
      isTolerant = false,
      RingRegisters.Counters,
      RingNode.counters(p.hasRelay)
    )
  )
  private val cans  = portF +: Seq.tabulate(p.canPorts - 1)(n => Module(new CanPort(p.can, n + 1)))
  private val relay = Option.when(p.hasRelay)(Module(new RelayMode(p.can)))
  private val node  = Module(new NodeHost(p))
  private val wide  = Module(new WideHost(p.lanes))
  private val ticks = Module(new TimeQuanta)

  // ---- the ring, and the port on it ----

  for ((pins, n) <- Seq(optical_1, optical_2).zipWithIndex) {
    ring.rx(n)      := pins.rx
    ring.optical(n) := pins.signal
    pins.tx         := ring.tx(n)
  }
  ring.drive      := portF.tx
  portF.rx        := ring.bus
  ticks.possible  := portF.bit.valid
  ticks.prescaler := portF.bit.bits.prescaler
  ring.quantum    := ticks.quantum
  ring.possible   := portF.bit.valid
  ring.quanta     := portF.bit.bits.quanta
  ring.us         := time.us
  ring.timer      := time.timer

  // The counters of the ring lie in the memory of its port.
  portF.counts.get := VecInit(ring.counts ++ relay.toSeq.flatMap(_.counts))

  for (r <- relay) {
    r.port <> portF.relay.get
    r.links <> ring.relay.get
    r.us   := time.us
    r.time := time.timer
  }

  for (pins <- can) {
    val pair = cans.last
    pair.rx := LevelCrossing(pins.rx)
    pins.tx := pair.tx
  }

  if (p.can.bridge)
    for (n <- 0 to 1) {
      val bridge = Module(new Bridge(p.can, waits = p.hasRelay && n == 0)).suggestName(s"bridge_$n")
      bridge.from <> cans(n).bridgeFrom.get
      bridge.into <> cans(1 - n).bridgeInto.get
    }

  // ---- the plant network ----

  private val plant = for (port <- ports.headOption) yield {
    // The three steps of a nibble slot, as in a slave.
    val slot         = Module(new SlotTimer(p.cyclesPerNibble))
    val processStep  = RegNext(slot.tick, false.B)
    val transmitStep = RegNext(processStep, false.B)
    slot.reference         := phyClkRef.get
    phyResetN.get          := !reset.asBool
    miiTxTick.get          := ShiftRegister(transmitStep, p.txShift + 1)
    port.core.receiveStep  := slot.tick
    port.core.transmitStep := transmitStep
    port.core.enable       := true.B
    port.core.shortMargin  := false.B
    val network = Module(new PlantNetwork)
    network.step     := processStep
    network.in       := port.core.fromWire
    port.core.toWire := network.out
    network.link     := port.core.link
    network.badFrame := port.core.events.invalidFrame
    network
  }

  // ---- the host ----

  // Who an address belongs to, by its upper byte; what belongs to nobody is answered by the node.
  wide.narrow <> connection.port
  private val page      = wide.wide.addr(15, 8)
  private val isCounter = wide.wide.addr(15, 5) === (RingRegisters.Counters >> 5).U
  private val isCan = cans.indices.map { n =>
    Seq(CanRegisters.PortStarts, CanRegisters.SlotStarts, CanRegisters.FilterStarts)
      .map(starts => page === (starts(n) >> 8).U)
      .reduce(_ || _) || (n == 0).B && isCounter
  }
  private val isFar = page === (RingRegisters.Distances >> 8).U && p.hasRelay.B
  private val isPlant = plant.fold(false.B) { _ =>
    page === (PlantRegisters.Settings >> 8).U || page(7, 4) === (PlantRegisters.SendData >> 12).U
  }
  private val isNode = !isCan.reduce(_ || _) && !isFar && !isPlant
  private def offer(port: HostPort, isMeant: Bool, addr: UInt = wide.wide.addr): Unit = {
    port.req   := wide.wide.req && isMeant
    port.write := wide.wide.write
    port.addr  := addr
    port.wdata := wide.wide.wdata
    port.be    := wide.wide.be
  }
  for ((port, isMeant) <- cans.zip(isCan)) offer(port.host, isMeant)
  // Of the page they are told only that it is the first one, that of the distances, or another.
  private val isFirst  = page === 0.U || isFar
  private val nodeAddr = !isFirst ## 0.U(3.W) ## isFar ## 0.U(3.W) ## wide.wide.addr(7, 0)
  offer(node.host, isNode, nodeAddr)
  offer(ring.host, isNode, nodeAddr)
  for (r <- relay) offer(r.host, isNode || isFar, nodeAddr)
  for (n <- plant) {
    offer(n.host, isPlant)
    node.plant.get := Cat(n.events.link, n.events.sent, n.events.received)
  }
  private val relayData = relay.fold(0.U)(_.host.rdata)
  wide.wide.ack := node.host.ack || relay.fold(false.B)(_.host.ack) || cans.map(_.host.ack).reduce(_ || _) ||
    plant.fold(false.B)(_.host.ack)
  wide.wide.rdata := Mux1H(
    Seq(isNode -> (node.host.rdata | ring.host.rdata | relayData), isFar -> relayData) ++
      cans.zip(isCan).map { case (c, is) => is -> c.host.rdata } ++ plant.map(n => isPlant -> n.host.rdata)
  )

  node.time := time.timer
  for ((port, n) <- cans.zipWithIndex) {
    port.time   := time.timer
    node.can(n) := port.events
  }
  irq := node.irq || ring.irq || relay.fold(false.B)(_.irq)
  connection.side.foreach(_.events := irq)
}

object RingNode {

  /** The counters of the ring, as [[RingPorts]] and [[RelayMode]] have their events: of own frames all may be
    * done at once; own ones may begin, and others be turned back, at both ports at once.
    */
  def counters(hasRelay: Boolean): Seq[WordCounter] = {
    import RelayCounter._
    def at(address: Int, bytes: Int, waiting: Int) = WordCounter(
      (address - RingRegisters.Counters) / 4,
      Option.when(bytes == 1)(address % 4),
      waiting
    )
    val ofRelay = RingRegisters.RelayCounters.zipWithIndex.map { case ((address, bytes), counter) =>
      val waiting = counter match {
        case Repeated | Failed | Confirmed                 => 5
        case Stray | Doubles | Aborted | Wrapped | OwnSent => 2
        case _                                             => 1
      }
      at(address, bytes, waiting)
    }
    RingRegisters.BusCounters.map(at(_, 1, 1)) ++ (if (hasRelay) ofRelay else Nil)
  }
}
