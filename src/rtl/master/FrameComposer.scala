package flyframe.master

import chisel3._
import chisel3.util._
import flyframe.lanes.Lanes
import flyframe.memory.DualPortRam
import flyframe.protocol.{DatagramLayout, EtherType}

/** The header of a datagram that the master is to send. */
class DatagramToSend extends Bundle {
  val command = UInt(8.W)
  val index   = UInt(8.W)

  /** ADP in the low half and ADO in the high one, or a logical address. */
  val address = UInt(32.W)

  /** How many bytes of data it has. */
  val length = UInt(11.W)
}

/** Composes EtherCAT frames of datagrams and sends them (FP-02, FP-12): the datagrams come one after the
  * other, each with its data; then the frame is sent, as often as wanted, until a new one is begun.
  *
  * An empty frame has length 0 and padding only.
  *
  * @param maxSubTelegrams
  *   datagrams of one frame
  */
class FrameComposer(maxSubTelegrams: Int) extends Module {
  import FrameComposer._

  /** Begins a new frame: no datagrams. */
  val clear = IO(Input(Bool()))

  /** A datagram if it fits, to be held until it is taken; then its data bytes. */
  val datagram = IO(Flipped(Decoupled(new DatagramToSend)))
  val data     = IO(Flipped(Decoupled(UInt(8.W))))

  /** The datagram offered does not fit into this frame. */
  val full = IO(Output(Bool()))

  /** Sends the frame; not while `busy`. */
  val send  = IO(Input(Bool()))
  val busy  = IO(Output(Bool()))
  val bytes = IO(Decoupled(new FrameByte))

  /** Source address, first byte of it in the low bits. */
  val source = IO(Input(UInt(48.W)))

  private object State extends ChiselEnum { val idle, header, data, counter, fetch, send = Value }
  private val state = RegInit(State.idle) // reset: no frame
  private val used  = RegInit(0.U(11.W))  // bytes of the EtherCAT area; reset: empty
  private val count = RegInit(0.U(8.W))   // datagrams
  private val last  = Reg(UInt(11.W))     // where the bit "more follow" of the last datagram is
  private val at    = Reg(UInt(12.W))     // byte within what is being written or sent
  private val left  = Reg(UInt(11.W))     // data bytes to come

  private val ram   = DualPortRam(2048, 8)(clock)
  private val asked = datagram.bits
  private val words = Cat(0.U(16.W), "b10000".U(5.W), asked.length, asked.address, asked.index, asked.command)
  private val write = WireDefault(false.B)
  ram.io.write        := write
  ram.io.writeAddress := used
  ram.io.writeData := MuxLookup(state.asUInt, 0.U(8.W))(
    Seq(
      State.header.asUInt -> Lanes.bytes(words, DatagramLayout.bytes)(at(3, 0)),
      State.data.asUInt   -> data.bits
    )
  )
  when(write) { used := used + 1.U }

  full := count === maxSubTelegrams.U || used +& datagram.bits.length > (Longest - DatagramLayout.Overhead).U
  datagram.ready := state === State.header && at === (DatagramLayout.bytes - 1).U
  data.ready     := state === State.data
  busy           := state =/= State.idle

  // Sending: 16 bytes of header, numbered from -16 on, then the area.
  private val inArea = !at.head(1).asBool
  private val head = Cat(
    "h1".U(4.W),
    0.U(1.W),
    used,
    Integer.reverseBytes(EtherType.EtherCat << 16).U(16.W), // the first byte sent is the low one
    source,
    Fill(48, true.B)
  )
  private val area =
    Mux(at(10, 0) === last && count =/= 0.U, ram.io.readData & 0x7f.U, ram.io.readData)
  ram.io.readAddress := at
  bytes.valid        := state === State.send
  bytes.bits.data := Mux(
    inArea,
    area,
    Lanes.bytes(head, HeaderBytes)(at(3, 0))
  )
  private val next = at + 1.U
  bytes.bits.last := next === used // an empty area ends before it begins

  switch(state) {
    is(State.idle) {
      at := 0.U
      when(clear) {
        used  := 0.U
        count := 0.U
      }.elsewhen(send) {
        at    := (-HeaderBytes).S(12.W).asUInt
        state := State.fetch
      }.elsewhen(datagram.valid && !full) {
        left  := datagram.bits.length
        count := count + 1.U
        state := State.header
      }
    }
    is(State.header) {
      write := true.B
      at    := at + 1.U
      when(at === DatagramLayout.Length.last.U) { last := used }
      when(at === (DatagramLayout.bytes - 1).U) {
        at    := 0.U
        state := Mux(left === 0.U, State.counter, State.data)
      }
    }
    is(State.data) {
      write := data.valid
      when(data.valid) {
        left := left - 1.U
        when(left === 1.U) { state := State.counter }
      }
    }
    is(State.counter) {
      write := true.B
      at    := at + 1.U
      when(at === (DatagramLayout.CounterBytes - 1).U) { state := State.idle }
    }
    is(State.fetch) { state := State.send }
    is(State.send) {
      when(bytes.ready) {
        at    := next
        state := Mux(bytes.bits.last, State.idle, State.fetch)
      }
    }
  }
}

object FrameComposer {
  private val HeaderBytes = 16

  /** The longest EtherCAT area in an Ethernet frame. */
  val Longest = 1498
}
