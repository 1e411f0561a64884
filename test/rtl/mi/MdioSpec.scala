package flyframe.mi

import chisel3._
import chiseltest._
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.SharedSimulation

/** An access on the management bus, with PHYs that answer it; or with a line that the test holds. */
class MdioUnderTest(coreClockMhz: Int) extends Module {
  private val dut = Module(new Mdio(coreClockMhz))
  val run         = IO(Input(Bool()))
  val delays      = IO(Input(Bool()))
  val isWrite     = IO(Input(Bool()))
  val phy         = IO(Input(UInt(5.W)))
  val phyRegister = IO(Input(UInt(5.W)))
  val loaded      = IO(Input(chisel3.util.Valid(UInt(16.W))))
  val done        = IO(Output(Bool()))
  val silent      = IO(Output(Bool()))
  val data        = IO(Output(UInt(16.W)))
  val mdc         = IO(Output(Bool()))
  val out         = IO(Output(Bool()))
  val enable      = IO(Output(Bool()))
  val collide     = IO(Output(Bool()))

  /** As the pins of [[Phys]]. */
  val present = IO(Input(UInt(32.W)))
  val at      = IO(Input(UInt(10.W)))
  val value   = IO(Output(UInt(16.W)))

  private val phys = Module(new Phys(coreClockMhz))
  dut.run         := run
  dut.delays      := delays
  dut.isWrite     := isWrite
  dut.phy         := phy
  dut.phyRegister := phyRegister
  for (i <- 0 to 1) {
    dut.load(i).valid := loaded.valid
    dut.load(i).bits  := loaded.bits(8 * i + 7, 8 * i)
  }
  done             := dut.done
  silent           := dut.silent
  data             := dut.data
  mdc              := dut.mdc
  out              := dut.mdioOut
  enable           := dut.mdioEnable
  collide          := dut.mdioEnable && phys.drives
  phys.mdc         := dut.mdc
  phys.line        := dut.mdioOut || !dut.mdioEnable
  phys.present     := present
  phys.at          := at
  phys.store.valid := false.B
  phys.store.bits  := 0.U
  value            := phys.value
  dut.mdioIn       := RegNext(RegNext(phys.level)) // the crossing
}

/** MI-06, MI-11: frames of the management bus, bit by bit. */
class MdioSpec extends AnyFlatSpec with SharedSimulation {

  /** What was on the line where MDC rose: driven level, or None where the line was let go. */
  private class Bench(dut: MdioUnderTest) {
    var bits          = Vector.empty[Option[Int]]
    var rises         = Vector.empty[Long]
    private var cycle = 0L
    private var last  = (false, false, false)

    dut.run.poke(false)
    dut.delays.poke(false)
    dut.present.poke(1 << 9)
    dut.reset.poke(true.B)
    dut.clock.step()
    dut.reset.poke(false.B)

    def step(): Unit = {
      val now = (is(dut.mdc), is(dut.enable), is(dut.out))
      if (now._1 && !last._1) {
        bits :+= Option.when(now._2)(if (now._3) 1 else 0)
        rises :+= cycle
      }
      if (now._1 && last._1) assert(now == last, "the line changes while MDC is high")
      assert(!is(dut.collide))
      last = now
      dut.clock.step()
      cycle += 1
    }
    private def is(signal: Bool) = signal.peekBoolean()

