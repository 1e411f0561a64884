package flyframe.host

import chisel3._
import chiseltest._
import org.scalatest.Assertions
import org.scalatest.flatspec.AnyFlatSpec
import scala.util.Random
import flyframe.memory.{HostPort, UnitUnderTest}
import flyframe.model.{Datagram, EtherCatFrame, WireFrame}
import flyframe.params.EscParams
import flyframe.protocol.Command._
import flyframe.rules.Steps
import flyframe.{ControllerUnderTest, RtlBench, SharedSimulation, TestSets}

/** The unit alone: the test is the SYNC signals, and the memory that inputs are written to. */
class DigitalIoUnderTest(p: EscParams)
    extends UnitUnderTest(
      p, {
        val port = Wire(new HostPort(p.lanes))
        port.ack   := false.B
        port.rdata := 0.U
        val syncs = IO(Input(Vec(p.syncSignals, Bool()))).suggestName("syncs")
        val pins  = IO(new DigitalPins(p)).suggestName("digital")
        new DigitalIo(p, pins, Some(port), syncs, false.B)
      }
    ) {
  val pins: DigitalPins = unit.pins
  val syncs: Seq[Bool]  = unit.syncs
}

/** Digital inputs and outputs without a host, to the cycle: B-118. */
class DigitalIoSpec extends AnyFlatSpec with SharedSimulation {

  // ---- inputs ----

  private class Inputs(dut: DigitalInputs, bytes: Int, lanes: Int) extends Assertions {
    private val random = new Random(bytes * 8 + lanes)
    private val mask   = (BigInt(1) << (8 * bytes)) - 1
    dut.take.poke(false)
    dut.port.ack.poke(false)
    dut.port.rdata.poke(0)

    private def levels(): BigInt = {
      val value = BigInt(32, random) & mask
      dut.levels.poke(value)
      value
    }

    /** Takes some levels, changes them at once, and answers each access after `wait` cycles at random; the
      * levels, the bytes written by their addresses, and the cycle of the first request.
      */
    def run(wait: Int, takesAgain: Boolean = false): (BigInt, Map[Int, Int], Int) = {
      val taken = levels()
      dut.take.poke(true)
      dut.clock.step()
      dut.take.poke(takesAgain)
      levels()
      var written = Map.empty[Int, Int]
      var first   = Option.empty[Int]
      var rest    = 0 // cycles without a request
      for (now <- 1 to 200 if rest < 20) {
        if (!dut.port.req.peekBoolean()) rest += 1
        else {
          if (first.isEmpty) first = Some(now)
          rest = 0
          def access = Seq(dut.port.addr, dut.port.wdata, dut.port.be).map(_.peekInt())
          val asked  = access
          for (_ <- 0 until random.nextInt(wait + 1)) {
            dut.clock.step()
            assert(dut.port.req.peekBoolean() && access == asked, "held until it is done")
          }
          assert(dut.port.write.peekBoolean())
          dut.port.ack.poke(true)
          val Seq(address, data, enables) = asked
          for (i <- 0 until lanes if enables.testBit(i))
            written += (address.toInt + i) -> (data >> 8 * i & 0xff).toInt
          dut.clock.step()
          dut.port.ack.poke(false)
          assert(!dut.port.req.peekBoolean(), "a cycle without a request is between two")
        }
        dut.take.poke(false)
        dut.clock.step()
      }
      (taken, written, first.get)
    }
  }
  for ((bytes, lanes) <- Seq(1 -> 1, 4 -> 1, 3 -> 2, 4 -> 2, 3 -> 4, 4 -> 4, 2 -> 4))
    together(s"$bytes bytes, $lanes lanes", new DigitalInputs(bytes, lanes))(
      "B-118: inputs are written as they were when they were taken, each byte once" -> { dut =>
        val bench = new Inputs(dut, bytes, lanes)
        for (wait <- Seq(0, 1, 5); again <- Seq(false, true); _ <- 0 until 10) {
          val (taken, written, first) = bench.run(wait, again)
          assert(written == (0 until bytes).map(i => 0x1000 + i -> (taken >> 8 * i & 0xff).toInt).toMap)
          assert(first >= 2, "what has been taken needs a cycle to settle")
        }
      }
    )

  // ---- outputs ----

