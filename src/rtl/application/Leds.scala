package flyframe.application

import chisel3._
import chisel3.util._
import flyframe.memory.{RegisterBus, RegisterUnit}
import flyframe.params.EscParams
import flyframe.protocol.{AlState, LedCode}
import flyframe.registers.LedRegisters
import flyframe.sii.SiiUnit

/** The LEDs: RUN, ERR and one per port. */
class LedPins(ports: Int) extends Bundle {
  val run     = Output(Bool())
  val err     = Output(Bool())
  val linkact = Output(Vec(ports, Bool()))
}

/** Shows LED codes: 200 ms flashes with a pause of 1 s, blinking 200/200 ms, flickering 50/50 ms (LED-08).
  *
  * The RUN LED's and the ERR LED's patterns share one clock of 50 ms steps.
  */
class LedPattern extends Module {

  /** Every 50 ms. */
  val tick = IO(Input(Bool()))
  val code = IO(Input(UInt(4.W)))
  val lit  = IO(Output(Bool()))

  // Steps of 50 ms: four on, four off for each flash, then 16 more off.
  private val step  = RegInit(0.U(7.W)) // reset: the pattern begins
  private val shown = RegNext(code, 0.U)
  private val flash = step(6, 3)
  private val isOn  = !step(2)
  when(tick) { step := Mux(step === Cat(code, 0.U(3.W)) + 15.U, 0.U, step + 1.U) }
  when(code =/= shown) { step := 0.U }
  lit := MuxLookup(code, flash < code && isOn)(
    Seq(
      LedCode.Off.U      -> false.B,
      LedCode.On.U       -> true.B,
      LedCode.Blinking.U -> isOn,
      LedCode.Flicker.U  -> !step(0)
    )
  )
}

/** One of the [[flyframe.registers.LedRegisters]]: shows `automaticCode` unless overridden. */
class LedControl extends Module {
  val automaticCode = IO(Input(UInt(4.W)))
  val write         = IO(Input(Valid(UInt(5.W))))

  /** Ends the override (LED-02, LED-04). */
  val drop  = IO(Input(Bool()))
  val code  = IO(Output(UInt(4.W)))
  val taken = IO(Output(Bool()))

  private val enable = RegInit(false.B) // reset: automatic
  private val wanted = Reg(UInt(4.W))
  when(drop) { enable := false.B }
  when(write.valid) {
    enable := write.bits(4)
    wanted := write.bits(3, 0)
  }
  code  := Mux(enable, wanted, automaticCode)
  taken := enable
}

/** The LINKACT LED of a port (LED-06): lit with a link, dark for every other step of 50 ms while frames pass.
  */
class LinkActivity extends Module {

  /** Every 50 ms. */
  val tick    = IO(Input(Bool()))
  val link    = IO(Input(Bool()))
  val traffic = IO(Input(Bool()))
  val lit     = IO(Output(Bool()))

  private val seen = RegInit(false.B) // reset: no traffic
  private val dark = RegInit(false.B)
  when(tick) {
    dark := seen && !dark
    seen := false.B
  }
  when(traffic) { seen := true.B }
  lit := link && !dark
}

/** All LEDs, two of them behind their registers (LED-01 to LED-06).
  *
  * @param links
  *   at the ports
  * @param active
  *   a frame comes or goes at the port
  * @param sii
  *   a load that has failed flickers at ERR
  * @param watchdogs
  *   one that has expired shows at ERR
  */
class Leds(
    p: EscParams,
    pins: LedPins,
    links: Seq[Bool],
    active: Seq[Bool],
    sii: Option[SiiUnit],
    watchdogs: Option[Watchdogs]
) extends RegisterUnit(LedRegisters.all) {
  private def known(signal: Option[Bool]): Bool = signal.getOrElse(false.B)

  def connect(bus: RegisterBus): Unit = {
    val tick      = Counter(p.coreClockMhz * 50000).inc()
    val al        = bus.value("al_status")
    val changed   = bus.changes("al_status")
    val emulation = bus.bool("device_emulation", default = p.isDigitalIo)
    val state = MuxLookup(al(3, 0), LedCode.Off.U)(
      Seq(
        AlState.PreOperational  -> LedCode.Blinking,
        AlState.SafeOperational -> LedCode.Single,
        AlState.Operational     -> LedCode.On,
        AlState.Bootstrap       -> LedCode.Flicker
      ).map { case (s, c) => s.U -> c.U }
    )
    // Errors that are edges stay until the state changes.
    val latched = RegInit(LedCode.Off.U(4.W)) // reset: no error
    when(changed) { latched := LedCode.Off.U }
    when(
      known(watchdogs.map(_.processDataExpires)) && al(3, 0) === AlState.Operational.U &&
        latched =/= LedCode.On.U
    ) {
      latched := LedCode.Double.U
    }
    when(known(watchdogs.map(_.pdiExpires))) { latched := LedCode.On.U }
    val error = Mux(
      known(sii.map(_.loadFailed)),
      LedCode.Flicker.U,
      Mux(latched =/= LedCode.Off.U, latched, Mux(al(4) && !emulation, LedCode.Single.U, LedCode.Off.U))
    )

    def led(name: String, automatic: UInt, drop: Bool, pin: Bool): Unit = {
      val control       = Module(new LedControl).suggestName(s"led_$name")
      val pattern       = Module(new LedPattern).suggestName(s"pattern_$name")
      val (code, taken) = (s"${name}_led_code", s"${name}_led_enable")
      control.automaticCode := automatic
      control.write.valid   := bus.written(code).valid
      control.write.bits    := Cat(bus.written(taken).bits, bus.written(code).bits)
      control.drop          := drop
      pattern.tick          := tick
      pattern.code          := control.code
      bus.status(code)      := control.code
      bus.status(taken)     := control.taken
      pin                   := pattern.lit
    }
    led("run", Mux(known(sii.map(_.loading)), LedCode.Flicker.U, state), changed, pins.run)
    led("err", error, error =/= LedCode.Off.U && error =/= RegNext(error), pins.err)
    for (((pin, link), traffic) <- pins.linkact.zip(links).zip(active)) {
      val unit = Module(new LinkActivity)
      unit.tick    := tick
      unit.link    := link
      unit.traffic := traffic
      pin          := unit.lit
    }
  }
}
