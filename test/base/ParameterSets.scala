package flyframe

import flyframe.params.{EscParams, Presets}

/** Parameter sets that tests and campaigns share; a set that only one test needs stands in that test. */
object TestSets {
  private def preset(name: String): EscParams = Presets.named(name).get.params
  private val min                             = preset("cyclone4-min")

  // The EEPROM's answers take time, which the model does not know: the RAM is opened by pin.
  private val complete = preset("slave").copy(preset = "complete", sii = 0, digitalOutputs = 4)

  /** Of random frames, each with its share of them: presets, and every core clock with another bus width.
    */
  val fuzz: Seq[(EscParams, Int)] = Seq(
    min                                                                                      -> 50000,
    min.copy(preset = "four", ports = 4, rmiiPorts = 0x5, ramKiB = 8, maxSubTelegrams = 128) -> 10000,
    complete                                                                                 -> 30000,
    complete.copy(
      preset = "complete-125",
      coreClockMhz = 125,
      dataBusWidth = 32,
      fmmus = 16,
      syncManagers = 16,
      sequentialMode = 1,
      deactivationDelay = 1,
      openBuffers = 1,
      readWriteOffset = 1,
      digitalOutputs = 2,
      ports = 3,
      acknowledgeByWrite = 1,
      writeProtection = 1
    ) -> 10000,
    complete.copy(
      preset = "complete-3",
      dataBusWidth = 16,
      fmmus = 3,
      fmmuBitwise = 0,
      digitalOutputs = 3,
      syncManagers = 2,
      sequentialMode = 1,
      deactivationDelay = 1,
      ramKiB = 1,
      watchdogs = 0,
      leds = 0,
      clocks = 2,
      syncSignals = 2,
      latchSignals = 2,
      eventTimes = 1,
      meanWays = 1,
      timeByPdi = 1,
      directSpeed = 1
    )                                                                                                -> 10000,
    preset("frame-processor")                                                                        -> 10000,
    min.copy(preset = "mhz25", coreClockMhz = 25, ports = 3, maxSubTelegrams = 128)                  -> 10000,
    min.copy(preset = "mhz25-32", coreClockMhz = 25, dataBusWidth = 32, nodeIdWidth = 12, alarm = 1) -> 5000,
    min.copy(
      preset = "mhz50-16",
      coreClockMhz = 50,
      rmiiPorts = 0x3,
      dataBusWidth = 16,
      ramKiB = 3,
      writeProtection = 1
    )                                                                                           -> 5000,
    min.copy(preset = "mhz125-8", coreClockMhz = 125, ports = 1, txShift = 3)                   -> 5000,
    preset("alarm-slave")                                                                       -> 20000,
    preset("alarm-slave").copy(preset = "alarm-125", coreClockMhz = 125, dataBusWidth = 32)     -> 5000,
    complete.copy(preset = "complete-alarm", alarm = 1, dataBusWidth = 16, maxSubTelegrams = 4) -> 3000,
    min.copy(preset = "clocks-50", clocks = 1, coreClockMhz = 50, ports = 4, dataBusWidth = 16) -> 5000,
    min.copy(preset = "mhz100-32", dataBusWidth = 32, ramKiB = 60, registerWritesPerFrame = 16) -> 5000
  )

  // As the preset `slave`, but for what only costs time here: further ports, LEDs, the EEPROM's start.
  private val soakSmall = preset("slave").copy(
    preset = "smsoak",
    ports = 1,
    leds = 0,
    watchdogs = 0,
    sii = 0,
    ramKiB = 1,
    maxSubTelegrams = 128
  )

  // Host words of four bytes, each byte an access of its own to the SyncManagers; another core clock.
  private val soakWide = soakSmall.copy(preset = "smsoak-wide", dataBusWidth = 32, coreClockMhz = 125)

