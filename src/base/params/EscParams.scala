package flyframe.params

/** All parameters of one controller, slave or master. A value, checked by [[EscParams.problems]]; behaviour
  * is a function of it.
  *
  * Every field has an entry in [[ParamTable.all]], from which the command line, its help, the checks and the
  * documentation are made.
  */
final case class EscParams(
    preset: String = "custom",
    role: Int = 0,
    dataBusWidth: Int = 8,
    maxSubTelegrams: Int = 15,
    nodeIdWidth: Int = 16,
    ports: Int = 2,
    coreClockMhz: Int = 100,
    ramKiB: Int = 1,
    fmmus: Int = 0,
    fmmuBitwise: Int = 0,
    readWriteOffset: Int = 0,
    syncManagers: Int = 0,
    sequentialMode: Int = 0,
    deactivationDelay: Int = 0,
    openBuffers: Int = 0,
    acknowledgeByWrite: Int = 0,
    applicationLayer: Int = 0,
    watchdogs: Int = 0,
    leds: Int = 0,
    digitalOutputs: Int = 0,
    clocks: Int = 0,
    clockBits: Int = 64,
    syncSignals: Int = 0,
    latchSignals: Int = 0,
    syncPulse: Int = 1000,
    clockPowerSaving: Int = 0,
    enhancedSync: Int = 0,
    meanWays: Int = 0,
    eventTimes: Int = 0,
    timeByPdi: Int = 0,
    directSpeed: Int = 0,
    alarm: Int = 0,
    maxSlaves: Int = 64,
    linePorts: Int = 1,
    sii: Int = 0,
    siiClockKhz: Int = 400,
    siiStartUs: Int = 100,
    registerWritesPerFrame: Int = 0,
    txShift: Int = 0,
    rmiiPorts: Int = 0,
    mi: Int = 0,
    phyAddressOffset: Int = 0,
    phyAddresses: Int = -1,
    miLinkDetection: Int = 0,
    enhancedLinkDetection: Int = 0,
    linkLowPorts: Int = 0,
    fxPorts: Int = 0,
    resetRegisters: Int = 0,
    writeProtection: Int = 0,
    temporaryLoopMs: Int = 1000,
    escType: Int = 0xf1,
    escRevision: Int = 0,
    escBuild: Int = 1,
    reportedRamKiB: Int = -1,
    reportedPorts: Int = -1,
    reportedFeatures: Int = -1
) {

  /** The master of a line of alarm slaves (LM) instead of a slave controller. */
  def isMaster: Boolean = role == 1

  /** Ports: of a master those to the slaves, and one to the plant network. */
  def portCount: Int = if (isMaster) linePorts + 1 else ports

  /** The PHY of a port has RMII, not MII. */
  def isRmii(port: Int): Boolean = (rmiiPorts >> port & 1) == 1

  /** Core clock cycles per nibble slot (40 ns on the wire): 1, 2, 4 or 5. */
  def cyclesPerNibble: Int = coreClockMhz / 25

  /** Bytes moved per access on the path between frame processor, memory and host: 1, 2 or 4. */
  def lanes: Int = dataBusWidth / 8

  /** Process data RAM in bytes, from 0x1000 on. */
  def ramBytes: Int = ramKiB * 1024

  /** Bits of the number of a SyncManager, at least 1. */
  def smIndexBits: Int =
    if (syncManagers > 8) 4 else if (syncManagers > 4) 3 else if (syncManagers > 2) 2 else 1

  /** SyncManagers, FMMUs are looked through in banks of eight. */
  def smBanks: Int   = if (syncManagers > 8) 2 else 1
  def fmmuBanks: Int = if (fmmus > 8) 2 else 1

  /** FMMUs map single bits, not only whole bytes. */
  def hasBitwiseFmmus: Boolean = fmmus > 0 && fmmuBitwise == 1

  /** APRW, FPRW and BRW may write to another place than they read from (B-113). */
  def hasReadWriteOffset: Boolean = readWriteOffset == 1

  /** Frame data pass through FMMUs or SyncManagers. */
  def translates: Boolean = fmmus > 0 || syncManagers > 0

  /** AL control and status, and event requests (AL, IRQ) are built. */
  def hasApplicationLayer: Boolean = applicationLayer == 1

  /** PDI and process data watchdog are built. */
  def hasWatchdogs: Boolean = watchdogs == 1

  /** RUN, ERR and link/activity LED outputs are built. */
  def hasLeds: Boolean = leds == 1

  /** Some registers are written bit by bit (FMMU-10). */
  def hasBitWrites: Boolean = hasBitwiseFmmus && digitalOutputs > 0

  /** The SII interface is built: with an I2C EEPROM, or with one that the host emulates (SII-21). */
  def hasSii: Boolean       = sii > 0
  def hasI2c: Boolean       = sii == 1
  def hasEmulation: Boolean = sii == 2

  /** The MII management interface is built (MI); the PDI may take it over (MI-07). */
  def hasMi: Boolean      = mi > 0
  def hasMiByPdi: Boolean = mi == 2

  /** Links are also found through MII management (LNK-06). */
  def hasMiLinks: Boolean = miLinkDetection == 1

  /** Enhanced link detection is built (LNK-08); it resets PHYs instead of restarting their auto-negotiation
    * (LNK-10).
    */
  def hasEnhancedLinks: Boolean = enhancedLinkDetection == 1
  def resetsPhys: Boolean       = hasEnhancedLinks && fxPorts != 0

  /** Bus and host may ask for a reset of the whole chip (SYS-04). */
  def hasResetRegisters: Boolean = resetRegisters == 1

  /** The bus may protect registers, or all it can write, against its own frames (SYS-02, SYS-03). */
  def hasWriteProtection: Boolean = writeProtection == 1

  /** More than the link input decides on a link. */
  def detectsLinks: Boolean = hasMiLinks || hasEnhancedLinks

  /** The controller accesses PHYs by itself, beside the commands of bus and host. */
  def hasOwnMiAccesses: Boolean = hasMiLinks || (hasEnhancedLinks && !resetsPhys)

  /** The port has a fibre PHY. */
  def isFx(port: Int): Boolean = (fxPorts >> port & 1) == 1

  /** The link input of the port is low while there is a link. */
  def isLinkLow(port: Int): Boolean = (linkLowPorts >> port & 1) == 1

  /** MII management address of a port's PHY (MI-08, MI-09). */
  def phyAddress(port: Int): Int =
    if (phyAddresses >= 0) phyAddresses >> (5 * port) & 31 else (phyAddressOffset + port) % 32

  /** SyncManagers have the sequential mode (SM-32). */
  def hasSequentialMode: Boolean = sequentialMode == 1

  /** SyncManagers have the deactivation delay (SM-29). */
  def hasDeactivationDelay: Boolean = deactivationDelay == 1

  /** The status of SyncManagers tells of open buffers (B-103). */
  def tellsOpenBuffers: Boolean = openBuffers == 1

  /** The host acknowledges by writing what else it acknowledges by reading (PDI-09, SM-36). */
  def acknowledgesByWrite: Boolean = acknowledgeByWrite == 1

  /** Receive times are stamped by a local clock (DC-05). */
  def hasClocks: Boolean = clocks > 0

  /** The local time is brought to that of a reference clock (DC-16 to DC-25). */
  def hasSystemTime: Boolean = clocks > 1

  /** SYNC signals have the extended activation (DC-36). */
  def hasEnhancedSync: Boolean = enhancedSync == 1

  /** Receive times of frames on their way back are means (B-100). */
  def hasMeanWays: Boolean = meanWays == 1

  /** The local times of changes of SyncManagers' buffers are kept (DC-42). */
  def hasEventTimes: Boolean = eventTimes == 1

  /** The host has the time loop, not the bus (DC-24). */
  def hasTimeByPdi: Boolean = timeByPdi == 1

  /** The speed of the local clock may be set directly (DC-25). */
  def hasDirectSpeed: Boolean = directSpeed == 1

  /** The units of distributed clocks are there as the EEPROM says (DC-06). */
  def savesClockPower: Boolean = clockPowerSaving == 1

  /** There are pins of SYNC or LATCH signals. */
  def hasClockPins: Boolean = syncSignals + latchSignals > 0

  /** Bytes of a time (DC-01): 4 or 8. */
  def clockBytes: Int = clockBits / 8

  /** What the local clock counts per core cycle, in ns: 8, 10, 20 or 40 (DC-02). */
  def clockPeriodNs: Int = 1000 / coreClockMhz

  /** A smoke detector and the reporting of its events in passing frames are built (ALARM). */
  def hasAlarm: Boolean = alarm == 1

  /** Some registers live in block RAM: 512 bytes behind user RAM. */
  def hasRegisterRam: Boolean =
    hasAlarm || hasSystemTime || fmmus > 0 || syncManagers > 0 || hasApplicationLayer || hasSii

  /** Register bytes one frame may write; more are refused without a working counter. The log must be
    * committed before the next frame can reach a register: 87 nibble slots lie between, of which 64 are used.
    */
  def writeLogDepth: Int =
    if (registerWritesPerFrame > 0) registerWritesPerFrame else (64 * cyclesPerNibble) min 256

  /** The longest log that can be committed in time; SyncManagers come before it, one per cycle, and FMMUs are
    * searched before the datagram's first byte.
    */
  def longestWriteLog: Int =
    (if (fmmus > 0) 78 else 87) * cyclesPerNibble - (if (syncManagers > 0) 20 else 0)

  /** Byte 0x0006 as reported, KiB. */
  def ramSizeReported: Int = if (reportedRamKiB >= 0) reportedRamKiB else ramKiB

  /** Byte 0x0007 as reported: two bits per port, 11 = MII or RMII. */
  def portDescriptor: Int = if (reportedPorts >= 0) reportedPorts else (1 << (2 * ports)) - 1

  /** Word 0x0008 as reported (GEN-07); derived: bit 12, sequential mode of SyncManagers; bit 8, extended
    * activation of SYNC signals; bit 7, separate counting of forwarded errors; bit 6, enhanced link
    * detection; bits 2 and 3, distributed clocks and those of 64 bits; bit 0, FMMUs that map whole bytes
    * only.
    */
  def features: Int =
    if (reportedFeatures >= 0) reportedFeatures
    else
      Seq(
        0x1000 -> hasSequentialMode,
        0x0100 -> hasEnhancedSync,
        0x0080 -> true,
        0x0040 -> hasEnhancedLinks,
        0x0008 -> (hasClocks && clockBits == 64),
        0x0004 -> hasClocks,
        0x0001 -> (fmmus > 0 && !hasBitwiseFmmus)
      ).collect { case (bit, true) => bit }.sum

  /** Verilog name of the top module. */
  def topName: String = preset.replaceAll("[^A-Za-z0-9]", "_")
}

