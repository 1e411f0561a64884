package flyframe.frame

import chisel3._
import chisel3.util._
import flyframe.mii.NibbleStream
import flyframe.protocol.{DatagramLayout, EtherType}
import flyframe.protocol.DatagramLayout.Length

/** Where in a frame the nibble at hand lies. */
object Part extends ChiselEnum {

  /** The parts in the order in which a frame holds them:
    *
    *   - ethernet: addresses, VLAN tag if there is one, and EtherType;
    *   - ip: IP and UDP header, if EtherCAT is carried in UDP;
    *   - ethercat: the EtherCAT header of two bytes;
    *   - header, data, counter: those of a datagram, again and again;
    *   - padding: what stands behind the last datagram, the FCS included;
    *   - foreign: the rest of a frame that is not EtherCAT, which passes as it is;
    *   - ended: no frame is under way, or what comes of it does not pass any more.
    */
  val ethernet, ip, ethercat, header, data, counter, padding, foreign, ended = Value
}

/** Where in its frame the nibble at hand stands. [[FrameParser]] finds that out, and all units that look into
  * passing frames go by it.
  */
class FramePosition extends Bundle {
  val part = Part()

  /** Byte within the part. */
  val byte = UInt(5.W)

  /** The nibble is the high half of its byte. */
  val high = Bool()

  /** Whole bytes of the frame before this one; the count stops at 60. */
  val frameBytes = UInt(6.W)

  /** Whole bytes of padding and FCS before this one; the count stops at 69. */
  val paddingBytes = UInt(7.W)

  /** Data bytes of the datagram that are still to come, this one included. */
  val dataLeft = UInt(11.W)

  /** Number of the datagram in its frame, from 0 on; the count stops at 129. */
  val datagram = UInt(8.W)

  /** With this nibble it is decided that the frame is not EtherCAT (B-10). */
  val notEtherCat = Bool()

  /** The UDP checksum has been cleared: the frame needs a new FCS even if it is not EtherCAT (B-12). */
  val checksumCleared = Bool()
}

/** Finds its way through a frame: Ethernet II, VLAN tag, UDP/IP, EtherCAT header, datagrams, padding (FP-01
  * to FP-07, B-10).
  *
  * @param abandon
  *   the frame ends for the processing unit with this nibble
  */
class FrameParser extends Module {
  val step     = IO(Input(Bool())) // once per nibble slot
  val in       = IO(Input(new NibbleStream))
  val abandon  = IO(Input(Bool()))
  val position = IO(Output(new FramePosition))

  private val part         = RegInit(Part.ended) // reset: no frame is under way
  private val byte         = Reg(UInt(5.W))
  private val high         = Reg(Bool())
  private val low          = Reg(UInt(4.W))      // low half of the byte at hand
  private val previous     = Reg(UInt(8.W))      // the byte before
  private val tagged       = Reg(Bool())
  private val frameBytes   = Reg(UInt(6.W))
  private val paddingBytes = Reg(UInt(7.W))
  private val length   = Reg(UInt(12.W)) // data bytes of the datagram (or UDP length), then those left
  private val cleared  = Reg(Bool())     // the UDP checksum has passed
  private val more     = Reg(Bool())
  private val datagram = Reg(UInt(8.W))

  private val whole = Cat(in.data, low)    // the byte at hand, with its high half
  private val word  = Cat(previous, whole) // big endian, as Ethernet and IP write their fields
  private val atEnd = WireDefault(false.B) // the last byte of the part
  private val next  = WireDefault(part)    // the part behind `atEnd`
  private val alien = WireDefault(false.B) // this byte shows that the frame is not EtherCAT

  private def on(n: Int): Bool = byte === n.U

  switch(part) {
    is(Part.ethernet) {
      atEnd := on(13)
      next  := Mux(word === EtherType.EtherCat.U, Part.ethercat, Part.ip)
      alien := on(
        13
      ) && word =/= EtherType.EtherCat.U && word =/= EtherType.Ipv4.U && (word =/= EtherType.Vlan.U || tagged)
    }
    is(Part.ip) {
      atEnd := on(27)
      next  := Part.ethercat
      alien := (on(0) && whole =/= 0x45.U) || (on(9) && whole =/= 0x11.U) || (on(
        23
      ) && word =/= EtherType.EtherCat.U)
    }
    is(Part.ethercat) {
      atEnd := on(1)
      next  := Part.header
      alien := on(1) && in.data =/= 1.U
    }
    is(Part.header) {
      atEnd := on(DatagramLayout.bytes - 1)
      next  := Mux(length === 0.U, Part.counter, Part.data)
    }
    is(Part.foreign) {
      atEnd := cleared && length === 7.U // the end by the UDP length: 6 of it came before the counting (B-12)
      next  := Part.padding
    }
    is(Part.data) {
      atEnd := length === 1.U
      next  := Part.counter
    }
    is(Part.counter) {
      atEnd := on(DatagramLayout.CounterBytes - 1)
      next  := Mux(more, Part.header, Part.padding)
    }
  }
  private val isTag = part === Part.ethernet && on(13) && word === EtherType.Vlan.U && !tagged

  position.part            := part
  position.byte            := byte
  position.high            := high
  position.frameBytes      := frameBytes
  position.paddingBytes    := paddingBytes
  position.dataLeft        := length(10, 0)
  position.datagram        := datagram
  position.notEtherCat     := high && alien
  position.checksumCleared := cleared

  when(step && in.valid) {
    when(!in.payload) {
      part         := Part.ethernet
      byte         := 0.U
      high         := false.B
      tagged       := false.B
      cleared      := false.B
      frameBytes   := 0.U
      paddingBytes := 0.U
      datagram     := 0.U
    }.otherwise {
      high := !high
      low  := in.data
      when(part === Part.header) { // the length word, least significant nibble first
        when(on(Length.offset) || (on(Length.last) && !high)) {
          length := Cat(Mux(on(Length.last), in.data(2, 0), in.data), length(11, 4))
        }
        when(on(Length.last) && high) { more := in.data(3) }
      }
      when(high) {
        previous := whole
        byte     := byte + 1.U
        when(frameBytes =/= 60.U) { frameBytes := frameBytes + 1.U }
        when(part === Part.padding && paddingBytes =/= 69.U) { paddingBytes := paddingBytes + 1.U }
        when(part === Part.ip && on(25)) { length := word(11, 0) }
          .elsewhen(part =/= Part.header) { length := length - 1.U }
        when(part === Part.ip && on(27)) { cleared := true.B }
        when(isTag) {
          tagged := true.B
          byte   := 10.U // two bytes of tag control, then the inner EtherType
        }.elsewhen(alien) {
          part := Mux(cleared && length === 7.U, Part.padding, Part.foreign)
        }.elsewhen(atEnd) {
          part := next
          byte := 0.U
          when(part === Part.counter && datagram =/= 129.U) { datagram := datagram + 1.U }
        }
      }
    }
    when(abandon) { part := Part.ended }
  }
  when(step && in.end) { part := Part.ended }
}
