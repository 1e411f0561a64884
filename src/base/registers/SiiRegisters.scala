package flyframe.registers

import flyframe.params.EscParams
import RegisterTable._

/** The EEPROM interface and the configuration loaded from there (SII-07 to SII-24); used by
  * [[flyframe.sii.SiiUnit]].
  */
object SiiRegisters {
  val PdiControl          = 0x0140
  val ConfigurationA0     = 0x0141
  val ConfigurationA5     = 0x0142
  val ConfigurationA6     = 0x0144
  val PdiConfiguration    = 0x0150
  val PdiConfigurationExt = 0x0152
  val EcatAccess          = 0x0500
  val Control             = 0x0502
  val Address             = 0x0504
  val Data                = 0x0508

  /** Bytes of the register RAM for the unit alone, at addresses without a register: the configuration area
    * while it is being read.
    */
  val Scratch: Range = 0x0560 until 0x0570

  /** A checksum word of the EEPROM that switches the check off (SII-03). */
  val ChecksumOff: Int = 0x88a4

  private val byEcat = rwIf("sii_ecat_may_write")
  private val byPdi  = rwIf("sii_pdi_may_write")
  private val take   = rwIf("sii_pdi_may_take")

  /** A host that emulates the EEPROM answers in these. */
  private val answer = rwIf("sii_pdi_may_answer")

  // format: off
  def apply(p: EscParams): Seq[Register] = {
    val emulated = if (p.hasEmulation) 1 else 0
    val twoByte  = if (p.hasI2c) status else constant
    val further  = if (p.hasEmulation) answer else r
    // Where there is no host nobody else answers.
    val followed = if (p.isDigitalIo) constant else stored
    val follows  = if (p.isDigitalIo) 1 else 0
    Seq(
    register(PdiControl,          1, "pdi_control",                r,      r,       "SII-07",
        "PDI control",
      field("pdi_type",                    7,  0, ram,      0,        "EEPROM A0[7:0]")),
    register(ConfigurationA0,     1, "esc_configuration_a0",       r,      r,       "SII-07",
        "ESC configuration A0",
      field("device_emulation",            0,  0, followed, follows,
          "1: AL status follows AL control (AL-05)"),
      field("esc_configuration",           7,  1, stored,   0x79,
          if (p.hasEnhancedLinks) "EEPROM A0[15:9]: enhanced link detection (LNK-11); bits 2, 3: no effect"
          else "EEPROM A0[15:9]: no effect")),
    register(ConfigurationA5,     2, "esc_configuration_a5",       r,      r,       "SII-07",
        "ESC configuration A5",
      field("esc_configuration_a5",       15,  0, ram,      0,        "EEPROM A5")),
    register(ConfigurationA6,     1, "esc_configuration_a6",       r,      r,       "SII-07",
        "ESC configuration A6",
      field("esc_configuration_a6",        7,  0, ram,      0,        "EEPROM A6[7:0]")),
    register(PdiConfiguration,    2, "pdi_configuration",          r,      r,       "SII-07",
        "PDI configuration",
      field("pdi_configuration",          15,  0, ram,      0,        "EEPROM A1")),
    register(PdiConfigurationExt, 2, "extended_pdi_configuration", r,      r,       "SII-07",
        "Extended PDI configuration",
      field("extended_pdi_configuration", 15,  0, ram,      0,        "EEPROM A3")),
    register(EcatAccess,          1, "eeprom_ecat_access",         rw,     r,       "SII-10, SII-11",
        "EEPROM ECAT access state",
      field("eeprom_offered",              0,  0, stored,   0,
          "1: the PDI may have the EEPROM interface"),
      field("eeprom_force",                1,  1, stored,   0,        "1: takes it back from the PDI")),
    register(0x0501,              1, "eeprom_pdi_access",          r,      take,    "SII-10, SII-11",
        "EEPROM PDI access state",
      field("eeprom_taken",                0,  0, loadable, 0,        "1: the PDI has the EEPROM interface")),
    register(Control,             2, "eeprom_control",             byEcat, answer,  "SII-12 to SII-15",
        "EEPROM control and status",
      field("eeprom_write_enable",         0,  0, status,   0,
          "1: ECAT may write the EEPROM in this frame"),
      field("eeprom_emulated",             5,  5, constant, emulated, "1: emulated by the host (SII-21)"),
      field("eeprom_eight_bytes",          6,  6, constant, 1,        "1: a read command reads 8 bytes"),
      field("eeprom_two_address_bytes",    7,  7, twoByte,  0,
          "1: EEPROM with two address bytes (SII-16)"),
      field("eeprom_command",             10,  8, status,   0,
          "1 read, 2 write, 4 reload, 0 clears the errors; reads the running command"),
      field("eeprom_checksum_error",      11, 11, status,   0,
          "1: configuration area has a wrong checksum"),
      field("eeprom_not_loaded",          12, 12, status,   0,        "1: no configuration loaded"),
      field("eeprom_command_error",       13, 13, status,   0,
          "1: invalid command, or the EEPROM did not acknowledge"),
      field("eeprom_write_error",         14, 14, status,   0,
          "1: write command without write enable"),
      field("eeprom_busy",                15, 15, status,   0,        "1: busy")),
    register(Address,             4, "eeprom_address",             byEcat, byPdi,   "SII-12",
        "EEPROM address",
      field("eeprom_address",             31,  0, ram,      0,        "Word address")),
    register(Data,                2, "eeprom_data",                byEcat, answer,  "SII-12, SII-14",
        "EEPROM data",
      field("eeprom_data",                15,  0, ram,      0,        "Word to write, or first word read")),
    register(Data + 2,            6, "eeprom_data_high",           r,      further, "SII-14",
        "EEPROM data, further words",
      field("eeprom_data_high",           47,  0, ram,      0,        "Second to fourth word read"))
    )
  }
  // format: on
}