/** Everything about one parameter: its name, text, unit, range, and how to read and change it in an
  * [[EscParams]].
  *
  * @param hex
  *   it is written hexadecimal
  * @param roles
  *   values of the parameter `role` for which it has an effect
  * @param master
  *   the same parameter as it is in a master, if it has another text or range there
  */
final case class ParamInfo(
    name: String,
    text: String,
    unit: String,
    range: String,
    allowed: Int => Boolean,
    get: EscParams => Int,
    set: (EscParams, Int) => EscParams,
    hex: Boolean = false,
    roles: Set[Int] = Set(0, 1),
    master: Option[ParamInfo] = None
) {

  /** This parameter as it is in a controller with this `role`. */
  def in(role: Int): ParamInfo = if (role == 1) master.getOrElse(this) else this

  /** The range with its unit, as sentences name it. */
  def rangeInWords: String = range + (if (unit == "code") "" else s" $unit")

  /** The value of this parameter in `p` as a person writes it. */
  def show(p: EscParams): String = if (hex && get(p) >= 0) f"0x${get(p)}%04x" else get(p).toString
}

/** The table of all parameters: the only place where a parameter's text, unit and range stand. */
object ParamTable {
  private def oneOf(values: Int*): (String, Int => Boolean) = (values.mkString(", "), values.contains(_))
  private def between(low: Int, high: Int): (String, Int => Boolean) =
    (s"$low to $high", v => v >= low && v <= high)
  private def reported(high: Int): (String, Int => Boolean) =
    (s"-1 (derived) or 0 to $high", v => v >= -1 && v <= high)

