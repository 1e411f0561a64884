package flyframe.can

import chisel3._
import chisel3.util._

/** What is to be said of a bit. At most one of `error`, `lost`, `overload` and `exception` is true. */
class BitVerdict extends Bundle {

  /** An error, its type as in [[CanError]], and whether it lies in an own active error or overload flag. */
  val error  = Bool()
  val kind   = UInt(3.W)
  val inFlag = Bool()

  /** The arbitration is lost (CAN-11). */
  val lost = Bool()

  /** An overload condition (CAN-12, CAN-13, CAN-21). */
  val overload = Bool()

  /** A protocol exception (CAN-08). */
  val exception = Bool()

  /** A recessive stuff bit of the own arbitration was heard dominant (CAN-31, CB-05). */
  val stuffInArbitration = Bool()
}

/** Compares a bit as it was heard with what it should be (CAN-20, CB-05). Combinational.
  *
  * @param isTolerant
  *   a recessive FDF is a protocol exception (CAN-08), else a form error (FB-11)
  */
class BitCheck(isTolerant: Boolean = true) extends Module {
  import CanField._

  val place = IO(Input(new BitPlace))

  /** The level heard, and what this node drove meanwhile. */
  val heard = IO(Input(Bool()))
  val sent  = IO(Input(Bool()))

  /** Sender of the frame, or else receiver. */
  val sender = IO(Input(Bool()))

  /** The identifier of the own frame has 29 bits; up to IDE. */
  val sendsExtended = IO(Input(Bool()))

  /** The bits before; five equal ones stand in front of a stuff bit. */
  val run     = IO(Input(new EqualBits))
  val isStuff = IO(Input(Bool()))

  /** The CRC heard is wrong. */
  val crcIsWrong = IO(Input(Bool()))

  val verdict = IO(Output(new BitVerdict))

  private val wrong       = sent =/= heard
  private val overwritten = sent && !heard
  private val inOwnFlag   = place.is(ActiveErrorFlag, OverloadFlag) && !place.behindFlag
  private val isLastOfEof = place.bit === 6.U
  private val isLastBit   = place.bit === 7.U // of a delimiter

  private def error(kind: Int): Unit = {
    verdict.error := true.B
    verdict.kind  := kind.U
  }

  // The RTR bit of the own frame, or what stands in front of it.
  private val upToRtr = place.is(Id, RtrOrSrr) ||
    Mux(place.is(Ide), sendsExtended, place.is(IdExtension, Rtr))

  verdict        := 0.U.asTypeOf(verdict)
  verdict.inFlag := inOwnFlag
  when(isStuff) {
    verdict.stuffInArbitration := sender && upToRtr && overwritten
    when(sender) {
      when(wrong) {
        error(CanError.Bit)
        when(verdict.stuffInArbitration) { error(CanError.Stuff) }
      }
    }.elsewhen(heard === run.level) { error(CanError.Stuff) }
  }.elsewhen(place.isStuffed) {
    verdict.lost := sender && place.isArbitration && overwritten
    when(sender && wrong && !verdict.lost) { error(CanError.Bit) }
    when(!sender && place.is(Fdf) && heard) {
      if (isTolerant) verdict.exception := true.B else error(CanError.Form)
    }
  }.otherwise {
    switch(place.field) {
      is(CrcDelimiter.U) { when(!heard) { error(CanError.Form) } }
      is(AckSlot.U) {
        when(!sent && heard) { error(CanError.Bit) }.elsewhen(sender && heard) { error(CanError.Ack) }
      }
      is(AckDelimiter.U) {
        when(!sender && crcIsWrong) { error(CanError.Crc) }.elsewhen(!heard) { error(CanError.Form) }
      }
      is(Eof.U) {
        when(!heard) {
          when(isLastOfEof && !sender) { verdict.overload := true.B }.otherwise { error(CanError.Form) }
        }
      }
      is(Intermission.U) { verdict.overload := !heard && !place.bit(1) }
      is(ActiveErrorFlag.U, OverloadFlag.U) { when(inOwnFlag && heard) { error(CanError.Bit) } }
      is(ErrorDelimiter.U, OverloadDelim.U) {
        when(!heard) {
          when(isLastBit) { verdict.overload := true.B }.otherwise { error(CanError.Form) }
        }
      }
    }
  }
}
