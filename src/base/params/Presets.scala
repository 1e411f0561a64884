package flyframe.params

/** A named parameter set. `note` is printed in the list of presets and in the header of all Verilog that
  * reports its identity.
  */
final case class Preset(params: EscParams, text: String, note: Option[String] = None) {
  def name: String = params.preset
}

/** The presets: every named parameter set stands here and nowhere else. */
object Presets {
  private val replayOnly = Some(
    "Reports another maker's identity: for replaying recorded traffic only, never for a product."
  )

  private val slave = EscParams(
    preset = "slave",
    ramKiB = 8,
    fmmus = 8,
    fmmuBitwise = 1,
    syncManagers = 8,
    applicationLayer = 1,
    watchdogs = 1,
    leds = 1,
    sii = 1
  )

  val all: Seq[Preset] = Seq(
    Preset(
      EscParams(preset = "frame-processor", ramKiB = 0),
      "smallest useful: two ports, registers and user RAM, no process data RAM"
    ),
    Preset(
      EscParams(preset = "cyclone4-min", ramKiB = 1),
      "smallest with process data: two ports, 1 KiB RAM, for an EP4CE6"
    ),
    Preset(
      slave,
      "complete slave: two ports, 8 FMMUs, 8 SyncManagers, 8 KiB RAM, I2C EEPROM; no distributed clocks"
    ),
    Preset(
      EscParams(
        preset = "digital-io",
        ramKiB = 1,
        fmmus = 2,
        fmmuBitwise = 1,
        syncManagers = 5,
        applicationLayer = 1,
        watchdogs = 1,
        leds = 1,
        sii = 1,
        hostInterface = 6,
        digitalOutputs = 4,
        digitalInputs = 4
      ),
      "digital I/O without a processor: two ports, 32 outputs, 32 inputs, 1 KiB RAM, I2C EEPROM"
    ),
    Preset(
      EscParams(preset = "alarm-slave", alarm = 1, ramKiB = 1, maxSubTelegrams = 128),
      "smoke-alarm slave: cyclone4-min with a detector whose events are appended to passing frames"
    ),
    Preset(
      EscParams(preset = "alarm-master", role = 1, coreClockMhz = 50, ramKiB = 0, escType = 0xf2),
      "smoke-alarm master: runs a line of alarm slaves, reports to a server by UDP over its second port"
    ),
    Preset(
      EscParams(
        preset = "ring-bus",
        role = 2,
        nodeIdWidth = 7,
        ring = 1,
        ramKiB = 0,
        escType = EscParams.NodeType
      ),
      "node of a fibre ring that is one CAN bus: a CAN controller, two optical ports, one break survived"
    ),
    Preset(
      EscParams(
        preset = "ring-node",
        role = 2,
        nodeIdWidth = 7,
        ring = 2,
        ramKiB = 0,
        escType = EscParams.NodeType
      ),
      "node of a fibre ring of up to 125 nodes and 100 km: ring-bus with relay mode, chosen by the host"
    ),
    Preset(
      EscParams(
        preset = "ring-node-tp",
        role = 2,
        nodeIdWidth = 7,
        ring = 2,
        canPorts = 2,
        bridge = 1,
        ramKiB = 0,
        escType = EscParams.NodeType
      ),
      "ring-node with a second CAN controller on a twisted pair, and a bridge between both"
    ),
    Preset(
      EscParams(
        preset = "ring-server",
        role = 2,
        nodeIdWidth = 7,
        coreClockMhz = 50,
        ring = 2,
        plant = 1,
        ramKiB = 0,
        escType = EscParams.NodeType
      ),
      "ring-node at 50 MHz with a port to the plant network: messages to it go to a server by UDP"
    ),
    Preset(
      // Mailbox and process data, a SyncManager for each way: more would be memory that nobody uses.
      slave.copy(preset = "ring-gateway", ring = 2, syncManagers = 4),
      "slave with a ring-node: process data of a fibre ring under an EtherCAT master"
    ),
    Preset(
      EscParams(
        preset = "et1100",
        ports = 4,
        ramKiB = 8,
        maxSubTelegrams = 128,
        escType = 0x11,
        escBuild = 3,
        fmmus = 8,
        fmmuBitwise = 1,
        syncManagers = 8,
        applicationLayer = 1,
        watchdogs = 1,
        leds = 1,
        sii = 1,
        reportedPorts = 0x3b,
        reportedFeatures = 0x00fc,
        clocks = 2,
        syncSignals = 2,
        latchSignals = 2,
        clockPowerSaving = 1,
        mi = 2,
        enhancedLinkDetection = 1
      ),
      "four ports, 8 FMMUs, 8 SyncManagers, 8 KiB RAM, distributed clocks",
      replayOnly
    ),
    Preset(
      EscParams(
        preset = "et1200",
        ports = 2,
        ramKiB = 1,
        maxSubTelegrams = 128,
        fmmus = 3,
        fmmuBitwise = 1,
        syncManagers = 4,
        applicationLayer = 1,
        watchdogs = 1,
        leds = 1,
        sii = 1,
        escType = 0x12,
        escRevision = 1,
        escBuild = 1,
        reportedPorts = 0x4a,
        reportedFeatures = 0x01fc,
        clocks = 2,
        syncSignals = 2,
        latchSignals = 2,
        enhancedSync = 1,
        clockPowerSaving = 1,
        mi = 1,
        enhancedLinkDetection = 1
      ),
      "two ports, 3 FMMUs, 4 SyncManagers, 1 KiB RAM, distributed clocks",
      replayOnly
    ),
    Preset(
      EscParams(
        preset = "lan9252",
        ports = 2,
        ramKiB = 4,
        maxSubTelegrams = 128,
        fmmus = 3,
        fmmuBitwise = 1,
        syncManagers = 4,
        openBuffers = 1,
        applicationLayer = 1,
        watchdogs = 1,
        leds = 1,
        sii = 1,
        escType = 0xc0,
        escRevision = 2,
        escBuild = 1,
        reportedPorts = 0x1f,
        reportedFeatures = 0x01cc,
        clocks = 2,
        syncSignals = 2,
        latchSignals = 2,
        enhancedSync = 1,
        clockPowerSaving = 1,
        mi = 1,
        enhancedLinkDetection = 1
      ),
      "two ports, 3 FMMUs, 4 SyncManagers, 4 KiB RAM, distributed clocks",
      replayOnly
    )
  )

