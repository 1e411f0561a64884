package flyframe.rules

import chisel3._
import chiseltest._
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.model.{Datagram, EtherCatFrame, WireFrame}
import flyframe.params.Presets
import flyframe.protocol.Command._
import flyframe.{ControllerUnderTest, RtlBench, SharedSimulation}

/** Power-on with an EEPROM that takes its time, and the LED pins: what only the RTL has. */
class StartSpec extends AnyFlatSpec with SharedSimulation {
  private val p = Presets
    .named("cyclone4-min")
    .get
    .params
    .copy(
      preset = "start",
      coreClockMhz = 25,
      applicationLayer = 1,
      leds = 1,
      sii = 1,
      siiClockKhz = 100,
      siiStartUs = 1
    )

  together("25 MHz", new ControllerUnderTest(p))(
    "SYS-01, SII-05, PDI-02, PDI-03, PDI-08: while the EEPROM is loaded all works " +
      "but process data, which then opens" ->
      (new Start(_).start()),
    "LED-01: RUN flickers while the EEPROM is loaded for the first time, not at a reload" -> (new Start(_)
      .flicker()),
    "SYS-01, B-119: a reset acts without the clock"       -> (new Start(_).withoutClock()),
    "LED-01, LED-02, LED-04: RUN and ERR have their pins" -> (new Start(_).pins()),
    "LED-06, LNK-13: LINKACT has its pins: dark without link, " +
      "lit with it, dark for a while after a frame" -> linkActivity
  )

  private def linkActivity(dut: ControllerUnderTest): Unit = {
    val bench = new RtlBench(dut, p)
    val led   = dut.led.get.linkact
    val frame = WireFrame.withFcs(EtherCatFrame(Seq(Datagram(Brd, 0, 0, Seq(0)))))

    def lit = led.map(_.peekBoolean())
    bench.setLink(1, up = false)
    assert(lit == Seq(true, false))
    bench.setLink(1, up = true)
    assert(lit == Seq(true, true))
    bench.send(0, frame)
    assert(lit == Seq(true, true), "with the next step")
    bench.advanceMs(50)
    assert(lit == Seq(false, false))
    assert(new Steps(bench).put(0x0101, 3 << 2))
    bench.advanceMs(200)
    assert(lit == Seq(true, true), "the loop setting does not matter")
  }

  private class Start(dut: ControllerUnderTest) extends Steps(new RtlBench(dut, p)) {
    private def is(signal: Bool): Boolean = signal.peekBoolean()

    def start(): Unit = {
      def loaded = is(dut.eepromLoaded.get)
      def ramIsOpen = {
        bench.hostWrite(0x1001, 0x33)
        put(0x1000, 0x11) && get(0x1000, 2).contains(Seq(0x11, 0x33)) && bench.hostRead(0x1001) == 0x33
      }
      bench.powerOn(EepromImage(0x0080, 0, 0, 0, 0x0123))
      assert(!loaded && (bench.hostRead(0x0503) & 0x90) == 0x90, "busy, not loaded")
      assert((dlStatus & 1) == 0 && !ramIsOpen && get(0x1000, 1).isEmpty)
      stationAddress(0x0042)
      assert(read(Fprd, 0x0042, 0x0010, 2).data == Seq(0x42, 0))
      assert(put(0x0f80, 0x5a) && bench.hostRead(0x0f80) == 0x5a)
      bench.hostWrite(0x0f81, 0xa5)
      assert(get(0x0f81, 1).contains(Seq(0xa5)))
      assert(word(0x0012) == 0 && !loaded && (bench.hostRead(0x0503) & 0x80) == 0x80, "still at it")
      eepromDone()
      assert(loaded && (dlStatus & 1) == 1 && ramIsOpen)
      assert(word(0x0012) == 0x0123 && word(0x0010) == 0x0042 && word(0x0130) == 1)
    }

    def withoutClock(): Unit = {
      bench.powerOn(EepromImage())
      eepromDone()
      assert(is(dut.eepromLoaded.get) && is(dut.phyResetN))
      dut.reset.poke(true.B)
      assert(!is(dut.eepromLoaded.get) && !is(dut.phyResetN))
      dut.reset.poke(false.B)
      assert(!is(dut.eepromLoaded.get), "until it is loaded anew")
    }

    def flicker(): Unit = {
      bench.powerOn(EepromImage())
      assert(bench.hostRead(0x0138) == 14)
      eepromDone()
      assert(bench.hostRead(0x0138) == 0)
      assert(put(0x0502, 0, 4) && (bench.hostRead(0x0503) & 0x80) == 0x80)
      assert(bench.hostRead(0x0138) == 0)
    }

    def pins(): Unit = {
      val led = dut.led.get
      for ((run, err) <- Seq((0, 0), (1, 0), (0, 1), (1, 1))) {
        bench.hostWrite(0x0138, 0x10 | 15 * run)
        bench.hostWrite(0x0139, 0x10 | 15 * err)
        assert(is(led.run) == (run == 1) && is(led.err) == (err == 1))
      }
    }
  }
}
