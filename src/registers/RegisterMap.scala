package flyframe.registers

import flyframe.params.EscParams
import Access._
import Source._

/** The registers of a controller with the given parameters, in address order. Adding a register means adding
  * it here.
  */
object RegisterMap {

  /** First byte of user RAM (GEN-04). */
  val UserRamStart = 0x0f80

  /** First byte of process data RAM (GEN-04). */
  val ProcessRamStart = 0x1000

  private def constant(name: String, title: String, address: Int, bytes: Int, value: Int, meaning: String) =
    Register(
      name,
      title,
      address,
      bytes,
      Read,
      Read,
      "GEN-07",
      Seq(Field(name, 8 * bytes - 1, 0, Constant, value, meaning))
    )

  private def information(p: EscParams) = Seq(
    constant("esc_type", "ESC type", 0x0000, 1, p.escType, "Controller family"),
    constant("esc_revision", "ESC revision", 0x0001, 1, p.escRevision, "Family revision"),
    constant("esc_build", "ESC build", 0x0002, 2, p.escBuild, "Build number"),
    constant("fmmus_supported", "FMMUs supported", 0x0004, 1, p.reportedFmmus, "Number of FMMUs"),
    constant(
      "sync_managers_supported",
      "SyncManagers supported",
      0x0005,
      1,
      p.reportedSyncManagers,
      "Number of SyncManagers"
    ),
    constant("ram_size", "RAM size", 0x0006, 1, p.ramSizeReported, "Process data RAM in KiB"),
    constant(
      "port_descriptor",
      "Port descriptor",
      0x0007,
      1,
      p.portDescriptor,
      "Two bits per port: 00 absent, 11 MII"
    ),
    constant("features", "ESC features supported", 0x0008, 2, p.features, "Feature bits (GEN-07)")
  )

  private def addresses(p: EscParams) = Seq(
    Register(
      "station_address",
      "Configured station address",
      0x0010,
      2,
      ReadWrite,
      Read,
      "FP-15",
      Seq(
        Field(
          "station_address",
          p.nodeIdWidth - 1,
          0,
          Stored(),
          0,
          "Node address compared for FPRD, FPWR, FPRW and FRMW"
        )
      )
    ),
    Register(
      "station_alias",
      "Configured station alias",
      0x0012,
      2,
      Read,
      ReadWrite,
      "FP-15",
      Seq(
        Field(
          "station_alias",
          p.nodeIdWidth - 1,
          0,
          Stored(),
          0,
          "Second node address while 0x0100[24] is set; written by the host"
        )
      )
    )
  )

  private def dlControl(p: EscParams) = Register(
    "dl_control",
    "ESC DL control",
    0x0100,
    4,
    ReadWrite,
    Read,
    "LP-01",
    Seq(
      Field(
        "destroy_non_ethercat",
        0,
        0,
        Stored(),
        1,
        "1: non-EtherCAT frames are destroyed and SOURCE_MAC[1] is set; 0: they pass (FP-09, FP-10)"
      ),
      Field(
        "temporary_use",
        1,
        1,
        Stored(hardwareSet = true),
        0,
        "1: the loop settings return to the former ones after about one second"
      )
    ) ++ (0 until p.ports).map(y =>
      Field(
        s"loop_port$y",
        9 + 2 * y,
        8 + 2 * y,
        Stored(hardwareSet = true),
        0,
        s"Loop setting of port $y: 0 auto, 1 auto close, 2 open, 3 closed (LP-01)"
      )
    ) ++ Seq(
      Field(
        "rx_fifo_size",
        18,
        16,
        Stored(),
        7,
        "RX FIFO size; 0 to 3 start one core cycle earlier where the clock leaves room (LP-12)"
      ),
      Field(
        "alias_enable",
        24,
        24,
        Stored(),
        0,
        "1: the station alias is accepted by all configured-address commands"
      )
    )
  )

  private def dlStatus(p: EscParams) = Register(
    "dl_status",
    "ESC DL status",
    0x0110,
    2,
    Read,
    Read,
    "LP-02",
    Seq(Field("pdi_operational", 0, 0, Status, 0, "1: configuration loaded, process data RAM open")) ++
      (0 until 4).map(y =>
        Field(
          s"physical_link_port$y",
          4 + y,
          4 + y,
          if (y < p.ports) Status else Constant,
          0,
          s"1: link at port $y"
        )
      ) ++
      (0 until 4).flatMap { y =>
        val (source, closed) = if (y < p.ports) (Status, 0) else (Constant, 1)
        Seq(
          Field(s"loop_closed_port$y", 8 + 2 * y, 8 + 2 * y, source, closed, s"1: loop at port $y closed"),
          Field(
            s"communication_port$y",
            9 + 2 * y,
            9 + 2 * y,
            source,
            0,
            s"1: communication established at port $y"
          )
        )
      }
  )

  private def counter(name: String, bit: Int, group: String, meaning: String) =
    Field(name, bit + 7, bit, Counter(group), 0, meaning)

  private def errorCounters(p: EscParams) = {
    val ports = 0 until p.ports
    ports.map(y =>
      Register(
        s"rx_error_port$y",
        s"RX error counter port $y",
        0x0300 + 2 * y,
        2,
        ReadClear,
        Read,
        "ERR-02",
        Seq(
          counter(s"invalid_frame_port$y", 0, "rx", s"Invalid frames received at port $y"),
          counter(s"rx_er_port$y", 8, "rx", s"Symbols with RX_ER at port $y (ERR-03)")
        )
      )
    ) ++ ports.map(y =>
      Register(
        s"forwarded_error_port$y",
        s"Forwarded RX error counter port $y",
        0x0308 + y,
        1,
        ReadClear,
        Read,
        "ERR-08",
        Seq(counter(s"forwarded_error_port$y", 0, "rx", s"Errors an earlier ESC has marked, seen at port $y"))
      )
    ) ++ Seq(
      Register(
        "epu_error",
        "ECAT processing unit error counter",
        0x030c,
        1,
        ReadClear,
        Read,
        "ERR-02",
        Seq(counter("epu_error", 0, "epu", "Errors of frames passing the processing unit"))
      )
    ) ++ ports.map(y =>
      Register(
        s"lost_link_port$y",
        s"Lost link counter port $y",
        0x0310 + y,
        1,
        ReadClear,
        Read,
        "ERR-11",
        Seq(counter(s"lost_link_port$y", 0, "lost_link", s"Link losses at port $y while its loop is auto"))
      )
    )
  }

  /** All registers that exist with parameters `p`, in address order, without overlap. */
  def apply(p: EscParams): Seq[Register] = {
    val registers =
      (information(p) ++ addresses(p) ++ Seq(dlControl(p), dlStatus(p)) ++ errorCounters(p)).sortBy(_.address)
    registers.zip(registers.drop(1)).foreach { case (a, b) =>
      require(a.address + a.bytes <= b.address, s"registers ${a.name} and ${b.name} overlap")
    }
    require(registers.last.address + registers.last.bytes <= UserRamStart, "register beyond 0x0F7F")
    registers
  }

  /** The register that covers `byteAddress`, if it exists. */
  def at(registers: Seq[Register], byteAddress: Int): Option[Register] = registers.find(_.covers(byteAddress))
}