  /** Of SyncManagers used by bus and host at once, each with its share of the steps. */
  val soak: Seq[(EscParams, Long)] = Seq(soakSmall -> 19L, soakWide -> 1L)

  /** Of slaves behind cables that fail. */
  val faults: Seq[EscParams] = Seq(preset("slave").copy(preset = "faults"))

  /** The set of random frames, of SyncManagers or of faults with this name, else the preset. */
  def named(name: String): Option[EscParams] =
    ((fuzz ++ soak).map(_._1) ++ faults).find(_.preset == name).orElse(Presets.named(name).map(_.params))

  // Temporary loops end soon, which saves time.
  private val ruled = min.copy(temporaryLoopMs = 1)

  private val ruledSets = Seq(
    ruled,
    ruled
      .copy(
        preset = "four-25",
        ports = 4,
        ramKiB = 8,
        coreClockMhz = 25,
        dataBusWidth = 32,
        writeProtection = 1
      ),
    ruled
      .copy(
        preset = "wide-50",
        coreClockMhz = 50,
        dataBusWidth = 16,
        maxSubTelegrams = 4,
        nodeIdWidth = 8,
        rmiiPorts = 0x1,
        writeProtection = 1
      )
  )

  private val ruledUnits = ruled
    .copy(
      preset = "units",
      ramKiB = 8,
      fmmus = 8,
      fmmuBitwise = 1,
      syncManagers = 8,
      applicationLayer = 1,
      watchdogs = 1,
      digitalOutputs = 4
    )
  private val ruledUnitSets = Seq(
    ruledUnits.copy(
      readWriteOffset = 1,
      resetRegisters = 1,
      writeProtection = 1,
      sequentialMode = 1,
      deactivationDelay = 1,
      openBuffers = 1
    ),
    ruledUnits.copy(
      preset = "units-16",
      watchdogs = 1,
      leds = 1,
      dataBusWidth = 32,
      fmmus = 16,
      fmmuBitwise = 0,
      syncManagers = 16,
      deactivationDelay = 1,
      openBuffers = 1,
      coreClockMhz = 125
    ),
    ruledUnits.copy(
      preset = "by-write",
      readWriteOffset = 1,
      dataBusWidth = 32,
      acknowledgeByWrite = 1,
      deactivationDelay = 1
    )
  )

  /** Each host interface, with the units that see what a host does. */
  val hosts: Seq[EscParams] =
    Seq(("avalon", 1, 16), ("axi", 2, 32), ("wishbone", 3, 8), ("spi", 4, 8), ("bus", 5, 16)).map {
      case (name, interface, width) =>
        ruled.copy(
          preset = name,
          hostInterface = interface,
          dataBusWidth = width,
          syncManagers = 4,
          acknowledgeByWrite = if (interface == 2) 1 else 0,
          generalOutputs = if (interface == 3) 8 else interface % 4,
          generalInputs = if (interface == 3) 8 else 5 - interface,
          applicationLayer = 1,
          watchdogs = 1
        )
    }

  /** Digital outputs and inputs without a host, with each of their events. */
  val digital: Seq[EscParams] = {
    val both = ruled.copy(
      hostInterface = 6,
      applicationLayer = 1,
      watchdogs = 1,
      digitalOutputs = 4,
      digitalInputs = 4
    )
    Seq(
      both.copy(preset = "digital", syncManagers = 5, fmmus = 2, fmmuBitwise = 1),
      both.copy(
        preset = "digital-trigger",
        dataBusWidth = 16,
        syncManagers = 4,
        digitalOutputEvent = 1,
        digitalInputs = 3,
        digitalInputEvent = 1
      ),
      both.copy(
        preset = "digital-sync",
        dataBusWidth = 32,
        clocks = 2,
        syncSignals = 2,
        digitalOutputs = 3,
        digitalOutputEvent = 3,
        digitalInputEvent = 2,
        digitalWatchdogLate = 1
      ),
      both.copy(preset = "digital-min", digitalOutputEvent = 1),
      both.copy(
        preset = "digital-eeprom",
        coreClockMhz = 25,
        leds = 1,
        sii = 1,
        siiClockKhz = 1000,
        siiStartUs = 1,
        digitalOutputs = 1,
        digitalInputs = 2,
        digitalWatchdogLate = 1
      ),
      both.copy(preset = "digital-in", dataBusWidth = 32, digitalOutputs = 0, watchdogs = 0)
    )
  }

