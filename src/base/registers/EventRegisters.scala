package flyframe.registers

import flyframe.params.EscParams
import RegisterTable._

/** Events for the master and for the host, and their masks (IRQ-01 to IRQ-08); used by
  * [[flyframe.application.Application]].
  */
object EventRegisters {
  val EcatMask    = 0x0200
  val AlMask      = 0x0204
  val EcatRequest = 0x0210
  val AlRequest   = 0x0220

  /** `whole` as far as there are SyncManagers for its bits. */
  private def ofEach(sms: Int, whole: Field): Option[Field] =
    Option.when(sms > 0)(whole.copy(high = (whole.low + sms - 1) min whole.high))

  // format: off
  def apply(p: EscParams): Seq[Register] = {
    val sms    = p.syncManagers
    val held   = if (p.hasRegisterRam) mirrored else stored
    val byHost = if (p.isDigitalIo) constant else stored // without a host nobody writes it
    val allSms = (BigInt(1) << sms) - 1
    val eeprom = if (p.hasEmulation) status else constant
    val expiry = if (p.hasWatchdogs) status else constant
    val active = if (sms > 0) status else constant
    def latches(name: String, bit: Int, source: Source, reset: Int, meaning: String) =
      Option.when(p.latchSignals > 0)(field(name, bit, bit, source, reset, meaning)).toSeq
    def syncs(kind: String, source: Source, reset: Int, meaning: String) = (0 until p.syncSignals).map(n =>
      field(s"sync${n}_$kind", 2 + n, 2 + n, source, reset, s"1: SYNC$n $meaning"))
    Seq(
    register(EcatMask,    2, "ecat_event_mask",    rw, r,  "IRQ-08", "ECAT event mask",
      field("ecat_event_mask",     15, 0, held, 0,
          "Bit n = 1: bit n of 0x0210 goes into the IRQ field of datagrams")),
    register(AlMask,      4, "al_event_mask",      r,  rw, "IRQ-01", "AL event mask", Seq(
      field("al_control_mask",      0, 0, byHost, 1,      "1: AL control event raises the interrupt")
    ) ++ latches("latch_mask", 1, byHost, 1, "1: LATCH event raises the interrupt") ++
      syncs("mask", byHost, 1, "raises the interrupt") ++ Seq(
      field("sm_activation_mask",   4, 4, byHost, 0,
          "1: SyncManager activation event raises the interrupt"),
      field("eeprom_mask",          5, 5, byHost, 0,      "1: EEPROM emulation event raises the interrupt"),
      field("watchdog_mask",        6, 6, byHost, 0,
          "1: process data watchdog event raises the interrupt")
    ) ++ ofEach(sms,
      field("sm_mask",             23, 8, byHost, allSms,
          "Bit n = 1: SyncManager n raises the interrupt")): _*),
    register(EcatRequest, 2, "ecat_event_request", r,  r,  "IRQ-08", "ECAT event request",
      latches("ecat_latch_event", 0, status, 0, "1: a LATCH of ECAT has an event") ++ Seq(
      field("dl_status_event",      2, 2, status, 0,
          "1: DL status changed; ends with an ECAT read of 0x0110"),
      field("al_status_event",      3, 3, status, 0,
          "1: AL status changed; ends with an ECAT read of 0x0130")
    ) ++ ofEach(sms,
      field("sm_ecat_event",       11, 4, status, 0,
          "Bit n: event of SyncManager n for the master")): _*),
    register(AlRequest,   4, "al_event_request",   r,  r,  "IRQ-02", "AL event request", Seq(
      field("al_control_event",     0, 0, status, 0,
          "1: AL control was written; ends with a PDI read of 0x0120")
    ) ++ latches("latch_event", 1, status, 0, "1: a LATCH of the PDI has an event") ++
      syncs("event", status, 0, "is active (DC-35)") ++ Seq(
      field("sm_activation_event",  4, 4, active, 0,
          "1: an activate register changed; ends with PDI reads of all changed"),
      field("eeprom_event",         5, 5, eeprom, 0,      "1: an EEPROM command waits for the PDI (SII-21)"),
      field("watchdog_event",       6, 6, expiry, 0,
          "1: process data watchdog expired; ends with a PDI read of 0x0440")
    ) ++ ofEach(sms,
      field("sm_al_event",         23, 8, status, 0,      "Bit n: event of SyncManager n for the host")): _*)
    )
  }
  // format: on
}
