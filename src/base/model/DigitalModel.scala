package flyframe.model

import flyframe.params.EscParams
import flyframe.protocol.AlState
import flyframe.registers.RegisterMap

/** Digital outputs (SM-26, B-68), and where there is no host also their events and digital inputs (B-118).
  *
  * @param loaded
  *   the local configuration is
  * @param running
  *   the process data watchdog is
  * @param write
  *   a byte is written to an address, as the host would
  */
class DigitalModel(
    p: EscParams,
    registers: ModelRegisters,
    loaded: () => Boolean,
    running: () => Boolean,
    write: (Int, Int) => Unit
) {
  private var shown     = Option.empty[Int]
  private var triggered = false
  private var latch     = false

  /** The levels at the pins of the inputs. */
  var inputs: Int = 0

  /** The pin that lets outputs be driven. */
  def enable: Boolean = enabled
  def enable_=(level: Boolean): Unit = {
    enabled = level
    watch()
  }
  private var enabled = true

  private def allowed = loaded() && enabled && (registers.value("al_status") & 0xf) == AlState.Operational
  private def isLate  = p.digitalWatchdogLate == 1

  /** The levels of the outputs, while they are driven. */
  def outputs: Option[Int] =
    if (p.isDigitalIo) shown else Option.when(loaded() && running())(registers.value("digital_output"))

  /** Something may have changed on which it depends whether outputs may be driven. */
  def watch(): Unit = if (p.isDigitalIo && !(allowed && (running() || isLate))) shown = None

  /** The outputs have an event. */
  private def update(): Unit = {
    shown = Option.when(allowed && running())(registers.value("digital_output"))
    watch()
  }

  private def take(): Unit =
    for (i <- 0 until p.digitalInputs) write(RegisterMap.ProcessRamStart + i, inputs >> 8 * i & 0xff)

  /** The pin by which inputs are taken has this level. */
  def setLatch(level: Boolean): Unit = {
    if (level && !latch && p.digitalInputEvent == 1) take()
    latch = level
  }

  /** Something triggers the process data watchdog. */
  def triggers(): Unit = triggered = true

  def frameBegins(): Unit = if (p.digitalInputEvent == 0) take()

  /** A frame has ended well, and its register writes have taken effect. */
  def frameEnds(): Unit = if (p.isDigitalIo && p.digitalOutputs > 0) {
    watch()
    if (p.digitalOutputEvent == 0 || (p.digitalOutputEvent == 1 && triggered)) update()
    triggered = false
  }

  /** SYNC signal `n` becomes active. */
  def sync(n: Int): Unit = {
    if (p.digitalInputEvent == 2 + n) take()
    if (p.digitalOutputEvent == 2 + n) update()
  }
}