  private def info(
      name: String,
      text: String,
      unit: String,
      range: (String, Int => Boolean),
      hex: Boolean = false
  )(
      get: EscParams => Int
  )(set: (EscParams, Int) => EscParams) = ParamInfo(name, text, unit, range._1, range._2, get, set, hex)

  /** Parameters that have an effect in a master, and those that have none in a slave. */
  private val ofMasters = Set(
    "role",
    "dataBusWidth",
    "maxSubTelegrams",
    "coreClockMhz",
    "maxSlaves",
    "linePorts",
    "txShift",
    "rmiiPorts",
    "escType",
    "escRevision",
    "escBuild"
  )
  private val notOfSlaves = Set("maxSlaves", "linePorts")

  /** What is different in a master. */
  private val inMasters: Map[String, ParamInfo => ParamInfo] = {
    def text(text: String)(i: ParamInfo) = i.copy(text = text)
    val (clocks, isClock)                = oneOf(50, 100, 125)
    val (threePorts, isOfThree)          = between(0, 0x7)
    Map(
      "dataBusWidth" -> text("bits moved per access of the host") _,
      "maxSubTelegrams" -> (i => {
        val (range, isEnough) = between(EscParams.LeastOfMaster, 128)
        i.copy(
          text = "datagrams that the master puts into one frame; above 16 they are 16",
          range = range,
          allowed = isEnough
        )
      }),
      "coreClockMhz" -> (_.copy(range = clocks, allowed = isClock)),
      "rmiiPorts"    -> (_.copy(range = threePorts, allowed = isOfThree)),
      "escType"      -> text("identity: type, 0x00 of the host's registers") _,
      "escRevision"  -> text("identity: revision, 0x01 of the host's registers") _,
      "escBuild"     -> text("identity: build, 0x02:0x03 of the host's registers") _
    )
  }