  // With an EEPROM only the rules that speak of it: its load takes time after every reset.
  private val ruledEeprom = ruled.copy(
    preset = "eeprom-25",
    coreClockMhz = 25,
    applicationLayer = 1,
    leds = 1,
    sii = 1,
    siiClockKhz = 1000,
    siiStartUs = 1
  )
  private val ruledEepromSets = Seq(
    ruledEeprom,
    ruledEeprom.copy(
      preset = "eeprom-100",
      coreClockMhz = 100,
      dataBusWidth = 32,
      ramKiB = 8,
      fmmus = 8,
      syncManagers = 8,
      watchdogs = 1
    )
  )
  private val ruledEmulated = Seq(
    ruledEeprom.copy(preset = "emulation-25", sii = 2),
    ruledUnits.copy(preset = "emulation-100", sii = 2, siiStartUs = 1, dataBusWidth = 16)
  )
  private val ruledAlarms = Seq(
    ruled.copy(preset = "alarm", alarm = 1),
    ruled
      .copy(preset = "alarm-16", alarm = 1, maxSubTelegrams = 1, dataBusWidth = 16, nodeIdWidth = 8)
      .copy(acknowledgeByWrite = 1),
    ruled.copy(
      preset = "alarm-25",
      alarm = 1,
      maxSubTelegrams = 4,
      dataBusWidth = 32,
      nodeIdWidth = 8,
      coreClockMhz = 25,
      applicationLayer = 1
    )
  )

  // Management of the PHYs: by commands alone; with links found by it; with fibre, and an EEPROM that says
  // where enhanced link detection is on.
  private val ruledMi = Seq(
    ruled.copy(preset = "mi-25", coreClockMhz = 25, mi = 2, phyAddressOffset = 16, linkLowPorts = 0x2),
    ruled.copy(
      preset = "mi-links",
      coreClockMhz = 50,
      dataBusWidth = 16,
      ports = 3,
      mi = 2,
      phyAddresses = 9 << 10 | 1 << 5 | 30,
      miLinkDetection = 1,
      enhancedLinkDetection = 1
    ),
    ruled.copy(
      preset = "mi-fibre",
      coreClockMhz = 25,
      mi = 1,
      sii = 1,
      siiClockKhz = 1000,
      siiStartUs = 1,
      miLinkDetection = 1,
      enhancedLinkDetection = 1,
      fxPorts = 0x2
    ),
    ruled.copy(preset = "mi-errors", coreClockMhz = 25, mi = 1, enhancedLinkDetection = 1, resetRegisters = 1)
  )

  private val ruledClocks = Seq(
    ruled.copy(
      preset = "clocks",
      ports = 3,
      clocks = 2,
      directSpeed = 1,
      syncSignals = 2,
      syncPulse = 0,
      enhancedSync = 1,
      meanWays = 1,
      eventTimes = 1,
      latchSignals = 2,
      applicationLayer = 1,
      syncManagers = 2
    ),
    ruled.copy(
      preset = "clocks-32",
      clocks = 2,
      syncSignals = 1,
      syncPulse = 5000,
      latchSignals = 1,
      clockBits = 32,
      dataBusWidth = 32,
      coreClockMhz = 125,
      ramKiB = 8,
      fmmus = 3,
      syncManagers = 4,
      applicationLayer = 1,
      writeProtection = 1,
      eventTimes = 1
    ),
    ruled.copy(
      preset = "clocks-pdi",
      clocks = 2,
      clockBits = 32,
      syncSignals = 1,
      syncPulse = 0,
      latchSignals = 1,
      timeByPdi = 1,
      directSpeed = 1,
      applicationLayer = 1,
      acknowledgeByWrite = 1
    ),
    ruledEeprom.copy(
      preset = "clocks-eeprom",
      coreClockMhz = 100,
      leds = 0,
      clocks = 2,
      syncSignals = 2,
      latchSignals = 2,
      clockPowerSaving = 1
    )
  )

