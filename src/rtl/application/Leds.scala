package flyframe.application

import chisel3._
import chisel3.util._
import flyframe.protocol.LedCode

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