  private def rolesOf(name: String): Set[Int] =
    Map(0 -> !notOfSlaves(name), 1 -> ofMasters(name)).collect { case (role, true) => role }.toSet

  val all: Seq[ParamInfo] = Seq[ParamInfo](
    info("role", "0: slave controller; 1: master of a line of alarm slaves", "code", between(0, 1))(_.role)(
      (p, v) => p.copy(role = v)
    ),
    info(
      "dataBusWidth",
      "bits moved per access between frame processor, memory and host",
      "bit",
      oneOf(8, 16, 32)
    )(
      _.dataBusWidth
    )((p, v) => p.copy(dataBusWidth = v)),
    info(
      "maxSubTelegrams",
      "datagrams of one frame that are processed; further ones pass",
      "datagrams",
      between(1, 128)
    )(
      _.maxSubTelegrams
    )((p, v) => p.copy(maxSubTelegrams = v)),
    info("nodeIdWidth", "implemented bits of station address and alias", "bit", between(4, 16))(
      _.nodeIdWidth
    )((p, v) => p.copy(nodeIdWidth = v)),
    info("ports", "ports", "ports", between(1, 4))(_.ports)((p, v) => p.copy(ports = v)),
    info("coreClockMhz", "core clock", "MHz", oneOf(25, 50, 100, 125))(_.coreClockMhz)((p, v) =>
      p.copy(coreClockMhz = v)
    ),
    info("ramKiB", "process data RAM from 0x1000", "KiB", between(0, 60))(_.ramKiB)((p, v) =>
      p.copy(ramKiB = v)
    ),
    info("fmmus", "FMMUs, 0x0600 on", "FMMUs", between(0, 16))(_.fmmus)((p, v) => p.copy(fmmus = v)),
    info("fmmuBitwise", "1: FMMUs map single bits; 0: whole bytes only", "switch", between(0, 1))(
      _.fmmuBitwise
    )((p, v) => p.copy(fmmuBitwise = v)),
    info(
      "readWriteOffset",
      "1: commands that read and write do so at two places, as far apart as the bus has written",
      "switch",
      between(0, 1)
    )(_.readWriteOffset)((p, v) => p.copy(readWriteOffset = v)),
    info("syncManagers", "SyncManagers, 0x0800 on", "SyncManagers", between(0, 16))(_.syncManagers)((p, v) =>
      p.copy(syncManagers = v)
    ),
    info(
      "sequentialMode",
      "1: SyncManagers can ask for their buffers to be written byte after byte",
      "switch",
      between(0, 1)
    )(_.sequentialMode)((p, v) => p.copy(sequentialMode = v)),
    info(
      "deactivationDelay",
      "1: the host can read the last buffer of a SyncManager that the master has switched off",
      "switch",
      between(0, 1)
    )(_.deactivationDelay)((p, v) => p.copy(deactivationDelay = v)),
    info(
      "openBuffers",
      "1: the status of SyncManagers tells which of their buffers are open",
      "switch",
      between(0, 1)
    )(_.openBuffers)((p, v) => p.copy(openBuffers = v)),
    info(
      "acknowledgeByWrite",
      "1: the host acknowledges events and closes the buffers it has read by a write, not by reading",
      "switch",
      between(0, 1)
    )(_.acknowledgeByWrite)((p, v) => p.copy(acknowledgeByWrite = v)),
    info(
      "applicationLayer",
      "1: AL control, status and code, event requests and masks",
      "switch",
      between(0, 1)
    )(
      _.applicationLayer
    )((p, v) => p.copy(applicationLayer = v)),
    info("watchdogs", "1: watchdogs of process data and PDI", "switch", between(0, 1))(_.watchdogs)((p, v) =>
      p.copy(watchdogs = v)
    ),
    info("leds", "1: outputs for RUN, ERR and link/activity LEDs", "switch", between(0, 1))(_.leds)((p, v) =>
      p.copy(leds = v)
    ),
    info(
      "digitalOutputs",
      "digital outputs behind a bus-driven register, 0x0F00 on, driven while the process data watchdog runs",
      "bytes",
      between(0, 4)
    )(_.digitalOutputs)((p, v) => p.copy(digitalOutputs = v)),
    info(
      "clocks",
      "distributed clocks: 0 none; 1 receive times of frames, by which a master measures delays; 2 and a " +
        "system time that follows a reference clock",
      "code",
      between(0, 2)
    )(_.clocks)((p, v) => p.copy(clocks = v)),
    info("clockBits", "bits of a time of distributed clocks", "bit", oneOf(32, 64))(_.clockBits)((p, v) =>
      p.copy(clockBits = v)
    ),
    info("syncSignals", "SYNC signals: SYNC0, or SYNC0 and SYNC1", "signals", between(0, 2))(_.syncSignals)(
      (p, v) => p.copy(syncSignals = v)
    ),
    info("latchSignals", "LATCH signals: LATCH0, or LATCH0 and LATCH1", "signals", between(0, 2))(
      _.latchSignals
    )((p, v) => p.copy(latchSignals = v)),
    info(
      "syncPulse",
      "length of a pulse of SYNC signals until an EEPROM tells it; 0: until the host reads its status",
      "10 ns",
      between(0, 0xffff)
    )(_.syncPulse)((p, v) => p.copy(syncPulse = v)),
    info(
      "clockPowerSaving",
      "1: SYNC and LATCH units are off, and with both of them the system time, until the EEPROM switches " +
        "them on",
      "switch",
      between(0, 1)
    )(_.clockPowerSaving)((p, v) => p.copy(clockPowerSaving = v)),
    info(
      "enhancedSync",
      "1: SYNC signals become active by their start time, which is completed and checked, and give single " +
        "pulses by hand",
      "switch",
      between(0, 1)
    )(_.enhancedSync)((p, v) => p.copy(enhancedSync = v)),
    info(
      "meanWays",
      "1: frames that come back have the receive time they have on the mean, for masters that measure " +
        "delays with one frame",
      "switch",
      between(0, 1)
    )(_.meanWays)((p, v) => p.copy(meanWays = v)),
    info(
      "eventTimes",
      "1: the times at which buffers of SyncManagers have changed last are kept",
      "switch",
      between(0, 1)
    )(_.eventTimes)((p, v) => p.copy(eventTimes = v)),
    info(
      "timeByPdi",
      "1: the host sets and compares the system time, with the time of LATCH0, in place of the bus",
      "switch",
      between(0, 1)
    )(_.timeByPdi)((p, v) => p.copy(timeByPdi = v)),
    info(
      "directSpeed",
      "1: the speed of the local clock may be set directly",
      "switch",
      between(0, 1)
    )(_.directSpeed)((p, v) => p.copy(directSpeed = v)),
    info(
      "alarm",
      "1: smoke detector whose events are appended to passing frames",
      "switch",
      between(0, 1)
    )(_.alarm)((p, v) => p.copy(alarm = v)),
    info(
      "maxSlaves",
      "slaves the master of a line can list",
      "slaves",
      oneOf(2, 4, 8, 16, 32, 64, 128)
    )(_.maxSlaves)((p, v) => p.copy(maxSlaves = v)),
    info(
      "linePorts",
      "ports of a master to its slaves: 1 a line; 2 a ring, whose end comes back to the second port",
      "ports",
      between(1, 2)
    )(_.linePorts)((p, v) => p.copy(linePorts = v)),
    info(
      "sii",
      "SII EEPROM: 0 none, the local side opens the RAM by a pin; 1 I2C EEPROM; 2 emulated by the host",
      "code",
      between(0, 2)
    )(_.sii)((p, v) => p.copy(sii = v)),
    info("siiClockKhz", "clock of the I2C EEPROM", "kHz", between(10, 1000))(_.siiClockKhz)((p, v) =>
      p.copy(siiClockKhz = v)
    ),
    info("siiStartUs", "wait between reset and the first access to the EEPROM", "us", between(1, 100000))(
      _.siiStartUs
    )((p, v) => p.copy(siiStartUs = v)),
    info(
      "registerWritesPerFrame",
      "register bytes one frame may write (0: as many as the core clock can commit, at most 256)",
      "bytes",
      ("0 (derived) or 16 to 348", v => v == 0 || (v >= 16 && v <= 348))
    )(_.registerWritesPerFrame)((p, v) => p.copy(registerWritesPerFrame = v)),
    info("txShift", "delay of TXD and TX_EN against the nibble slot", "core cycles", between(0, 4))(
      _.txShift
    )((p, v) => p.copy(txShift = v)),
    info(
      "rmiiPorts",
      "ports whose PHY has RMII with a reference clock of 50 MHz instead of MII: bit y for port y",
      "bits",
      between(0, 0xf),
      hex = true
    )(_.rmiiPorts)((p, v) => p.copy(rmiiPorts = v)),
    info(
      "mi",
      "MII management interface to the PHYs: 0 none; 1 of the bus; 2 the host may take it over",
      "code",
      between(0, 2)
    )(_.mi)((p, v) => p.copy(mi = v)),
    info(
      "phyAddressOffset",
      "MII management address of port 0; further ports follow it",
      "address",
      between(0, 31)
    )(
      _.phyAddressOffset
    )((p, v) => p.copy(phyAddressOffset = v)),
    info(
      "phyAddresses",
      "MII management addresses of ports 0 to 3, five bits each from the lowest up",
      "code",
      ("-1 (by phyAddressOffset) or 0x0 to 0xfffff", v => v >= -1 && v <= 0xfffff),
      hex = true
    )(_.phyAddresses)((p, v) => p.copy(phyAddresses = v)),
    info(
      "miLinkDetection",
      "1: PHYs are configured and asked for their links through MII management",
      "switch",
      between(0, 1)
    )(_.miLinkDetection)((p, v) => p.copy(miLinkDetection = v)),
    info(
      "enhancedLinkDetection",
      "1: a port with many RX_ER closes, and its PHY begins anew",
      "switch",
      between(0, 1)
    )(_.enhancedLinkDetection)((p, v) => p.copy(enhancedLinkDetection = v)),
    info(
      "linkLowPorts",
      "ports whose link input is low while there is a link: bit y for port y",
      "bits",
      between(0, 0xf),
      hex = true
    )(_.linkLowPorts)((p, v) => p.copy(linkLowPorts = v)),
    info(
      "fxPorts",
      "ports whose PHY is on fibre (100BASE-FX): bit y for port y",
      "bits",
      between(0, 0xf),
      hex = true
    )(
      _.fxPorts
    )((p, v) => p.copy(fxPorts = v)),
    info("resetRegisters", "1: bus and host may ask for a reset of the whole chip", "switch", between(0, 1))(
      _.resetRegisters
    )((p, v) => p.copy(resetRegisters = v)),
    info(
      "writeProtection",
      "1: the bus may protect registers, and all it can write, against frames that do not ask to write",
      "switch",
      between(0, 1)
    )(_.writeProtection)((p, v) => p.copy(writeProtection = v)),
    info("temporaryLoopMs", "how long a temporary loop setting (0x0100[1]) lasts", "ms", between(1, 2000))(
      _.temporaryLoopMs
    )((p, v) => p.copy(temporaryLoopMs = v)),
    info("escType", "identity: type, 0x0000", "code", between(0, 0xff), hex = true)(_.escType)((p, v) =>
      p.copy(escType = v)
    ),
    info("escRevision", "identity: revision, 0x0001", "code", between(0, 0xff), hex = true)(_.escRevision)(
      (p, v) => p.copy(escRevision = v)
    ),
    info("escBuild", "identity: build, 0x0002:0x0003", "code", between(0, 0xffff), hex = true)(_.escBuild)(
      (p, v) => p.copy(escBuild = v)
    ),
    info("reportedRamKiB", "RAM size as 0x0006 reports it (replay identities only)", "KiB", reported(60))(
      _.reportedRamKiB
    )((p, v) => p.copy(reportedRamKiB = v)),
    info(
      "reportedPorts",
      "port descriptor as 0x0007 reports it (replay identities only)",
      "code",
      reported(0xff),
      true
    )(
      _.reportedPorts
    )((p, v) => p.copy(reportedPorts = v)),
    info("reportedFeatures", "features as 0x0008:0x0009 report them", "code", reported(0xffff), hex = true)(
      _.reportedFeatures
    )((p, v) => p.copy(reportedFeatures = v))
  ).map(i => i.copy(roles = rolesOf(i.name))).map(i => i.copy(master = inMasters.get(i.name).map(_(i))))

