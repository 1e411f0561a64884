package flyframe.host

import chisel3._
import chisel3.util._
import flyframe.clocks.{MemoryBusCrossing, MemoryBusStrobes}
import flyframe.params.EscParams

/** The pins of an asynchronous microcontroller bus, data in both directions. Chip select and write are low
  * active; the others are as the parameters say.
  *
  * @param lanes
  *   bytes of the data bus: 1, 2 or 4
  */
class MicrocontrollerPins(lanes: Int) extends Bundle {
  val cs_n    = Input(Bool())
  val rd      = Input(Bool())
  val wr_n    = Input(Bool())
  val be      = Input(UInt(lanes.W))
  val a       = Input(UInt((16 - log2Ceil(lanes)).W))
  val d_in    = Input(UInt((8 * lanes).W))
  val d_out   = Output(UInt((8 * lanes).W))
  val d_drive = Output(Bool())

  /** Level of BUSY, and whether it is driven. */
  val busy       = Output(Bool())
  val busy_drive = Output(Bool())
}

/** What the host gives together with the strobes of an access. */
class MicrocontrollerPayload(lanes: Int) extends Bundle {
  val be   = UInt(lanes.W)
  val a    = UInt((16 - log2Ceil(lanes)).W)
  val data = UInt((8 * lanes).W)
}

/** An asynchronous microcontroller bus of 8, 16 or 32 bits (`hostInterface` 5, B-117), such as the external
  * memory interface of an STM32 (FSMC, FMC).
  *
  * A read, and with `busWriteEarly` a write, is carried out when its strobe begins, and the host waits for
  * it: else a write is carried out when its strobe has ended, and the next access waits. BUSY and the
  * direction of the data pins follow the pins without a clock.
  */
class MicrocontrollerInterface(p: EscParams) extends HostInterface(p) {
  private val early = p.busWriteEarly == 1

  val bus    = IO(new MicrocontrollerPins(p.lanes))
  def pins   = bus
  def prefix = "bus"

  private object State extends ChiselEnum {

    /** How far the access is.
      *   - `idle`: the pins show no access, or it has not settled yet.
      *   - `seen`, `sure`: what comes with it has been taken, and its strobes at that moment are on their way
      *     here. If they have ended by then, it was none.
      *   - `write`: a write has begun, which is carried out when it has ended.
      *   - `ask`: the access is at the host port, which has not acknowledged it yet.
      *   - `done`: the access is carried out, but the host still holds its strobes; they must not begin a
      *     second one.
      */
    val idle, seen, sure, write, ask, done = Value
  }
  import State._
  private val state   = RegInit(idle) // reset: no access
  private val isWrite = Reg(Bool())

  private val crossing = Module(new MemoryBusCrossing(new MicrocontrollerPayload(p.lanes)))
  private val strobes  = Wire(new MemoryBusStrobes)
  strobes.ne  := bus.cs_n
  strobes.noe := bus.rd === (p.busReadHigh == 0).B
  strobes.nwe := bus.wr_n
  private val writes = !strobes.ne && !strobes.nwe // as the pins are
  private val reads  = !strobes.ne && !strobes.noe
  crossing.strobes   := strobes
  crossing.pins.be   := (if (p.busByteEnableHigh == 1) bus.be else ~bus.be)
  crossing.pins.a    := bus.a
  crossing.pins.data := bus.d_in
  // What comes with a write is taken as long as its strobe lasts; it does not change together with that.
  crossing.hold := state === idle || (state === write && writes)

  private val held   = crossing.held
  private val all    = (p.busReadAll == 1).B && !isWrite
  private val none   = !held.be.orR && !all
  private val posted = isWrite && (!early).B // the host does not wait for it
  private val ends   = state === ask && (port.ack || none)

  // The host has ended this access before it was done, or one that it has begun while a write was carried
  // out: it has not looked at BUSY. What stands at the pins then is another access.
  private val dropped = state === ask && RegNext(crossing.active) && !crossing.active
  private val lost    = RegNext(crossing.write)            // its direction
  private val cut     = Reg(Bool())
  private val waited  = !posted && !cut && crossing.active // somebody waits for its end
  when(dropped) { cut := true.B }
  switch(state) {
    is(idle) {
      cut := false.B
      when(crossing.active && crossing.settled) { state := seen }
    }
    is(seen) { state := sure }
    is(sure) {
      isWrite := crossing.write
      state   := (if (early) ask else Mux(crossing.write, write, ask))
      when(!crossing.active) { state := idle }
    }
    is(write) { when(!crossing.active) { state := ask } }
    is(ask) { when(ends) { state := Mux(waited, done, idle) } }
    is(done) { when(!crossing.active) { state := idle } }
  }
  side.error.valid := dropped || (state === ask && none)
  side.error.bits  := Mux(dropped, Cat(lost, !lost), Cat(isWrite, !isWrite, 0.U(2.W)))

  port.req   := state === ask && !none
  port.write := isWrite
  port.addr  := held.a << log2Ceil(p.lanes)
  port.wdata := held.data
  port.be    := held.be | Fill(p.lanes, all)

  // The pins keep the data for as long as the host holds the strobe; the host port shows them for one cycle.
  private val readData = RegEnable(port.rdata, port.ack && !isWrite)
  bus.d_out   := readData
  bus.d_drive := reads

  // A host must not wait for a controller in reset.
  private val released = RegInit(true.B)
  private val occupied = RegInit(false.B)
  released := (ends && waited) || (state === done && crossing.active)
  // It lasts until a write that has begun meanwhile has been seen: its host then ends it.
  when(state === write) { occupied := !crossing.active }
  when(state === idle && !crossing.active) { occupied := false.B }
  private def later(by: Int) = Seq.iterate(released, by + 1)(RegNext(_, true.B)).reduce(_ && _)
  private val over = if (p.busReadDelay == 0) released else Mux(isWrite, released, later(p.busReadDelay))
  private val waits =
    if (p.busBusyEarly == 1) !strobes.ne && !over
    else (reads && !over) || (writes && (if (early) !over else occupied))
  private val (level, drive) = MicrocontrollerInterface.driven(waits, p.busBusyDriver)
  bus.busy       := level
  bus.busy_drive := drive
}

object MicrocontrollerInterface {

  /** Level of a pin and whether it is driven, by its driver as in 0x0150[1:0].
    *
    * @param driver
    *   0 low active, 1 the same as open drain, 2 high active, 3 the same as open source
    */
  def driven(active: Bool, driver: Int): (Bool, Bool) = driver match {
    case 0 => (!active, true.B)
    case 1 => (false.B, active)
    case 2 => (active, true.B)
    case _ => (true.B, active)
  }
}
