package flyframe.can

import chiseltest._
import flyframe.Simulation
import org.scalatest.flatspec.AnyFlatSpec
import scala.util.Random

/** What a bit means and what is driven in the next one, alone: the wire is written from the standard. */
class BitOutlookSpec extends AnyFlatSpec with ChiselScalatestTester {
  import CanField._

  /** A bit of a frame, or of what follows it, and its place. */
  private case class Spot(level: Boolean, field: Int, bit: Int, byte: Int, isStuff: Boolean)

  private val fields = Map(
    "sof" -> Sof,
    "id"  -> Id,
    "srr" -> RtrOrSrr,
    "ide" -> Ide,
    "ext" -> IdExtension,
    "fdf" -> Fdf,
    "r0"  -> R0,
    "dlc" -> Dlc,
    "crc" -> Crc
  )

  /** A frame, its delimiters recessive, up to the end of the intermission. A stuff bit has the place of the
    * bit behind it.
    */
  private def spots(frame: CanFrame): Seq[Spot] = {
    def spot(b: WireBit) = {
      val field = b.part match {
        case "data" => Data
        case "rtr"  => if (frame.extended) Rtr else RtrOrSrr
        case part   => fields(part)
      }
      val (bit, byte) = if (field == Data) (b.index % 8, b.index / 8) else (b.index, 0)
      Spot(b.level == '1', field, bit, byte, isStuff = false)
    }
    val all = Wire(frame).bits.map(b => spot(b).copy(isStuff = b.isStuff)) ++ Seq(
      (CrcDelimiter to AckDelimiter).map(Spot(level = true, _, 0, 0, isStuff = false)),
      (0 to 6).map(Spot(level = true, Eof, _, 0, isStuff = false)),
      (0 to 2).map(Spot(level = true, Intermission, _, 0, isStuff = false))
    ).flatten
    all.zip(all.tail :+ all.last).map { case (s, behind) =>
      if (s.isStuff) behind.copy(level = s.level, isStuff = true) else s
    }
  }

  private def random(random: Random) = {
    val extended = random.nextBoolean()
    val dlc      = random.nextInt(16)
    val remote   = random.nextInt(3) == 0
    // Bytes with long runs bring stuff bits.
    val data = Seq.fill(CanFrame.size(dlc, remote))(Seq(0, 0xff, random.nextInt(256))(random.nextInt(3)))
    CanFrame(random.nextInt(if (extended) 1 << 29 else 1 << 11), extended, remote, dlc, data)
  }

  /** Brings the state in which bit `i` of a frame finds a node that has heard what stands before. */
  private class Bench(dut: BitOutlook) {
    private val s = dut.state
    for (flag <- Seq(s.crcIsWrong, s.wasLooped, s.passive)) flag.poke(false)
    for (flag <- Seq(s.passiveBehind.tecUp8, s.passiveBehind.recUp1, s.passiveBehind.recUp8)) flag.poke(false)
    s.mayCount.poke(true)

    def at(field: Int, bit: Int = 0, byte: Int = 0): Unit = {
      s.place.field.poke(field)
      s.place.bit.poke(bit)
      s.place.byte.poke(byte)
      s.isStuff.poke(false)
      s.run.count.poke(1)
      s.run.level.poke(true)
    }

    def bring(frame: CanFrame, all: Seq[Spot], i: Int, sender: Boolean): Unit = {
      val (spot, before) = (all(i), all.take(i))
      val counted        = before.filter(!_.isStuff)
      at(spot.field, spot.bit, spot.byte)
      s.isStuff.poke(spot.isStuff)
      s.sender.poke(sender)
      s.sent.poke(if (sender) spot.level else spot.field != AckSlot)
      val last = before.lastOption.exists(_.level)
      s.run.level.poke(last)
      s.run.count.poke(before.reverseIterator.takeWhile(_.level == last).size % 8)
      s.crc.poke(Crc15.of(counted.filter(b => b.field <= Crc || b.field == Data).map(_.level)) >> 13)
      s.isExtended.poke(frame.extended)
      s.isRemote.poke(counted.findLast(b => b.field == RtrOrSrr || b.field == Rtr).exists(_.level))
      val heard = counted.filter(_.field == Dlc).map(_.level)
      val own   = (0 to 3).map(j => (frame.dlc >> 3 - j & 1) == 1)
      s.dlc.poke((own ++ heard).takeRight(4).foldLeft(0)((n, b) => 2 * n + (if (b) 1 else 0)))
      // What comes out of the shift register: identifier, RTR, SRR, IDE and data; the second word of the data
      // is not in it before the first one has left.
      val ahead = all
        .drop(i + 1)
        .find(b => !b.isStuff && (b.field >= Id && b.field <= Rtr || b.field == Data))
      val isOfSecond = ahead.exists(b => b.field == Data && b.byte == 4 && b.bit == 0)
      s.ownBit.poke(ahead.exists(_.level) ^ isOfSecond)
      s.ownAhead.poke(ahead.exists(_.level) == isOfSecond)
    }

    /** The bit is sampled; `meaning` is right then. */
    def hear(level: Boolean): Unit = {
      dut.heard.poke(!level)
      dut.clock.step(2)
      dut.heard.poke(level)
      dut.clock.step()
    }

    def level: Boolean = dut.meaning.level.peekBoolean()

    def next: (Int, Int, Int) = {
      val n     = dut.meaning.next
      val field = n.field.peekInt().toInt
      // Of other fields the byte counts for nothing.
      (field, n.bit.peekInt().toInt, if (field == Data) n.byte.peekInt().toInt else 0)
    }

    def isError: Boolean = dut.meaning.verdict.error.peekBoolean()
  }

