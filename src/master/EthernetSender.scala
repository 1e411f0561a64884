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

  private object State extends ChiselEnum { val idle, preamble, data, padding, fcs, drop = Value }
  import State._
  private val state = RegInit(idle)     // reset: nothing leaves
  private val count = Reg(UInt(6.W))    // nibbles of preamble, FCS and gap; whole bytes up to 60
  private val high  = Reg(Bool())
  private val rest  = Reg(UInt(4.W))    // the high nibble
  private val ended = Reg(Bool())       // the last byte has been taken
  private val crc   = Reg(UInt(32.W))
  private val gap   = RegInit(0.U(5.W)) // slots to wait; reset: the line was quiet

  // The next byte: its source may be slow to choose it.
  private val following = Reg(new FrameByte)
  private val full      = RegInit(false.B) // reset: there is none
  bytes.ready := !full
  when(bytes.fire) { following := bytes.bits }

  private val takes  = state === data && !high
  private val late   = takes && !full
  private val nibble = Mux(takes, following.data(3, 0), rest)
  when(bytes.fire) { full := true.B }.elsewhen(step && (takes || state === drop)) { full := false.B }

  private val next = WireDefault(NibbleStream.idle)
  out          := RegEnable(next, NibbleStream.idle, step)
  next.crcGood := true.B
  switch(state) {
    is(preamble) {
      next.valid := true.B
      next.data  := Mux(count === 15.U, 0xd.U, 5.U)
    }
    is(data, padding) {
      next.valid   := true.B
      next.payload := true.B
      next.data    := Mux(state === data, nibble, 0.U)
      next.last    := late
      next.bad     := late
      next.odd     := late
    }
    is(fcs) {
      next.valid   := true.B
      next.payload := true.B
      next.data    := ~crc(3, 0)
      next.last    := count === 7.U
    }
  }

  when(step) {
    when(gap =/= 0.U) { gap := gap - 1.U }
    switch(state) {
      is(idle) {
        count := 0.U
        when(full && gap === 0.U) { state := preamble }
      }
      is(preamble) {
        count := count + 1.U
        high  := false.B
        ended := false.B
        crc   := Crc32.Start
        when(count === 15.U) {
          state := data
          count := 0.U
        }
      }
      is(data, padding) {
        high := !high
        crc  := Crc32.next(crc, next.data)
        when(takes) {
          rest  := following.data(7, 4)
          ended := following.last
        }
        when(high) {
          when(count =/= 60.U) { count := count + 1.U }
          when(ended) {
            state := Mux(count >= 59.U, fcs, padding)
            when(count >= 59.U) { count := 0.U }
          }
        }
        when(late) { state := drop }
      }
      is(fcs) {
        count := count + 1.U
        crc   := crc >> 4
        when(count === 7.U) { state := idle }
      }
      is(drop) { when(full && following.last) { state := idle } }
    }
    when(next.last) { gap := 24.U }
  }
}
