package flyframe.model

import flyframe.registers.Register

/** One watchdog, in ticks of the divider (B-61).
  *
  * @param expired
  *   called when it expires
  */
class Watchdog(time: () => Int, expired: () => Unit) {
  private var running = false
  private var ticks   = 0

  /** Running, or off. */
  def alive: Boolean = running || time() == 0

  def trigger(): Unit = { running = true; ticks = 0 }

  /** The time was written. */
  def restart(): Unit = ticks = 0

  def tick(count: Long): Unit = if (running && time() != 0) {
    ticks = (ticks + count).min(0x20000).toInt
    if (ticks > time()) { running = false; expired() }
  }
}

/** Both watchdogs with divider and registers (WD-01 to WD-09).
  *
  * @param expired
  *   called when one expires, by the name of its counter
  */
class WatchdogModel(registers: ModelRegisters, expired: String => Unit = _ => ()) extends ModelUnit {
  private var phase = 0L // of the divider, in units of 40 ns
  private var event = false

  val processData: Watchdog = new Watchdog(
    () => registers.value("watchdog_time_process_data"),
    () => { event = true; expires("watchdog_count_process_data") }
  )
  val pdi: Watchdog =
    new Watchdog(() => registers.value("watchdog_time_pdi"), () => expires("watchdog_count_pdi"))

  private def expires(counter: String): Unit = {
    registers.count(counter)
    expired(counter)
  }

  /** Lets `slots` times 40 ns pass. */
  def advance(slots: Long): Unit = {
    val period = registers.value("watchdog_divider") + 2
    val ticks  = (phase + slots) / period
    phase = (phase + slots) % period
    processData.tick(ticks)
    pdi.tick(ticks)
  }

  override def status(field: String): Option[Int] = {
    val set = field match {
      case "watchdog_event"                => Some(event)
      case "watchdog_process_data"         => Some(processData.alive)
      case "watchdog_pdi" | "pdi_watchdog" => Some(pdi.alive)
      case _                               => None
    }
    set.map(if (_) 1 else 0)
  }

  override def written(register: Register, address: Int, byte: Int, byHost: Boolean): Unit =
    register.name match {
      case "watchdog_time_process_data" => processData.restart()
      case "watchdog_time_pdi"          => pdi.restart()
      case _                            =>
    }

  override def acknowledged(register: Register, address: Int): Unit =
    if (register.name == "watchdog_status_process_data") event = false
}
