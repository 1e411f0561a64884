package flyframe.master

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

  private object State extends ChiselEnum { val idle, preamble, data, padding, fcs, drop, gap = Value }
  import State._
  private val state = RegInit(idle)  // reset: nothing leaves, and the line was quiet
  private val count = Reg(UInt(6.W)) // nibbles of preamble, FCS and gap; whole bytes up to 59
  private val high  = Reg(Bool())
  private val rest  = Reg(UInt(4.W)) // the high nibble
  private val ended = Reg(Bool())    // the last byte has been taken
  private val crc   = Reg(UInt(32.W))

  // The next byte: its source may be slow to choose it.
  private val following = Reg(new FrameByte)
  private val full      = RegInit(false.B) // reset: there is none
  bytes.ready := !full
  when(bytes.fire) { following := bytes.bits }

  private val takes  = state === data && !high
  private val late   = takes && !full
  private val nibble = Mux(takes, following.data(3, 0), rest)
  when(bytes.fire) { full := true.B }.elsewhen(step && (takes || state === drop)) { full := false.B }

  private val next    = WireDefault(NibbleStream.idle)
  private val content = state === data || state === padding
  out          := RegEnable(next, NibbleStream.idle, step)
  next.crcGood := true.B
  next.valid   := state === preamble || next.payload
  next.payload := content || state === fcs
  next.last    := late || (state === fcs && count === 7.U)
  next.bad     := late
  next.odd     := late
  switch(state) {
    is(preamble) { next.data := Mux(count === 15.U, 0xd.U, 5.U) }
    is(data) { next.data := nibble }
    is(fcs) { next.data := ~crc(3, 0) }
  }

  // But for content, it is shifted out, with ones behind it: after the preamble it is Crc32.Start.
  private val nextCrc = Crc32.next(crc, Mux(content, next.data, crc(3, 0))) | Cat(Fill(4, !content), 0.U(28.W))

  when(step) {
    crc := nextCrc
    val enough = count === 59.U
    switch(state) {
      is(idle) {
        count := 0.U
        when(full) { state := preamble }
      }
      is(preamble) {
        count := count + 1.U
        high  := false.B
        ended := false.B
        when(count === 15.U) {
          state := data
          count := 0.U
        }
      }
      is(data, padding) {
        high := !high
        when(takes) {
          rest  := following.data(7, 4)
          ended := following.last
        }
        when(high) {
          when(!enough) { count := count + 1.U }
          when(ended) {
            state := Mux(enough, fcs, padding)
            when(enough) { count := 0.U }
          }
        }
        when(late) { state := drop }
      }
      is(fcs) {
        count := count + 1.U
        when(count === 7.U) {
          state := gap
          count := 0.U
        }
      }
      is(drop) {
        count := 0.U
        when(full && following.last) { state := gap }
      }
      is(gap) {
        count := count + 1.U
        when(count === 23.U) { state := idle }
      }
    }
  }
}
