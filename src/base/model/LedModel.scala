package flyframe.model

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
  private var expired    = 0 // 2, 15: a watchdog's code, until the state changes
  private var lastError  = 0

  private def error: Int =
    if (loadFailed()) 14
    else if (expired != 0) expired
    else if ((lastStatus & 0x10) != 0 && !emulation()) 1
    else 0

  private def automatic(led: String): Int = if (led == "err") error
  else
    lastStatus & 0xf match {
      case 2 => 13
      case 3 => 14
      case 4 => 1
      case 8 => 15
      case _ => 0
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
    if (counter == "watchdog_count_pdi") expired = 15
    else if ((lastStatus & 0xf) == 8 && expired != 15) expired = 2
    watch()
  }

  /** Something may have changed: another error ends the override (LED-04). */
  def watch(): Unit = {
    if (error != 0 && error != lastError) overridden -= "err"
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
