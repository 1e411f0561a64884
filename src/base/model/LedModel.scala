package flyframe.model

import flyframe.protocol.AlState
import flyframe.protocol.LedCode._
import flyframe.registers.Register

/** The LED override registers (LED-01 to LED-04), as far as they are registers.
  *
  * @param loadFailed
  *   the last load of the EEPROM found no configuration
  */
class LedModel(registers: ModelRegisters, emulation: () => Boolean, loadFailed: () => Boolean)
    extends ModelUnit {
  private val overridden = scala.collection.mutable.Map.empty[String, Int]
  private var lastStatus = registers.value("al_status")
  private var expired    = Off // a watchdog's code, until the state changes
  private var lastError  = Off

  private def error: Int =
    if (loadFailed()) Flicker
    else if (expired != Off) expired
    else if ((lastStatus & AlState.Error) != 0 && !emulation()) Single
    else Off

  private def automatic(led: String): Int = if (led == "err") error
  else
    lastStatus & 0xf match {
      case AlState.PreOperational  => Blinking
      case AlState.Bootstrap       => Flicker
      case AlState.SafeOperational => Single
      case AlState.Operational     => On
      case _                       => Off
    }

  private val Name = "(run|err)_led_(code|enable|override)".r

  override def status(field: String): Option[Int] = field match {
    case _ if !field.contains("_led_") => None // the quick answer for most fields
    case Name(led, "code")             => Some(overridden.getOrElse(led, automatic(led)))
    case Name(led, "enable")           => Some(if (overridden.contains(led)) 1 else 0)
    case _                             => None
  }

  /** The watchdog with this counter has expired (LED-03). */
  def watchdogExpired(counter: String): Unit = {
    if (counter == "watchdog_count_pdi") expired = On
    else if ((lastStatus & 0xf) == AlState.Operational && expired != On) expired = Double
    watch()
  }

  /** Something may have changed: another error ends the override (LED-04). */
  def watch(): Unit = {
    if (error != Off && error != lastError) overridden -= "err"
    lastError = error
  }

  override def written(register: Register, address: Int, byte: Int, byHost: Boolean): Unit = {
    register.name match {
      case Name(led, _) => if ((byte & 0x10) != 0) overridden(led) = byte & 0xf else overridden -= led
      case _            =>
    }
    val status = registers.value("al_status")
    if (status != lastStatus) {
      overridden -= "run"
      expired = 0
    }
    lastStatus = status
    watch()
  }
}
