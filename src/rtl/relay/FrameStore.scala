package flyframe.relay

import chisel3._
import chisel3.util._
import flyframe.ram.DualPortRam

/** The pins of [[FrameStore]]. */
abstract class FrameStorePins extends Module {
  import FrameStore._

  /** Of each receiver: a byte, the slot of a transit buffer in which it is kept, too, and that this is done.
    */
  val byte    = IO(Input(Vec(2, Valid(UInt(8.W)))))
  val index   = IO(Input(Vec(2, UInt(5.W))))
  val transit = IO(Input(Vec(2, Valid(UInt(PlaceBits.W)))))
  val taken   = IO(Output(Vec(2, Bool())))

  /** The header of a receiver's frame goes to its slot: in this cycle byte 0, and so on. */
  val copies   = IO(Input(Valid(UInt(1.W))))
  val copiesTo = IO(Input(UInt(PlaceBits.W)))

  /** Reads of the senders, which last until they are answered; `slot` is what leaves. */
  val fetch   = IO(Input(Vec(2, Valid(UInt(5.W)))))
  val slot    = IO(Input(Vec(2, UInt(PlaceBits.W))))
  val fetched = IO(Output(Vec(2, Bool())))

  /** Reads of what a receiver has got: `granted` says that the byte is there in the next cycle. */
  val read    = IO(Input(Valid(UInt(5.W))))
  val from    = IO(Input(UInt(1.W)))
  val granted = IO(Output(Bool()))

  val data = IO(Output(UInt(8.W)))
}

/** The bytes of frames that come, wait and leave, the check left out, in one block RAM: a place for each
  * receiver, and the slots of both transit buffers. Who reads gets the byte in the next cycle.
  */
class FrameStore extends FrameStorePins {
  import FrameStore._

  private val ram = DualPortRam(1 << PlaceBits + 5, 8)(clock)

  // ---- reads ----

  // Reset: nothing is copied, nothing was read.
  private val copied  = RegInit(0.U(3.W)) // the byte to be read next; 0: none
  private val copier  = Reg(UInt(1.W))
  private val target  = Reg(UInt(PlaceBits.W))
  private val copying = copies.valid || copied =/= 0.U
  when(copying) { copied := Mux(copied === HeaderBytes.U, 0.U, copied + 1.U) }
  when(copies.valid) {
    copier := copies.bits
    target := copiesTo
  }
  private val grants  = Wire(Vec(2, Bool()))
  private val answers = RegNext(grants, VecInit(false.B, false.B))
  grants(0) := fetch(0).valid && !copying && !answers(0)
  grants(1) := fetch(1).valid && !copying && !answers(1) && !grants(0)
  fetched   := answers
  granted   := read.valid && !copying && !grants(0) && !grants(1)
  ram.io.readAddress := Mux(
    copying,
    receiver(Mux(copies.valid, copies.bits, copier)) ## copied.pad(5),
    Mux(
      grants(0),
      slot(0) ## fetch(0).bits,
      Mux(grants(1), slot(1) ## fetch(1).bits, receiver(from) ## read.bits)
    )
  )
  data := ram.io.readData

  // ---- writes: to the receiver's place, then to the slot ----

  private val pastes = RegNext(copying && copied =/= HeaderBytes.U, false.B)
  private val pasted = RegNext(copied)
  private val second = RegInit(VecInit(false.B, false.B)) // the first one is done; reset: it is not
  private val goes   = Seq(byte(0).valid && !pastes, byte(1).valid && !byte(0).valid && !pastes)
  for (p <- 0 to 1) {
    taken(p) := goes(p) && (second(p) || !transit(p).valid)
    when(goes(p)) { second(p) := !second(p) && transit(p).valid }
  }
  private def place(p: Int) = Mux(second(p), transit(p).bits, receiver(p.U)) ## index(p)
  ram.io.write        := pastes || goes(0) || goes(1)
  ram.io.writeAddress := Mux(pastes, target ## pasted.pad(5), Mux(goes(0), place(0), place(1)))
  ram.io.writeData    := Mux(pastes, data, Mux(goes(0), byte(0).bits, byte(1).bits))

  private def receiver(port: UInt) = port(0) ## Fill(TransitLists.SlotBits, 1.U)
}

object FrameStore {

  /** An output and a slot. The last slot is the place of the receiver of the same port. */
  val PlaceBits: Int = 1 + TransitLists.SlotBits

  private val HeaderBytes = 4
}
