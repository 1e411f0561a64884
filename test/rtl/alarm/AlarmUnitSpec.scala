package flyframe.alarm

import chisel3._
import chisel3.util._
import chiseltest._
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.SharedSimulation
import flyframe.params.{EscParams, Presets}
import flyframe.protocol.DetectorState.{Alarm, Normal}
import flyframe.protocol.{DetectorMode, SlaveStatus}
import flyframe.rules.Line

/** The alarm unit with the registers that it counts down, as the register file has them. */
class AlarmUnderTest(p: EscParams) extends Module {
  private val unit  = Module(new AlarmUnit(p))
  val current       = IO(Input(UInt(3.W)))
  val damaged       = IO(Input(Bool()))
  val silence       = IO(Input(Bool()))
  val restart       = IO(Input(Bool()))
  val registersBusy = IO(Input(Bool()))
  val lamp          = IO(Output(Bool()))
  val buzzer        = IO(Output(Bool()))
  val status        = IO(Output(UInt(16.W)))

  /** Written, and as they are. */
  val setMode    = IO(Flipped(Valid(UInt(2.W))))
  val setSeconds = IO(Flipped(Valid(UInt(16.W))))
  val setAlive   = IO(Flipped(Valid(UInt(16.W))))
  val seconds    = IO(Output(UInt(16.W)))
  val alive      = IO(Output(UInt(16.W)))
  private def register(port: CountDown, written: Valid[UInt]): UInt = {
    val value = RegInit(0.U(port.value.getWidth.W))
    when(written.valid) { value := written.bits }
    when(port.load.valid) { value := port.load.bits }
    port.value := value
    value
  }
  register(unit.mode, setMode)
  seconds := register(unit.seconds, setSeconds)
  alive   := register(unit.hostAlive, setAlive)

  unit.pins.current       := current
  unit.pins.config_fault  := damaged
  unit.detect             := true.B
  unit.debounce           := 0.U
  unit.changes            := false.B
  unit.offTime            := 0.U
  unit.selfTest           := 1.U
  unit.epoch              := 0.U
  unit.node               := 0.U
  unit.registersBusy      := registersBusy
  unit.silence            := silence
  unit.restart            := restart
  unit.acknowledge.valid  := false.B
  unit.acknowledge.bits   := DontCare
  unit.acknowledgeChanges := false.B
  unit.confirm.valid      := false.B
  unit.confirm.bits       := DontCare
  unit.confirmChanges     := false.B
  unit.newMaster          := false.B
  unit.busy               := false.B
  unit.nibble             := 0.U
  unit.nextWord           := 0.U
  unit.reads              := false.B
  unit.begins             := false.B
  unit.takes              := false.B
  lamp                    := unit.pins.lamp
  buzzer                  := unit.pins.buzzer
  status                  := unit.status
}

/** What of an alarm slave takes long, or must come in one cycle with something else. */
class AlarmUnitSpec extends AnyFlatSpec with SharedSimulation {
  private val Mhz    = 2
  private val p      = Presets.named("alarm-slave").get.params.copy(coreClockMhz = Mhz)
  private val Second = Mhz * 1000000

  private class Driver(dut: AlarmUnderTest) {
    dut.damaged.poke(false)
    dut.silence.poke(false)
    dut.restart.poke(false)
    dut.registersBusy.poke(false)
    Seq(dut.setMode, dut.setSeconds, dut.setAlive).foreach(_.valid.poke(false))
    become(Normal)

    def become(state: Int): Unit = {
      dut.current.poke(Line.current(state))
      dut.clock.step(6)
    }
    def set(register: Valid[UInt], value: Int): Unit = {
      register.valid.poke(true)
      register.bits.poke(value)
      dut.clock.step()
      register.valid.poke(false)
    }
    def pulse(signal: Bool): Unit = {
      signal.poke(true)
      dut.clock.step()
      signal.poke(false)
    }
    def has(bit: Int): Boolean    = (dut.status.peekInt().toInt & bit) != 0
    def is(signal: Bool): Boolean = signal.peekBoolean()
    def number(signal: UInt): Int = signal.peekInt().toInt
  }

  together("2 MHz", new AlarmUnderTest(p))(
    "DET-06: a mode lasts for its seconds, the first of which may be shorter" -> { dut =>
      val driver = new Driver(dut)
      import driver._
      val modes = Seq(DetectorMode.Disable -> SlaveStatus.Disabled, DetectorMode.Test -> SlaveStatus.Testing)
      for ((mode, bit) <- modes) {
        set(dut.setSeconds, 3)
        set(dut.setMode, mode)
        dut.clock.step(2 * Second - 10)
        assert(has(bit))
        dut.clock.step(Second + 20)
        assert(!has(bit) && number(dut.seconds) == 0)
      }
    },
    "DET-06: without seconds a mode ends with the next one; one that does not exist is none" -> { dut =>
      val driver = new Driver(dut)
      import driver._
      set(dut.setMode, DetectorMode.Disable)
      dut.clock.step(Second + 10)
      assert(!has(SlaveStatus.Disabled) && number(dut.seconds) == 0)
      set(dut.setMode, 3)
      become(Alarm)
      assert(has(SlaveStatus.Alarm) && !has(SlaveStatus.Disabled) && !has(SlaveStatus.Testing))
    },
    "DET-06, ALARM-11: time that passes while registers are written counts later" -> { dut =>
      val driver = new Driver(dut)
      import driver._
      set(dut.setAlive, 5)
      set(dut.setSeconds, 2)
      dut.registersBusy.poke(true)
      dut.clock.step(3000 * Mhz)
      assert(number(dut.alive) == 5 && number(dut.seconds) == 2)
      dut.registersBusy.poke(false)
      dut.clock.step(2)
      assert(number(dut.alive) == 4)
      dut.clock.step(1000 * Mhz * 5)
      assert(number(dut.alive) == 0 && has(SlaveStatus.HostDead))
    },
    "ALARM-06: an alarm that begins with the order to be silent sounds; a reset ends it for good" -> { dut =>
      val driver = new Driver(dut)
      import driver._
      dut.current.poke(Line.current(Alarm))
      dut.silence.poke(true)
      while (!has(SlaveStatus.Alarm)) dut.clock.step()
      dut.clock.step()
      dut.silence.poke(false)
      assert(is(dut.lamp) && is(dut.buzzer) && has(SlaveStatus.Latched | SlaveStatus.Sounding))
      pulse(dut.silence)
      assert(is(dut.lamp) && !is(dut.buzzer))
      pulse(dut.restart)
      for (_ <- 1 to 20) {
        assert(!is(dut.lamp) && !is(dut.buzzer) && !has(SlaveStatus.Alarm))
        dut.clock.step()
      }
      dut.clock.step(1000 * Mhz + 10)
      assert(is(dut.lamp) && is(dut.buzzer), "the smoke is still there")
    },
    "ALARM-12: damage of the configuration shows as long as the device tells of it" -> { dut =>
      val driver = new Driver(dut)
      import driver._
      assert(!has(SlaveStatus.Configuration))
      dut.damaged.poke(true)
      dut.clock.step(3)
      assert(has(SlaveStatus.Configuration))
      dut.damaged.poke(false)
      dut.clock.step(3)
      assert(!has(SlaveStatus.Configuration))
    }
  )
}
