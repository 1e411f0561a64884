package flyframe.registers

import flyframe.params.EscParams
import RegisterTable._

/** The data link layer: control and status of ports and frames; used by [[flyframe.port.LoopControl]],
  * [[flyframe.port.TemporaryLoops]] and [[flyframe.frame.FrameProcessor]].
  */
object DlRegisters {
  val Control = 0x0100
  val Offset  = 0x0108
  val Status  = 0x0110

  /** The byte of the control register with the loop settings of all ports. */
  val LoopByte: Int = Control + 1

  /** Its byte with the size of the RX FIFO. */
  val FifoByte: Int = Control + 2

  // format: off
  private def loopSetting(y: Int) =
      field(s"loop_port$y",          9 + 2 * y, 8 + 2 * y, loadable,   0,
          s"Loop setting of port $y: 0 auto, 1 auto close, 2 open, 3 closed (LP-01)")

  private def control(p: EscParams) = {
    val configured = if (p.hasSii) stored else constant
    register(Control, 4, "dl_control", rw, r, "LP-01", "ESC DL control", Seq(
      field("destroy_non_ethercat",          0,         0, stored,     1,
          "1: non-EtherCAT frames are destroyed and SOURCE_MAC[1] is set; 0: they pass (FP-09, FP-10)"),
      field("temporary_use",                 1,         1, loadable,   0,
          "1: the loop settings return to the former ones after about one second")
    ) ++ (0 until p.ports).map(loopSetting) ++ Seq(
      field("rx_fifo_size",                 18,        16, stored,     7,
          "RX FIFO size; 0 to 3 start one core cycle earlier where the clock leaves room (LP-12)"),
      field("dl_configuration",             23,        20, configured, 0,
          "From EEPROM A5[7:4] (SII-22); without effect here"),
      field("alias_enable",                 24,        24, stored,     0,
          "1: the station alias is accepted by all configured-address commands")
    ): _*)
  }

  private val offset =
    register(Offset, 2, "read_write_offset", rw, r, "B-113", "Physical read/write offset",
      field("read_write_offset",            15,         0, stored,     0,
          "APRW, FPRW and BRW write so many bytes behind the place that they read"))

  // The loop of a port that is not there is closed.
  private def link(y: Int, source: Source) =
      field(s"physical_link_port$y",     4 + y,     4 + y, source,     0,      s"1: link at port $y")

  private def port(y: Int, source: Source, closed: Int) = Seq(
      field(s"loop_closed_port$y",   8 + 2 * y, 8 + 2 * y, source,     closed, s"1: loop at port $y closed"),
      field(s"communication_port$y", 9 + 2 * y, 9 + 2 * y, source,     0,
          s"1: communication established at port $y")
  )

  private def linkStatus(p: EscParams) = {
    val watchdog          = if (p.hasWatchdogs) status else constant
    val enhanced          = if (p.hasSii) status else constant
    val ecat              = if (p.hasApplicationLayer) ack else r // ends an event, see EventRegisters
    def source(port: Int) = if (port < p.ports) status else constant
    register(Status,  2, "dl_status",  ecat, r, "LP-02", "ESC DL status", Seq(
      field("pdi_operational",               0,         0, status,     0,
          "1: configuration loaded, process data RAM open"),
      field("pdi_watchdog",                  1,         1, watchdog,   0,
          "1: the PDI watchdog runs or is off; 0: expired (WD-07)")
    ) ++ Option.when(p.hasEnhancedLinks)(
      field("enhanced_link_detection",       2,         2, enhanced,   1,
          "1: enhanced link detection is on at a port (LNK-11)")
    ) ++ (0 until 4).map(y => link(y, source(y))) ++
      (0 until 4).flatMap(y => port(y, source(y), if (y < p.ports) 0 else 1)): _*)
  }
  // format: on

  def apply(p: EscParams): Seq[Register] =
    Seq(control(p), linkStatus(p)) ++ Option.when(p.hasReadWriteOffset)(offset)
}
