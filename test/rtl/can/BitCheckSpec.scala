package flyframe.can

import chisel3._
import chiseltest._
import org.scalatest.flatspec.AnyFlatSpec

/** What a bit means, for each place, role and level: all that can be, against the text of the rules. */
class BitCheckSpec extends AnyFlatSpec with ChiselScalatestTester {
  import CanField._

  /** @param sent
    *   what the node drives; a receiver that acknowledges, and whoever sends a flag, drives dominant
    * @param extended
    *   the own frame has 29 bits
    * @param run
    *   the level of the bits before
    */
  private case class Case(
      field: Int,
      bit: Int,
      sender: Boolean,
      sent: Boolean,
      heard: Boolean,
      isStuff: Boolean,
      run: Boolean,
      extended: Boolean,
      crcIsWrong: Boolean
  )

  private val fixed       = Seq(CrcDelimiter, AckDelimiter, Eof, ErrorDelimiter, OverloadDelim)
  private val arbitration = Seq(Id, RtrOrSrr, Ide, IdExtension, Rtr)

  /** The last bits up to the RTR bit of the own frame. */
  private def upToRtr(extended: Boolean) = if (extended) arbitration else Seq(Id, RtrOrSrr)

  /** The verdict, in words of the rules; nothing said is nothing wrong. */
  private def verdict(c: Case, isTolerant: Boolean): String = {
    val isOverwritten = c.sent && !c.heard
    val isInFrame     = (c.field >= Sof && c.field <= Crc) || c.field >= Data
    val isInFlag      = Seq(ActiveErrorFlag, OverloadFlag).contains(c.field) && c.bit < 6
    c.field match {
      case _ if c.isStuff && c.sender && c.sent != c.heard =>
        if (isOverwritten && upToRtr(c.extended).contains(c.field)) "stuff in arbitration" else "bit"
      case _ if c.isStuff && !c.sender && c.heard == c.run           => "stuff"
      case _ if c.isStuff                                            => ""
      case f if c.sender && arbitration.contains(f) && isOverwritten => "lost"
      case _ if isInFrame && c.sender && c.sent != c.heard           => "bit"
      case Fdf if !c.sender && c.heard                              => if (isTolerant) "exception" else "form"
      case AckSlot if c.heard && !c.sent                            => "bit"
      case AckSlot if c.heard && c.sender                           => "ack"
      case AckDelimiter if c.crcIsWrong && !c.sender                => "crc"
      case Eof if !c.heard && c.bit == 6 && !c.sender               => "overload"
      case ErrorDelimiter | OverloadDelim if !c.heard && c.bit == 7 => "overload"
      case Intermission if !c.heard && c.bit < 2                    => "overload"
      case _ if isInFlag && c.heard                                 => "bit"
      case f if fixed.contains(f) && !c.heard                       => "form"
      case _                                                        => ""
    }
  }

  /** Last bits of the fields that matter here; of others the middle ones are as the first. */
  private def bits(field: Int) = field match {
    case Intermission                                                    => 0 to 2
    case Eof                                                             => 0 to 6
    case ErrorDelimiter | OverloadDelim | ActiveErrorFlag | OverloadFlag => 0 to 7
    case _                                                               => 0 to 0
  }

  private val levels = Seq(false, true)
  private val cases = for {
    field   <- (Idle to BusOff) :+ Data
    bit     <- bits(field)
    sender  <- levels
    isStuff <- levels if !isStuff || field > Sof && field <= CrcDelimiter || field == Data
    isInFlag = Seq(ActiveErrorFlag, OverloadFlag).contains(field) && bit < 6
    sent <-
      if (isInFlag) Seq(false)
      else if (sender && field < AckDelimiter || field == AckSlot) levels
      else Seq(true)
    run <- if (isStuff) levels else Seq(true)
    isLong = Seq(IdExtension, Rtr, R0).contains(field) // only of frames with 29 bits
    extended   <- if (sender) levels.filter(_ || !isLong) else Seq(false)
    crcIsWrong <- if (field == AckDelimiter) levels else Seq(false)
    heard      <- levels
  } yield Case(field, bit, sender, sent, heard, isStuff, run, extended, crcIsWrong)

  for (isTolerant <- levels)
    s"CAN-08, CAN-11 to CAN-13, CAN-20, CB-05: a bit, FD ${if (isTolerant) "tolerated" else "refused"}" should
      "mean what the rules say, in each place" in test(new BitCheck(isTolerant)) { dut =>
        val names = CanError.all.map { case (name, kind) => kind -> name }.toMap
        val met = cases.map { c =>
          dut.place.field.poke(c.field)
          dut.place.bit.poke(c.bit)
          dut.place.byte.poke(0)
          dut.sender.poke(c.sender)
          dut.sent.poke(c.sent)
          dut.heard.poke(c.heard)
          dut.isStuff.poke(c.isStuff)
          dut.run.level.poke(c.run)
          dut.run.count.poke(if (c.isStuff) EqualBits.Most else 1)
          dut.sendsExtended.poke(c.extended)
          dut.crcIsWrong.poke(c.crcIsWrong)
          val v = dut.verdict
          val said = Seq(
            Option.when(v.error.peekBoolean())(
              names(v.kind.peekInt().toInt) + (if (v.stuffInArbitration.peekBoolean()) " in arbitration"
                                               else "")
            ),
            Option.when(v.lost.peekBoolean())("lost"),
            Option.when(v.overload.peekBoolean())("overload"),
            Option.when(v.exception.peekBoolean())("exception")
          ).flatten
          assert(said == Seq(verdict(c, isTolerant)).filter(_.nonEmpty), c)
          val isInFlag = Seq(ActiveErrorFlag, OverloadFlag).contains(c.field) && c.bit < 6
          assert(v.inFlag.peekBoolean() == isInFlag, c)
          said
        }
        assert(met.flatten.toSet.size == (if (isTolerant) 9 else 8))
      }
}
