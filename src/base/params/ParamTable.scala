package flyframe.params

/** Everything about one parameter: its name, text, unit, range, and how to read and change it in an
  * [[EscParams]].
  *
  * @param hex
  *   it is written hexadecimal
  * @param roles
  *   values of the parameter `role` for which it has an effect
  * @param elsewhere
  *   the same parameter as it is in controllers of other roles, where it has another text or range
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
    roles: Set[Int] = Set(0, 1, 2),
    elsewhere: Map[Int, ParamInfo] = Map.empty
) {

  /** This parameter as it is in a controller with this `role`. */
  def in(role: Int): ParamInfo = elsewhere.getOrElse(role, this)

  /** The range with its unit, as sentences name it. */
  def rangeInWords: String = range + (if (unit == "code") "" else s" $unit")

  /** The value of this parameter in `p` as a person writes it. */
  def show(p: EscParams): String = if (hex && get(p) >= 0) f"0x${get(p)}%04x" else get(p).toString
}

/** The table of all parameters: the only place where a parameter's text, unit and range stand. */
object ParamTable {
  private[params] def oneOf(values: Int*): (String, Int => Boolean) =
    (values.mkString(", "), values.contains(_))
  private[params] def between(low: Int, high: Int): (String, Int => Boolean) =
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

  private def switch(name: String, text: String) = info(name, text, "switch", between(0, 1)) _

  /** How a host is connected, in words. */
  private[params] val hosts =
    "how the host is connected: 0 a plain synchronous port; 1 Avalon-MM; 2 AXI4-Lite; " +
      "3 Wishbone B4; 4 SPI; 5 an asynchronous microcontroller bus"

