package flyframe.registers

import flyframe.params.EscParams
import RegisterTable._

/** What a slave says of itself (GEN-07). No unit is behind them: they are constants. */
object InformationRegisters {
  // format: off
  def apply(p: EscParams): Seq[Register] = identity(p) ++ Option.when(p.acknowledgesByWrite)(pdi)

  /** What there is to know of the PDI; that it is active is what its unit tells. */
  private val pdi: Register =
    register(0x014e, 2, "pdi_information",         r, r, "PDI-09, SM-38", "PDI information",
      field("acknowledge_by_write",     0, 0, constant, 1,
          "1: what the PDI acknowledges it acknowledges by writing"),
      field("pdi_configured",           1, 1, status,   0, "1: a configuration was loaded from the EEPROM"),
      field("pdi_active",               2, 2, status,   0, "1: the PDI is active"))

  private def identity(p: EscParams): Seq[Register] = Seq(
    register(0x0000, 1, "esc_type",                r, r, "GEN-07", "ESC type",
      field("esc_type",                 7, 0, constant, p.escType,         "Controller family")),
    register(0x0001, 1, "esc_revision",            r, r, "GEN-07", "ESC revision",
      field("esc_revision",             7, 0, constant, p.escRevision,     "Family revision")),
    register(0x0002, 2, "esc_build",               r, r, "GEN-07", "ESC build",
      field("esc_build",               15, 0, constant, p.escBuild,        "Build number")),
    register(0x0004, 1, "fmmus_supported",         r, r, "GEN-07", "FMMUs supported",
      field("fmmus_supported",          7, 0, constant, p.fmmus,           "Number of FMMUs")),
    register(0x0005, 1, "sync_managers_supported", r, r, "GEN-07", "SyncManagers supported",
      field("sync_managers_supported",  7, 0, constant, p.syncManagers,    "Number of SyncManagers")),
    register(0x0006, 1, "ram_size",                r, r, "GEN-07", "RAM size",
      field("ram_size",                 7, 0, constant, p.ramSizeReported, "Process data RAM in KiB")),
    register(0x0007, 1, "port_descriptor",         r, r, "GEN-07", "Port descriptor",
      field("port_descriptor",          7, 0, constant, p.portDescriptor,
          "Two bits per port: 00 absent, 11 MII or RMII")),
    register(0x0008, 2, "features",                r, r, "GEN-07", "ESC features supported",
      field("features",                15, 0, constant, p.features,        "Feature bits (GEN-07)"))
  )
  // format: on
}
