package flyframe.relay

import chisel3._
import chisel3.util.Valid
import chiseltest._
import flyframe.Simulation
import org.scalatest.flatspec.AnyFlatSpec
import scala.util.Random

class SourcesSpec extends AnyFlatSpec {

  /** The unit, but for a pin whose name is a word of C++. */
  private class Bench extends Module {
    val on      = IO(Input(Bool()))
    val confirm = IO(Input(UInt(16.W)))
    val unit    = IO(Input(Bool()))
    val frame   = IO(Input(Valid(new WholeFrame)))
    val done    = IO(Output(Bool()))
    val takes   = IO(Output(Bool()))
    val doubles = IO(Output(Bool()))
    val asks    = IO(Input(Valid(UInt(7.W))))
    val told    = IO(Output(Valid(UInt(16.W))))

    private val sources = Module(new Sources)
    sources.on      := on
    sources.confirm := confirm
    sources.unit    := unit
    sources.frame   := frame
    sources.asks    := asks
    done            := sources.done
    takes           := sources.takes
    doubles         := sources.double
    told            := sources.told
  }

  "FR-59 to FR-61, RB-23: what a node knows of sources" should "be what the model knows" in
    RawTester.test(new Bench, Simulation.annotations(this, "sources")) { dut =>
      val random = new Random(8)
      var units  = 0L
      var limit  = 40
      val model  = new SourcesModel(() => limit, unitCycles = 1)
      val seen   = scala.collection.mutable.Map.empty[String, Int].withDefaultValue(0)
      val newest = Array.fill(128)(random.nextInt(1 << 14))

      /** 640 us are over: one source is looked at meanwhile. */
      def unit(): Unit = {
        dut.unit.poke(true)
        dut.clock.step()
        dut.unit.poke(false)
        dut.clock.step(5)
        units += 1
        model.pass(units)
      }
      def clear(): Unit = {
        dut.on.poke(false)
        dut.clock.step()
        dut.on.poke(true)
        dut.clock.step(700) // all are forgotten
        model.clear()
      }
      def distances(source: Int): Int = {
        dut.asks.valid.poke(true)
        dut.asks.bits.poke(source)
        while (!dut.told.valid.peekBoolean()) dut.clock.step()
        val told = dut.told.bits.peekInt().toInt
        dut.clock.step()
        dut.asks.valid.poke(false)
        dut.clock.step()
        told
      }
      for (pin <- Seq(dut.on, dut.unit, dut.frame.valid, dut.asks.valid)) pin.poke(false)
      dut.confirm.poke(limit)
      dut.clock.step(3)
      clear()
      for (step <- 0 until 30000) {
        // Few sources, one of which is rarely heard; sequences near the newest one, and anywhere.
        val source = Seq(1, 2, 3, 60, 127)(random.nextInt(if (random.nextInt(50) == 0) 5 else 4))
        val isLife = random.nextInt(40) == 0
        val sequence =
          if (isLife) random.nextInt(3)
          else if (random.nextInt(30) == 0) random.nextInt(1 << 14)
          else {
            val near = newest(source) + random.nextInt(80) - 40 & 0x3fff
            if ((near - newest(source) & 0x3fff) < 40) newest(source) = near
            near
          }
        val kind               = if (isLife) 1 else if (random.nextInt(40) == 0) 2 else 0
        val (sentBy, by, hops) = (random.nextInt(2), random.nextInt(2), 1 + random.nextInt(255))
        val it                 = dut.frame.bits
        it.kind.poke(kind)
        it.sentBy.poke(sentBy)
        it.source.poke(source)
        it.sequence.poke(sequence)
        it.distance.poke((256 - hops) min 255)
        it.receivedBy.poke(by)
        dut.frame.valid.poke(true)
        while (!dut.done.peekBoolean()) dut.clock.step()
        model.hears(LinkHeader(kind, sentBy, source, sequence, hops), by)
        if (kind == 1) model.starts(source, sequence)
        val takes = kind == 0 && model.takes(source, sequence)
        dut.takes.expect(takes, s"step $step: $sequence of $source")
        dut.doubles.expect(kind == 0 && !takes, s"step $step: $sequence of $source")
        seen(if (kind == 0) s"taken $takes" else s"kind $kind") += 1
        dut.clock.step()
        dut.frame.valid.poke(false)
        dut.clock.step()
        if (random.nextInt(4) == 0) {
          val asked = if (random.nextBoolean()) source else random.nextInt(128)
          val told  = distances(asked)
          assert(told == (model.distance(asked, 0) | model.distance(asked, 1) << 8), s"step $step: $asked")
          if (told == 0) seen("unknown") += 1
        }
        if (random.nextInt(3) == 0) unit()
        if (random.nextInt(400) == 0) for (_ <- 0 until random.nextInt(3 * limit)) unit()
        if (random.nextInt(4000) == 0) clear()
        if (random.nextInt(2000) == 0) {
          limit = 20 + random.nextInt(60)
          dut.confirm.poke(limit)
        }
        if (step == 20000) for (_ <- 0 until 70000) unit() // the time goes round
      }
      assert(seen.size == 5 && seen.values.forall(_ > 300), s"$seen")
    }

  "FR-60, RB-25: what was known before a switch" should "be told in no cycle behind it" in
    RawTester.test(new Bench, Simulation.annotations(this, "switched sources")) { dut =>
      val Last = 127
      for (pin <- Seq(dut.unit, dut.frame.valid, dut.asks.valid)) pin.poke(false)
      dut.confirm.poke(40)
      dut.on.poke(false)
      dut.clock.step(3)
      dut.on.poke(true)
      dut.asks.bits.poke(Last)

      /** Whether something is told in this cycle, and what. */
      def told: Option[BigInt] =
        if (dut.told.valid.peekBoolean()) Some(dut.told.bits.peekInt()) else None
      def ask(): BigInt = {
        dut.asks.valid.poke(true)
        while (told.isEmpty) dut.clock.step()
        val is = told.get
        dut.clock.step()
        dut.asks.valid.poke(false)
        dut.clock.step()
        is
      }
      for (cycles <- (0 until 20) ++ (20 until 800 by 13)) {
        dut.clock.step(700)
        val it = dut.frame.bits
        for ((field, value) <- Seq(it.kind -> 0, it.sentBy -> 1, it.source -> Last, it.sequence -> cycles))
          field.poke(value)
        it.distance.poke(9)
        it.receivedBy.poke(0)
        dut.frame.valid.poke(true)
        while (!dut.done.peekBoolean()) dut.clock.step()
        dut.clock.step()
        dut.frame.valid.poke(false)
        assert(ask() == 9)

        // A question that is under way when the mode is switched off, or one behind the switch.
        dut.asks.valid.poke(cycles % 2 == 0)
        dut.clock.step(1 + cycles  % 5)
        dut.on.poke(false)
        dut.clock.step(1 + cycles % 3)
        dut.on.poke(true)
        for (cycle <- 0 until 800) {
          dut.asks.valid.poke(cycles % 2 == 0 || cycle >= cycles)
          assert(told.forall(_ == 0), s"cycle $cycle behind a switch, asked $cycles cycles behind it")
          dut.clock.step()
        }
        assert(ask() == 0)
      }
    }
}
