package flyframe.master

import chisel3._
import chisel3.util._
import flyframe.ethernet.NetworkSettings
import flyframe.ram.DualPortRam
import flyframe.registers.MasterRegisters

/** Makes tags by Ascon-AEAD128 (NIST SP 800-232): of a message as associated data, without plaintext.
  *
  * A round takes six cycles, so a block of 16 bytes takes 48. The tag begins to come at most 210 cycles after
  * the last byte, and needs 96.
  */
class AsconTag extends Module {

  /** The key, from [[NetworkSettings]]: the byte comes a cycle after its address. It is read again and again
    * while there is nothing to tag, and it may be read.
    */
  val granted        = IO(Input(Bool()))
  val settingAddress = IO(Output(UInt(NetworkSettings.AddressBits.W)))
  val setting        = IO(Input(UInt(8.W)))

  /** The 16 bytes of a nonce, then a message of at least one byte. */
  val in = IO(Flipped(Decoupled(UInt(8.W))))

  /** After the last byte of the message. */
  val end = IO(Input(Bool()))

  /** The 16 bytes of the tag, the first one first; the next nonce may come behind them. A byte comes at most
    * six cycles after it may.
    */
  val tag      = IO(Output(Valid(UInt(8.W))))
  val tagReady = IO(Input(Bool()))

  private object Phase extends ChiselEnum { val idle, start, first, more, last, tag = Value }
  private val phase                         = RegInit(Phase.idle) // reset: nothing to do
  private val time                          = RegInit(0.U(3.W))   // cycle of a pass; reset: one begins
  private val round                         = RegInit(0.U(4.W))   // or byte of the tag; reset: the first
  private val side                          = RegInit(false.B)    // of the old state; reset: any
  private def is(phases: Phase.Type*): Bool = phases.map(phase === _).reduce(_ || _)

  // Bytes on the way to where they are added from: the message and what it is padded with, and the key.
  private object Padding extends ChiselEnum { val none, one, zeros, done = Value }
  private val padding = RegInit(Padding.none) // what follows the message; reset: the message is not over
  private val place   = RegInit(0.U(4.W))     // of the next byte in its block; reset: the first
  private val full    = RegInit(false.B)      // a block is there; reset: none
  private val low     = Reg(UInt(8.W))        // the byte before
  private val pads = !full && is(Phase.first, Phase.more, Phase.start) &&
    (padding === Padding.one || padding === Padding.zeros)

