package flyframe.registers

import flyframe.params.EscParams
import RegisterTable._

/** MII management (MI-02 to MI-09) and the links that it finds (LNK-05); used by [[flyframe.mi.MiUnit]] and
  * [[flyframe.mi.LinkUnit]].
  */
object MiRegisters {
  val Control    = 0x0510
  val Address    = 0x0512
  val Data       = 0x0514
  val EcatAccess = 0x0516
  val PdiAccess  = 0x0517
  val PortStatus = 0x0518

  /** The byte with the command and the errors. */
  val CommandByte: Int = Control + 1

  private val byEcat = rwIf("mi_ecat_may_write")
  private val claim  = rwIf("mi_ecat_may_claim")
  private val take   = rwIf("mi_pdi_may_take")

  // format: off
  private def access = Seq(
    register(EcatAccess, 1, "mi_ecat_access", claim, r,    "MI-07", "PHY ECAT access state",
      field("mi_exclusive",         0,  0, stored,   0, "1: the PDI may not take the interface")),
    register(PdiAccess,  1, "mi_pdi_access",  rw,    take, "MI-07", "PHY PDI access state",
      field("mi_taken",             0,  0, status,   0, "1: the PDI has the interface; it writes this bit"),
      field("mi_force",             1,  1, status,   0,
          "1: takes it back from the PDI; ECAT writes this bit"))
  )

  /** Control, PHY and data. */
  def apply(p: EscParams): Seq[Register] = {
    val byPdi      = if (p.hasMiByPdi) rwIf("mi_pdi_may_write") else r
    val (one, two) = (p.miLinkDetection, if (p.hasMiByPdi) 1 else 0)
    Seq(
    register(Control, 2, "mi_control",  byEcat, byPdi, "MI-02 to MI-05", "PHY control and status",
      field("mi_write_enable",      0,  0, status,   0, "1: ECAT may write to a PHY in this frame"),
      field("mi_pdi_possible",      1,  1, constant, two,
          "1: the PDI may take the interface over (0x0516, 0x0517)"),
      field("mi_link_detection",    2,  2, constant, one, "1: links are found through MI (0x0518)"),
      field("mi_port_address",      7,  3, status,   p.phyAddress(0),
          "Address of the PHY at port 0; with 0x0512[7] at the port in 0x0512[1:0]"),
      field("mi_command",          10,  8, status,   0,
          "1 read, 2 write, 0 clears the errors; reads the running command"),
      field("mi_read_error",       13, 13, status,   0, "1: the PHY did not answer"),
      field("mi_command_error",    14, 14, status,   0,
          "1: invalid command, or write without write enable"),
      field("mi_busy",             15, 15, status,   0, "1: busy")),
    register(Address, 1, "mi_phy",      byEcat, byPdi, "MI-08, MI-09",   "PHY address",
      field("mi_phy_address",       4,  0, stored,   0,
          "0 to 3: the PHY of that port; from 4 on added to the address of port 0"),
      field("mi_translation_off",   7,  7, stored,   0, "1: the address is used as it is")),
    register(0x0513,  1, "mi_register", byEcat, byPdi, "MI-02",          "PHY register address",
      field("mi_register_address",  4,  0, stored,   0, "Register of the PHY")),
    register(Data,    2, "mi_data",     byEcat, byPdi, "MI-02",          "PHY data",
      field("mi_data",             15,  0, status,   0, "Data to write, or read"))
    ) ++ (if (p.hasMiByPdi) access else Nil)
  }

  private def port(p: EscParams, y: Int) = {
    // Who has the interface clears.
    val (ecat, pdi) = if (p.hasMiByPdi) (rwIf("mi_ecat_may_clear"), rwIf("mi_pdi_may_clear")) else (rw, r)
    register(PortStatus + y, 1, s"mi_port$y", ecat, pdi, "LNK-05", s"PHY port $y status",
      field(s"mi_physical_link_port$y", 0, 0, status, 0, "1: the PHY reports a link"),
      field(s"mi_link_port$y",          1, 1, status, 0, "1: and one that suits EtherCAT"),
      field(s"mi_link_error_port$y",    2, 2, status, 0, "1: the link does not suit, and is held off"),
      field(s"mi_poll_error_port$y",    3, 3, status, 0,
          "1: the PHY did not answer; cleared by a write to any of 0x0518 on"),
      field(s"mi_partner_error_port$y", 4, 4, status, 0, "1: the partner cannot do 100 Mbit/s full duplex"),
      field(s"mi_configured_port$y",    5, 5, status, 0,
          "1: the PHY was configured; cleared by a write to any of 0x0518 on"))
  }
  // format: on

  /** Status of the ports' PHYs. */
  def ports(p: EscParams): Seq[Register] = (0 until p.ports).map(port(p, _))
}
