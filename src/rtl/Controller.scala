package flyframe

import chisel3.Module
import flyframe.alarm.{AlarmPins, SmokeAlarm}
import flyframe.params.EscParams

/** The top level that a parameter set asks for. Only here products meet the core. */
object Controller {
  def apply(p: EscParams): Module = p.role match {
    case 1 => new MasterController(p)
    case 2 => new RingNode(p)
    case _ => slave(p)
  }

  /** That of a slave. */
  def slave(p: EscParams): SlaveController =
    if (p.hasAlarm) new AlarmSlave(p)
    else if (p.hasRing) RingGateway(p)
    else new SlaveController(p)
}

/** A slave with a smoke detector, whose events it reports in passing frames (ALARM). */
class AlarmSlave(p: EscParams) extends SlaveController(p, Seq(new SmokeAlarm(p))) {

  /** Smoke detector, buzzer and lamp. */
  val alarm: AlarmPins = unit[SmokeAlarm].pins
}