  /** The parameter with this name. */
  def named(name: String): Option[ParamInfo] = all.find(_.name == name)
}

object EscParams {

  /** Datagrams of a master's frame, at least: one acknowledgement must fit beside a survey, four reads, two
    * orders, the host's datagram, and a confirmation (LM-01).
    */
  val LeastOfMaster = 10

  /** Why `p` cannot be built: one sentence per problem, naming the parameter, its value and the allowed
    * range. Empty = fine.
    */
  def problems(p: EscParams): Seq[String] = {
    val single = ParamTable.all.filterNot(i => i.in(p.role).allowed(i.get(p))).map { i =>
      val here = i.in(p.role)
      val role = if (here.range == i.range) "" else s" if role is ${p.role}"
      s"${i.name} is ${i.show(p)} but must be ${here.rangeInWords}$role."
    }
    if (single.nonEmpty) single
    else
      Option
        .when(p.txShift >= p.cyclesPerNibble)(
          s"txShift is ${p.txShift} but must be 0 to ${p.cyclesPerNibble - 1} core cycles at " +
            s"coreClockMhz ${p.coreClockMhz}."
        )
        .toSeq ++ rmii(p) ++ (if (p.isMaster) ofMaster(p) else ofSlave(p))
  }

  /** Half a nibble is a whole number of core cycles. */
  private def rmii(p: EscParams): Option[String] = {
    val all = (1 << p.portCount) - 1
    if (p.rmiiPorts > all)
      Some(f"rmiiPorts is 0x${p.rmiiPorts}%x but must be 0x0 to 0x$all%x with ${p.portCount} ports.")
    else
      Option.when(p.rmiiPorts != 0 && p.coreClockMhz % 50 != 0)(
        f"rmiiPorts is 0x${p.rmiiPorts}%x but must be 0x0 at coreClockMhz ${p.coreClockMhz}."
      )
  }

