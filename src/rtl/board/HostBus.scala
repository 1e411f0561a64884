package flyframe.board

import chisel3._
import chisel3.util._
import flyframe.clocks.{MemoryBusCrossing, MemoryBusStrobes}
import flyframe.memory.HostPort

/** The pins of an asynchronous memory bus, as the external memory interface of a microcontroller has them
  * (STM32: FSMC, FMC): control pins low active, data in both directions.
  *
  * @param lanes
  *   bytes of the data bus: 1, 2 or 4
  * @param addressBits
  *   word address
  */
class MemoryBus(lanes: Int, addressBits: Int) extends Bundle {
  val ne      = Input(Bool())
  val noe     = Input(Bool())
  val nwe     = Input(Bool())
  val nbl     = Input(UInt(lanes.W))
  val a       = Input(UInt(addressBits.W))
  val d_in    = Input(UInt((8 * lanes).W))
  val d_out   = Output(UInt((8 * lanes).W))
  val d_drive = Output(Bool())
  val nwait   = Output(Bool())
}

/** What the host gives together with the strobes of an access. */
class MemoryBusPayload(lanes: Int, addressBits: Int) extends Bundle {
  val nbl  = UInt(lanes.W)
  val a    = UInt(addressBits.W)
  val data = UInt((8 * lanes).W)
}

/** Turns accesses of an asynchronous memory bus into accesses to a host port (HB-01 to HB-05).
  *
  * An access is carried out when its strobe falls, not when it rises, so that data need no hold time; the
  * host waits for it: `nwait` is low from the fall of `ne` until it is done. `nwait` and the direction of the
  * data pins follow the pins without a clock.
  */
class HostBus(lanes: Int) extends Module {
  private val wordBits = HostBus.AddressBits - log2Ceil(lanes)

  val bus  = IO(new MemoryBus(lanes, wordBits))
  val host = IO(Flipped(new HostPort(lanes)))

  private object State extends ChiselEnum {

    /** How far the access is.
      *   - `idle`: the pins show no access, or it has not settled yet.
      *   - `ask`: the access is at the host port, which has not acknowledged it yet.
      *   - `done`: the access is carried out, but the host still holds its strobes; they must not begin a
      *     second one.
      */
    val idle, ask, done = Value
  }
  import State._
  private val state    = RegInit(idle)   // reset: no access
  private val released = RegInit(true.B) // reset: a host must not wait for a controller in reset
  private val write    = Reg(Bool())
  // The pins keep the data for as long as the host holds the strobe; the host port shows them for one cycle.
  private val readData = RegEnable(host.rdata, host.ack)

  private val crossing = Module(new MemoryBusCrossing(new MemoryBusPayload(lanes, wordBits)))
  private val strobes  = Wire(new MemoryBusStrobes)
  strobes.ne         := bus.ne
  strobes.noe        := bus.noe
  strobes.nwe        := bus.nwe
  crossing.strobes   := strobes
  crossing.pins.nbl  := bus.nbl
  crossing.pins.a    := bus.a
  crossing.pins.data := bus.d_in
  crossing.hold      := state === idle

  released := (state === ask && host.ack) || (state === done && crossing.active)
  switch(state) {
    is(idle) {
      when(crossing.active && crossing.settled) {
        write := crossing.write
        state := ask
      }
    }
    is(ask) { when(host.ack) { state := done } }
    is(done) { when(!crossing.active) { state := idle } }
  }

  host.req   := state === ask
  host.write := write
  host.addr  := crossing.held.a << log2Ceil(lanes)
  host.wdata := crossing.held.data
  host.be    := ~crossing.held.nbl

  bus.d_out   := readData
  bus.d_drive := !bus.ne && !bus.noe
  bus.nwait   := bus.ne || released
}

object HostBus {

  /** Bits of a byte address on the bus: 8 KiB, as much as an alarm controller has. */
  val AddressBits = 13
}
