package flyframe.model

import flyframe.registers.Register

/** The LED override registers (LED-01 to LED-04), as far as they are registers. */
class LedModel(registers: ModelRegisters) extends ModelUnit {
  private val overridden = scala.collection.mutable.Map.empty[String, Int]
  private var lastStatus = registers.value("al_status")

  private def automatic(led: String): Int = if (led == "err") { if ((lastStatus & 0x10) != 0) 1 else 0 }
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
    case Name(led, "code")   => Some(overridden.getOrElse(led, automatic(led)))
    case Name(led, "enable") => Some(if (overridden.contains(led)) 1 else 0)
    case _                   => None
  }

  override def written(register: Register, address: Int, byte: Int, byHost: Boolean): Unit = {
    register.name match {
      case Name(led, _) => if ((byte & 0x10) != 0) overridden(led) = byte & 0xf else overridden -= led
      case _            =>
    }
    val status = registers.value("al_status")
    if (status != lastStatus) overridden -= "run"
    if ((status & ~lastStatus & 0x10) != 0) overridden -= "err"
    lastStatus = status
  }
}
