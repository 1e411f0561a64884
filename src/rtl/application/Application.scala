package flyframe.application

import chisel3._
import flyframe.memory.{RegisterBus, RegisterUnit}
import flyframe.params.EscParams
import flyframe.registers.{ApplicationRegisters, EventRegisters}

/** AL control and status, and the event requests towards master and host with their masks (AL-01 to AL-06,
  * IRQ-01 to IRQ-08). Events of other units are status fields that those drive.
  */
class Application(p: EscParams) extends RegisterUnit(ApplicationRegisters(p) ++ EventRegisters(p)) {

  /** Event requests for the IRQ field of datagrams, 16 bits (IRQ-08). */
  val irqField: UInt = Wire(UInt(16.W))

  def connect(bus: RegisterBus): Unit = {
    val emulation = bus.bool("device_emulation", default = p.isDigitalIo)
    val written   = bus.writes("al_control")
    val waits     = bus.untilAcknowledged("al_control")(written && !emulation).suggestName("controlEvent")
    bus.status("al_control_event") := waits
    bus.guard("al_control_free")   := emulation || !waits
    bus.guard("al_status_by_pdi")  := !emulation
    bus.set("al_status", RegNext(written, false.B) && emulation, bus.value("al_control"))

    for (status <- Seq("dl_status", "al_status"))
      bus.status(s"${status}_event") := bus
        .untilEcatReads(status)(bus.changes(status))
        .suggestName(s"${status}_changed")
    irqField := bus.whole("ecat_event_request") & bus.whole("ecat_event_mask")
    bus.interrupt((bus.whole("al_event_request") & bus.whole("al_event_mask")).orR)
  }
}
