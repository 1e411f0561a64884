package flyframe.relay

import chisel3._
import chisel3.util._
import flyframe.can.CanName

/** What came within a bit: it counts at its end (RB-21). */
class BitReport extends Bundle {
  val header     = Bool()
  val identified = Bool()
  val bad        = Bool()
  val good       = Bool()
  val starts     = Bool()
}

/** The pins of [[LinkInput]]. */
abstract class LinkInputPins extends Module {
  val setting = IO(Input(new LinkSetting))

  /** Bits of another length begin; the port comes up or goes down; a bit of this node ends. */
  val renew   = IO(Input(Bool()))
  val restart = IO(Input(Bool()))
  val tick    = IO(Input(Bool()))

  /** In bus mode nothing is heard, and nothing is told. What comes when it ends may be the rest of a frame:
    * the receiver begins anew (RB-25).
    */
  val rests = IO(Input(Bool()))

  val heard   = IO(Input(Bool()))
  val address = IO(Input(UInt(7.W)))
  val stuck   = IO(Output(Bool()))

  /** Of the bit that the last `tick` ended. */
  val report = IO(Output(new BitReport))

  /** An identifier to be kept, until it is: before a bit is over. */
  val named     = IO(Output(Valid(new CanName)))
  val takesName = IO(Input(Bool()))

  /** Of the frame that comes: its source is this node, it has no hops left. */
  val isOwn  = IO(Output(Bool()))
  val isLast = IO(Output(Bool()))

  /** A byte to be stored, until it is; of hops one less than came. */
  val byte  = IO(Output(Valid(UInt(8.W))))
  val index = IO(Output(UInt(5.W)))
  val takes = IO(Input(Bool()))

  val badHeader = IO(Output(Bool()))
  val badFrame  = IO(Output(Bool()))
}

/** A link receiver behind its bit timing: what came in the last bit, and the bytes as they come. */
class LinkInput extends LinkInputPins {
  private val bits     = Module(new LinkBits)
  private val receiver = Module(new LinkReceiver)
  private val events   = receiver.events
  private val anew     = restart || (!rests && RegNext(rests, true.B)) // reset: as in bus mode
  bits.setting     := setting
  bits.restart     := renew || anew
  bits.heard       := heard || rests
  bits.hard        := receiver.idle
  receiver.sample  := bits.sample
  receiver.restart := anew
  receiver.address := address
  stuck            := receiver.stuck
  isOwn            := receiver.isOwn
  badHeader        := events.badHeader && !rests
  badFrame         := events.badFrame && !rests

  private val now = Wire(new BitReport)
  now.header     := events.header
  now.identified := events.identified
  now.bad        := events.bad
  now.good       := events.good
  now.starts     := events.starts
  private val soFar = RegInit(0.U.asTypeOf(new BitReport)) // reset: nothing came
  private val all   = soFar.asUInt | now.asUInt
  private val told  = RegInit(0.U.asTypeOf(new BitReport)) // reset: likewise
  // A port may change within a bit that another length of the bits has cut: what came in it is void (RB-20).
  soFar := Mux(tick || anew, 0.U, all).asTypeOf(new BitReport)
  when(tick) { told := all.asTypeOf(new BitReport) }
  when(rests) {
    soFar := 0.U.asTypeOf(new BitReport)
    told  := 0.U.asTypeOf(new BitReport)
  }
  report := told

  // The word is there a cycle behind the event. Reset: nothing is to be stored.
  private val isLastReg = Reg(Bool())
  private val stores    = RegInit(false.B)
  private val names     = RegInit(false.B)
  when(RegNext(events.header, false.B)) { isLastReg := receiver.word(15, 8) === 0.U }
  when(takes) { stores := false.B }
  when(events.byte) { stores := true.B }
  when(takesName) { names := false.B }
  when(events.identified) { names := true.B }
  isLast      := isLastReg
  named.valid := names
  named.bits  := CanName.of(receiver.word)
  byte.valid  := stores
  byte.bits   := receiver.word(7, 0) - (receiver.index === LinkHeader.HopsByte.U)
  index       := receiver.index
}
