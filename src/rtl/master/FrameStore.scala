package flyframe.master

import chisel3._
import chisel3.util._
import flyframe.ethernet.FrameByte
import flyframe.ram.DualPortRam

/** A frame on its way to its sender: it begins to leave when so much of it is here that its source, which is
  * faster than the wire but for what it needs at the end, is not too late for any byte. Beside it there is
  * room for what is needed for another one, which is not made while this one leaves.
  */
class FrameStore extends Module {
  import FrameStore._
  val in  = IO(Flipped(Decoupled(new FrameByte)))
  val out = IO(Decoupled(new FrameByte))

  /** A byte to be kept beside the frame; it may be read while no frame is here, a cycle later. */
  val note        = IO(Flipped(Valid(UInt(8.W))))
  val noteAddress = IO(Input(UInt(5.W)))
  val readsNote   = IO(Input(Bool()))
  val readAddress = IO(Input(UInt(5.W)))
  val readData    = IO(Output(UInt(8.W)))

  /** Nothing is here: the next frame may begin. */
  val empty = IO(Output(Bool()))

  private val write                 = RegInit(0.U(Bits.W)) // reset: nothing is here
  private val read                  = RegInit(0.U(Bits.W))
  private val leaves                = RegInit(false.B)     // reset: not yet
  private val isThere               = RegNext(leaves && read =/= write && !out.fire, false.B)
  private val isFull                = write + 1.U === read
  private val ram                   = DualPortRam(2 << Bits, 9)(clock)
  private def ofNote(address: UInt) = Cat(1.U(1.W), address.pad(Bits))
  ram.io.write        := in.fire || note.valid
  ram.io.writeAddress := Mux(note.valid, ofNote(noteAddress), write)
  ram.io.writeData    := Mux(note.valid, Cat(note.bits, false.B), in.bits.asUInt)
  ram.io.readAddress  := Mux(readsNote, ofNote(readAddress), read)
  readData            := ram.io.readData(8, 1)
  out.valid           := isThere
  out.bits            := ram.io.readData.asTypeOf(new FrameByte)
  in.ready            := !isFull && !note.valid
  empty               := read === write
  when(in.fire) { write := write + 1.U }
  when(isFull || (in.fire && in.bits.last)) { leaves := true.B }
  when(out.fire) {
    read := read + 1.U
    when(out.bits.last) { leaves := false.B }
  }
}

object FrameStore {

  /** Bits of a place. */
  private val Bits = 7
}
