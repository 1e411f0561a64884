package flyframe.mi

import chisel3._
import chisel3.util._
import flyframe.memory.{RegisterBus, RegisterUnit}
import flyframe.mii.{LinkSignals, PortSignals}
import flyframe.params.EscParams
import flyframe.registers.MiRegisters

/** Decides on the links of all ports, where more than their inputs does (LNK-01 to LNK-12).
  *
  * @param ports
  *   all, by their numbers
  * @param access
  *   to the PHYs, if it needs that
  * @param phyResets
  *   to the reset inputs of the PHYs, if it uses those
  * @param firstLoad
  *   of the EEPROM, if there is one: it is under way; and the last load has failed
  */
class LinkUnit(
    p: EscParams,
    ports: Seq[PortSignals],
    access: Option[PhyAccess],
    phyResets: Option[Vec[Bool]],
    firstLoad: Option[(Bool, Bool)]
) extends RegisterUnit(if (p.hasMiLinks) MiRegisters.ports(p) else Nil) {
  private val detection = Option.when(p.hasMiLinks)(Module(new LinkDetection(p)).suggestName("linkDetection"))
  private val links: Seq[LinkSignals] = ports.map(_.detection.get)

  /** Links before enhanced link detection, as DL status shows them (OP-15). */
  val physical: Seq[Bool] = detection.fold(links.map(_.signal))(_.link)

  def connect(bus: RegisterBus): Unit = {
    val asks = Wire(Vec(p.ports, Bool())) // restart auto-negotiation
    val done = Wire(Vec(p.ports, Bool()))
    done := VecInit.fill(p.ports)(false.B)
    for (d <- detection) {
      d.signal  := VecInit(links.map(_.signal))
      d.clear   := (0 until p.ports).map(y => bus.writes(s"mi_port$y")).reduce(_ || _)
      d.restart := asks
      done      := d.restarted
      access.get <> d.access
      for ((s, y) <- d.status.zipWithIndex) {
        bus.status(s"mi_physical_link_port$y") := s.physical
        bus.status(s"mi_link_port$y")          := s.link
        bus.status(s"mi_link_error_port$y")    := s.error
        bus.status(s"mi_poll_error_port$y")    := s.pollError
        bus.status(s"mi_partner_error_port$y") := s.partnerError
        bus.status(s"mi_configured_port$y")    := s.configured
      }
    }
    if (!p.hasEnhancedLinks) {
      asks := VecInit.fill(p.ports)(false.B)
      for ((link, found) <- links.zip(physical)) link.link := found
    } else {
      val enhanced = Module(new EnhancedLinkDetection(p.ports, p.coreClockMhz)).suggestName("enhancedLinks")
      enhanced.found := VecInit(physical)
      enhanced.rxEr  := VecInit(ports.map(_.events.rxEr))
      enhanced.on    := VecInit(isOn(bus))
      for ((link, left) <- links.zip(enhanced.link)) link.link := left
      for (y            <- 0 until p.ports) {
        val pending = RegInit(false.B).suggestName(s"restarts_$y") // reset: no PHY begins anew
        // A link that is gone needs no restart any more.
        if (!p.resetsPhys) pending := physical(y) && (enhanced.restarts(y) || (pending && !done(y)))
        asks(y)                    := pending
      }
      if (!p.resetsPhys && detection.isEmpty) {
        val restarts = Module(new Restarts(p.ports)).suggestName("restarts")
        restarts.restart := asks
        done             := restarts.restarted
        access.get <> restarts.access
      }
      for (pins <- phyResets) {
        val slow = Counter(enhanced.tick, 128)._2
        for ((pin, starts) <- pins.zip(enhanced.restarts)) {
          val reset = Module(new PhyReset)
          reset.tick  := slow
          reset.start := starts
          pin         := reset.resetN
        }
      }
    }
  }

  /** Where enhanced link detection is on (LNK-11): everywhere until the first load, then as the EEPROM says;
    * off if that was not loaded.
    */
  private def isOn(bus: RegisterBus): Seq[Bool] =
    firstLoad.fold(Seq.fill(p.ports)(true.B)) { case (loading, failed) =>
      val off = RegInit(false.B).suggestName("enhancedLinksOff") // reset: on
      when(RegNext(loading, false.B) && !loading && failed) { off := true.B }
      val a0 = bus.value("esc_configuration") // bits 7:1
      bus.status("enhanced_link_detection") := !off && (a0(0) || a0(6, 3).orR)
      (0 until p.ports).map(y => !off && (a0(0) || a0(3 + y)))
    }
}