  /** Of the rule tests, on model and RTL. */
  val rules: Seq[EscParams] =
    ruledSets ++ ruledUnitSets ++ hosts ++ digital ++ ruledClocks ++ ruledEepromSets ++ ruledEmulated ++
      ruledAlarms ++ ruledMi

  /** Nodes of a fibre ring: each pair of values of two parameters. */
  val rings: Seq[EscParams] = Pairwise[Int](
    Seq(
      Seq(8, 16, 32),
      Seq(50, 100),
      Seq(1, 2),
      Seq(0, 1),
      Seq(16, 64, 128),
      Seq(4, 16, 32),
      Seq(4, 7),
      Seq(1, 2)
    ) :+
      Seq(0, 1, 2, 3, 5),
    point => point.last != 2 || point.head == 32 // AXI4-Lite has words of 32 bits
  ).zipWithIndex.map { case (Seq(width, clock, ports, demodulator, frames, filters, bits, ring, host), i) =>
    preset("ring-bus").copy(
      preset = s"ring$i",
      dataBusWidth = width,
      coreClockMhz = clock,
      canPorts = ports,
      bridge = if (ports == 2 && filters >= 16) i % 2 else 0,
      demodulator = demodulator,
      rxFrames = frames,
      filters = filters,
      nodeIdWidth = bits,
      ring = ring,
      plant = i / 2 % 2,
      rmiiPorts = if (i % 8 == 2 || i % 8 == 7) 1 else 0,
      hostInterface = host
    )
  }

  /** FMMUs 0, 1, 3, 8, 16 and SyncManagers 0, 2, 4, 8, 16, each with the most and the least of the other
    * kind.
    */
  private val matrixUnits: Seq[EscParams] =
    Seq((0, 2), (1, 4), (3, 2), (8, 8), (16, 16), (0, 16), (16, 0)).map { case (fmmus, syncManagers) =>
      EscParams(
        preset = s"f${fmmus}_s$syncManagers",
        ramKiB = 8,
        fmmus = fmmus,
        syncManagers = syncManagers,
        applicationLayer = 1
      )
    }

  /** Slaves with a ring under them. */
  private lazy val gateways: Seq[EscParams] = Seq(
    EscParams(preset = "gateway", ring = 1, ramKiB = 8, fmmus = 3, syncManagers = 4, applicationLayer = 1)
  )

  /** All there is, in both ways to keep the configuration. */
  private val matrixComplete: Seq[EscParams] = Seq(
    EscParams(
      preset = "all_i2c",
      fmmus = 8,
      syncManagers = 8,
      sii = 1,
      mi = 2,
      miLinkDetection = 1,
      enhancedLinkDetection = 1,
      resetRegisters = 1
    ),
    EscParams(
      preset = "all_emulated",
      fmmus = 16,
      syncManagers = 16,
      sii = 2,
      dataBusWidth = 32,
      coreClockMhz = 125
    )
  ).map(
    _.copy(ramKiB = 8, fmmuBitwise = 1, applicationLayer = 1, watchdogs = 1, leds = 1, digitalOutputs = 4)
  )