  private def ofSlave(p: EscParams): Seq[String] = Seq(
    Option.when(p.writeLogDepth > p.longestWriteLog)(
      s"registerWritesPerFrame is ${p.registerWritesPerFrame} but must be 0 (derived) or 16 to " +
        s"${p.longestWriteLog} bytes at coreClockMhz ${p.coreClockMhz}."
    ),
    scanned("fmmus", p.fmmus, p),
    scanned("syncManagers", p.syncManagers, p),
    Seq(
      "sequentialMode"    -> p.sequentialMode,
      "deactivationDelay" -> p.deactivationDelay,
      "openBuffers"       -> p.openBuffers
    ).collectFirst {
      case (name, value) if value > 0 && p.syncManagers == 0 =>
        s"$name is $value but must be 0 if syncManagers is 0."
    },
    Option.when(p.hasReadWriteOffset && !p.translates)(
      "readWriteOffset is 1 but must be 0 if fmmus and syncManagers are 0."
    ),
    Option.when(p.hasSystemTime && p.coreClockMhz < 100)(
      s"clocks is ${p.clocks} but must be 0 to 1 at coreClockMhz ${p.coreClockMhz}."
    ),
    Seq("syncSignals" -> p.syncSignals, "latchSignals" -> p.latchSignals).collectFirst {
      case (name, value) if value > 0 && !p.hasSystemTime =>
        s"$name is $value but must be 0 if clocks is ${p.clocks}."
    },
    Option.when(p.hasEnhancedSync && p.syncSignals == 0)(
      "enhancedSync is 1 but must be 0 if syncSignals is 0."
    ),
    Option.when(p.hasMeanWays && !p.hasClocks)("meanWays is 1 but must be 0 if clocks is 0."),
    Option.when(p.hasMeanWays && p.ports == 1)("meanWays is 1 but must be 0 if ports is 1."),
    Option.when(p.hasEventTimes && !p.hasClocks)("eventTimes is 1 but must be 0 if clocks is 0."),
    Option.when(p.hasEventTimes && p.syncManagers == 0)(
      "eventTimes is 1 but must be 0 if syncManagers is 0."
    ),
    Option.when(p.hasTimeByPdi && p.latchSignals == 0)("timeByPdi is 1 but must be 0 if latchSignals is 0."),
    Option.when(p.hasDirectSpeed && !p.hasSystemTime)(
      s"directSpeed is 1 but must be 0 if clocks is ${p.clocks}."
    ),
    Option.when(p.acknowledgesByWrite && !p.hasApplicationLayer && !p.hasAlarm && !p.hasClockPins)(
      "acknowledgeByWrite is 1 but must be 0 if applicationLayer, alarm, syncSignals and latchSignals are 0."
    ),
    Option.when(p.savesClockPower && !p.hasClockPins)(
      "clockPowerSaving is 1 but must be 0 if syncSignals and latchSignals are 0."
    ),
    Option.when(p.savesClockPower && !p.hasSii)("clockPowerSaving is 1 but must be 0 if sii is 0."),
    Option.when(p.hasWatchdogs && !p.hasApplicationLayer)(
      "watchdogs is 1 but must be 0 if applicationLayer is 0."
    ),
    Option.when(p.hasLeds && !p.hasApplicationLayer)("leds is 1 but must be 0 if applicationLayer is 0."),
    Option.when(p.syncManagers > 0 && !p.hasApplicationLayer)(
      s"syncManagers is ${p.syncManagers} but must be 0 if applicationLayer is 0."
    )
  ).flatten ++ phys(p)

