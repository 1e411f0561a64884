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

  // A byte a cycle. Reset: nothing was asked for.
  private val grants  = Wire(Vec(2, Bool()))
  private val answers = RegNext(grants, VecInit(false.B, false.B))
  grants(0) := fetch(0).valid && !answers(0)
  grants(1) := fetch(1).valid && !answers(1) && !grants(0)

  private val asked  = Mux(grants(0), fetch(0).bits, fetch(1).bits)
  private val header = Mux(grants(0), leaves(0), leaves(1))
  private val behind = asked - FirstData.U // the identifier comes down from the fourth byte of its word
  private val isData = asked >= FirstData.U
  private val isDlc  = asked === (FirstData - 1).U
  load.valid := grants.asUInt.orR && asked(4, 2) =/= 0.U && !header.isLife
  load.bits  := header.slot ## Mux(isData, 1.U(1.W) ## behind(2), isDlc)

  // In the next cycle.
  private val at     = RegNext(asked)
  private val of     = RegNext(header)
  private val port   = RegNext(!grants(0))
  private val lane   = RegNext(Mux(isData, behind(1, 0), Mux(isDlc, 0.U, ~asked(1, 0))))
  private val byte   = Lanes.bytes(data, 4)(lane)
  private val isLong = data(31)
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
    fetched(p).valid := answers(p)
    fetched(p).bits  := shown
  }
  private def FirstData = 9
}
