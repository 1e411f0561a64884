package flyframe.fibre

import chisel3._
import chisel3.util._
import flyframe.lanes.Lanes
import flyframe.memory.HostPort
import flyframe.registers.RingRegisters

/** What the host has set of ports and bus mode. */
class RingControl extends Bundle {
  val address = UInt(7.W)
  val off     = Bool()
  val forced  = UInt(2.W)
  val home    = Bool()
  val upMs    = UInt(8.W)
}

/** The registers of ports and bus mode at a host port of 32 bits, see [[RingRegisters]] (FB-10). An access is
  * acknowledged in its second cycle, and what is written counts from the next one on. What is read follows
  * from the address at once, so that others may be selected beside it. Addresses that belong to nobody here
  * read 0.
  *
  * @param addressBits
  *   implemented bits of the node's address
  */
class RingHost(addressBits: Int) extends Module {
  val host    = IO(new HostPort(4))
  val control = IO(Output(new RingControl))

  val ports = IO(Input(Vec(2, new PortReport)))
  val ring  = IO(Input(new BusReport))

  /** An event is pending that the mask lets pass. */
  val irq = IO(Output(Bool()))

  private val acknowledged = RegInit(false.B) // reset: no access is under way
  acknowledged := host.req && !acknowledged

  private def isAt(register: Int) = host.addr(15, 2) === (register / 4).U
  private def written(register: Int): (Bool, UInt) = {
    val lane = register % 4
    (acknowledged && host.write && isAt(register) && host.be(lane), Lanes.byte(host.wdata, lane))
  }

  // ---- what the host sets; reset: as the register table says ----

  private def stored(register: Int, high: Int, low: Int, reset: Int = 0): UInt = {
    val (isWritten, byte) = written(register)
    RegEnable(byte(high, low), reset.U((high - low + 1).W), isWritten)
  }
  private val address = stored(RingRegisters.Address, addressBits - 1, 0)
  private val off     = stored(RingRegisters.Control, RingRegisters.PortsOff, RingRegisters.PortsOff)
  private val forced  = stored(RingRegisters.Control, RingRegisters.Forced + 1, RingRegisters.Forced)
  private val home    = stored(RingRegisters.Control, RingRegisters.Home, RingRegisters.Home)
  private val upMs    = stored(RingRegisters.UpMs, 7, 0, RingRegisters.UpMsReset)
  private val mask    = stored(RingRegisters.Mask, RingRegisters.ModeEvent, RingRegisters.PortEvent)
  control.address := address
  control.home    := home
  control.forced  := forced
  control.off     := off
  control.upMs    := upMs

  // ---- events: one that happens while it is cleared stays ----

  private val upsWere   = RegNext(VecInit(ports.map(_.up)).asUInt, 0.U(2.W)) // reset: down
  private val modeWas   = RegNext(ring.mode, 1.U)                            // reset: alone
  private val guardWas  = RegNext(ring.guard, false.B)
  private val portEvent = upsWere =/= VecInit(ports.map(_.up)).asUInt
  private val modeEvent = modeWas =/= ring.mode || guardWas =/= ring.guard
  private val clears    = written(RingRegisters.Events)
  private val events    = RegInit(0.U(2.W))                                  // reset: none
  events := (events & ~Mux(clears._1, clears._2(6, 5), 0.U(2.W))) | (modeEvent ## portEvent)
  irq    := (events & mask).orR

  // ---- what it reads ----

  private val state = Cat(ring.cutOff, false.B, ring.alone, ring.guard, ring.mode)
  private val shown = Seq(
    RingRegisters.Address -> address,
    RingRegisters.Control -> Cat(off, false.B, forced, home, false.B),
    RingRegisters.State   -> state,
    RingRegisters.Ports   -> Cat((1 to 0 by -1).map(n => ring.stuck(n) ## portBits(ports(n)))),
    RingRegisters.UpMs    -> upMs,
    RingRegisters.Events  -> (events ## 0.U(5.W)),
    RingRegisters.Mask    -> (mask ## 0.U(5.W))
  )
  private def portBits(port: PortReport) = port.up ## port.search ## port.signal

  host.ack := acknowledged
  host.rdata := shown
    .groupBy(_._1 / 4)
    .toSeq
    .sortBy(_._1)
    .map { case (_, word) =>
      val bytes = word.map { case (register, byte) => byte.pad(8) << 8 * (register % 4) }
      Mux(isAt(word.head._1), bytes.reduce(_ | _).pad(32), 0.U(32.W))
    }
    .reduce(_ | _)
}