  def named(name: String): Option[Preset] = all.find(_.name == name)
  def default: Preset                     = all(1)

  /** A slave that has every register there is, for the list of them. */
  def allRegisters: EscParams = named("slave").get.params.copy(
    ports = 4,
    digitalOutputs = 4,
    generalOutputs = 8,
    generalInputs = 8,
    clocks = 2,
    syncSignals = 2,
    latchSignals = 2,
    enhancedSync = 1,
    eventTimes = 1,
    directSpeed = 1,
    readWriteOffset = 1,
    sequentialMode = 1,
    deactivationDelay = 1,
    openBuffers = 1,
    acknowledgeByWrite = 1,
    hostInterface = 1,
    alarm = 1,
    mi = 2,
    miLinkDetection = 1,
    enhancedLinkDetection = 1,
    resetRegisters = 1,
    writeProtection = 1
  )

  /** Parameters of the alarm master. */
  def master: EscParams = named("alarm-master").get.params

  /** Parameters of a ring node. */
  def ring: EscParams = named("ring-bus").get.params

  /** A slave with a ring. */
  def gateway: EscParams = named("ring-gateway").get.params

  /** Of one with relay mode, too. */
  def relay: EscParams = named("ring-node").get.params

  /** What must be said about a controller with parameters `p`: the note of the preset whose identity it
    * reports, whatever its own name.
    */
  def note(p: EscParams): Option[String] =
    all.find(preset => preset.note.isDefined && preset.params.escType == p.escType).flatMap(_.note)
}
