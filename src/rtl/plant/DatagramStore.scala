package flyframe.plant

import chisel3._
import chisel3.util._
import flyframe.ethernet.UdpReceived
import flyframe.lanes.Lanes
import flyframe.ram.DualPortRam

/** Two places for datagrams of the server, which the host takes in their order (GW-04). One for which there
  * is no place when it begins is dropped.
  */
class DatagramStore extends Module {
  import DatagramStore._

  /** See [[flyframe.ethernet.UdpReceiver]]. */
  val data     = IO(Flipped(Valid(UInt(8.W))))
  val offset   = IO(Input(UInt(11.W)))
  val received = IO(Flipped(Valid(new UdpReceived)))

  /** A datagram waits, of so many bytes, until the host releases it. */
  val waiting = IO(Output(Bool()))
  val length  = IO(Output(UInt(11.W)))
  val release = IO(Input(Bool()))

  /** A word of it, a cycle later; its first byte is the lowest. */
  val readAddress = IO(Input(UInt(WordBits.W)))
  val readData    = IO(Output(UInt(32.W)))

  /** Pulses: one has come; one was dropped; a frame to this station was none of the server. */
  val comes   = IO(Output(Bool()))
  val dropped = IO(Output(Bool()))
  val refused = IO(Output(Bool()))

  private val oldest  = RegInit(0.U(1.W)) // reset: both places are free
  private val count   = RegInit(0.U(2.W))
  private val lengths = Reg(Vec(2, UInt(11.W)))
  private val late    = Reg(Bool())
  private val free    = oldest ^ count(0)

  // The last word is written with each byte that comes.
  private val word = Reg(UInt(32.W))
  private val lane = offset(1, 0)
  private val bytes = Lanes.bytes(Mux(lane === 0.U, 0.U, word), 4).zipWithIndex.map { case (old, i) =>
    Mux(lane === i.U, data.bits, old)
  }
  private val whole   = Cat(bytes.reverse)
  private val blocked = Mux(offset === 0.U, count(1), late)
  private val ram     = DualPortRam(2 << WordBits, 32)(clock)
  ram.io.write        := data.valid && !blocked
  ram.io.writeAddress := free ## (offset >> 2)(WordBits - 1, 0)
  ram.io.writeData    := whole
  ram.io.readAddress  := oldest ## readAddress
  readData            := ram.io.readData
  when(data.valid) {
    late := blocked
    word := whole
  }

  private val isOurs = received.bits.good && received.bits.fromServer
  private val leaves = release && waiting
  comes   := received.valid && isOurs && !late
  dropped := received.valid && isOurs && late
  refused := received.valid && !isOurs
  waiting := count =/= 0.U
  length  := lengths(oldest)
  when(comes) { lengths(free) := received.bits.length }
  when(leaves) { oldest := ~oldest }
  count := count + comes - leaves
}

object DatagramStore {

  /** Bits of the number of a word in a place. */
  val WordBits = 9
}