  private def bench(body: (BitOutlook, Bench) => Unit) =
    test(new BitOutlook).withAnnotations(Simulation.annotations(this, "outlook"))(dut =>
      body(dut, new Bench(dut))
    )

  "CAN-07, CAN-09, CAN-14: a frame" should "be driven by its sender, and acknowledged by receivers" in
    bench { (dut, b) =>
      val source = new Random(1)
      for (n <- 1 to 40) {
        val frame             = random(source)
        val (isWrong, looped) = (source.nextInt(4) == 0, source.nextInt(4) == 0)
        val all               = spots(frame)
        for {
          sender <- Seq(true, false)
          i      <- all.indices.init
        } {
          def what   = s"frame $n, bit $i, ${if (sender) "sender" else "receiver"}, $frame"
          val (a, z) = (all(i), all(i + 1))
          b.bring(frame, all, i, sender)
          // A CRC is known behind its last bit.
          dut.state.crcIsWrong.poke(isWrong && !sender && Seq(CrcDelimiter, AckSlot).contains(a.field))
          dut.state.wasLooped.poke(looped)
          val level = a.field != AckSlot && a.level
          b.hear(level)
          assert(!b.isError, what)
          assert(b.next == ((z.field, z.bit, z.byte)), what)
          val acks = z.field == AckSlot && (if (sender) looped else !isWrong)
          assert(b.level == ((!sender || z.level) && !acks), what)
          if (a.field == Data && a.bit == 7 && !a.isStuff)
            assert(dut.meaning.isLastByte.peekBoolean() == (z.field == Crc), what)
          assert(!dut.meaning.idles.peekBoolean(), what)
        }
        b.bring(frame, all, all.size - 1, sender = true)
        for (passive <- Seq(false, true)) {
          dut.state.passive.poke(passive)
          b.hear(level = true)
          assert(dut.meaning.idles.peekBoolean() == !passive) // CAN-12: else it suspends
        }
        dut.state.passive.poke(false)
      }
    }

  "CAN-11: a sender that loses the arbitration" should "be silent from the next bit on" in bench { (dut, b) =>
    val source = new Random(2)
    var lost   = 0
    for (_ <- 1 to 20) {
      val frame = random(source)
      val all   = spots(frame)
      for (i <- all.indices if all(i).level && !all(i).isStuff && all(i).field >= Id && all(i).field <= Rtr) {
        b.bring(frame, all, i, sender = true)
        b.hear(level = false)
        assert(dut.meaning.verdict.lost.peekBoolean() && !b.isError && b.level, s"$frame, $i")
        lost += 1
      }
    }
    assert(lost > 100)
  }

  "CAN-30, CAN-31, CAN-33: the flag behind an error" should "be that of the state behind the count" in
    bench { (dut, b) =>
      // In which counter which step is taken, and where: Some(field) of an own flag, or None, a form error.
      for {
        passive  <- Seq(false, true)
        mayCount <- Seq(true, false)
        behind   <- 0 until 8
        sender   <- Seq(true, false)
        isFlag   <- Seq(false, true)
      } {
        def bit(i: Int) = (behind >> i & 1) == 1
        dut.state.passive.poke(passive)
        dut.state.mayCount.poke(mayCount)
        dut.state.passiveBehind.tecUp8.poke(bit(0))
        dut.state.passiveBehind.recUp1.poke(bit(1))
        dut.state.passiveBehind.recUp8.poke(bit(2))
        dut.state.sender.poke(sender)
        dut.state.sent.poke(!isFlag)
        if (isFlag) b.at(ActiveErrorFlag, 3) else b.at(Eof, 2)
        b.hear(level = isFlag)
        assert(b.isError)
        val isPassive = if (!mayCount) passive else if (sender) bit(0) else if (isFlag) bit(2) else bit(1)
        assert(b.level == isPassive, s"$passive $mayCount $behind $sender $isFlag")
      }
    }

  "CAN-31: a stuff bit of the own arbitration heard dominant" should "be followed by the flag of the state" in
    bench { (dut, b) =>
      for (passive <- Seq(false, true)) {
        b.at(Id, 6)
        dut.state.isStuff.poke(true)
        dut.state.run.count.poke(5)
        dut.state.run.level.poke(false)
        dut.state.sender.poke(true)
        dut.state.sent.poke(true)
        dut.state.passive.poke(passive)
        dut.state.passiveBehind.tecUp8.poke(!passive) // the counter stands
        b.hear(level = false)
        assert(b.isError && b.level == passive)
      }
    }

  "CAN-12, CAN-13, CAN-21: an overload condition" should "be followed by a flag of six bits" in
    bench { (dut, b) =>
      for (sender <- Seq(true, false)) {
        dut.state.sender.poke(sender)
        dut.state.sent.poke(true)
        val places = Seq(Intermission -> 0, Intermission -> 1, ErrorDelimiter -> 7, OverloadDelim -> 7) ++
          Option.when(!sender)(Eof -> 6)
        for ((field, bit) <- places) {
          b.at(field, bit)
          b.hear(level = false)
          assert(dut.meaning.verdict.overload.peekBoolean() && !b.level, s"$field $bit")
        }
        dut.state.sent.poke(false)
        for {
          flag <- Seq(ActiveErrorFlag, OverloadFlag)
          bit  <- 0 to 7
        } {
          b.at(flag, bit)
          b.hear(level = false)
          // Bit 6: the flag is over, and what others drive is heard.
          assert(!b.isError && b.level == (bit >= 5), s"$flag $bit")
        }
        dut.state.sent.poke(true)
        for (bit <- Seq(0, 6, 7)) {
          b.at(PassiveErrorFlag, bit)
          b.hear(level = false)
          assert(!b.isError && b.level, s"passive $bit")
        }
      }
    }
}
