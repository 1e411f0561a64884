package flyframe.can

import chisel3._
import chisel3.util._

/** The identifier, RTR, SRR, IDE and data of the frame at hand, bit by bit: what is to be sent leaves one
  * shift register at its top, while what is heard enters it at its bottom. So a sender that loses the
  * arbitration has what came before.
  *
  * The own frame is read from the memory of slots a word at a time, when the engine needs it; what was heard
  * goes to the FIFO in the same way.
  */
class FrameShift extends Module {
  import FrameShift._

  /** From [[ProtocolEngine]]; `begins`: a frame was begun a cycle ago. */
  val begins   = IO(Input(Bool()))
  val bits     = IO(Input(new FrameBits))
  val ownBit   = IO(Output(Bool()))
  val ownAhead = IO(Output(Bool()))
  val ownDlc   = IO(Output(Valid(UInt(4.W))))

  /** Reads a word of the slot that is being sent; `data` has it in the next cycle, always. */
  val load = IO(Output(Valid(UInt(2.W))))
  val data = IO(Input(UInt(32.W)))

  /** A word of the frame heard. The third and fourth come as 0 first, in case that there are none. */
  val store = IO(Output(Valid(UInt(2.W))))
  val word  = IO(Output(UInt(32.W)))

  /** The identifier word of the frame heard is there, from the cycle behind `identified` on. */
  val identifier = IO(Output(UInt(32.W)))
  val identified = IO(Output(Bool()))

  // No register of data has a reset: what counts has been loaded.
  private val register = Reg(UInt(32.W))
  private val heardId  = Reg(UInt(32.W))
  private val ahead    = Reg(Bool())

  // ---- to be sent ----

  private val sends  = RegInit(false.B)                      // the own frame is loaded; reset: none
  private val idEnds = RegNext(bits.identifierEnds, false.B) // reset: no frame
  private val loading = RegInit(0.U(2.W)) // words still to be read behind the identifier; reset: none
  private val reloads  = RegNext(sends && bits.wordEnds && !bits.dataEnds, false.B) // reset: no frame
  private val loadWord = Mux(reloads, 3.U, MuxLookup(loading, 0.U)(Seq(3.U -> 1.U, 2.U -> 3.U, 1.U -> 2.U)))
  load.valid := begins || loading =/= 0.U || reloads
  load.bits  := loadWord
  when(begins) { sends := true.B }
  when(bits.identifierEnds) { sends := bits.sends }
  when(loading =/= 0.U) { loading := loading - 1.U }
  when(bits.identifierEnds && bits.sends) { loading := 3.U }
  private val loaded       = RegNext(load.valid, false.B)
  private val loadedWord   = RegNext(loadWord)
  private val loadedReload = RegNext(reloads)

  ownDlc.valid := loaded && loadedWord === 1.U
  ownDlc.bits  := data(3, 0)
  ownAhead     := ahead
  ownBit       := Mux(bits.passes, register(30), register(31))

  // ---- the register ----

  private val aligning = RegInit(0.U(5.W)) // bits to go until the first byte is at the top; reset: none
  private val stores   = RegInit(false.B)  // the word is complete
  private val second   = Reg(Bool())       // it is the second one of the data
  when(aligning =/= 0.U) { aligning := aligning - 1.U }
  stores := aligning === 1.U
  when(bits.wordEnds) {
    aligning := ~bits.byte(1, 0) ## 0.U(3.W)
    stores   := bits.byte(1, 0).andR
    second   := bits.byte(2)
  }
  // An identifier word is brought into its order in the last cycle before the first shift may come (CB-15):
  // the way from the memory has no time for it.
  private val arranges = RegNext(loaded && loadedWord === 0.U, false.B) // reset: no frame
  when(arranges) { register := CanOrder(register) }
  when(bits.shifts || aligning =/= 0.U) { register := register(30, 0) ## (bits.bit && bits.shifts) }
  when(loaded) {
    switch(loadedWord) {
      is(0.U) { register := data }
      is(2.U) { register := bytesSwapped(data) }
      is(3.U) {
        ahead := data(7)
        when(loadedReload) { register := bytesSwapped(data) }
      }
    }
  }

  // ---- heard ----

  // Reset: nothing is to be cleared.
  private val clearing = RegInit(0.U(2.W))
  private val heardNow = Cat(
    bits.isExtended,
    bits.isRemote,
    0.U(1.W),
    Mux(bits.isExtended, register(31, 21) ## register(18, 1), register(12, 2))
  )
  when(idEnds) {
    heardId  := heardNow
    clearing := 3.U
  }
  when(clearing =/= 0.U) { clearing := clearing - 1.U }
  identifier  := heardId
  identified  := idEnds
  store.valid := clearing =/= 0.U || stores
  store.bits := MuxLookup(clearing, Mux(second, 3.U(2.W), 2.U(2.W)))(
    Seq(3.U -> 0.U(2.W), 2.U -> 2.U(2.W), 1.U -> 3.U(2.W))
  )
  word := Mux(clearing === 3.U, heardId, Mux(clearing === 0.U, bytesSwapped(register), 0.U))
}

object FrameShift {

  /** The first byte on the wire is the lowest one in memory. */
  private def bytesSwapped(word: UInt): UInt = Cat((0 until 4).map(i => word(8 * i + 7, 8 * i)))
}

/** Frames in the order of arbitration (CAN-41): the bits from the identifier to RTR, as they are sent, which
  * are a number that is smaller for the one that wins; behind those of a base frame come zeros.
  */
object CanOrder {

  /** Of an identifier word: bit 31 for 29 bits, 30 remote, 28-0. */
  def apply(word: UInt): UInt = CanName.of(word).order
}

/** An identifier, and the kind of frame: what arbitration goes by. */
class CanName extends Bundle {
  val isExtended = Bool()
  val isRemote   = Bool()
  val identifier = UInt(29.W)

  def order: UInt = Mux(
    isExtended,
    identifier(28, 18) ## 3.U(2.W) ## identifier(17, 0) ## isRemote,
    identifier(10, 0) ## isRemote ## 0.U(20.W)
  )
}

object CanName {

  /** Of an identifier word. */
  def of(word: UInt): CanName = (word(31, 30) ## word(28, 0)).asTypeOf(new CanName)
}