  /** PHYs: parameters of ports that there are and of units that are built, each PHY with an address of its
    * own (LNK-12).
    */
  private def phys(p: EscParams): Seq[String] = {
    val all = (1 << p.ports) - 1
    Seq(
      Seq("linkLowPorts" -> p.linkLowPorts, "fxPorts" -> p.fxPorts).collect {
        case (name, value) if value > all =>
          f"$name is 0x$value%x but must be 0x0 to 0x$all%x with ${p.ports} ports."
      },
      Option.when(p.fxPorts != 0 && p.fxPorts <= all && !p.detectsLinks)(
        f"fxPorts is 0x${p.fxPorts}%x but must be 0x0 if miLinkDetection and enhancedLinkDetection are 0."
      ),
      if (p.hasMi) addressing(p)
      else
        Seq(
          "miLinkDetection"       -> p.miLinkDetection,
          "enhancedLinkDetection" -> p.enhancedLinkDetection,
          "phyAddressOffset"      -> p.phyAddressOffset
        ).collect { case (name, value) if value != 0 => s"$name is $value but must be 0 if mi is 0." } ++
          Option.when(p.phyAddresses >= 0)(
            f"phyAddresses is 0x${p.phyAddresses}%04x but must be -1 if mi is 0."
          )
    ).flatten
  }

