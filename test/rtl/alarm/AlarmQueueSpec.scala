package flyframe.alarm

import scala.util.Random
import chisel3._
import chisel3.util._
import chiseltest._
import flyframe.SharedSimulation
import org.scalatest.flatspec.AnyFlatSpec

/** The queue, and a player that lets events pass by the thousand: one every 16 cycles, acknowledged and
  * confirmed.
  */
class QueueBench extends Module {
  private val queue = Module(new AlarmQueue(QueueBench.Depth))
  val plays         = IO(Input(Bool()))
  val state         = IO(Input(chiselTypeOf(queue.state)))
  val acknowledge   = IO(Flipped(Valid(UInt(16.W))))
  val confirm       = IO(Flipped(Valid(UInt(16.W))))
  val again         = IO(Input(Bool()))
  val head          = IO(chiselTypeOf(queue.head))
  val kept          = IO(chiselTypeOf(queue.kept))
  private val count = RegInit(0.U(5.W))
  private val phase = count(3, 0)
  private val last  = RegEnable(queue.head.bits.sequence, phase === 8.U)
  count             := Mux(plays, count + 1.U, 0.U)
  queue.state       := Mux(plays, Mux(count(4), 2.U, 1.U), state)
  queue.time        := 0.U
  queue.acknowledge := acknowledge
  queue.confirm     := confirm
  queue.repeat      := again
  queue.hold        := false.B
  when(plays) {
    queue.acknowledge.valid := phase === 8.U
    queue.acknowledge.bits  := queue.head.bits.sequence
    queue.confirm.valid     := phase === 12.U
    queue.confirm.bits      := last
  }
  head := queue.head
  kept := queue.kept
}

object QueueBench {
  val Depth = 16
}

class AlarmQueueSpec extends AnyFlatSpec with SharedSimulation {
  private def is(b: Bool) = b.peek().litToBoolean

  /** ALARM-03 and ALARM-04 in plain words: events with their numbers, the first `told` of them seen by the
    * master.
    */
  private class Scene(dut: QueueBench, seed: Int, var next: Int, var state: Int) {
    val random = new Random(seed)
    var kept   = Vector.empty[(Int, Int)] // number, state
    var told   = 0
    dut.plays.poke(false)
    dut.state.poke(state)
    dut.acknowledge.valid.poke(false)
    dut.confirm.valid.poke(false)
    dut.again.poke(false)

    private def pulse(signal: Bool): Unit = {
      signal.poke(true)
      dut.clock.step()
      signal.poke(false)
    }
    private var reported = state
    private def look(): Unit =
      if (state != reported && kept.size < QueueBench.Depth) {
        kept :+= (next, state)
        next = next % 0xffff + 1
        reported = state
      }

    def change(): Unit = {
      state = 1 + random.nextInt(4)
      dut.state.poke(state)
      look()
    }
    def acknowledge(number: Int): Unit = {
      dut.acknowledge.bits.poke(number)
      pulse(dut.acknowledge.valid)
      if (kept.lift(told).exists(_._1 == number)) told += 1
    }
    def confirm(number: Int): Unit = {
      dut.confirm.bits.poke(number)
      pulse(dut.confirm.valid)
      val index = kept.indexWhere(_._1 == number)
      if (index >= 0 && index < told) {
        kept = kept.drop(index + 1)
        told -= index + 1
        look()
      }
    }
    def repeat(): Unit = {
      pulse(dut.again)
      told = 0
    }
    def any(): Int = random.nextInt(4) match {
      case 0 => random.nextInt(0x10000)
      case 1 => (next + random.nextInt(5) - 2) & 0xffff
      case _ => if (kept.isEmpty) 0 else kept(random.nextInt(kept.size))._1
    }
    def check(what: String): Unit = {
      dut.clock.step(8)
      assert(dut.kept.peek().litValue == kept.size, what)
      assert(is(dut.head.valid) == (told < kept.size), what)
      for ((number, state) <- kept.lift(told)) {
        assert(dut.head.bits.sequence.peek().litValue == number, what)
        assert(dut.head.bits.state.peek().litValue == state, what)
      }
    }
    def play(steps: Int): Unit = for (n <- 1 to steps) {
      random.nextInt(12) match {
        case 0 | 1 | 2 | 3 => change()
        case 4 | 5 | 6 | 7 => acknowledge(kept.lift(told).fold(any())(_._1))
        case 8             => acknowledge(any())
        case 9 | 10        => confirm(any())
        case 11 if n % 5 == 0 => repeat()
        case _ => confirm(kept.lift(told - 1).fold(0)(_._1))
      }
      check(s"step $n")
    }

    /** Acknowledged and confirmed in consecutive cycles, as by one frame. */
    def both(): Unit = for ((number, _) <- kept.lift(told)) {
      dut.acknowledge.bits.poke(number)
      dut.acknowledge.valid.poke(true)
      dut.clock.step()
      dut.acknowledge.valid.poke(false)
      dut.confirm.bits.poke(number)
      pulse(dut.confirm.valid)
      kept = kept.drop(told + 1)
      told = 0
      look()
      check("acknowledged and confirmed at once")
    }
  }

  together("16 events", new QueueBench)(
    "ALARM-03, ALARM-04: what is acknowledged, confirmed and asked for again, at random" -> { dut =>
      val scene = new Scene(dut, seed = 1, next = 1, state = 0)
      scene.play(4000)
      for (_ <- 1 to 200) {
        scene.play(10)
        scene.both()
      }
    },
    "ALARM-03, ALARM-04: the same where numbers wrap, and leave out 0" -> { dut =>
      dut.acknowledge.valid.poke(false)
      dut.confirm.valid.poke(false)
      dut.again.poke(false)
      dut.plays.poke(true)
      dut.clock.step(16 * 65500)
      assert(dut.kept.peek().litValue == 0)
      // An even number of events: the last one was that of the second half.
      val scene = new Scene(dut, seed = 2, next = 65501, state = 2)
      scene.check("65,500 events have passed")
      scene.play(2000)
      assert(scene.next < 2000, "it has wrapped")
    }
  )
}
