package flyframe.relay

import chisel3._
import chisel3.util._
import flyframe.lanes.Lanes

/** The bytes of own frames for the senders (FR-41): of the header, and of the slot in which a frame stands.
  */
class OwnBytes(slotBits: Int) extends Module {
  val address = IO(Input(UInt(7.W)))
  val leaves  = IO(Input(Vec(2, new OwnHeader(slotBits))))

  /** A byte that is asked for, as [[FrameStore]] numbers them; it stays so until it is there. */
  val fetch   = IO(Input(Vec(2, Valid(UInt(5.W)))))
  val fetched = IO(Output(Vec(2, Valid(UInt(8.W)))))

  /** Reads a word of a slot, which is there in the next cycle. */
  val load = IO(Output(Valid(UInt((slotBits + 2).W))))
  val data = IO(Input(UInt(32.W)))

  // One byte at a time, in four steps: the word is read; it is there; its byte is at hand; so is what is sent
  // of it. Reset: none is asked for.
  private val steps = RegInit(0.U(4.W))
  private val port  = Reg(UInt(1.W))
  private val at    = Reg(UInt(5.W))
  private val idle  = steps === 0.U
  steps := steps(2, 0) ## (idle && (fetch(0).valid || fetch(1).valid))
  when(idle) {
    port := !fetch(0).valid
    at   := Mux(fetch(0).valid, fetch(0).bits, fetch(1).bits)
  }

  private val of     = Mux(port.asBool, leaves(1), leaves(0))
  private val behind = at - FirstData.U // the identifier comes down from the fourth byte of its word
  private val isData = at >= FirstData.U
  private val isDlc  = at === (FirstData - 1).U
  load.valid := steps(0) && at(4, 2) =/= 0.U && !of.isLife
  load.bits  := of.slot ## Mux(isData, 1.U(1.W) ## behind(2), isDlc)

  private val lane   = Mux(isData, behind(1, 0), Mux(isDlc, 0.U, ~at(1, 0)))
  private val byte   = RegNext(Lanes.bytes(data, 4)(lane))
  private val isLong = RegNext(data(31))
  private val kind   = 0.U(1.W) ## of.isLife
  private val words  = Cat(kind, port, address, of.sequence)
  private val identifier = MuxLookup(at(1, 0), byte)(
    Seq(
      0.U -> (byte & Mux(isLong, "hdf".U, "hc0".U)),
      1.U -> (byte & Fill(8, isLong)),
      2.U -> (byte & (Fill(5, isLong) ## 7.U(3.W)))
    )
  )
  private val shown = MuxLookup(at, Mux(of.isLife, 0.U, byte))(
    (0 to 2).map(i => i.U -> words(23 - 8 * i, 16 - 8 * i)) ++
      (4 to 7).map(i => i.U -> Mux(of.isLife, 0.U, identifier)) :+
      ((FirstData - 1).U -> Mux(of.isLife, 0.U, byte(3, 0)))
  )
  for (p <- 0 to 1) {
    fetched(p).valid := steps(3) && port === p.U
    fetched(p).bits  := RegNext(shown)
  }
  private def FirstData = 9
}
