package flyframe.params

/** All parameters of one controller: slave, master or ring node. A value, checked by [[EscParams.problems]];
  * behaviour is a function of it.
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
    digitalInputs: Int = 0,
    digitalInputEvent: Int = 0,
    digitalOutputEvent: Int = 0,
    digitalWatchdogLate: Int = 0,
    generalOutputs: Int = 0,
    generalInputs: Int = 0,
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
    hostInterface: Int = 0,
    spiMode: Int = 3,
    spiLateSample: Int = 0,
    spiSelHigh: Int = 0,
    busWriteEarly: Int = 0,
    busBusyEarly: Int = 0,
    busBusyDriver: Int = 0,
    busReadDelay: Int = 0,
    busReadAll: Int = 0,
    busReadHigh: Int = 0,
    busByteEnableHigh: Int = 0,
    alarm: Int = 0,
    maxSlaves: Int = 64,
    linePorts: Int = 1,
    ring: Int = 0,
    canPorts: Int = 1,
    demodulator: Int = 0,
    toneDominantKhz: Int = 25000,
    toneSearchKhz: Int = 5000,
    toneRecessiveKhz: Int = 1000,
    rxFrames: Int = 64,
    filters: Int = 16,
    bridge: Int = 0,
    plant: Int = 0,
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

  /** A node of a fibre ring (NODE) instead of a slave controller. */
  def isRing: Boolean = role == 2

  /** There is a fibre ring: that of a node, or one under a slave (GW-01). */
  def hasRing: Boolean = ring > 0

  /** The node of a slave's ring: what the slave has of a node, behind a plain host port. */
  def ringNode: EscParams = EscParams(
    preset = s"$preset-node",
    role = 2,
    dataBusWidth = dataBusWidth,
    nodeIdWidth = 7,
    coreClockMhz = coreClockMhz,
    ramKiB = 0,
    ring = ring,
    canPorts = canPorts,
    demodulator = demodulator,
    toneDominantKhz = toneDominantKhz,
    toneSearchKhz = toneSearchKhz,
    toneRecessiveKhz = toneRecessiveKhz,
    rxFrames = rxFrames,
    filters = filters,
    bridge = bridge,
    escType = EscParams.NodeType
  )

  /** Ports with a PHY: of a master those to the slaves, and one to the plant network; of a ring node that
    * one.
    */
  def portCount: Int = if (isRing) plant else if (isMaster) linePorts + 1 else ports

  /** A node has relay mode beside bus mode. */
  def hasRelay: Boolean = ring == 2

  /** A ring node has a port to the plant network. */
  def hasPlant: Boolean = plant == 1

  /** What modems and ports of a node are built with. */
  def fibre: FibreParams =
    FibreParams(coreClockMhz, toneDominantKhz, toneSearchKhz, toneRecessiveKhz, demodulator)

  /** What the CAN ports of a node are built with. */
  def can: CanParams =
    CanParams(rxFrames, filters, coreClockMhz = coreClockMhz, bridge = bridge == 1, hostBytes = lanes)

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

  /** There is no host, but digital outputs and inputs (B-118); AL status follows AL control (AL-07). */
  def isDigitalIo: Boolean = hostInterface == 6

  /** Errors of the host's interface are counted (ERR-11): at a plain port there are none. */
  def countsHostErrors: Boolean = hostInterface > 0 && !isDigitalIo && role == 0

  /** Writes to the digital outputs trigger the process data watchdog, where no SyncManager can (B-118). */
  def outputsTrigger: Boolean = digitalOutputs > 0 && syncManagers == 0

  /** A host that accesses bytes at its own pace, and is not told to wait. */
  def hostCannotWait: Boolean = hostInterface == 4

  /** There are events or buffers that the host acknowledges. */
  def isAcknowledged: Boolean = hasApplicationLayer || hasAlarm || hasClockPins

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
    hasAlarm || hasSystemTime || fmmus > 0 || syncManagers > 0 || (hasApplicationLayer && !isDigitalIo) ||
      hasSii

  /** Register bytes one frame may write; more are refused without a working counter. The log must be
    * committed before the next frame can reach a register: 87 nibble slots lie between, of which 64 are used.
    */
  def writeLogDepth: Int =
    if (registerWritesPerFrame > 0) registerWritesPerFrame
    else (64 * cyclesPerNibble) min 256 min longestWriteLog

  /** The longest log that can be committed in time; SyncManagers come before it, one per cycle, and FMMUs are
    * searched before the datagram's first byte. A host that cannot wait takes five cycles of 32.
    */
  def longestWriteLog: Int = {
    val cycles = (if (fmmus > 0) 78 else 87) * cyclesPerNibble - (if (syncManagers > 0) 20 else 0)
    if (hostCannotWait) cycles * 27 / 32 else cycles
  }

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

object EscParams {

  /** Datagrams of a master's frame, at least: one acknowledgement must fit beside a survey, four reads, two
    * orders, the host's datagram, and a confirmation (LM-01).
    */
  val LeastOfMaster = 10

  /** Where the registers of a node begin in the address space of a slave that has a ring (GW-01). */
  val RingSpace = 0x8000

  /** The type that ring nodes report. */
  val NodeType = 0xf3

  /** Why `p` cannot be built: one sentence per problem, naming the parameter, its value and the allowed
    * range. Empty = fine.
    */
  def problems(p: EscParams): Seq[String] = ParamChecks.problems(p)

  /** `p` if it can be built, else the first problem. */
  def check(p: EscParams): Either[String, EscParams] = problems(p).headOption.toLeft(p)
}
