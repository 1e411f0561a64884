package flyframe.can

import chisel3._
import chisel3.util._

/** What is known of a bit before it is sampled, and in the cycle behind that. */
class BitState extends Bundle {
  val place = new BitPlace

  /** What this node drives meanwhile, and whether it is the sender of the frame, or else a receiver. */
  val sent   = Bool()
  val sender = Bool()

  /** The bits before, and whether this is a stuff bit. */
  val run     = new EqualBits
  val isStuff = Bool()

  /** The CRC so far: its top bits, and whether it is wrong behind the frame. */
  val crc        = UInt(2.W)
  val crcIsWrong = Bool()

  /** Of the frame, as far as it is known. */
  val isExtended = Bool()
  val isRemote   = Bool()
  val dlc        = UInt(4.W)

  /** The bits of the own frame that come behind this one: see [[FrameShift]]. */
  val ownBit   = Bool()
  val ownAhead = Bool()

  /** When the bit was sampled: the own frame is acknowledged inside; errors change the counters. */
  val wasLooped = Bool()
  val mayCount  = Bool()

  /** [[Confinement]]. */
  val passive       = Bool()
  val passiveBehind = new PassiveBehind
}

/** What a bit means, as it was heard. */
class BitMeaning extends Bundle {
  val verdict = new BitVerdict

  /** The place of the next bit, if the verdict says nothing else. */
  val next = new BitPlace

  /** This is the last bit of a data byte, the last one; if it is recessive the bus is idle behind it. */
  val isLastByte = Bool()
  val idles      = Bool()

  /** What this node drives in the next bit, if it begins no frame with it. */
  val level = Bool()
}

/** Works out what a bit means while it is sampled: `meaning` is right in the cycle behind the sample, which
  * comes two cycles behind the last change of `state` at the earliest (CB-15).
  */
class BitOutlook(isTolerant: Boolean = true) extends Module {
  import CanField._

  val state = IO(Input(new BitState))

  /** The level, in the cycle of the sample. */
  val heard   = IO(Input(Bool()))
  val meaning = IO(Output(new BitMeaning))

  private val s     = state
  private val more  = s.run.and(heard)
  private val level = RegNext(heard)
  private val check = Module(new BitCheck(isTolerant))
  check.place         := s.place
  check.heard         := heard
  check.sent          := s.sent
  check.sender        := s.sender
  check.sendsExtended := s.ownBit
  check.run           := s.run
  check.isStuff       := s.isStuff
  check.crcIsWrong    := s.crcIsWrong

  private val walk = Module(new NextPlace)
  walk.place      := s.place
  walk.heard      := heard
  walk.isExtended := s.isExtended
  walk.isRemote   := s.isRemote
  walk.dlc        := s.dlc
  walk.suspends   := s.sender && s.passive
  walk.flagIsOver := more.count === 6.U

  // No register has a reset: they follow the state.
  private val verdict = RegNext(check.verdict)
  private val next    = RegNext(Mux(s.isStuff, s.place, walk.next))
  private val isFull  = RegNext(more.isFull && (s.place.isStuffed || s.isStuff))
  meaning.verdict    := verdict
  meaning.next       := next
  meaning.isLastByte := RegNext(walk.isLastByte)
  meaning.idles      := RegNext(walk.idles)

  // ---- the level of the next bit ----

  private val isDlc   = s.place.is(Dlc) && !s.isStuff
  private val isCrc   = s.place.isStuffed && !s.isStuff // the bit goes into the CRC
  private val isAhead = next.is(Data) && next.bit === 0.U && next.byte === 4.U
  private val ownBit = MuxLookup(next.field, Mux(isAhead, s.ownAhead, s.ownBit))(
    Seq(
      Fdf.U          -> false.B,
      R0.U           -> false.B,
      Dlc.U          -> Mux(isDlc, s.dlc(2), s.dlc(3)),
      Crc.U          -> Mux(isCrc, s.crc.xorR ^ level, s.crc(1)), // the top bit behind this one
      CrcDelimiter.U -> true.B
    )
  )
  private val sends    = s.sender && !verdict.lost && !s.place.is(Intermission)
  private val isStuff  = isFull && (next.isStuffed || next.is(CrcDelimiter))
  private val frameBit = Mux(isStuff, !level, ownBit)
  private val acks     = next.is(AckSlot) && Mux(s.sender, s.wasLooped, !s.crcIsWrong)
  private val flags    = next.is(ActiveErrorFlag, OverloadFlag) && !next.behindFlag
  private val calmly   = Mux(sends && (next.isStuffed || isStuff), frameBit, !acks && !flags)
  private val isPassive = Mux(
    !s.mayCount || (s.sender && verdict.stuffInArbitration),
    s.passive,
    Mux(
      s.sender,
      s.passiveBehind.tecUp8,
      Mux(verdict.inFlag, s.passiveBehind.recUp8, s.passiveBehind.recUp1)
    )
  )
  meaning.level := Mux(verdict.error, isPassive, calmly && !verdict.overload)
}
