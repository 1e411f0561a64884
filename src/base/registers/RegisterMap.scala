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

  /** Digital outputs: the one register that SyncManagers act on and that is written bit by bit. */
  val DigitalOutputs = 0x0f00

  /** First address that SyncManagers act on (B-52). */
  def firstManaged(p: EscParams): Int = if (p.digitalOutputs > 0) DigitalOutputs else UserRamStart

  /** Bits of the byte address of a register. */
  def addressBits(p: EscParams): Int = if (p.isMaster) 8 else 12

  /** First byte of process data RAM (GEN-04). */
  val ProcessRamStart = 0x1000

  /** Bytes of the register RAM for the SII unit alone, at addresses without a register: the configuration
    * area while it is being read.
    */
  val SiiScratch = 0x0560 until 0x0570

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
    constant("fmmus_supported", "FMMUs supported", 0x0004, 1, p.fmmus, "Number of FMMUs"),
    constant(
      "sync_managers_supported",
      "SyncManagers supported",
      0x0005,
      1,
      p.syncManagers,
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
        "dl_configuration",
        23,
        20,
        if (p.hasSii) Stored() else Constant,
        0,
        "From EEPROM A5[7:4] (SII-22); without effect here"
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
    Seq(
      Field("pdi_operational", 0, 0, Status, 0, "1: configuration loaded, process data RAM open"),
      Field(
        "pdi_watchdog",
        1,
        1,
        if (p.hasWatchdogs) Status else Constant,
        0,
        "1: the PDI watchdog runs or is off; 0: expired (WD-07)"
      )
    ) ++
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

  private def field(name: String, high: Int, low: Int, source: Source, meaning: String, reset: BigInt = 0) =
    Field(name, high, low, source, reset, meaning)

  private val applicationLayer = Seq(
    Register(
      "al_control",
      "AL control",
      0x0120,
      2,
      ReadGuardedWrite,
      ReadAcknowledge,
      "AL-01, AL-04",
      Seq(field("al_control", 6, 0, Stored(), "Requested state, bit 4: error acknowledge", 1)),
      ecatGuard = Some("al_control_free")
    ),
    Register(
      "al_status",
      "AL status",
      0x0130,
      2,
      ReadAcknowledge,
      ReadGuardedWrite,
      "AL-01, AL-05, AL-06",
      Seq(field("al_status", 6, 0, Stored(hardwareSet = true), "Present state, bit 4: error indication", 1)),
      pdiGuard = Some("al_status_by_pdi")
    ),
    Register(
      "al_status_code",
      "AL status code",
      0x0134,
      2,
      Read,
      ReadWrite,
      "AL-06",
      Seq(field("al_status_code", 15, 0, Ram, "Why the state was refused or left"))
    )
  )

  private def events(p: EscParams) = {
    val sms = p.syncManagers
    def smEvents(name: String, low: Int, high: Int, source: Source, meaning: String, reset: BigInt = 0) =
      Option.when(sms > 0)(field(name, (low + sms - 1) min high, low, source, meaning, reset))
    val allSms = (BigInt(1) << sms) - 1
    Seq(
      Register(
        "ecat_event_mask",
        "ECAT event mask",
        0x0200,
        2,
        ReadWrite,
        Read,
        "IRQ-08",
        Seq(
          field(
            "ecat_event_mask",
            15,
            0,
            Stored(),
            "Bit n = 1: bit n of 0x0210 goes into the IRQ field of datagrams"
          )
        )
      ),
      Register(
        "al_event_mask",
        "AL event mask",
        0x0204,
        4,
        Read,
        ReadWrite,
        "IRQ-01",
        Seq(
          field("al_control_mask", 0, 0, Stored(), "1: AL control event raises the interrupt", 1),
          field("sm_activation_mask", 4, 4, Stored(), "1: SyncManager activation event raises the interrupt"),
          field("eeprom_mask", 5, 5, Stored(), "1: EEPROM emulation event raises the interrupt"),
          field("watchdog_mask", 6, 6, Stored(), "1: process data watchdog event raises the interrupt")
        ) ++ smEvents("sm_mask", 8, 23, Stored(), "Bit n = 1: SyncManager n raises the interrupt", allSms)
      ),
      Register(
        "ecat_event_request",
        "ECAT event request",
        0x0210,
        2,
        Read,
        Read,
        "IRQ-08",
        Seq(
          field("dl_status_event", 2, 2, Status, "1: DL status changed; ends with an ECAT read of 0x0110"),
          field("al_status_event", 3, 3, Status, "1: AL status changed; ends with an ECAT read of 0x0130")
        ) ++ smEvents("sm_ecat_event", 4, 11, Status, "Bit n: event of SyncManager n for the master")
      ),
      Register(
        "al_event_request",
        "AL event request",
        0x0220,
        4,
        Read,
        Read,
        "IRQ-02",
        Seq(
          field(
            "al_control_event",
            0,
            0,
            Status,
            "1: AL control was written; ends with a PDI read of 0x0120"
          ),
          field(
            "sm_activation_event",
            4,
            4,
            Status,
            "1: an activate register changed; ends with PDI reads of all changed"
          ),
          field(
            "eeprom_event",
            5,
            5,
            if (p.hasEmulation) Status else Constant,
            "1: an EEPROM command waits for the PDI (SII-21)"
          ),
          field(
            "watchdog_event",
            6,
            6,
            if (p.hasWatchdogs) Status else Constant,
            "1: process data watchdog expired; ends with a PDI read of 0x0440"
          )
        ) ++ smEvents("sm_al_event", 8, 23, Status, "Bit n: event of SyncManager n for the host")
      )
    )
  }

  private val watchdogs = {
    def time(name: String, title: String, address: Int, rule: String) = Register(
      name,
      title,
      address,
      2,
      ReadWrite,
      Read,
      rule,
      Seq(field(name, 15, 0, Stored(), "In watchdog ticks; 0 = off", 0x03e8))
    )
    def count(name: String, title: String, address: Int) =
      Register(
        name,
        title,
        address,
        1,
        ReadClear,
        Read,
        "WD-09",
        Seq(counter(name, 0, "watchdog", "Expiries"))
      )
    Seq(
      Register(
        "watchdog_divider",
        "Watchdog divider",
        0x0400,
        2,
        ReadWrite,
        Read,
        "WD-01",
        Seq(field("watchdog_divider", 15, 0, Stored(), "A tick is (value + 2) * 40 ns", 0x09c2))
      ),
      time("watchdog_time_pdi", "Watchdog time PDI", 0x0410, "WD-06"),
      time("watchdog_time_process_data", "Watchdog time process data", 0x0420, "WD-04"),
      Register(
        "watchdog_status_process_data",
        "Watchdog status process data",
        0x0440,
        2,
        Read,
        ReadAcknowledge,
        "WD-05",
        Seq(field("watchdog_process_data", 0, 0, Status, "1: running or off; 0: expired"))
      ),
      count("watchdog_count_process_data", "Watchdog counter process data", 0x0442),
      count("watchdog_count_pdi", "Watchdog counter PDI", 0x0443),
      Register(
        "watchdog_status_pdi",
        "Watchdog status PDI",
        0x0448,
        1,
        Read,
        Read,
        "WD-07",
        Seq(field("watchdog_pdi", 0, 0, Status, "1: running or off; 0: expired"))
      )
    )
  }

  private val leds = Seq("run" -> 0x0138, "err" -> 0x0139).map { case (led, address) =>
    Register(
      s"${led}_led_override",
      s"${led.toUpperCase} LED override",
      address,
      1,
      ReadWrite,
      ReadWrite,
      if (led == "run") "LED-02" else "LED-04",
      Seq(
        field(
          s"${led}_led_code",
          3,
          0,
          Status,
          "Pattern shown: 0 off, 1 to 12 flashes, 13 blinking, 14 flickering, 15 on"
        ),
        field(s"${led}_led_enable", 4, 4, Status, "1: bits 3:0 as written are shown")
      )
    )
  }

  private def sii(p: EscParams) = {
    def configuration(name: String, title: String, address: Int, bytes: Int, fields: Field*) =
      Register(name, title, address, bytes, Read, Read, "SII-07", fields)
    val (byEcat, byPdi) = (Some("sii_ecat_may_write"), Some("sii_pdi_may_write"))
    // A host that emulates the EEPROM answers in these.
    val answers = Some("sii_pdi_may_answer")
    Seq(
      configuration("pdi_control", "PDI control", 0x0140, 1, field("pdi_type", 7, 0, Ram, "EEPROM A0[7:0]")),
      configuration(
        "esc_configuration_a0",
        "ESC configuration A0",
        0x0141,
        1,
        field("device_emulation", 0, 0, Stored(), "1: AL status follows AL control (AL-05)"),
        field(
          "esc_configuration",
          7,
          1,
          Stored(),
          "EEPROM A0[15:9]; enhanced link detection and DC are not built",
          0x79
        )
      ),
      configuration(
        "esc_configuration_a5",
        "ESC configuration A5",
        0x0142,
        2,
        field("esc_configuration_a5", 15, 0, Ram, "EEPROM A5")
      ),
      configuration(
        "esc_configuration_a6",
        "ESC configuration A6",
        0x0144,
        1,
        field("esc_configuration_a6", 7, 0, Ram, "EEPROM A6[7:0]")
      ),
      configuration(
        "pdi_configuration",
        "PDI configuration",
        0x0150,
        2,
        field("pdi_configuration", 15, 0, Ram, "EEPROM A1")
      ),
      configuration(
        "extended_pdi_configuration",
        "Extended PDI configuration",
        0x0152,
        2,
        field("extended_pdi_configuration", 15, 0, Ram, "EEPROM A3")
      ),
      Register(
        "eeprom_ecat_access",
        "EEPROM ECAT access state",
        0x0500,
        1,
        ReadWrite,
        Read,
        "SII-10, SII-11",
        Seq(
          field("eeprom_offered", 0, 0, Stored(), "1: the PDI may have the EEPROM interface"),
          field("eeprom_force", 1, 1, Stored(), "1: takes it back from the PDI")
        )
      ),
      Register(
        "eeprom_pdi_access",
        "EEPROM PDI access state",
        0x0501,
        1,
        Read,
        ReadGuardedWrite,
        "SII-10, SII-11",
        Seq(field("eeprom_taken", 0, 0, Stored(hardwareSet = true), "1: the PDI has the EEPROM interface")),
        pdiGuard = Some("sii_pdi_may_take")
      ),
      Register(
        "eeprom_control",
        "EEPROM control and status",
        0x0502,
        2,
        ReadGuardedWrite,
        ReadGuardedWrite,
        "SII-12 to SII-15",
        Seq(
          field("eeprom_write_enable", 0, 0, Status, "1: ECAT may write the EEPROM in this frame"),
          field(
            "eeprom_emulated",
            5,
            5,
            Constant,
            "1: emulated by the host (SII-21)",
            if (p.hasEmulation) 1 else 0
          ),
          field("eeprom_eight_bytes", 6, 6, Constant, "1: a read command reads 8 bytes", 1),
          field(
            "eeprom_two_address_bytes",
            7,
            7,
            if (p.hasI2c) Status else Constant,
            "1: EEPROM with two address bytes (SII-16)"
          ),
          field(
            "eeprom_command",
            10,
            8,
            Status,
            "1 read, 2 write, 4 reload, 0 clears the errors; reads the running command"
          ),
          field("eeprom_checksum_error", 11, 11, Status, "1: configuration area has a wrong checksum"),
          field("eeprom_not_loaded", 12, 12, Status, "1: no configuration loaded"),
          field(
            "eeprom_command_error",
            13,
            13,
            Status,
            "1: invalid command, or the EEPROM did not acknowledge"
          ),
          field("eeprom_write_error", 14, 14, Status, "1: write command without write enable"),
          field("eeprom_busy", 15, 15, Status, "1: busy")
        ),
        byEcat,
        answers
      ),
      Register(
        "eeprom_address",
        "EEPROM address",
        0x0504,
        4,
        ReadGuardedWrite,
        ReadGuardedWrite,
        "SII-12",
        Seq(field("eeprom_address", 31, 0, Ram, "Word address")),
        byEcat,
        byPdi
      ),
      Register(
        "eeprom_data",
        "EEPROM data",
        0x0508,
        2,
        ReadGuardedWrite,
        ReadGuardedWrite,
        "SII-12, SII-14",
        Seq(field("eeprom_data", 15, 0, Ram, "Word to write, or first word read")),
        byEcat,
        answers
      ),
      Register(
        "eeprom_data_high",
        "EEPROM data, further words",
        0x050a,
        6,
        Read,
        if (p.hasEmulation) ReadGuardedWrite else Read,
        "SII-14",
        Seq(field("eeprom_data_high", 47, 0, Ram, "Second to fourth word read")),
        pdiGuard = Option.when(p.hasEmulation)(answers.get)
      )
    )
  }

  private def digitalOutputs(p: EscParams) = Register(
    "digital_output",
    "Digital I/O output data",
    DigitalOutputs,
    4,
    ReadWrite,
    Read,
    "SM-26, PDI-11",
    Seq(
      field(
        "digital_output",
        8 * p.digitalOutputs - 1,
        0,
        Stored(),
        "Outputs, driven while the process data watchdog runs; single bits can be written through an FMMU"
      )
    )
  )

  private def fmmu(p: EscParams, n: Int) = {
    def part(name: String, title: String, offset: Int, bytes: Int, bits: Int, meaning: String) = Register(
      s"fmmu${n}_$name",
      s"FMMU $title",
      0x0600 + 16 * n + offset,
      bytes,
      ReadWrite,
      Read,
      "FMMU-01",
      Seq(field(s"fmmu${n}_$name", bits - 1, 0, Ram, meaning)),
      block = Some(Block(n, p.fmmus, 16))
    )
    Seq(
      part("logical_start", "logical start address", 0x0, 4, 32, "First logical byte"),
      part("length", "length", 0x4, 2, 16, "Logical bytes, from the first to the last with a mapped bit"),
      part("start_bit", "logical start bit", 0x6, 1, 3, "First mapped bit of the first logical byte"),
      part("stop_bit", "logical stop bit", 0x7, 1, 3, "Last mapped bit of the last logical byte"),
      part("physical_start", "physical start address", 0x8, 2, 16, "Local address of the first byte"),
      part("physical_bit", "physical start bit", 0xa, 1, 3, "First bit in the first local byte"),
      part("type", "type", 0xb, 1, 2, "Bit 0: for reads; bit 1: for writes"),
      part("activate", "activate", 0xc, 1, 1, "1: active"),
      part("reserved", "reserved", 0xd, 3, 1, "Reads 0").copy(ecat = Read, fields = Nil)
    )
  }

  private def syncManager(p: EscParams, n: Int) = {
    def register(
        name: String,
        title: String,
        offset: Int,
        bytes: Int,
        ecat: Access,
        pdi: Access,
        rule: String,
        fields: Field*
    ) =
      Register(
        s"sm${n}_$name",
        s"SyncManager $title",
        0x0800 + 8 * n + offset,
        bytes,
        ecat,
        pdi,
        rule,
        fields,
        ecatGuard = Option.when(ecat == ReadGuardedWrite)(s"sm${n}_disabled"),
        block = Some(Block(n, p.syncManagers, 8))
      )
    def configuration(name: String, title: String, offset: Int, bytes: Int, meaning: String) =
      register(
        name,
        title,
        offset,
        bytes,
        ReadGuardedWrite,
        Read,
        "SM-01 to SM-10",
        field(s"sm${n}_$name", 8 * bytes - 1, 0, Ram, meaning)
      )
    Seq(
      configuration("start", "start address", 0, 2, "First byte; writable while inactive"),
      configuration("length", "length", 2, 2, "Bytes of a buffer; writable while inactive"),
      configuration(
        "control",
        "control",
        4,
        1,
        "[1] 0 buffered, 1 mailbox; [2] 1 ECAT writes; [4] ECAT, [5] AL interrupt; [6] watchdog trigger; writable while inactive"
      ),
      register(
        "status",
        "status",
        5,
        1,
        Read,
        Read,
        "SM-15, SM-21",
        field(
          s"sm${n}_write_event",
          0,
          0,
          Status,
          "1: completely written; ends with the read of the first byte"
        ),
        field(
          s"sm${n}_read_event",
          1,
          1,
          Status,
          "1: completely read; ends with the write of the first byte"
        ),
        field(s"sm${n}_mailbox_full", 3, 3, Status, "Mailbox: 1 full"),
        field(s"sm${n}_last_buffer", 5, 4, Status, "Buffered: buffer written last, 3 = none", 3)
      ),
      register(
        "activate",
        "activate",
        6,
        1,
        ReadWrite,
        ReadAcknowledge,
        "SM-28, SM-35",
        field(s"sm${n}_enable", 0, 0, Stored(), "1: active"),
        field(s"sm${n}_repeat_request", 1, 1, Stored(), "Toggled by the master")
      ),
      register(
        "pdi_control",
        "PDI control",
        7,
        1,
        Read,
        ReadWrite,
        "SM-27, SM-35",
        field(s"sm${n}_deactivated", 0, 0, Status, "1: switched off by the host, area locked"),
        field(s"sm${n}_repeat_acknowledge", 1, 1, Stored(), "Toggled by the host")
      )
    )
  }

  /** Where the register RAM, 512 bytes, keeps the byte at `address`: FMMUs, then SyncManagers, then the
    * others by the low seven bits of their address.
    */
  def ramIndex(address: Int): Int =
    if (address >> 8 == 6) address & 0xff
    else if (address >> 7 == 0x800 >> 7) 0x100 | (address & 0x7f)
    else 0x180 | (address & 0x7f)

  /** Bits that exist of the byte at `address` in the register RAM. */
  def ramMask(registers: Seq[Register], address: Int): Int = at(registers, address).fold(0) { r =>
    r.fields
      .flatMap(f => f.low to f.high)
      .map(_ - 8 * (address - r.address))
      .filter(b => b >= 0 && b < 8)
      .map(1 << _)
      .sum
  }

  /** All registers that exist with parameters `p`, in address order, without overlap. */
  def apply(p: EscParams): Seq[Register] = {
    val registers =
      if (p.isMaster) MasterRegisters(p)
      else
        (information(p) ++ addresses(p) ++ Seq(dlControl(p), dlStatus(p)) ++ errorCounters(p) ++
          (if (p.hasApplicationLayer) applicationLayer ++ events(p) else Nil) ++
          (if (p.hasWatchdogs) watchdogs else Nil) ++
          (if (p.hasLeds) leds else Nil) ++
          (if (p.hasSii) sii(p) else Nil) ++
          (if (p.digitalOutputs > 0) Seq(digitalOutputs(p)) else Nil) ++
          (if (p.hasAlarm) AlarmRegisters.all else Nil) ++
          (0 until p.fmmus).flatMap(fmmu(p, _)) ++
          (0 until p.syncManagers).flatMap(syncManager(p, _))).sortBy(_.address)
    registers.zip(registers.drop(1)).foreach { case (a, b) =>
      require(a.address + a.bytes <= b.address, s"registers ${a.name} and ${b.name} overlap")
    }
    require(registers.last.address + registers.last.bytes <= UserRamStart, "register beyond 0x0F7F")
    val inRam = registers.filter(_.inRam).flatMap(_.range.map(ramIndex))
    require(inRam.distinct.size == inRam.size, "two registers at one place of the register RAM")
    registers
  }

  /** The register that covers `byteAddress`, if it exists. */
  def at(registers: Seq[Register], byteAddress: Int): Option[Register] = registers.find(_.covers(byteAddress))
}
