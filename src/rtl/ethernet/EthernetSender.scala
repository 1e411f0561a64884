package flyframe.ethernet

import chisel3._
import chisel3.util._
import flyframe.mii.{Crc32, NibbleStream}

/** A byte of a frame on its way to or from a master's units. */
class FrameByte extends Bundle {
  val data = UInt(8.W)

  /** The last one. */
  val last = Bool()
}

/** Makes an Ethernet frame of bytes: preamble and SFD before them, padding to 60 bytes and the FCS behind,
  * and keeps the minimum gap of 12 bytes to the next frame.
  *
  * A byte is taken every second nibble slot; one that does not come in time ends the frame, which then leaves
  * bad. Its remaining bytes are taken and dropped.
  */
class EthernetSender extends Module {

  /** Once per nibble slot. */
  val step = IO(Input(Bool()))

  /** The frame from destination address on, without FCS. */
  val bytes = IO(Flipped(Decoupled(new FrameByte)))
  val out   = IO(Output(new NibbleStream))

  private object State extends ChiselEnum { val idle, preamble, data, padding, fcs, gap, drop = Value }
  import State._
  private val state = RegInit(idle)  // reset: nothing leaves, and the line was quiet
  private val count = Reg(UInt(7.W)) // nibbles of this part; of content up to 119, then 118 and 119 in turns
  private val rest  = Reg(UInt(4.W)) // the high nibble
  private val ended = Reg(Bool())    // the last byte has been taken
  private val crc   = Reg(UInt(32.W))

  // The next byte: its source may be slow to choose it.
  private val following = Reg(new FrameByte)
  private val full      = RegInit(false.B) // reset: there is none
  bytes.ready := !full
  when(bytes.fire) { following := bytes.bits }

  private val high   = count(0)
  private val takes  = state === data && !high
  private val late   = takes && !full
  private val nibble = Mux(takes, following.data(3, 0), rest)
  when(bytes.fire) { full := true.B }.elsewhen(step && (takes || state === drop)) { full := false.B }

  // Nibbles of preamble with SFD, least content (60 bytes), FCS, and gap: all have a low part of 7.
  private val most = MuxLookup(state, (24 / 8 - 1).U)(
    Seq(preamble -> (16 / 8 - 1).U, data -> (120 / 8 - 1).U, padding -> (120 / 8 - 1).U, fcs -> (8 / 8 - 1).U)
  )
  private val whole = count(2, 0).andR && count(6, 3) === most

  private val next    = WireDefault(NibbleStream.idle)
  private val content = state === data || state === padding
  out          := RegEnable(next, NibbleStream.idle, step)
  out.crcGood  := true.B // not from the register, so that the transmitter's logic for others folds away
  next.valid   := state === preamble || content || state === fcs
  next.payload := state =/= preamble
  next.end     := state === gap && count === 0.U
  next.bad     := !ended // late: with a nibble that means nothing
  next.odd     := !ended
  switch(state) {
    is(preamble) { next.data := Mux(whole, 0xd.U, 5.U) }
    is(data) { next.data := nibble }
    is(fcs) { next.data := ~crc(3, 0) }
  }

  // But for content, it is shifted out, with ones behind it: after the preamble it is Crc32.Start.
  private val nextCrc =
    Crc32.next(crc, Mux(content, next.data, crc(3, 0))) | Cat(Fill(4, !content), 0.U(28.W))

  when(step) {
    crc   := nextCrc
    count := Mux(whole, Mux(content && !ended, 118.U, 0.U), count + 1.U)
    when(takes) {
      rest  := following.data(7, 4)
      ended := following.last
    }
    switch(state) {
      is(idle) {
        count := 0.U
        ended := false.B
        when(full) { state := preamble }
      }
      is(preamble) { when(whole) { state := data } }
      is(data, padding) {
        when(high && ended) { state := Mux(whole, fcs, padding) }
        when(late) {
          state := gap
          count := 0.U
        }
      }
      is(fcs) { when(whole) { state := gap } }
      is(gap) { when(whole) { state := Mux(ended, idle, drop) } }
      is(drop) { when(full && following.last) { state := idle } }
    }
  }
}
