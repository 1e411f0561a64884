package flyframe.alarm

import chisel3._
import chisel3.util._
import flyframe.frame.{FramePosition, Part}
import flyframe.lanes.Lanes
import flyframe.mii.{Crc32, NibbleStream}
import flyframe.protocol.AppendedLayout
import flyframe.ram.{DualPortRam, DualPortRamIO}

/** Adds one datagram to a passing frame, behind the others (AP-01 to AP-10, docs/rules/alarm.md).
  *
  * While nothing is pending it is a wire. A frame that starts while a datagram is pending leaves
  * [[DatagramAppender.Delay]] nibbles late, so that its length field is known before it is sent, and its FCS
  * before it is replaced. The frame then has the new length, the bit "more follows" in the datagram that was
  * the last, the new datagram in place of padding, beyond it as far as needed, and an FCS of its own. Frames
  * that come while this one is leaving follow behind the minimum gap, unchanged.
  *
  * Nothing leaves better than it came: a frame that ends bad is sent on bad.
  *
  * @param bytes
  *   length of the datagram, header and working counter included
  * @param maxSubTelegrams
  *   datagrams a frame may have
  * @param newRam
  *   makes the buffer's RAM; another one for proofs, which cannot see into a black box
  */
class DatagramAppender(
    bytes: Int,
    maxSubTelegrams: Int,
    newRam: (Int, Int, Clock) => DualPortRamIO = DualPortRam(_, _)(_).io
) extends Module {
  import DatagramAppender._
  private val nibbles = 2 * bytes

  /** Once per nibble slot: `in` is over and the next one begins. */
  val step = IO(Input(Bool()))
  val in   = IO(Input(new NibbleStream))
  val out  = IO(Output(new NibbleStream))

  /** Where `in` lies in its frame. */
  val position = IO(Input(new FramePosition))

  /** There is a datagram to append. It must not change while `busy`, which is true, at the latest, in the
    * cycle behind the last one with `pending`, and stays true while the datagram may be needed.
    */
  val pending = IO(Input(Bool()))
  val busy    = IO(Output(Bool()))

  /** The number of the nibble needed now, the low one of each byte first, and the nibble; and the byte of the
    * one that will be needed in the next cycle. `reads` is true from the second nibble on.
    */
  val nibble   = IO(Output(UInt(log2Ceil(nibbles).W)))
  val nextByte = IO(Output(UInt(log2Ceil(bytes).W)))
  val data     = IO(Input(UInt(4.W)))
  val reads    = IO(Output(Bool()))

  /** For one cycle each: a frame begins, of whatever kind; a frame takes the datagram. */
  val begins = IO(Output(Bool()))
  val takes  = IO(Output(Bool()))

  // These describe the frame that comes in.
  private val inFrame   = RegInit(false.B) // a frame is coming in; reset: none
  private val delayed   = RegInit(false.B) // frames go through the buffer; reset: they pass
  private val candidate = RegInit(false.B) // the frame coming in may get the datagram; reset: no
  private val append    = RegInit(false.B) // the frame that was chosen gets the datagram; reset: no
  private val starts    = in.valid && !inFrame

  // The buffer holds the frames that have come and not left.
  private val ram     = newRam(Depth, (new Entry).getWidth, clock)
  private val writeAt = RegInit(0.U(log2Ceil(Depth).W))     // reset: empty
  private val readAt  = RegInit(0.U(log2Ceil(Depth).W))
  private val count   = RegInit(0.U(log2Ceil(Depth + 1).W))
  private val ends    = RegInit(0.U(log2Ceil(Depth + 1).W)) // entries that are ends
  private val active  = RegInit(false.B)                    // a frame is leaving; reset: no
  private val gap    = RegInit(Gap.U(5.W)) // slots since the last frame left; reset: long ago
  private val cut    = RegInit(false.B)    // the rest of a frame does not fit; reset: no
  private val rested = gap === Gap.U
  // Only when nothing is left in the buffer, and no end of a cut frame is to come, may frames pass undelayed.
  private val empty    = count === 0.U && !active && rested && !(cut && inFrame)
  private val wanted   = RegEnable(pending, false.B, step) // reset: nothing pending
  private val chooses  = starts && !delayed && wanted && !in.payload
  private val buffered = delayed || chooses

  // What a nibble means is known when it comes in. It is kept with it as a mark, for the time when it leaves.
  private val length = Reg(UInt(12.W))
  private val left   = Reg(UInt(12.W)) // of the length: bytes still to come
  private val wrong  = Reg(Bool())     // length and datagrams do not fit together
  private val quarter  = Cat(position.byte(0), position.high).suggestName("at") // of the length's two bytes
  private val inHeader = in.payload && position.part === Part.ethercat && !position.checksumCleared
  private val isFirst  = position.byte === 0.U && !position.high
  private val isBehind = in.payload && isFirst && Mux(
    length === 0.U,
    position.part === Part.header && position.datagram === 0.U,
    position.part === Part.padding && position.paddingBytes === 0.U
  )
  private val isMore =
    in.payload && position.part === Part.header && position.byte === 7.U && position.high && length =/= 0.U
  private val fits = (length === 0.U || length >= 12.U) && length < (12 * maxSubTelegrams).U &&
    length <= (LongestLength - bytes).U && !length(11)
  when(step && in.valid && candidate) {
    when(inHeader) {
      when(quarter =/= 3.U) { length := Cat(in.data, length(11, 4)) }
        .otherwise {
          append := in.data === 1.U && fits
          left   := length
        }
    }.elsewhen(position.high) { left := left - 1.U }
    when(isBehind && length =/= 0.U && left =/= 0.U) { wrong := true.B }
  }

  // The position of this slave: what the first datagram of the frame has counted so far.
  private val slave = Reg(UInt(8.W))
  private val inPosition =
    in.payload && position.part === Part.header && position.datagram === 0.U &&
      position.byte === AppendedLayout.Adp.offset.U && length =/= 0.U
  when(step && in.valid && candidate && inPosition) { slave := Cat(in.data, slave(7, 4)) }

  private val full  = count >= (Depth - 2).U
  private val push  = buffered && in.busy && !(cut && !starts) && count =/= Depth.U
  private val entry = Wire(new Entry)
  entry.payload := in.payload
  entry.data    := in.data
  entry.end     := in.end || full
  entry.bad     := in.bad || full
  entry.odd     := in.odd
  entry.crcGood := in.crcGood
  entry.mark := MuxCase(
    Mark.none,
    Seq(
      in.end                        -> Mark.none,
      (inHeader && quarter =/= 3.U) -> Mark.length,
      isMore                        -> Mark.more,
      isBehind                      -> Mark.behind
    )
  )

  // These describe the frame that leaves.
  private val head      = ram.readData.asTypeOf(new Entry)
  private val closed    = RegInit(false.B) // the end of the frame to be extended has come; reset: no
  private val rest      = Reg(UInt(4.W))   // nibbles of it up to its FCS that are still to leave, once closed
  private val isBad     = Reg(Bool())
  private val inserted  = Reg(Bool())      // the first nibble of the datagram has left
  private val inserting = RegInit(false.B) // more nibbles of the datagram are to leave; reset: no
  private val at        = Reg(UInt(log2Ceil(nibbles).W))
  private val crc       = Reg(UInt(32.W))
  private val word      = Reg(UInt(2.W))   // number of the next nibble of the length field
  private val inFcs     = RegInit(false.B) // only the FCS is left of the frame; reset: no frame
  private val isPlace   = head.mark === Mark.behind && !(closed && rest < FcsNibbles.U)
  private val inserts   = append && (inserting || (!inserted && isPlace))
  private val pop       = active && !(inserts && inFcs)
  private val newLength = length + bytes.U

  // What leaves is chosen in one slot and sent in the next, because the way from the RAM to the next port is
  // too long for one cycle.
  private val next = WireDefault(NibbleStream.idle)
  private val held = RegEnable(next, NibbleStream.idle, step)
  out := Mux(delayed, held, in)
  when(chooses) { out.valid := false.B }

  // `crc` covers the nibbles before the one held, and `crcNow` that one, too. As soon as the FCS leaves,
  // `crc` is only shifted out.
  private val shifts = Reg(Bool()) // the FCS is leaving
  private val crcNow = Mux(shifts, crc, Crc32.next(crc, held.data))
  when(active) {
    next.valid   := !head.end
    next.payload := head.payload
    next.data    := head.data
    next.end     := head.end // never while the datagram is inserted: that is done before the FCS
    next.bad     := head.bad
    next.odd     := head.odd
    next.crcGood := head.crcGood
    when(append) {
      next.bad     := isBad
      next.crcGood := !isBad
      when(inserts) {
        next.data := MuxCase(
          data,
          Seq(
            (at === (2 * AppendedLayout.Index.offset).U)     -> slave(3, 0),
            (at === (2 * AppendedLayout.Index.offset + 1).U) -> slave(7, 4)
          )
        )
      }.elsewhen(inFcs) {
        when(rest =/= 0.U) { next.data := crcNow(3, 0) ^ Fill(4, !isBad) } // else half a byte
      }.elsewhen(head.mark === Mark.length) {
        next.data := Lanes.nibbles(newLength, 3)(word)
      }.elsewhen(head.mark === Mark.more) {
        next.data := head.data | 8.U
      }
    }
  }
  private val leaves = active && next.end
  busy     := append || candidate || chooses || wanted
  nibble   := at
  nextByte := Mux(step && active && inserting, at + 1.U, at) >> 1 // the first nibble leaves its byte as it is
  reads    := inserting
  begins   := step && starts
  takes    := step && active && inserts && !inserted

  ram.write        := step && push
  ram.writeAddress := writeAt
  ram.writeData    := entry.asUInt
  ram.readAddress  := Mux(step && pop, readAt + 1.U, readAt)

  when(step) {
    when(in.busy) { inFrame := in.valid }
    when(chooses) { delayed := true.B }.elsewhen(empty && !push) { delayed := false.B }
    when(starts) {
      candidate := chooses
      cut       := false.B
    }
    when(chooses) {
      closed   := false.B
      inFcs    := false.B
      wrong    := false.B
      inserted := false.B
      at       := 0.U
      slave    := 0.U
      word     := 0.U
      shifts   := false.B
    }
    when(push) {
      writeAt := writeAt + 1.U
      when(full) { cut := true.B }
    }
    when(pop) { readAt := readAt + 1.U }
    count := count + push - pop
    ends  := ends + (push && entry.end) - (pop && head.end)

    // With the end of the frame that may be extended it is known how many nibbles are left to leave. The
    // first of those in the buffer is the one before its FCS, if no half byte is behind that.
    val isOver = candidate && in.end
    when(isOver) { rest := Mux(in.odd, FcsNibbles.U, (FcsNibbles + 1).U) }.elsewhen(pop) {
      rest := rest - 1.U
    }
    inFcs := Mux(isOver, in.odd, closed && (inFcs || pop))
    when(isOver) {
      candidate := false.B
      closed    := true.B
      isBad     := in.bad || wrong
    }

    // A frame begins to leave when its lag is in the buffer. One that cannot be extended, or has come as a
    // whole, need not wait for that, but its first nibble must have been in the RAM for a slot.
    val ready = count >= (Lag - 1).U || (!candidate && count > 1.U) || ends =/= 0.U
    active := Mux(active, !next.end, delayed && rested && ready)
    when(active) {
      gap := 0.U
      when(inserts) {
        inserted  := true.B
        inserting := at =/= (nibbles - 1).U
        at        := at + 1.U
      }
      when(head.mark === Mark.length) { word := word + 1.U }
    }.elsewhen(!rested) { gap := gap + 1.U }
    crc := Mux(held.payload, crcNow, Crc32.Start)
    when(active && append && inFcs && !inserts) {
      crc    := crcNow >> 4
      shifts := true.B
    }
    when(leaves) { append := false.B }
  }
}

