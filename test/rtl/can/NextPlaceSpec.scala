package flyframe.can

import chisel3._
import chiseltest._
import org.scalatest.flatspec.AnyFlatSpec
import scala.util.Random

/** How a controller goes through the bit stream, one place from the other. */
class NextPlaceSpec extends AnyFlatSpec with ChiselScalatestTester {
  import CanField._

  private class Walk(dut: NextPlace) {
    private var place = (Idle, 0, 0)
    for (flag <- Seq(dut.isExtended, dut.isRemote, dut.suspends, dut.flagIsOver)) flag.poke(false)
    dut.dlc.poke(0)

    def go(field: Int, bit: Int = 0): Unit = place = (field, bit, 0)

    /** The field, as errors record it, and the bit of it behind a bit that was heard. */
    def hear(level: Boolean): (Int, Int) = {
      dut.place.field.poke(place._1)
      dut.place.bit.poke(place._2)
      dut.place.byte.poke(place._3)
      dut.heard.poke(level)
      val next = dut.next
      place = (next.field.peekInt().toInt, next.bit.peekInt().toInt, next.byte.peekInt().toInt)
      at
    }
    def hear(levels: String): (Int, Int) = {
      for (level <- levels) hear(level == '1')
      at
    }
    private def at = (if (place._1 == Data) Data + place._3 else place._1, place._2)
  }

  private def walk(body: (NextPlace, Walk) => Unit) = test(new NextPlace)(dut => body(dut, new Walk(dut)))

  "CAN-07: the bits of any frame" should "be those that a reader of frames finds" in walk { (dut, walk) =>
    val random = new Random(1)
    for (_ <- 1 to 60) {
      val extended = random.nextBoolean()
      val dlc      = random.nextInt(16)
      val remote   = random.nextInt(3) == 0
      val data     = Seq.fill(if (remote) 0 else dlc min 8)(random.nextInt(256))
      val frame    = CanFrame(random.nextInt(if (extended) 1 << 29 else 1 << 11), extended, remote, dlc, data)
      val reader   = new FrameReaderModel
      reader.begin()
      dut.isExtended.poke(extended)
      dut.isRemote.poke(remote)
      // What has been heard of the DLC, then all of it.
      dut.dlc.poke(0)
      walk.go(Idle)
      while (reader.field != CrcDelimiter) {
        val level = FrameReaderModel.level(frame, reader.field, reader.bit, reader.checksum)
        if (reader.field == Dlc && reader.bit == 3) dut.dlc.poke(dlc >> 1)
        if (reader.field >= Data || reader.field == Crc) dut.dlc.poke(dlc)
        reader.take(level)
        assert(walk.hear(level) == ((reader.field, reader.bit)), frame)
      }
      assert(walk.hear("10111111") == ((Eof, 5)))
      assert(walk.hear("1") == ((Eof, 6)))
      assert(walk.hear("1") == ((Intermission, 0)))
    }
  }

  "CAN-12: behind the intermission" should "come an idle bus, eight bits more, or a frame" in
    walk { (dut, walk) =>
      for (
        (suspends, bits, next) <- Seq(
          (false, "111", Idle          -> 0),
          (false, "110", Id            -> 0), // the third bit was a start of frame
          (true, "111", Suspend        -> 0),
          (true, "110", Id             -> 0),
          (true, "1111111111", Suspend -> 7),
          (true, "11111111111", Idle   -> 0),
          (true, "11111110", Id        -> 0)
        )
      ) {
        walk.go(Intermission)
        dut.suspends.poke(suspends)
        assert(walk.hear(bits) == next, s"$suspends $bits")
      }
    }

  "CAN-10, CAN-34: eleven recessive bits in a row" should "end integrating, and count in bus-off" in
    walk { (_, walk) =>
      // The edge in front of a dominant bit lets the count begin anew, too (CB-03): it is never the eleventh.
      walk.go(Integrating)
      assert(walk.hear("1" * 5 + "0") == ((Integrating, 0)))
      assert(walk.hear("1" * 10) == ((Integrating, 10)))
      assert(walk.hear("1") == ((Idle, 0)))
      walk.go(BusOff)
      assert(walk.hear("1" * 5 + "0") == ((BusOff, 0)))
      assert(walk.hear("1" * 10) == ((BusOff, 10)))
      assert(walk.hear("1") == ((BusOff, 0)))
    }

  "CAN-21: a flag" should "be followed by dominant bits of others, and by eight recessive ones" in
    walk { (dut, walk) =>
      for ((flag, delimiter) <- Seq(ActiveErrorFlag -> ErrorDelimiter, OverloadFlag -> OverloadDelim)) {
        walk.go(flag)
        assert(walk.hear("0" * 5) == ((flag, 5)))
        assert(walk.hear("0") == ((flag, 6)))
        assert(walk.hear("000") == ((flag, 7)))
        assert(walk.hear("1") == ((delimiter, 1)))
        assert(walk.hear("1" * 6) == ((delimiter, 7)))
        assert(walk.hear("1") == ((Intermission, 0)))
      }
      // A passive one lasts until six equal bits have been heard.
      walk.go(PassiveErrorFlag)
      assert(walk.hear("1101") == ((PassiveErrorFlag, 0)))
      dut.flagIsOver.poke(true)
      assert(walk.hear("1") == ((PassiveErrorFlag, 6)))
      dut.flagIsOver.poke(false)
      assert(walk.hear("0") == ((PassiveErrorFlag, 7)))
      assert(walk.hear("1") == ((ErrorDelimiter, 1)))
    }
}
