package flyframe.relay

import chisel3._
import flyframe.RingNode
import flyframe.can.{Bridge, CanPort}
import flyframe.fibre.RingHost
import flyframe.memory.HostPort
import flyframe.node.NodeTime
import flyframe.params.CanParams
import flyframe.registers.{CanRegisters, RingRegisters}

/** Relay mode with its CAN port and its registers, but without what makes tones of levels. With a bridge
  * there is port T, too, on a bus of its own.
  */
class RelayPortUnderTest(p: CanParams) extends Module {
  val heard = IO(Input(Vec(2, Bool())))
  val up    = IO(Input(Vec(2, Bool())))
  val level = IO(Output(Vec(2, Bool())))
  val stuck = IO(Output(Vec(2, Bool())))
  val host  = IO(new HostPort(4))
  val irq   = IO(Output(Bool()))

  private val relay = Module(new RelayMode(p))
  private val port = Module(
    new CanPort(p, 0, hasRelay = true, isTolerant = false, RingRegisters.Counters, RingNode.counters(true))
  )
  private val ring = Module(new RingHost(7))
  private val time = Module(new NodeTime(p.coreClockMhz))

  relay.port <> port.relay.get
  port.counts.get     := VecInit(RingRegisters.BusCounters.map(_ => false.B) ++ relay.counts)
  relay.links.up      := up
  relay.links.level   := heard
  relay.links.address := ring.control.address
  relay.us            := time.us
  relay.time          := time.timer
  level               := relay.links.send
  stuck               := relay.links.stuck
  port.rx             := true.B
  port.time           := time.timer
  irq                 := relay.irq

  private val pair = Option.when(p.bridge)(Module(new CanPort(p, 1)))
  for (t <- pair) {
    t.rx   := true.B
    t.time := time.timer
    for ((from, into, waits) <- Seq((port, t, true), (t, port, false))) {
      val bridge = Module(new Bridge(p, waits))
      bridge.from <> from.bridgeFrom.get
      bridge.into <> into.bridgeInto.get
    }
  }

  // What the ring's own mode would say.
  ring.ring := 0.U.asTypeOf(ring.ring)
  for (n <- 0 to 1) {
    ring.ports(n)    := 0.U.asTypeOf(ring.ports(n))
    ring.ports(n).up := up(n)
  }
  ring.ring.alone := !up(0) && !up(1)
  ring.ring.mode  := Mux(up(0) === up(1), 1.U, Mux(up(0), 2.U, 3.U))

  private val page      = host.addr(15, 8)
  private val isCounter = host.addr(15, 5) === (RingRegisters.Counters >> 5).U
  private def isOf(n: Int) = Seq(CanRegisters.PortStarts, CanRegisters.SlotStarts, CanRegisters.FilterStarts)
    .map(starts => page === (starts(n) >> 8).U)
    .reduce(_ || _)
  private val isPort = isCounter || isOf(0)
  private val isPair = pair.fold(false.B)(_ => isOf(1))
  private val isRing = !isPort && !isPair
  private val isFar  = page === (RingRegisters.Distances >> 8).U
  private val units = Seq(port.host -> isPort, ring.host -> (isRing && !isFar), relay.host -> isRing) ++
    pair.map(_.host -> isPair)
  for ((unit, isMeant) <- units) {
    unit.req   := host.req && isMeant
    unit.write := host.write
    unit.addr  := host.addr
    unit.wdata := host.wdata
    unit.be    := host.be
  }
  host.ack := units.map(_._1.ack).reduce(_ || _)
  private val ofRing = Mux(isFar, 0.U, ring.host.rdata) | relay.host.rdata
  host.rdata := Mux(isPort, port.host.rdata, pair.foldLeft(ofRing)((r, t) => Mux(isPair, t.host.rdata, r)))
}