  // Two cycles a byte: its address, then itself. Zeros follow the key. Reset: any.
  private val keyAt    = RegInit(0.U(6.W))
  private val readsKey = granted && phase === Phase.idle && place === 0.U && !full && !in.valid
  private val isZero   = keyAt(5)
  keyAt          := Mux(readsKey, keyAt + 1.U, keyAt(5, 2) ## 0.U(2.W))
  settingAddress := MasterRegisters.MasterKey.U | keyAt(4, 1)
  in.ready       := !full && padding === Padding.none

  private val takes = in.fire || pads
  private val byte = Mux(
    pads,
    padding === Padding.one,
    Mux(readsKey, setting & Fill(8, !isZero), in.bits)
  )
  when(takes || keyAt(0)) { low := byte }
  when(takes) {
    place := place + 1.U
    when(place.andR) { full := true.B }
  }
  when(end) { padding := Padding.one }
  when(pads) { padding := Mux(place.andR, Padding.done, Padding.zeros) }

  // A copy for each word of the state but one: places in it are the first and the second half of a block,
  // of the key, and zeros.
  private object Half { val Block0 = 0; val Block1 = 1; val Key0 = 2; val Key1 = 3; val Zero = 4 }
  private val piece = Cat(time(1), !time(0)) // 1, 0, 3, 2, 1, 0
  private def copy(half: UInt): UInt = {
    val ram = DualPortRam(32, Ascon.PieceBits)(clock)
    ram.io.write        := Mux(takes, place(0), readsKey && keyAt(1, 0).andR)
    ram.io.writeAddress := Mux(takes, Cat(0.U(2.W), place(3, 1)), Cat(isZero, !isZero, keyAt(4, 2)))
    ram.io.writeData    := Cat(byte, low)
    ram.io.readAddress  := Cat(half, piece)
    ram.io.readData
  }
  private def choose(cases: (Bool, Int)*): UInt =
    MuxCase(Half.Zero.U(3.W), cases.map { case (when, half) => when -> half.U(3.W) })

  // What is added at the beginning of each permutation, and to get the tag.
  private val starts = phase === Phase.start && round === 0.U
  private val blocks = is(Phase.first, Phase.more) && round === AsconTag.Rounds8.U
  private val second = phase === Phase.first && round === AsconTag.Rounds8.U
  private val closes = phase === Phase.last && round === 0.U
  private val tags   = phase === Phase.tag
  private val even   = copy(choose(starts -> Half.Key1, blocks -> Half.Block0, closes -> Half.Key0))
  private val add1   = copy(choose(starts -> Half.Key0, blocks -> Half.Block1))
  private val add3 = copy(
    choose(starts -> Half.Block0, (second || tags) -> Half.Key0, closes -> Half.Key1)
  )
  private val add4 = copy(choose(starts -> Half.Block1, (second || tags) -> Half.Key1))

  // The cycle after the address of a piece: the piece is there.
  private val at     = RegNext(piece)
  private val opened = RegNext(starts)
  private val closed = RegNext(closes)
  private val to0    = RegNext(is(Phase.first, Phase.more))
  private val number = RegNext(round)
  private val ascon  = Module(new Ascon)
  private val pieces = (0 until 4).map(i => (AsconTag.Iv >> (16 * i) & 0xffff).toInt)
  private val iv = Mux1H(
    pieces.zipWithIndex.map { case (p, i) =>
      (opened && at === i.U) -> p.U(16.W)
    } :+
      ((closed && at === 0.U) -> 1.U(16.W)) // padding of the plaintext, of which there is none
  )
  private val constant = Cat(~number, number) & Fill(8, at === 0.U)
  ascon.add(0) := (even & Fill(16, to0)) | iv
  ascon.add(1) := add1
  ascon.add(2) := (even & Fill(16, !to0)) ^ constant
  ascon.add(3) := add3
  ascon.add(4) := add4 ^ Cat(closed && at === 3.U, 0.U(15.W)) // it ends the associated data

  private val waits  = time === 0.U && Mux(tags, !tagReady, blocks && !full)
  private val counts = time(2) || time(1) // the piece is not only read for its neighbour
  ascon.piece := piece
  ascon.side  := side
  ascon.write := counts && !tags
  ascon.clear := RegNext(phase === Phase.idle)

  tag.valid := RegNext(tags && counts && piece === round(2, 1), false.B)
  private val pair = Mux(number(3), ascon.sum(4), ascon.sum(3))
  tag.bits := Mux(number(0), pair(15, 8), pair(7, 0))

  when(!waits) { time := time + 1.U }
  when(time === 5.U) {
    time  := 0.U
    round := round + 1.U
    when(!tags) { side := !side }
    when(starts || blocks) { full := false.B }
    when(phase === Phase.idle) {
      round := 0.U
      when(full) { phase := Phase.start }
    }
    when(round === 11.U && !tags) {
      round := 0.U
      when(phase === Phase.last) {
        phase := Phase.tag
      }.elsewhen(padding === Padding.done && !full) {
        phase := Phase.last
      }.otherwise {
        phase := Mux(phase === Phase.start, Phase.first, Phase.more)
        round := AsconTag.Rounds8.U
      }
    }
    when(tags && round.andR) {
      phase   := Phase.idle
      padding := Padding.none
    }
  }
}

object AsconTag {

  /** The initial value: it names Ascon-AEAD128. */
  private val Iv = BigInt("00001000808c0001", 16)

  /** Where a permutation of eight rounds begins among the twelve. */
  private val Rounds8 = 4
}