    /** One access; what was read, or None if no PHY answered, and the cycles it took. */
    def access(
        isWrite: Boolean,
        phy: Int,
        register: Int,
        data: Int = 0,
        rest: Int => Boolean = _ => false
    ): (Option[Int], Int) = {
      dut.isWrite.poke(isWrite)
      dut.phy.poke(phy)
      dut.phyRegister.poke(register)
      dut.loaded.valid.poke(true)
      dut.loaded.bits.poke(data)
      step()
      dut.loaded.valid.poke(false)
      dut.run.poke(true)
      var cycles = 0
      while (!is(dut.done)) {
        dut.delays.poke(rest(cycles))
        step()
        cycles += 1
        assert(cycles < 40000, "never done")
      }
      dut.delays.poke(false)
      val result = Option.when(!is(dut.silent))(dut.data.peekInt().toInt)
      step()
      dut.run.poke(false)
      (result, cycles)
    }
    def stored(phy: Int, register: Int): Int = {
      dut.at.poke(phy << 5 | register)
      dut.value.peekInt().toInt
    }
  }
  private def binary(value: Int, width: Int) = (width - 1 to 0 by -1).map(i => Option(value >> i & 1))
  private val Free                           = Option.empty[Int]

  for (mhz <- Seq(25, 50, 100, 125))
    together(s"$mhz MHz", new MdioUnderTest(mhz))(
      "MI-06: a write is preamble, start, opcode, addresses, turnaround, data, and an idle clock" -> { dut =>
        val b = new Bench(dut)
        assert(b.access(isWrite = true, 9, 0x15, 0x8e71)._1.contains(0x8e71))
        val header = binary(1, 2) ++ binary(1, 2) ++ binary(9, 5) ++ binary(0x15, 5) ++ binary(2, 2)
        assert(b.bits == Seq.fill(32)(Some(1)) ++ header ++ binary(0x8e71, 16) :+ Free)
        assert(b.stored(9, 0x15) == 0x8e71)
      },
      "MI-06: a read lets the line go from the turnaround on" -> { dut =>
        val b = new Bench(dut)
        b.access(isWrite = true, 9, 3, 0x1de7)
        b.bits = Vector.empty
        assert(b.access(isWrite = false, 9, 3, 0x5555)._1.contains(0x1de7))
        val header = binary(1, 2) ++ binary(2, 2) ++ binary(9, 5) ++ binary(3, 5)
        assert(b.bits == Seq.fill(32)(Some(1)) ++ header ++ Seq.fill(19)(Free))
      },
      "MI-01, MI-05: without a PHY a read ends, and says so; a write ends" -> { dut =>
        val b = new Bench(dut)
        assert(b.access(isWrite = false, 8, 3)._1.isEmpty)
        assert(b.access(isWrite = true, 8, 3, 1)._1.contains(1))
      },
      "MI-11: MDC is at most 2.5 MHz, and an access takes the same time always" -> { dut =>
        val b     = new Bench(dut)
        val times = Seq(9, 8).map(b.access(isWrite = false, _, 1)._2) :+ b.access(isWrite = true, 9, 1)._2
        assert(times.distinct.size == 1 && times.head <= 50 * mhz)
        val periods = b.rises.zip(b.rises.tail).map { case (a, b) => b - a }
        assert(periods.min * 1000 >= 400 * mhz)
      },
      "MI-06: a frame that delays goes on as it was" -> { dut =>
        val b = new Bench(dut)
        assert(b.access(isWrite = true, 9, 4, 0x6a95, rest = c => c / 7 % 3 == 0)._1.contains(0x6a95))
        assert(b.stored(9, 4) == 0x6a95)
        assert(b.access(isWrite = false, 9, 4, 0, rest = c => c / 5 % 2 == 0)._1.contains(0x6a95))
      },
      "MI-11: a reset within a frame lets the line go, and the next access is whole" -> { dut =>
        for (at <- Seq(3, 30, 40, 47, 50, 63)) {
          val b = new Bench(dut)
          dut.isWrite.poke(at % 2 == 0)
          dut.run.poke(true)
          while (b.bits.size < at) b.step()
          dut.reset.poke(true.B)
          dut.clock.step()
          assert(!dut.enable.peekBoolean() && !dut.mdc.peekBoolean(), s"bit $at")
          val again = new Bench(dut)
          assert(again.access(isWrite = true, 9, 6, 0x1000 | at)._1.contains(0x1000 | at))
          assert(again.stored(9, 6) == (0x1000 | at))
        }
      }
    )
}