object DatagramAppender {

  /** Nibbles a frame is held back so that it can be extended: its FCS, half a byte behind it, its end, and
    * one to choose.
    */
  val Delay = 11

  private val Lag        = 10
  private val FcsNibbles = 8

  /** Entries of the buffer. It holds the lag and as many nibbles as the datagram has, and what piles up while
    * further frames come with shorter gaps than they leave with.
    */
  private val Depth = 128

  /** Slots between the end of a frame and the next one that leave through the buffer. Frames come with 24,
    * less what the crossings take; with more than that between those that leave, the buffer would never get
    * empty.
    */
  private val Gap = 19

  /** The longest EtherCAT length field in an Ethernet frame: 1500 bytes less its header. */
  private val LongestLength = 1498

  private object Mark extends ChiselEnum {

    /** What a nibble is to the frame that is extended.
      *   - `none`: it leaves as it came, unless the new datagram or the new FCS takes its place.
      *   - `length`: it is nibble 0, 1 or 2 of the length field, which becomes that of the longer frame.
      *   - `more`: it has the bit "more datagrams follow" of a datagram's header, which becomes 1.
      *   - `behind`: it is the first one behind the datagrams, where the new datagram goes.
      */
    val none, length, more, behind = Value
  }

  private class Entry extends Bundle {
    val payload = Bool()
    val data    = UInt(4.W)
    val end     = Bool()
    val bad     = Bool()
    val odd     = Bool()
    val crcGood = Bool()
    val mark    = Mark()
  }
}