  private def addressing(p: EscParams): Seq[String] = {
    val shown = f"0x${p.phyAddresses}%04x"
    Seq(
      Option.when(p.phyAddresses >= 0 && p.phyAddressOffset != 0)(
        s"phyAddressOffset is ${p.phyAddressOffset} but must be 0 if phyAddresses is $shown."
      ),
      Option.when((0 until p.ports).map(p.phyAddress).distinct.size < p.ports)(
        s"phyAddresses is $shown but must have ${p.ports} different addresses for as many ports."
      )
    ).flatten
  }

  /** FMMUs and SyncManagers are looked through one per core cycle, in two halves, while a byte passes. */
  private def scanned(name: String, value: Int, p: EscParams): Option[String] =
    Option.when(value > 0 && p.coreClockMhz < 100)(
      s"$name is $value but must be 0 at coreClockMhz ${p.coreClockMhz}."
    )

  /** A master has two ports, and nothing of a slave. */
  private def ofMaster(p: EscParams): Seq[String] = {
    val nothing = Seq(
      "ramKiB",
      "fmmus",
      "readWriteOffset",
      "syncManagers",
      "sequentialMode",
      "deactivationDelay",
      "openBuffers",
      "acknowledgeByWrite",
      "applicationLayer",
      "watchdogs",
      "leds",
      "digitalOutputs",
      "clocks",
      "syncSignals",
      "latchSignals",
      "clockPowerSaving",
      "enhancedSync",
      "meanWays",
      "eventTimes",
      "timeByPdi",
      "directSpeed",
      "alarm",
      "sii",
      "resetRegisters",
      "writeProtection",
      "mi",
      "phyAddressOffset",
      "miLinkDetection",
      "enhancedLinkDetection",
      "linkLowPorts",
      "fxPorts"
    )
    Option.when(p.ports != 2)(s"ports is ${p.ports} but must be 2 if role is 1.").toSeq ++
      nothing.flatMap(ParamTable.named).filter(_.get(p) != 0).map { i =>
        s"${i.name} is ${i.get(p)} but must be 0 if role is 1."
      } ++ Option.when(p.phyAddresses >= 0)(
        f"phyAddresses is 0x${p.phyAddresses}%04x but must be -1 if role is 1."
      )
  }

  /** `p` if it can be built, else the first problem. */
  def check(p: EscParams): Either[String, EscParams] = problems(p).headOption.toLeft(p)
}