  val all: Seq[ParamInfo] = Seq[ParamInfo](
    info(
      "role",
      "0: slave controller; 1: master of a line of alarm slaves; 2: node of a fibre ring",
      "code",
      between(0, 2)
    )(_.role)((p, v) => p.copy(role = v)),
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
    switch("fmmuBitwise", "1: FMMUs map single bits; 0: whole bytes only")(
      _.fmmuBitwise
    )((p, v) => p.copy(fmmuBitwise = v)),
    switch(
      "readWriteOffset",
      "1: commands that read and write do so at two places, as far apart as the bus has written"
    )(_.readWriteOffset)((p, v) => p.copy(readWriteOffset = v)),
    info("syncManagers", "SyncManagers, 0x0800 on", "SyncManagers", between(0, 16))(_.syncManagers)((p, v) =>
      p.copy(syncManagers = v)
    ),
    switch("sequentialMode", "1: SyncManagers can ask for their buffers to be written byte after byte")(
      _.sequentialMode
    )((p, v) => p.copy(sequentialMode = v)),
    switch(
      "deactivationDelay",
      "1: the host can read the last buffer of a SyncManager that the master has switched off"
    )(_.deactivationDelay)((p, v) => p.copy(deactivationDelay = v)),
    switch("openBuffers", "1: the status of SyncManagers tells which of their buffers are open")(
      _.openBuffers
    )((p, v) => p.copy(openBuffers = v)),
    switch(
      "acknowledgeByWrite",
      "1: the host acknowledges events and closes the buffers it has read by a write, not by reading"
    )(_.acknowledgeByWrite)((p, v) => p.copy(acknowledgeByWrite = v)),
    switch("applicationLayer", "1: AL control, status and code, event requests and masks")(
      _.applicationLayer
    )((p, v) => p.copy(applicationLayer = v)),
    switch("watchdogs", "1: watchdogs of process data and PDI")(_.watchdogs)((p, v) => p.copy(watchdogs = v)),
    switch("leds", "1: outputs for RUN, ERR and link/activity LEDs")(_.leds)((p, v) => p.copy(leds = v)),
    info(
      "digitalOutputs",
      "digital outputs behind a bus-driven register, 0x0F00 on, driven while the process data watchdog runs",
      "bytes",
      between(0, 4)
    )(_.digitalOutputs)((p, v) => p.copy(digitalOutputs = v)),
    info(
      "digitalInputs",
      "digital inputs, without a host: written to 0x1000 on",
      "bytes",
      between(0, 4)
    )(_.digitalInputs)((p, v) => p.copy(digitalInputs = v)),
    info(
      "digitalInputEvent",
      "digital inputs are taken: 0 when a frame begins; 1 when their latch pin rises; 2, 3 with SYNC0, SYNC1",
      "code",
      between(0, 3)
    )(_.digitalInputEvent)((p, v) => p.copy(digitalInputEvent = v)),
    info(
      "digitalOutputEvent",
      "digital outputs change, without a host: 0 when a frame has ended; 1 when one has triggered the " +
        "process data watchdog; 2, 3 with SYNC0, SYNC1",
      "code",
      between(0, 3)
    )(_.digitalOutputEvent)((p, v) => p.copy(digitalOutputEvent = v)),
    switch(
      "digitalWatchdogLate",
      "digital outputs fall, without a host: 0 when the process data watchdog expires; 1 with the next event"
    )(_.digitalWatchdogLate)((p, v) => p.copy(digitalWatchdogLate = v)),
    info(
      "generalOutputs",
      "general purpose outputs behind 0x0F10, which bus and host write",
      "bytes",
      between(0, 8)
    )(_.generalOutputs)((p, v) => p.copy(generalOutputs = v)),
    info("generalInputs", "general purpose inputs behind 0x0F18", "bytes", between(0, 8))(_.generalInputs)(
      (p, v) => p.copy(generalInputs = v)
    ),
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
    switch(
      "clockPowerSaving",
      "1: SYNC and LATCH units are off, and with both of them the system time, until the EEPROM switches " +
        "them on"
    )(_.clockPowerSaving)((p, v) => p.copy(clockPowerSaving = v)),
    switch(
      "enhancedSync",
      "1: SYNC signals become active by their start time, which is completed and checked, and give single " +
        "pulses by hand"
    )(_.enhancedSync)((p, v) => p.copy(enhancedSync = v)),
    switch(
      "meanWays",
      "1: frames that come back have the receive time they have on the mean, for masters that measure " +
        "delays with one frame"
    )(_.meanWays)((p, v) => p.copy(meanWays = v)),
    switch("eventTimes", "1: the times at which buffers of SyncManagers have changed last are kept")(
      _.eventTimes
    )((p, v) => p.copy(eventTimes = v)),
    switch(
      "timeByPdi",
      "1: the host sets and compares the system time, with the time of LATCH0, in place of the bus"
    )(_.timeByPdi)((p, v) => p.copy(timeByPdi = v)),
    switch("directSpeed", "1: the speed of the local clock may be set directly")(_.directSpeed)((p, v) =>
      p.copy(directSpeed = v)
    ),
    info(
      "hostInterface",
      s"$hosts; 6 none, digital outputs and inputs",
      "code",
      between(0, 6)
    )(_.hostInterface)((p, v) => p.copy(hostInterface = v)),
    info(
      "spiMode",
      "SPI mode: bit 1 is the level of the clock at rest; bit 0: bits change with the first edge of a pulse",
      "code",
      between(0, 3)
    )(_.spiMode)((p, v) => p.copy(spiMode = v)),
    switch("spiLateSample", "1: MISO changes with the edge at which MOSI is sampled, half a clock later")(
      _.spiLateSample
    )((p, v) => p.copy(spiLateSample = v)),
    switch("spiSelHigh", "1: SPI select is active high")(_.spiSelHigh)((p, v) => p.copy(spiSelHigh = v)),
    switch(
      "busWriteEarly",
      "microcontroller bus: 0 writes are carried out behind their end; 1 at their beginning"
    )(
      _.busWriteEarly
    )((p, v) => p.copy(busWriteEarly = v)),
    switch("busBusyEarly", "microcontroller bus: BUSY begins 0 with read or write; 1 with the chip select")(
      _.busBusyEarly
    )((p, v) => p.copy(busBusyEarly = v)),
    info(
      "busBusyDriver",
      "driver of BUSY: 0 low active; 1 low active, open drain; 2 high active; 3 high active, open source",
      "code",
      between(0, 3)
    )(_.busBusyDriver)((p, v) => p.copy(busBusyDriver = v)),
    info(
      "busReadDelay",
      "core cycles by which the data of a read are there before BUSY ends",
      "core cycles",
      between(0, 3)
    )(_.busReadDelay)((p, v) => p.copy(busReadDelay = v)),
    switch("busReadAll", "1: reads take all bytes of the bus, whatever its byte enables")(_.busReadAll)(
      (p, v) => p.copy(busReadAll = v)
    ),
    switch("busReadHigh", "1: read of the microcontroller bus is active high")(_.busReadHigh)((p, v) =>
      p.copy(busReadHigh = v)
    ),
    switch("busByteEnableHigh", "1: byte enables of the microcontroller bus are active high")(
      _.busByteEnableHigh
    )((p, v) => p.copy(busByteEnableHigh = v)),
    switch("alarm", "1: smoke detector whose events are appended to passing frames")(_.alarm)((p, v) =>
      p.copy(alarm = v)
    ),
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
      "ring",
      "1: two optical ports, and a ring in bus mode between them; 2: relay mode, too",
      "code",
      between(0, 2)
    )(_.ring)((p, v) => p.copy(ring = v)),
    info(
      "canPorts",
      "CAN controllers: 1 on the fibre; 2 and one on a twisted pair",
      "ports",
      between(1, 2)
    )(_.canPorts)((p, v) => p.copy(canPorts = v)),
    info(
      "demodulator",
      "levels of light: 0 by distances between its edges, at once; 1 by their number, every 2 us",
      "code",
      between(0, 1)
    )(_.demodulator)((p, v) => p.copy(demodulator = v)),
    info("toneDominantKhz", "tone of a dominant level", "kHz", between(6400, 25000))(_.toneDominantKhz)(
      (p, v) => p.copy(toneDominantKhz = v)
    ),
    info(
      "toneSearchKhz",
      "tone of a port that hears nothing, 1/8 to 1/4 of toneDominantKhz",
      "kHz",
      between(1600, 5200)
    )(_.toneSearchKhz)((p, v) => p.copy(toneSearchKhz = v)),
    info(
      "toneRecessiveKhz",
      "tone of a recessive level, at most 1/4 of toneSearchKhz",
      "kHz",
      between(400, 1300)
    )(_.toneRecessiveKhz)((p, v) => p.copy(toneRecessiveKhz = v)),
    info("rxFrames", "frames that the FIFO of a CAN port holds", "frames", between(16, 128))(_.rxFrames)(
      (p, v) => p.copy(rxFrames = v)
    ),
    info("filters", "entries of the acceptance filter of a CAN port", "filters", between(4, 32))(_.filters)(
      (p, v) => p.copy(filters = v)
    ),
    switch("bridge", "a host may join both CAN ports: what some filters of one accept, the other sends")(
      _.bridge
    )((p, v) => p.copy(bridge = v)),
    switch("plant", "a port to the plant network, by which a host exchanges datagrams with a server")(
      _.plant
    )((p, v) => p.copy(plant = v)),
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
    switch("miLinkDetection", "1: PHYs are configured and asked for their links through MII management")(
      _.miLinkDetection
    )((p, v) => p.copy(miLinkDetection = v)),
    switch("enhancedLinkDetection", "1: a port with many RX_ER closes, and its PHY begins anew")(
      _.enhancedLinkDetection
    )((p, v) => p.copy(enhancedLinkDetection = v)),
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
    switch("resetRegisters", "1: bus and host may ask for a reset of the whole chip")(
      _.resetRegisters
    )((p, v) => p.copy(resetRegisters = v)),
    switch(
      "writeProtection",
      "1: the bus may protect registers, and all it can write, against frames that do not ask to write"
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
  ).map(ParamRoles(_))

  /** What is told of a controller with parameters `p`: of a ring node its own parameters, of the others all
    * that not only nodes have, and what their ring has if there is one.
    */
  def told(p: EscParams): Seq[ParamInfo] = all.filter { i =>
    if (p.isRing) i.roles(2) else !ParamRoles.isOfNodes(i.name) || (p.hasRing && i.roles(p.role))
  }

  /** The parameter with this name. */
  def named(name: String): Option[ParamInfo] = all.find(_.name == name)

  /** The parameter with this name, which there is. */
  private[params] def apply(name: String): ParamInfo = named(name).get
}
