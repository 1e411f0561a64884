package flyframe.host

import chisel3._
import chisel3.util._
import flyframe.clocks.SpiCrossing
import flyframe.lanes.Lanes
import flyframe.params.EscParams

/** An access of an SPI host to one byte. */
private class SpiAccess extends Bundle {
  val write = Bool()
  val place = UInt(16.W)
  val data  = UInt(8.W)

  /** The host has begun another selection since: what is read is not for that. */
  val stale = Bool()
}

/** An SPI slave (`hostInterface` 4, B-115), framed as other controllers of this class have it.
  *
  * An access is what happens while the slave is selected: two bytes with address and command, or three,
  * during which the AL event request comes back, and then any number of data bytes at ascending addresses.
  * Bytes read are fetched ahead, one, unless MOSI is high in the first bit of the byte in front.
  */
class SpiInterface(p: EscParams) extends HostInterface(p) {
  import SpiInterface._
  val spi    = IO(new SpiPins)
  def pins   = spi
  def prefix = "spi"

  private val selected = spi.sel === (p.spiSelHigh == 1).B
  private val shift    = Module(new SpiShift(p.spiMode, p.spiLateSample == 1))
  private val crossing = Module(new SpiCrossing)
  shift.selected    := selected
  shift.clk         := spi.clk
  shift.mosi        := spi.mosi
  spi.miso          := shift.miso
  spi.miso_drive    := selected
  crossing.selected := selected
  crossing.bytes <> shift.bytes

  private object State extends ChiselEnum {

    /** What the next byte of the host is.
      *   - `closed`: none, as the slave is not selected, or has been so since a reset.
      *   - `high`, `low`, `extension`: the first, second, third byte of address and command.
      *   - `pause`: one that gives the first data byte time to come.
      *   - `read`, `write`: data.
      *   - `ignored`: anything, behind a command that asks for nothing.
      */
    val closed, high, low, extension, pause, read, write, ignored = Value
  }
  import State._
  private val state   = RegInit(closed) // reset: not in the middle of an access
  private val address = Reg(UInt(16.W))
  private val command = Reg(UInt(2.W))  // its upper bits

  // One access at the port, and one that waits for it: each as it was asked for, whatever the host has begun
  // since. A third one finds no place and is left out; the next byte has its own address all the same.
  private val wanted  = WireDefault(false.B)   // in the next cycle, when the address is there
  private val again   = WireDefault(false.B)   // the next byte is to be read
  private val asked   = Wire(new SpiAccess)
  private val asks    = RegNext(wanted, false.B) || again
  private val begun   = RegInit(false.B)       // one is at the port; reset: none
  private val waits   = RegInit(false.B)
  private val current = Reg(new SpiAccess)
  private val waiting = Reg(new SpiAccess)
  private val free    = !begun && !RegNext(port.ack, false.B)
  private val lacks   = asks && waits && !free // a place
  asked.write := RegNext(state === write)
  asked.place := address
  asked.data  := crossing.received
  asked.stale := false.B
  when(port.ack) { begun := false.B }
  when(free && (waits || asks)) {
    begun   := true.B
    current := Mux(waits, waiting, asked)
  }
  when(asks && !lacks) { waiting := asked }
  waits := Mux(free, waits && asks, waits || asks)
  when(asks) { address := address + 1.U }
  port.req   := begun
  port.write := current.write
  port.addr  := current.place
  port.wdata := Fill(p.lanes, current.data)
  port.be    := UIntToOH(Lanes.of(current.place, p.lanes), p.lanes)

  // What is sent next; and for how long a byte read has been there, 0: it is not.
  private val next = Reg(UInt(8.W))
  private val age  = Reg(UInt(3.W))
  private val ripe = age === (SpiCrossing.Margin + 1).U
  crossing.next := next
  when(state === closed) { next := side.events(7, 0) }
  when(crossing.taken) {
    when(state === high) { next := side.events(15, 8) }
    when(state === low) { next := side.events(23, 16) }
  }
  when(age =/= 0.U && !ripe) { age := age + 1.U }
  when(state === high || (state === read && crossing.taken)) { age := 0.U }
  when(port.ack && !current.write && !current.stale && (state === pause || state === read)) {
    next := Lanes.bytes(port.rdata, p.lanes)(Lanes.of(current.place, p.lanes))
    age  := 1.U
  }

  // What goes wrong in an access (0x030E).
  private val early = Reg(Bool()) // a byte was taken before it was there, or came when there was no place
  private val terminated = Reg(Bool()) // this byte is the last one, or there was one before it
  private val over       = Reg(Bool()) // there was
  private val beyond     = Reg(Bool())
  private val inByte     = Reg(Bool())
  private val odd        = Mux(inByte, crossing.bits, 0.U)
  private val endless    = (state === pause || state === read) && !terminated
  private val wasActive = RegNext(crossing.active, true.B) // reset: an access that has begun does not count
  private val ends      = wasActive && !crossing.active && state =/= closed
  private val late      = early || lacks
  side.error.valid := ends && (odd.orR || late || endless || beyond)
  side.error.bits  := Cat(command, beyond, endless, late, odd)

  /** What follows address and command. */
  private def follows(asked: UInt, extended: Bool): Unit = {
    command := asked >> 1
    state   := ignored
    when(asked === Command.Read || asked === Command.ReadWithPause) {
      state  := Mux(asked(0), pause, read)
      wanted := true.B
    }
    when(asked === Command.Write) { state := write }
    when(asked === Command.Extension && !extended) { state := extension }
  }
  when(crossing.begun) { inByte := true.B }
  when(crossing.whole) {
    inByte := false.B
    switch(state) {
      is(high) {
        address := crossing.received << 5
        state   := low
      }
      is(low) {
        address := Cat(address(15, 5), crossing.received(7, 3))
        follows(crossing.received(2, 0), false.B)
      }
      is(extension) {
        address := Cat(crossing.received(7, 5), address(12, 0))
        follows(crossing.received(4, 2), true.B)
      }
      is(pause) { state := read }
      is(write) { wanted := true.B }
    }
  }
  when(state === read) {
    when(crossing.begun) {
      when(crossing.firstBit) { terminated := true.B }
      when(over) { beyond := true.B }
      again := !over && !crossing.firstBit
    }
    when(crossing.whole) { over := terminated }
    when(crossing.taken && !ripe && !over) { early := true.B }
  }
  when(lacks) { early := true.B }
  when(!wasActive && crossing.active) {
    current.stale := true.B
    waiting.stale := true.B
    state         := high
    command       := 0.U
    early         := false.B
    terminated    := false.B
    over          := false.B
    beyond        := false.B
    inByte        := false.B
  }
  when(!crossing.active) { state := closed }
}

object SpiInterface {

  /** What the host asks for, in the low bits of its second byte, or of its third. */
  object Command {
    val Read          = 2.U
    val ReadWithPause = 3.U
    val Write         = 4.U
    val Extension     = 6.U
  }
}
