package flyframe.registers

import RegisterTable._

/** The override of the state LEDs (LED-02, LED-04); used by [[flyframe.application.Leds]]. */
object LedRegisters {
  val Run = 0x0138
  val Err = 0x0139

  private val pattern = "Pattern shown: 0 off, 1 to 12 flashes, 13 blinking, 14 flickering, 15 on"

  // format: off
  val all: Seq[Register] = Seq(
    register(Run, 1, "run_led_override", rw, rw, "LED-02", "RUN LED override",
      field("run_led_code",   3, 0, status, 0, pattern),
      field("run_led_enable", 4, 4, status, 0, "1: bits 3:0 as written are shown")),
    register(Err, 1, "err_led_override", rw, rw, "LED-04", "ERR LED override",
      field("err_led_code",   3, 0, status, 0, pattern),
      field("err_led_enable", 4, 4, status, 0, "1: bits 3:0 as written are shown"))
  )
  // format: on
}
