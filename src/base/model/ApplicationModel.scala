package flyframe.model

import flyframe.registers.Register

/** AL control and status, and the events of both status registers (AL, B-40 to B-43).
  *
  * @param dlStatus
  *   the present value of DL status
  */
class ApplicationModel(registers: ModelRegisters, emulation: () => Boolean, dlStatus: () => Int)
    extends ModelUnit {
  private var alControlEvent = false
  private var alStatusEvent  = false
  private var dlStatusEvent  = true // the links have come up since reset
  private var lastAlStatus   = registers.value("al_status")
  private var lastDlStatus   = Option.empty[Int]

  private def bit(value: Boolean): Int = if (value) 1 else 0

  override def status(field: String): Option[Int] = field match {
    case "al_control_event" => Some(bit(alControlEvent))
    case "al_status_event"  => Some(bit(alStatusEvent))
    case "dl_status_event"  => Some(bit(dlStatusEvent))
    case _                  => None
  }

  override def guard(name: String): Option[Boolean] = name match {
    case "al_control_free"  => Some(emulation() || !alControlEvent)
    case "al_status_by_pdi" => Some(!emulation())
    case _                  => None
  }

  override def written(register: Register, address: Int, byte: Int, byHost: Boolean): Unit = {
    if (register.name == "al_control")
      if (emulation()) registers.set("al_status", registers.value("al_control")) // AL-05
      else alControlEvent = true
    val state = registers.value("al_status")
    if (state != lastAlStatus) alStatusEvent = true
    lastAlStatus = state
  }

  override def acknowledged(register: Register, address: Int): Unit =
    if (register.name == "al_control") alControlEvent = false

  override def readByEcat(register: Register): Unit = register.name match {
    case "al_status" => alStatusEvent = false
    case "dl_status" => dlStatusEvent = false
    case _           =>
  }

  /** Something outside the registers may have changed DL status. */
  def watchDlStatus(): Unit = {
    val present = dlStatus()
    if (lastDlStatus.exists(_ != present)) dlStatusEvent = true
    lastDlStatus = Some(present)
  }
}