  for (late <- Seq(false, true))
    together(s"late $late", new DigitalOutputs(2, late))(
      "WD-05, B-118: outputs change with events, and fall at once when they may not be driven" -> { dut =>
        val random                      = new Random(5)
        var shown                       = Option.empty[BigInt]
        def draw(likely: Double)        = random.nextDouble() < likely
        var (allowed, running, written) = (false, false, BigInt(0))
        var falls                       = 0
        for (cycle <- 0 until 20000) {
          if (draw(0.1)) allowed = draw(0.8)
          if (draw(0.1)) running = draw(0.8)
          if (draw(0.2)) written = BigInt(16, random)
          val event = draw(0.2)
          dut.allowed.poke(allowed)
          dut.running.poke(running)
          dut.written.poke(written)
          dut.update.poke(event)
          dut.clock.step()
          val before = shown
          if (!allowed) shown = None
          else if (event) shown = Option.when(running)(written)
          else if (!running && !late) shown = None
          if (before.isDefined && shown.isEmpty) falls += 1
          assert(dut.driven.peekBoolean() == shown.isDefined, s"cycle $cycle")
          assert(dut.levels.peekInt() == shown.getOrElse(BigInt(0)), s"cycle $cycle")
          assert(dut.valid.peekBoolean() == (event && shown.isDefined), s"cycle $cycle")
        }
        assert(falls > 100)
      }
    )

  // ---- with SYNC ----

  private val sync = TestSets.digital.find(_.digitalOutputEvent == 3).get
  together("SYNC", new DigitalIoUnderTest(sync))(
    "DC-35, B-118: SYNC within the register writes of a frame waits for them: outputs change at once" -> {
      dut =>
        for (record <- Seq(dut.value, dut.others, dut.reads); signal <- record.elements.values)
          signal.asInstanceOf[UInt].poke(0.U)
        for (input <- Seq(dut.good, dut.bad, dut.begins, dut.busy, dut.error, dut.commitStarts))
          input.poke(false)
        for (field <- Seq("pdi_operational", "watchdog_process_data")) dut.others.uint(field).poke(1)
        dut.value.uint("al_status").poke(8)
        dut.pins.output_enable.get.poke(true)
        dut.pins.input.get.poke(0)
        dut.syncs.foreach(_.poke(false))
        def written(levels: Int): Unit = dut.value.uint("digital_output").poke(levels)
        def pulse(): Unit = {
          dut.syncs(1).poke(true)
          dut.clock.step(3)
          dut.syncs(1).poke(false)
          dut.clock.step()
        }
        def shown = Option.when(dut.pins.output_driven.get.peekBoolean())(
          dut.pins.output.get.peekInt().toInt
        )
        dut.registersBusy.poke(false)
        dut.clock.step(5)
        written(0x111111)
        dut.clock.step(5)
        assert(shown.isEmpty, "no event")
        pulse()
        assert(shown.contains(0x111111))
        dut.registersBusy.poke(true)
        written(0x111122)
        pulse()
        dut.clock.step(10)
        assert(shown.contains(0x111111), "half written")
        written(0x222222)
        dut.registersBusy.poke(false)
        dut.clock.step(2)
        assert(shown.contains(0x222222))
        written(0x333333)
        dut.clock.step(10)
        assert(shown.contains(0x222222), "once")
    }
  )

  // ---- their pins at a controller ----

  private val digital = TestSets.digital.head
  together("controller", new ControllerUnderTest(digital))(
    "B-118: each frame begins with a pulse of 80 ns, and outputs have one of 80 ns with their event" -> {
      dut =>
        val bench = new RtlBench(dut, digital)
        val steps = new Steps(bench)
        import steps.{good, put, spoiled, syncManager}
        for (i <- 0 until 4) syncManager(i, 0x0f00 + i, 1, 0x44)
        assert(put(0x0120, 8, 0))
        val pins    = dut.digital.get
        var begins  = Vector.empty[Boolean]
        var valid   = Vector.empty[Boolean]
        var outputs = Vector.empty[BigInt]
        bench.eachCycle = Some { _ =>
          begins :+= pins.frame_begins.get.peekBoolean()
          valid :+= pins.output_valid.get.peekBoolean()
          outputs :+= pins.output.get.peekInt()
        }

        /** Beginnings and lengths of pulses. */
        def pulses(levels: Vector[Boolean]): Seq[(Int, Int)] = {
          val rises = levels.indices.filter(i => i > 0 && levels(i) && !levels(i - 1))
          rises.map(i => i -> levels.drop(i).takeWhile(identity).size)
        }
        assert(put(0x0f00, 1, 2, 3, 4) && put(0x0f00, 0xf0, 0xf1, 0xf2, 0xf3))
        spoiled(Datagram(Apwr, 0, 0x0f00, Seq(9)))
        good(bench.send(0, WireFrame.withFcs(EtherCatFrame(Seq(Datagram(Nop, 0, 0, Seq(0)))))))
        val length = 2 * digital.cyclesPerNibble
        assert(pulses(begins).map(_._2) == Seq.fill(4)(length))
        assert(pulses(valid).map(_._2) == Seq.fill(3)(length), "not with the bad one")
        val changes = outputs.indices.filter(i => i > 0 && outputs(i) != outputs(i - 1))
        assert(outputs.distinct == Seq(BigInt(0), BigInt(0x04030201), BigInt("f3f2f1f0", 16)))
        assert(changes == pulses(valid).take(2).map(_._1 - 1), "all at once, a cycle before the pulse")
    }
  )
}
