package flyframe.dc

import chisel3._
import chiseltest._
import chiseltest.formal._
import chiseltest.formal.backends.Engines
import org.scalatest.flatspec.AnyFlatSpec

/** A [[LocalClock]] driven by a [[SpeedControl]] whose inputs are all free: a time loop that does anything.
  * From reset on, so only carries into the second byte are reached.
  */
class LocalClockProof(periodNs: Int) extends Module {
  private val value      = IO(Input(UInt(15.W)))
  private val slew       = IO(Input(Bool()))
  private val lose       = IO(Input(Bool()))
  private val win        = IO(Input(Bool()))
  private val localClock = Module(new LocalClock(periodNs, 8, 8))
  private val speed      = Module(new SpeedControl)
  speed.value     := value
  speed.slew      := slew
  speed.lose      := lose
  speed.win       := win
  speed.round     := localClock.last
  localClock.more := speed.more
  assert(speed.more >= -2.S && speed.more <= 2.S, "a cycle counts its period, and -2 to 2 ns")

  // The time as one number; a round gives that of its first cycle.
  private val time   = RegInit(0.U(64.W))
  private val passes = (periodNs.S(8.W) + speed.more).asUInt
  time := time + passes
  private val first = RegInit(0.U(64.W))
  when(localClock.last) { first := time + passes }
  assert(localClock.timeByte === (first >> (localClock.place << 3))(7, 0), "a byte of another time")
}

class LocalClockFormal extends AnyFlatSpec with ChiselScalatestTester with Formal {
  for (periodNs <- Seq(8, 10))
    s"DC-03, DC-18, $periodNs ns: the local time" should
      "go on by -2 to 2 ns more than its period in every cycle, whatever the time loop does" in {
        assume(Engines.present, Engines.missing)
        verify(new LocalClockProof(periodNs), Seq(BoundedCheck(40), Engines.boolector))
      }
}
