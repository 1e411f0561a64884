package flyframe.master

import chisel3._
import chisel3.util._
import flyframe.ethernet.FrameByte
import flyframe.lanes.Lanes
import flyframe.protocol.EtherType
import flyframe.ram.DualPortRam

/** Keeps the datagrams of a frame and sends it (FP-02, FP-12): the bytes of its EtherCAT area come one after
  * the other; then the frame is sent, as often as wanted, until a new one is begun.
  */
class FrameComposer extends Module {
  import FrameComposer._

  /** Begins a new frame: no datagrams. */
  val clear = IO(Input(Bool()))

  /** The next byte of the area; not while `busy`. How many there are. */
  val byte   = IO(Flipped(Valid(UInt(8.W))))
  val length = IO(Output(UInt(AddressBits.W)))

  /** Sends the frame; not while `busy`. */
  val send  = IO(Input(Bool()))
  val busy  = IO(Output(Bool()))
  val bytes = IO(Decoupled(new FrameByte))

  /** Source address, first byte of it in the low bits. */
  val source = IO(Input(UInt(48.W)))

  /** What was sent: the byte of the area at `look`, a cycle later. */
  val look = IO(Input(UInt(AddressBits.W)))
  val sent = IO(Output(UInt(8.W)))

  private val used    = RegInit(0.U(AddressBits.W))    // bytes of the area; reset: empty
  private val sending = RegInit(false.B)               // reset: nothing leaves
  private val settled = Reg(Bool())                    // the memory shows the byte at `at`
  private val at      = Reg(UInt((AddressBits + 1).W)) // byte that leaves: the header from -16 on, the area

  private def copy(address: UInt): UInt = {
    val ram = DualPortRam(1 << AddressBits, 8)(clock)
    ram.io.write        := byte.valid
    ram.io.writeAddress := used
    ram.io.writeData    := byte.bits
    ram.io.readAddress  := address
    ram.io.readData
  }
  private val area = copy(at(AddressBits - 1, 0))
  sent   := copy(look)
  length := used
  busy   := sending
  when(clear) { used := 0.U }.elsewhen(byte.valid) { used := used + 1.U }

  private val head = Cat(
    "h1".U(4.W),
    used.pad(12),
    Integer.reverseBytes(EtherType.EtherCat << 16).U(16.W), // the first byte sent is the low one
    source,
    Fill(48, true.B)
  )
  private val next = at + 1.U
  bytes.valid     := sending && settled
  bytes.bits.data := Mux(at.head(1).asBool, Lanes.bytes(head, HeaderBytes)(at(3, 0)), area)
  bytes.bits.last := next === used

  settled := !bytes.fire && sending
  when(bytes.fire) {
    at := next
    when(bytes.bits.last) { sending := false.B }
  }
  when(send) {
    at      := (-HeaderBytes).S((AddressBits + 1).W).asUInt
    sending := true.B
  }
}

object FrameComposer {
  private val HeaderBytes = 16

  /** Bits of an address in the area: it is as long as one memory block. */
  val AddressBits = 9
}
