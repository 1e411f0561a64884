package flyframe.dc

import scala.util.Random
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.SharedSimulation
import flyframe.model.TimeLoop
import flyframe.params.EscParams
import flyframe.registers.ClockRegisters

/** The system time alone, with the test as bus and host. */
class SystemTimeSpec extends AnyFlatSpec with SharedSimulation {
  private def shown(loop: TimeLoop) = (BigInt(loop.shownDifference), BigInt(loop.shownSpeed))

  private def check(name: String)(run: ClockBench => Unit) = name -> { dut: ClocksUnderTest =>
    run(new ClockBench(dut))
  }

  for ((bits, width, mhz) <- Seq((64, 8, 100), (32, 32, 125)))
    together(
      s"$bits bits, bus of $width, $mhz MHz",
      new ClocksUnderTest(
        EscParams(clocks = 2, clockBits = bits, dataBusWidth = width, coreClockMhz = mhz)
      )
    )(
      check("DC-03, DC-16: the system time is the local time and the offset") { b =>
        val before = b.hostTime()
        b.step(1000)
        val gone = b.hostTime() - before
        assert(gone >= 1000 * 1000 / mhz && gone < 1100 * 1000 / mhz + 200, gone)
        val offset = BigInt(if (bits == 64) "123456789abcdef0" else "9abcdef0", 16)
        val local  = b.hostTime()
        b.write(ClockRegisters.Offset, offset, bits / 8)
        val mask  = (BigInt(1) << bits) - 1
        val ahead = (b.hostTime() - local - offset) & mask
        assert(ahead > 0 && ahead < 2000, ahead)
        assert(b.read(ClockRegisters.Offset, bits / 8) == offset)
      },
      check("DC-17: a frame reads the time of its beginning less the delay, all the time") { b =>
        b.write(ClockRegisters.Delay, 5000, 4)
        b.frame()
        val atFrame = b.read(ClockRegisters.SystemTime, 4)
        b.step(3000)
        assert(b.read(ClockRegisters.SystemTime, 4) == atFrame)
        val now = b.hostTime()
        val age = (now - atFrame - 5000) & ((BigInt(1) << bits) - 1)
        assert(age > 3000 * 1000 / mhz && age < 3400 * 1000 / mhz, age)
        assert(b.read(ClockRegisters.Delay, 4) == 5000)
      },
      check("OP-19, DC-17, DC-19, B-85: differences and speed are those of the model") { b =>
        val loop   = new TimeLoop
        val random = new Random(7)
        assert(b.drift() == ((BigInt(0), BigInt(0))))
        for (n <- 1 to 60) {
          val difference = random.nextInt(4) match {
            case 0 => random.nextInt(41) - 20
            case 1 => random.nextInt(4001) - 2000
            case 2 => random.nextInt(200001) - 100000
            case _ => random.nextInt() >> 1
          }
          b.sample(loop, difference)
          assert(b.drift() == shown(loop), s"sample $n, $difference ns")
          if (n == 20) {
            b.set("time_filter_depth", 0x0934, 0)
            loop.resetMean()
            assert(b.drift() == shown(loop))
          }
          if (n == 25) {
            b.set("speed_filter_depth", 0x0935, 0)
            loop.resetSpeed()
            assert(b.drift() == shown(loop))
          }
          if (n == 40) b.set("time_filter_depth", 0x0934, 15)
          if (n == 40) loop.resetMean()
        }
      },
      check("B-85: the speed stays within its range, that of any speed counter start") { b =>
        for (start <- Seq(0x1000, 0x80, 0x7f, 0x10, 0x3fff)) {
          b.set("speed_filter_depth", 0x0935, 0)
          b.set("speed_counter_start", 0x0930, start)
          val loop = new TimeLoop
          loop.reset(start)
          for (difference <- Seq(1 << 30, -(1 << 30)); _ <- 1 to 3) {
            b.sample(loop, difference)
            assert(b.drift() == shown(loop), start)
          }
        }
      },
      check("DC-20: a write of the speed counter start resets the filters") { b =>
        val loop = new TimeLoop
        b.sample(loop, 1000)
        assert(b.drift()._1 != 0)
        b.set("speed_counter_start", 0x0930, 0x1000)
        assert(b.drift() == ((BigInt(0), BigInt(0))))
      },
      check("DC-18: the clock becomes slower or faster, and never jumps") { b =>
        val loop = new TimeLoop
        for (difference <- Seq(3000, -6000)) {
          b.set("speed_counter_start", 0x0930, 0x1000)
          loop.reset(0x1000)
          // Far enough that the range is its end: 3969 of 4096.
          for (_ <- 1 to 5) b.sample(loop, 16000 * difference.sign)
          b.step(40000)
          val (from, at) = (b.hostTime(), b.cycle)
          b.step(200000)
          val (to, end) = (b.hostTime(), b.cycle)
          val expected  = (end - at) * (1000.0 / mhz + loop.winsPerCycle)
          val gone      = ((to - from) & ((BigInt(1) << bits) - 1)).toDouble
          assert(math.abs(gone - expected) < 20, s"$gone ns, not $expected")
          assert(math.abs(gone / ((end - at) * 1000.0 / mhz) - 1) > 500e-6)
        }
      },
      check("B-85: a sixteenth, a quarter of the difference, 4096 ns are corrected") { b =>
        val loop       = new TimeLoop
        val (from, at) = (b.hostTime(), b.cycle)
        var fallen     = 0
        for (
          (difference, falls) <- Seq(
            8000    -> 2000,
            16384   -> 4096,
            -100000 -> -4096,
            16383   -> 4095,
            -16384  -> -4096,
            -112    -> -7
          )
        ) {
          b.sample(loop, difference)
          b.set("speed_counter_start", 0x0930, 0x1000)
          b.step(40000)
          fallen += falls
          val (to, end) = (b.hostTime(), b.cycle)
          val gone      = (to - from).toDouble - (end - at) * 1000.0 / mhz
          assert(math.abs(gone + fallen) < 25, gone)
        }
      },
      check("DC-01: the host sees all bytes of the time at which it reads the first") { b =>
        // A carry between two bytes while they are read.
        for (_ <- 1 to 20) {
          val (time, at) = (b.hostTime(), b.cycle)
          b.step(7)
          val (later, end) = (b.hostTime(), b.cycle)
          // Bytes of two times would be 256 ns apart; when the engine begins it differs by less than that.
          val wrong = later - time - (end - at) * 1000 / mhz
          assert(wrong.abs < 128, wrong)
          b.step(((256 - (later & 0xff).toInt) / 10).max(1))
        }
      }
    )
}