  /** Smoke-alarm slaves: each pair of values of dataBusWidth 8, 16, 32, maxSubTelegrams 1, 4, 15 and
    * nodeIdWidth 4, 8, 16 is in one of nine points.
    */
  private val matrixAlarm: Seq[EscParams] =
    for ((width, i) <- Seq(8, 16, 32).zipWithIndex; (count, j) <- Seq(1, 4, 15).zipWithIndex) yield {
      val id = Seq(4, 8, 16)((i + j) % 3)
      EscParams(
        preset = s"alarm${width}_t${count}_i$id",
        dataBusWidth = width,
        maxSubTelegrams = count,
        nodeIdWidth = id,
        ramKiB = 1,
        alarm = 1
      )
    }

  private val matrixWire: Seq[EscParams] =
    for {
      width <- Seq(8, 16, 32)
      ports <- Seq(1, 2, 4)
      count <- Seq(1, 15, 128)
      id    <- Seq(8, 16)
    } yield EscParams(
      preset = s"m${width}_p${ports}_t${count}_i$id",
      dataBusWidth = width,
      ports = ports,
      maxSubTelegrams = count,
      nodeIdWidth = id,
      ramKiB = 1
    )

  /** What no pair brings: all units on a bus of 16 bits, and SyncManagers up to the end of the address space.
    */
  private val matrixCorners: Seq[EscParams] = Seq(
    EscParams(
      preset = "units_w16",
      dataBusWidth = 16,
      ramKiB = 8,
      fmmus = 16,
      fmmuBitwise = 1,
      syncManagers = 16,
      applicationLayer = 1
    ),
    EscParams(preset = "ram60_s2", ramKiB = 60, fmmus = 4, syncManagers = 2, applicationLayer = 1)
  )

  /** The points of the parameter matrix. */
  val matrix: Seq[EscParams] = matrixWire ++ matrixUnits ++ matrixComplete ++ matrixAlarm ++ matrixCorners

  /** Those that belong to every sample: with an EEPROM, the corners, and of the alarm slaves, which the rule
    * tests fit, one of each bus width and each number of datagrams.
    */
  val besidePairs: Seq[EscParams] = matrixComplete ++ matrixCorners ++ gateways ++
    matrixAlarm.zipWithIndex.collect { case (p, i) if i % 4 == 0 => p }

  private type Change = (String, EscParams => EscParams)
  private def sampled(letter: String, all: Int*)(change: (EscParams, Int) => EscParams): Seq[Change] =
    all.map(v => s"$letter$v" -> (change(_, v)))

  private val parameters: Seq[Seq[Change]] = Seq(
    sampled("w", 8, 16, 32)((p, v) => p.copy(dataBusWidth = v)),
    sampled("p", 1, 2, 4)((p, v) => p.copy(ports = v)),
    sampled("t", 1, 15, 128)((p, v) => p.copy(maxSubTelegrams = v)),
    sampled("i", 4, 8, 16)((p, v) => p.copy(nodeIdWidth = v)),
    sampled("c", 25, 100, 125)((p, v) => p.copy(coreClockMhz = v)),
    sampled("f", 0, 3, 16)((p, v) => p.copy(fmmus = v, fmmuBitwise = if (v == 16) 1 else 0)),
    sampled("s", 0, 4, 16)((p, v) => p.copy(syncManagers = v)),
    // 0: none; 1: the application layer; 2: with everything that builds on it
    sampled("u", 0, 1, 2)((p, v) =>
      if (v == 2) p.copy(applicationLayer = 1, watchdogs = 1, leds = 1, digitalOutputs = 4)
      else p.copy(applicationLayer = v)
    ),
    sampled("a", 0, 1)((p, v) => p.copy(alarm = v))
  )

  private def set(changes: Seq[Change]): EscParams =
    changes.foldLeft(EscParams(preset = changes.map(_._1).mkString("_"), ramKiB = 8)) {
      case (p, (_, change)) =>
        change(p)
    }

  /** Slave controllers of every kind, so that each pair of values of two parameters is in one of them. */
  lazy val sample: Seq[EscParams] =
    Pairwise[Change](parameters, changes => EscParams.problems(set(changes)).isEmpty).map(set)
}
