package flyframe.relay

import chisel3._
import chisel3.util._
import flyframe.lanes.Lanes
import flyframe.memory.HostPort
import flyframe.registers.RingRegisters

/** The registers of relay mode at a host port of 32 bits, see [[flyframe.registers.RingRegisters]]. They lie
  * between those of the ring and of the node, whose host acknowledges accesses in their second cycle: what is
  * read is ORed. The page of distances is acknowledged here, when a distance has been found.
  *
  * @param least
  *   core cycles of the shortest bit
  */
class RelayHost(least: Int) extends Module {
  val host    = IO(new HostPort(4))
  val setting = IO(Output(new OwnSetting)) // but one shot
  val oneShot = IO(Input(Bool()))

  /** Relay mode is on in the next cycle; it has just been switched on or off. */
  val onNext   = IO(Output(Bool()))
  val switches = IO(Output(Bool()))

  /** Core cycles of a bit (RB-26): what was written, or the shortest or longest there is. */
  val bitCycles = IO(Output(UInt(8.W)))

  /** The host says that an address conflict is over. */
  val restart  = IO(Output(Bool()))
  val conflict = IO(Input(Bool()))
  val irq      = IO(Output(Bool()))
  val address  = IO(Input(UInt(7.W)))

  /** Of [[Sources]]: asks for the distances of a source until they are told, that of port 1 in the low byte.
    */
  val asks = IO(Output(Valid(UInt(7.W))))
  val told = IO(Input(Valid(UInt(16.W))))

  private val isFar        = host.addr(15, 8) === (RingRegisters.Distances >> 8).U
  private val acknowledged = RegInit(false.B) // reset: no access is under way
  private val active       = host.req && !acknowledged

  // ---- distances: those of two sources are a word; in bus mode nothing is known, and nobody is asked ----

  private val isSecond = RegInit(false.B) // reset: the first one
  private val first    = Reg(UInt(16.W))
  private val second   = Reg(UInt(16.W))
  asks.valid := active && isFar && !host.write
  asks.bits  := host.addr(7, 2) ## isSecond
  private val isTold = asks.valid && told.valid
  when(isTold) {
    isSecond := !isSecond
    when(isSecond) { second := told.bits }.otherwise { first := told.bits }
  }
  when(!setting.on) {
    isSecond := false.B
    first    := 0.U
    second   := 0.U
  }
  acknowledged := active && (!isFar || host.write || !setting.on || (isTold && isSecond))
  host.ack     := acknowledged && isFar

  // ---- what the host sets; reset: as the register table says ----

  private def isAt(register: Int) = host.addr(15, 2) === (register / 4).U
  private def written(register: Int): (Bool, UInt) = {
    val lane = register % 4
    (acknowledged && host.write && isAt(register) && host.be(lane), Lanes.byte(host.wdata, lane))
  }
  private def stored(register: Int, high: Int, low: Int, reset: Int): UInt = {
    val (isWritten, byte) = written(register)
    RegEnable(byte(high, low), reset.U((high - low + 1).W), isWritten)
  }
  private val relay   = stored(RingRegisters.Control, RingRegisters.Relay, RingRegisters.Relay, 0)
  private val bit     = stored(RingRegisters.LinkBit, 7, 0, RingRegisters.LinkBitReset)
  private val low     = stored(RingRegisters.Confirm, 7, 0, RingRegisters.ConfirmReset & 0xff)
  private val high    = stored(RingRegisters.Confirm + 1, 7, 0, RingRegisters.ConfirmReset >> 8)
  private val retries = stored(RingRegisters.Retries, 7, 0, RingRegisters.RetriesReset)
  private val life    = stored(RingRegisters.Life, 6, 0, 0)

  private val (isControl, control) = written(RingRegisters.Control)
  setting.on      := relay.asBool
  onNext          := Mux(isControl, control(RingRegisters.Relay), relay.asBool)
  switches        := RegNext(onNext =/= relay.asBool, false.B) // reset: off
  setting.address := address
  setting.life    := life
  setting.confirm := high ## low
  setting.retries := retries
  setting.oneShot := oneShot
  restart         := isControl && control(RingRegisters.ClearConflict)
  bitCycles := Mux(
    bit < least.U,
    least.U,
    Mux(bit > LinkTiming.Most.U, LinkTiming.Most.U, bit)
  )

  // ---- the event of an address conflict: one that happens while it is cleared stays. Reset: none ----

  private val event  = RegInit(false.B)
  private val mask   = stored(RingRegisters.Mask, RingRegisters.ConflictEvent, RingRegisters.ConflictEvent, 0)
  private val clears = written(RingRegisters.Events)
  event := (event && !(clears._1 && clears._2(RingRegisters.ConflictEvent))) ||
    (conflict && !RegNext(conflict, false.B)) // reset: no conflict
  irq := event && mask.asBool

  // ---- what it reads ----

  host.rdata := Mux1H(
    Seq(
      isAt(RingRegisters.Address) -> (conflict ## 0.U(11.W) ## relay ## 0.U(8.W)),
      isAt(RingRegisters.LinkBit) -> (high ## low ## bitCycles.pad(16)),
      isAt(RingRegisters.Retries) -> (life ## 0.U(8.W) ## retries),
      isAt(RingRegisters.Events)  -> (mask ## 0.U(15.W) ## event ## 0.U(RingRegisters.ConflictEvent.W)),
      isFar                       -> (second ## first)
    )
  )
}
