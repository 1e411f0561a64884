package flyframe.mii

import scala.util.Random
import chiseltest._
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.SharedSimulation

/** From half nibbles to symbols of MII. */
class RmiiSymbolsSpec extends AnyFlatSpec with SharedSimulation {

  /** What the PHY gives in one period of its clock. */
  private case class Half(crsDv: Boolean, rxd: Int, er: Boolean = false)

  /** A symbol: RX_DV, RX_ER, RXD. */
  private type Seen = (Boolean, Boolean, Int)

  private class Driver(dut: RmiiSymbols) {
    dut.clock.setTimeout(0)

    private var last = 2 // cycles since the last symbol

    /** The symbols of `halves`, without those that say nothing. No two come in consecutive cycles. */
    def apply(halves: Seq[Half]): Seq[Seen] = halves.flatMap { half =>
      dut.crsDv.poke(half.crsDv)
      dut.rxd.poke(half.rxd)
      dut.rxEr.poke(half.er)
      val dv    = dut.symbol.dv.peekBoolean()
      val er    = dut.symbol.er.peekBoolean()
      val valid = dut.valid.peekBoolean()
      assert(!valid || last > 1)
      last = if (valid) 1 else last + 1
      val symbol = Option.when(valid && (dv || er))(
        (dv, er, if (dv) dut.symbol.data.peekInt().toInt else 0)
      )
      dut.clock.step()
      symbol
    }
  }

  private val Carrier         = Half(crsDv = true, 0) // CRS_DV is up, there are no data yet
  private val Silence         = Half(crsDv = false, 0)
  private def silent(n: Int)  = Seq.fill(n)(Silence)
  private def carrier(n: Int) = Seq.fill(n)(Carrier)

  /** Halves of nibbles; in the last `late` of them the carrier has gone, so CRS_DV falls in each first half.
    */
  private def halves(nibbles: Seq[Int], late: Int = 0): Seq[Half] = nibbles.zipWithIndex.flatMap {
    case (n, i) =>
      Seq(Half(i < nibbles.size - late, n & 3), Half(crsDv = true, n >> 2))
  }
  private def symbols(nibbles: Seq[Int]): Seq[Seen] = nibbles.map((true, false, _))
  private val Start                                 = Seq.fill(15)(5) :+ 0xd

  together("in the PHY's clock", new RmiiSymbols)(
    "B-71: a frame, whatever the PHY does before and behind it" -> { dut =>
      val driver = new Driver(dut)
      val random = new Random(1)
      driver(silent(4))
      for (_ <- 1 to 300) {
        val frame = Start ++ Seq.fill(random.nextInt(60))(random.nextInt(16))
        val late  = random.nextInt(8) min frame.size
        assert(
          driver(
            carrier(random.nextInt(12)) ++ halves(frame, late) ++ silent(2 + random.nextInt(9))
          ) == symbols(frame)
        )
      }
    },
    "B-71: a preamble that has lost an odd number of halves ends with its SFD all the same" -> { dut =>
      val driver = new Driver(dut)
      val random = new Random(2)
      driver(silent(4))
      for (lost <- 1 to 29 by 2) {
        val payload = Seq.fill(30)(random.nextInt(16))
        val seen    = driver(carrier(5) ++ halves(Start).drop(lost) ++ halves(payload, late = 4) ++ silent(6))
        val (preamble, rest) = seen.span(_ == ((true, false, 5)))
        assert(rest == symbols(0xd +: payload))
        assert(preamble.size == (31 - lost) / 2)
      }
    },
    "B-71: RX_ER in either half of a nibble, and without a frame" -> { dut =>
      val driver = new Driver(dut)
      driver(silent(4))
      for (at <- 0 until 2 * 24) {
        val frame    = Start ++ Seq.fill(8)(9)
        val given    = halves(frame).zipWithIndex.map { case (h, i) => h.copy(er = i == at) }
        val expected = frame.zipWithIndex.map { case (n, i) => (true, i == at / 2, n) }
        assert(driver(given ++ silent(5)) == expected, s"RX_ER in half $at")
      }
      assert(driver(Seq.fill(10)(Half(crsDv = false, 0, er = true)) ++ silent(3)).forall { case (dv, er, _) =>
        er && !dv
      })
    },
    "B-71: a false carrier is RX_ER, and no frame" -> { dut =>
      val driver = new Driver(dut)
      driver(silent(4))
      val seen = driver(carrier(3) ++ Seq.fill(20)(Half(crsDv = true, 2)) ++ silent(5))
      assert(seen.size >= 10 && seen.forall { case (dv, er, _) => er && !dv })
      assert(driver(halves(Start :+ 7) ++ silent(3)) == symbols(Start :+ 7))
      // Whatever follows in the same carrier.
      val late = driver(Half(crsDv = true, 3) +: halves(Start ++ Seq(1, 2, 3)))
      assert(late.size >= 19 && late.forall { case (dv, er, _) => er && !dv })
      driver(silent(3))
      assert(driver(halves(Start :+ 7) ++ silent(3)) == symbols(Start :+ 7))
    },
    "B-71: frames and carriers of any kind, one right behind the other" -> { dut =>
      val driver = new Driver(dut)
      val random = new Random(3)
      driver(silent(4))
      for (_ <- 1 to 1000) {
        driver(random.nextInt(4) match {
          case 0 =>
            Seq.fill(random.nextInt(9))(Half(random.nextBoolean(), random.nextInt(4), random.nextBoolean()))
          case 1 => halves(Start).drop(1) ++ halves(Seq(1, 2, 3), late = 2)
          case _ => halves(Start ++ Seq(1, 2, 3))
        })
        val behind = driver(silent(3 + random.nextInt(3)))
        assert(behind.size <= 2)
        assert(driver(halves(Start :+ 7) ++ silent(5)) == symbols(Start :+ 7))
      }
    }
  )
}
