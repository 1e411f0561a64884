package flyframe.can

import chisel3._
import chisel3.util._

/** Where in the bit stream a controller is (CB-10): field, as in [[CanField]], but all data bytes are one;
  * bit of the field, or how many bits of it are over; and the data byte.
  */
class BitPlace extends Bundle {
  val field = UInt(5.W)
  val bit   = UInt(5.W)
  val byte  = UInt(3.W)

  def is(fields: Int*): Bool = fields.map(field === _.U).reduce(_ || _)

  /** The field as errors record it. */
  def recorded: UInt = field | Mux(field === CanField.Data.U, byte, 0.U)

  def isArbitration: Bool = field >= CanField.Id.U && field <= CanField.Rtr.U
  def isIdle: Bool        = field === CanField.Idle.U

  /** Bits that are stuffed; the stuff bit behind the CRC lies in front of its delimiter. */
  def isStuffed: Bool = (field >= CanField.Sof.U && field <= CanField.Crc.U) || field(4, 3).andR

  /** All bits of the flag have been sent, and the first recessive one has not come: bit is 6, then 7. */
  def behindFlag: Bool = bit(2, 1).andR

  def isDelimiter: Bool = is(CanField.ErrorDelimiter, CanField.OverloadDelim)

  /** Nobody sends, or only one who does not count; edges synchronise hard (CAN-03, CB-03). */
  def isHard: Bool = is(CanField.Idle, CanField.Suspend, CanField.Integrating, CanField.BusOff) ||
    (is(CanField.Intermission) && bit =/= 0.U)

  /** A dominant bit here is the start of a frame. */
  def isStart: Bool =
    is(CanField.Idle, CanField.Suspend) || (is(CanField.Intermission) && bit === 2.U)

  /** A lost arbitration as it is recorded, from 1. */
  def lostBit: UInt = bit +& MuxLookup(field, 1.U(6.W))(
    Seq(
      CanField.RtrOrSrr    -> 12.U,
      CanField.Ide         -> 13.U,
      CanField.IdExtension -> 14.U,
      CanField.Rtr         -> 32.U
    ).map { case (f, n) => f.U -> n }
  )
}

object BitPlace {
  def apply(field: Int, bit: Int = 0): BitPlace = {
    val place = Wire(new BitPlace)
    place.field := field.U
    place.bit   := bit.U
    place.byte  := 0.U
    place
  }
}

/** The place of the next bit, if the present one is no error, no stuff bit and no overload condition.
  * Combinational.
  */
class NextPlace extends Module {
  import CanField._

  val place = IO(Input(new BitPlace))

  /** The level heard. */
  val heard = IO(Input(Bool()))

  /** Of the frame: identifier of 29 bits, remote; DLC without the bit heard, and whole in the data. */
  val isExtended = IO(Input(Bool()))
  val isRemote   = IO(Input(Bool()))
  val dlc        = IO(Input(UInt(4.W)))

  /** The intermission is followed by a suspended transmission. */
  val suspends = IO(Input(Bool()))

  /** Six equal bits have come in a passive flag. */
  val flagIsOver = IO(Input(Bool()))

  val next = IO(Output(new BitPlace))

  /** It is that of an idle bus if this bit is recessive. */
  val idles = IO(Output(Bool()))

  /** This is the last byte of the data. */
  val isLastByte = IO(Output(Bool()))
  isLastByte := place.byte === Mux(dlc(3), 7.U, dlc(2, 0) - 1.U)

  // The last bit of each field that has more than one.
  private val lastBit = MuxLookup(place.field, 0.U(5.W))(
    Seq(
      Id              -> 10,
      IdExtension     -> 17,
      Dlc             -> 3,
      Data            -> 7,
      Crc             -> 14,
      Eof             -> 6,
      Intermission    -> 2,
      Suspend         -> 7,
      ActiveErrorFlag -> 5,
      OverloadFlag    -> 5,
      ErrorDelimiter  -> 7,
      OverloadDelim   -> 7,
      Integrating     -> 10,
      BusOff          -> 10
    ).map { case (f, n) => f.U -> n.U }
  )
  private val isLast = place.bit === lastBit
  idles := place.isIdle || (isLast && (place
    .is(Suspend, Integrating) || (place.is(Intermission) && !suspends)))
  private val hasData = !isRemote && (dlc(2, 0) ## heard).orR

  private def to(field: Int): Unit = {
    next.field := field.U
    next.bit   := 0.U
  }

  next.field := place.field
  next.bit   := place.bit + 1.U
  next.byte  := 0.U
  switch(place.field) {
    is(Idle.U) { next.bit := 0.U; when(!heard) { to(Id) } }
    is(Sof.U) { to(Id) }
    is(Id.U) { when(isLast) { to(RtrOrSrr) } }
    is(RtrOrSrr.U) { to(Ide) }
    is(Ide.U) { to(Fdf); when(heard) { to(IdExtension) } }
    is(IdExtension.U) { when(isLast) { to(Rtr) } }
    is(Rtr.U) { to(Fdf) }
    is(Fdf.U) { to(Dlc); when(isExtended) { to(R0) } }
    is(R0.U) { to(Dlc) }
    is(Dlc.U) { when(isLast) { to(Crc); when(hasData) { to(Data) } } }
    is(Data.U) {
      next.byte := place.byte + isLast
      when(isLast) {
        next.bit := 0.U
        when(isLastByte) { to(Crc) }
      }
    }
    is(Crc.U) { when(isLast) { to(CrcDelimiter) } }
    is(CrcDelimiter.U) { to(AckSlot) }
    is(AckSlot.U) { to(AckDelimiter) }
    is(AckDelimiter.U) { to(Eof) }
    is(Eof.U) { when(isLast) { to(Intermission) } }
    is(Intermission.U) {
      when(isLast) { to(Idle); when(suspends) { to(Suspend) }; when(!heard) { to(Id) } }
    }
    is(Suspend.U) { when(isLast) { to(Idle) }; when(!heard) { to(Id) } }
    is(ActiveErrorFlag.U, PassiveErrorFlag.U, OverloadFlag.U) {
      when(place.behindFlag) {
        next.bit := 7.U
        when(heard) {
          to(ErrorDelimiter)
          when(place.field === OverloadFlag.U) { to(OverloadDelim) }
          next.bit := 1.U // this was the first one
        }
      }.elsewhen(place.field === PassiveErrorFlag.U) { next.bit := Mux(flagIsOver, 6.U, 0.U) }
    }
    is(ErrorDelimiter.U, OverloadDelim.U) { when(isLast) { to(Intermission) } }
    is(Integrating.U) { when(isLast) { to(Idle) }; when(!heard) { next.bit := 0.U } }
    is(BusOff.U) { when(isLast || !heard) { next.bit := 0.U } }
  }
}
