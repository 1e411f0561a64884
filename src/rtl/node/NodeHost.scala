package flyframe.node

import chisel3._
import chisel3.util._
import flyframe.can.PortEvents
import flyframe.lanes.Lanes
import flyframe.memory.HostPort
import flyframe.params.EscParams
import flyframe.registers.NodeRegisters

/** The registers of a node that belong to none of its units: identity, time, and the events of its CAN ports
  * (see [[NodeRegisters]]). An access is acknowledged in its second cycle, as those to the registers of the
  * ring are, which lie between these: what both show is ORed.
  */
class NodeHost(p: EscParams) extends Module {
  import NodeRegisters._

  val host = IO(new HostPort(4))
  val time = IO(Input(UInt(32.W)))
  val can  = IO(Input(Vec(p.canPorts, new PortEvents)))

  /** Those of the plant port, in the order of their bits. */
  val plant = Option.when(p.hasPlant)(IO(Input(UInt(3.W))))

  /** An event is pending that the mask lets pass. */
  val irq = IO(Output(Bool()))

  private val acknowledged = RegInit(false.B) // reset: no access is under way
  acknowledged := host.req && !acknowledged

  private def isAt(register: Int) = host.addr(15, 2) === (register / 4).U

  /** Bytes of the word in which a register is, that are written now: 1 in all their bits. */
  private def written(register: Int) = {
    val bytes = Mux(acknowledged && host.write && isAt(register), host.be, 0.U)
    Cat((3 to 0 by -1).map(i => Fill(8, bytes(i))))
  }

  private val bits = (0 until p.canPorts).flatMap(n => Seq.tabulate(CanEvents.size)(CanEventBits(n) + _)) ++
    plant.toSeq.flatMap(_ => Seq.tabulate(3)(PlantEventBits + _))
  private val all = bits.map(1 << _).sum.U(16.W)
  private val now = can.zipWithIndex.flatMap { case (events, n) =>
    // In the order of CanEvents.
    val pulses = Seq(events.received, events.slotDone, events.state, events.busError, events.overrun)
    pulses.zipWithIndex.map { case (pulse, i) => Mux(pulse, (1 << CanEventBits(n) + i).U(16.W), 0.U) }
  } ++ plant.map(_ << PlantEventBits)

  // Events: one that happens while it is cleared stays. Reset: as the register table says.
  private val events = RegInit(0.U(16.W))
  private val mask   = RegInit(0.U(16.W))
  private val word   = written(Events)
  private val clears = word(15, 0) & host.wdata(15, 0)
  events := ((events & ~clears) | now.reduce(_ | _)) & all
  mask   := ((mask & ~word(31, 16)) | (host.wdata(31, 16) & word(31, 16))) & all
  irq    := (events & mask).orR
  require(Mask == Events + 2 && Events % 4 == 0, f"Mask is 0x$Mask%02x but must stand behind Events.")

  // Of a host with narrower words: a read of the first bytes of the time keeps the others for the next reads.
  private val shownTime =
    if (p.lanes == 4) time
    else {
      val later = RegEnable(time(31, 8 * p.lanes), host.req && !acknowledged && isAt(Time) && host.be(0))
      later ## Lanes.bytes(time, p.lanes).asUInt
    }

  private val identity = Cat(p.escBuild.U(16.W), p.escRevision.U(8.W), p.escType.U(8.W))
  host.ack := acknowledged
  host.rdata := RegNext(
    Mux1H(
      Seq(
        isAt(Identity) -> identity,
        isAt(Time)     -> shownTime,
        isAt(Events)   -> mask ## events
      )
    )
  )
}
