package flyframe.params

import org.scalatest.flatspec.AnyFlatSpec

/** Ranges of the parameters, written down here a second time: a changed range must be meant. */
class EscParamsSpec extends AnyFlatSpec {

  /** `base`: a clock at which nothing but the range itself limits the parameter. */
  private case class Limits(inside: Seq[Int], outside: Seq[Int], base: EscParams = EscParams())
  private def between(low: Int, high: Int) = Limits(Seq(low, high), Seq(low - 1, high + 1))
  private val local                        = EscParams(applicationLayer = 1)
  private val onBus                        = EscParams(hostInterface = 5)
  private val noHost                       = local.copy(hostInterface = 6, watchdogs = 1, digitalOutputs = 1)
  private val ring                         = EscParams(role = 2, ring = 1, nodeIdWidth = 7, ramKiB = 0)
  private val slowest                      = ring.copy(toneSearchKhz = 1600, toneRecessiveKhz = 400)
  private val limits = Map(
    "dataBusWidth"           -> Limits(Seq(8, 16, 32), Seq(0, 7, 9, 24, 33, 64)),
    "maxSubTelegrams"        -> between(1, 128),
    "nodeIdWidth"            -> between(4, 16),
    "ports"                  -> between(1, 4),
    "coreClockMhz"           -> Limits(Seq(25, 50, 100, 125), Seq(0, 24, 75, 101, 126)),
    "ramKiB"                 -> between(0, 60),
    "registerWritesPerFrame" -> Limits(Seq(0, 16, 348), Seq(-1, 1, 15, 349)),
    "txShift"                -> between(0, 4).copy(base = EscParams(coreClockMhz = 125)),
    "rmiiPorts"              -> between(0, 0xf).copy(base = EscParams(ports = 4)),
    "mi"                     -> between(0, 2),
    "phyAddressOffset"       -> between(0, 31).copy(base = EscParams(mi = 1)),
    "phyAddresses"           -> between(-1, 0xfffff).copy(base = EscParams(ports = 1, mi = 1)),
    "miLinkDetection"        -> between(0, 1).copy(base = EscParams(mi = 1)),
    "enhancedLinkDetection"  -> between(0, 1).copy(base = EscParams(mi = 1)),
    "linkLowPorts"           -> between(0, 0xf).copy(base = EscParams(ports = 4)),
    "fxPorts"         -> between(0, 0xf).copy(base = EscParams(ports = 4, mi = 1, enhancedLinkDetection = 1)),
    "resetRegisters"  -> between(0, 1),
    "writeProtection" -> between(0, 1),
    "temporaryLoopMs" -> between(1, 2000),
    "escType"         -> between(0, 0xff),
    "escRevision"     -> between(0, 0xff),
    "escBuild"        -> between(0, 0xffff),
    "fmmus"           -> between(0, 16),
    "syncManagers"    -> between(0, 16).copy(base = local),
    "applicationLayer"   -> between(0, 1),
    "watchdogs"          -> between(0, 1).copy(base = local),
    "leds"               -> between(0, 1).copy(base = local),
    "fmmuBitwise"        -> between(0, 1),
    "readWriteOffset"    -> between(0, 1).copy(base = EscParams(fmmus = 1)),
    "digitalOutputs"     -> between(0, 4),
    "generalOutputs"     -> between(0, 8),
    "generalInputs"      -> between(0, 8),
    "role"               -> Limits(Seq(0, 1), Seq(-1, 3), EscParams(ramKiB = 0)),
    "sequentialMode"     -> between(0, 1).copy(base = EscParams(syncManagers = 2, applicationLayer = 1)),
    "deactivationDelay"  -> between(0, 1).copy(base = EscParams(syncManagers = 2, applicationLayer = 1)),
    "openBuffers"        -> between(0, 1).copy(base = EscParams(syncManagers = 2, applicationLayer = 1)),
    "acknowledgeByWrite" -> between(0, 1).copy(base = local),
    "clocks"             -> between(0, 2),
    "syncSignals"        -> between(0, 2).copy(base = EscParams(clocks = 2)),
    "latchSignals"       -> between(0, 2).copy(base = EscParams(clocks = 2)),
    "syncPulse"          -> between(0, 0xffff),
    "clockPowerSaving"   -> between(0, 1).copy(base = EscParams(clocks = 2, syncSignals = 1, sii = 1)),
    "enhancedSync"       -> between(0, 1).copy(base = EscParams(clocks = 2, syncSignals = 1)),
    "meanWays"           -> between(0, 1).copy(base = EscParams(clocks = 1)),
    "eventTimes"         -> between(0, 1).copy(base = local.copy(clocks = 1, syncManagers = 1)),
    "timeByPdi"          -> between(0, 1).copy(base = EscParams(clocks = 2, latchSignals = 1)),
    "directSpeed"        -> between(0, 1).copy(base = EscParams(clocks = 2)),
    "clockBits"          -> Limits(Seq(32, 64), Seq(0, 31, 33, 63, 65)),
    "hostInterface"      -> between(0, 6).copy(base = noHost.copy(hostInterface = 0)),
    "digitalInputs"      -> between(0, 4).copy(base = noHost),
    "digitalInputEvent" -> between(0, 3)
      .copy(base = noHost.copy(digitalInputs = 1, clocks = 2, syncSignals = 2)),
    "digitalOutputEvent"  -> between(0, 3).copy(base = noHost.copy(clocks = 2, syncSignals = 2)),
    "digitalWatchdogLate" -> between(0, 1).copy(base = noHost),
    "spiMode"             -> between(0, 3),
    "spiLateSample"       -> between(0, 1).copy(base = EscParams(hostInterface = 4)),
    "spiSelHigh"          -> between(0, 1).copy(base = EscParams(hostInterface = 4)),
    "busWriteEarly"       -> between(0, 1).copy(base = onBus),
    "busBusyEarly"        -> between(0, 1).copy(base = onBus.copy(busWriteEarly = 1)),
    "busBusyDriver"       -> between(0, 3).copy(base = onBus),
    "busReadDelay"        -> between(0, 3).copy(base = onBus),
    "busReadAll"          -> between(0, 1).copy(base = onBus),
    "busReadHigh"         -> between(0, 1).copy(base = onBus),
    "busByteEnableHigh"   -> between(0, 1).copy(base = onBus),
    "alarm"               -> between(0, 1),
    "maxSlaves"           -> Limits(Seq(2, 4, 8, 16, 32, 64, 128), Seq(0, 1, 3, 65, 256)),
    "linePorts"           -> Limits(Seq(1, 2), Seq(0, 3)),
    "ring"                -> Limits(Seq(1, 2), Seq(-1, 3), ring),
    "canPorts"            -> between(1, 2).copy(base = ring),
    "demodulator"         -> between(0, 1).copy(base = ring),
    "toneDominantKhz"     -> Limits(Seq(6400, 12800), Seq(6399, 25001), slowest),
    "toneSearchKhz"       -> Limits(Seq(1600), Seq(1599, 5201), slowest.copy(toneDominantKhz = 6400)),
    "toneRecessiveKhz"    -> between(400, 1300).copy(base = ring.copy(toneSearchKhz = 5200)),
    "rxFrames"            -> between(16, 128).copy(base = ring),
    "filters"             -> between(4, 32).copy(base = ring),
    "bridge"              -> between(0, 1).copy(base = ring.copy(canPorts = 2)),
    "plant"               -> between(0, 1).copy(base = ring),
    "sii"                 -> between(0, 2),
    "siiClockKhz"         -> between(10, 1000),
    "siiStartUs"          -> between(1, 100000),
    "reportedRamKiB"      -> between(-1, 60),
    "reportedPorts"       -> between(-1, 0xff),
    "reportedFeatures"    -> between(-1, 0xffff)
  )

  "The limits of this test" should "cover every parameter" in
    assert(limits.keySet == ParamTable.all.map(_.name).toSet)

  for (info <- ParamTable.all; limit <- limits.get(info.name)) {
    info.name should s"accept ${limit.inside.mkString(", ")}" in {
      for (value <- limit.inside) {
        val p = info.set(limit.base, value)
        assert(info.get(p) == value)
        assert(EscParams.check(p) == Right(p))
      }
    }
    it should s"refuse ${limit.outside.mkString(", ")} in one sentence" in {
      for (value <- limit.outside ++ Seq(Int.MinValue, Int.MaxValue)) {
        val p = info.set(limit.base, value)
        assert(EscParams.problems(p).size == 1)
        val sentence = EscParams.check(p).left.toOption.get
        assert(sentence.startsWith(s"${info.name} is ${info.show(p)} but must be ${info.range}"))
        assert(sentence.indexOf('.') == sentence.length - 1, sentence)
      }
    }
    it should "be changed alone" in {
      val changed = info.set(limit.base, limit.inside.last)
      for (other <- ParamTable.all if other != info) assert(other.get(changed) == other.get(limit.base))
    }
  }

  "registerWritesPerFrame" should "be at most 87 per core cycle of a nibble" in {
    for ((clock, most) <- Seq(25 -> 87, 50 -> 174, 100 -> 348)) {
      val p = EscParams(coreClockMhz = clock)
      assert(EscParams.problems(p.copy(registerWritesPerFrame = most)).isEmpty)
      if (clock < 100)
        assert(
          EscParams.problems(p.copy(registerWritesPerFrame = most + 1)) == Seq(
            s"registerWritesPerFrame is ${most + 1} but must be 0 (derived) or 16 to $most bytes " +
              s"at coreClockMhz $clock."
          )
        )
    }
  }
  it should "leave SyncManagers time to change buffers before" in {
    val most = EscParams(syncManagers = 16, applicationLayer = 1, registerWritesPerFrame = 328)
    assert(EscParams.problems(most).isEmpty)
    assert(EscParams.problems(most.copy(registerWritesPerFrame = 329)).size == 1)
    assert(EscParams.problems(most.copy(fmmus = 8, registerWritesPerFrame = 292)).isEmpty)
    assert(EscParams.problems(most.copy(fmmus = 8, registerWritesPerFrame = 293)).size == 1)
  }
  it should "have a default that fits every core clock" in {
    for (clock <- Seq(25, 50, 100, 125)) {
      val p = EscParams(coreClockMhz = clock)
      assert(EscParams.problems(p).isEmpty)
      assert(p.writeLogDepth == (64 * clock / 25 min 256))
    }
  }

  "txShift" should "stay below the core cycles of a nibble" in {
    for (clock <- Seq(25, 50, 100, 125)) {
      val most = clock / 25 - 1
      val p    = EscParams(coreClockMhz = clock)
      assert(EscParams.problems(p.copy(txShift = most)).isEmpty)
      if (most < 4)
        assert(
          EscParams.problems(p.copy(txShift = most + 1)) == Seq(
            s"txShift is ${most + 1} but must be 0 to $most core cycles at coreClockMhz $clock."
          )
        )
    }
  }

  "LNK-12: PHYs" should "have addresses of their own, and nothing without effect" in {
    val p    = EscParams(ports = 3, mi = 1)
    val none = EscParams(ports = 3)
    val fx   = "must be 0 if miLinkDetection and enhancedLinkDetection are 0."
    for (
      (set, sentence) <- Seq(
        none.copy(miLinkDetection = 1)       -> "miLinkDetection is 1 but must be 0 if mi is 0.",
        none.copy(enhancedLinkDetection = 1) -> "enhancedLinkDetection is 1 but must be 0 if mi is 0.",
        none.copy(phyAddressOffset = 16)     -> "phyAddressOffset is 16 but must be 0 if mi is 0.",
        none.copy(phyAddresses = 0x0443)     -> "phyAddresses is 0x0443 but must be -1 if mi is 0.",
        none.copy(linkLowPorts = 8)          -> "linkLowPorts is 0x8 but must be 0x0 to 0x7 with 3 ports.",
        none.copy(fxPorts = 4)               -> s"fxPorts is 0x0004 but $fx",
        p.copy(fxPorts = 4)                  -> s"fxPorts is 0x0004 but $fx",
        p.copy(fxPorts = 8)                  -> "fxPorts is 0x8 but must be 0x0 to 0x7 with 3 ports.",
        p.copy(phyAddresses = 0x0421) ->
          "phyAddresses is 0x0421 but must have 3 different addresses for as many ports.",
        p.copy(phyAddresses = 0x0443, phyAddressOffset = 1) ->
          "phyAddressOffset is 1 but must be 0 if phyAddresses is 0x0443.",
        EscParams(role = 1, ramKiB = 0, phyAddressOffset = 1) ->
          "phyAddressOffset is 1 but must be 0 if role is 1.",
        EscParams(role = 1, ramKiB = 0, phyAddresses = 2) ->
          "phyAddresses is 0x0002 but must be -1 if role is 1."
      )
    ) assert(EscParams.problems(set) == Seq(sentence))
    val fits = p.copy(mi = 1, miLinkDetection = 1, phyAddresses = 0x0443)
    assert(EscParams.problems(fits).isEmpty && (0 to 2).map(fits.phyAddress) == Seq(3, 2, 1))
    assert((0 to 3).map(EscParams(phyAddressOffset = 30).phyAddress) == Seq(30, 31, 0, 1))
  }

  "A master" should "have two ports and nothing of a slave" in {
    val master = EscParams(role = 1, ramKiB = 0)
    assert(EscParams.problems(master).isEmpty)
    assert(EscParams.problems(master.copy(ports = 3)) == Seq("ports is 3 but must be 2 if role is 1."))
    assert(
      EscParams.problems(master.copy(coreClockMhz = 25)) ==
        Seq("coreClockMhz is 25 but must be 50, 100, 125 MHz if role is 1.")
    )
    for (clock <- Seq(50, 100, 125)) assert(EscParams.problems(master.copy(coreClockMhz = clock)).isEmpty)
    for (
      p <- Seq(master.copy(fmmus = 1, coreClockMhz = 50), master.copy(watchdogs = 1), master.copy(leds = 1))
    )
      assert(EscParams.problems(p).map(_.split(" is 1 ")(1)) == Seq("but must be 0 if role is 1."))
    assert(
      EscParams.problems(master.copy(coreClockMhz = 50, txShift = 2)) ==
        Seq("txShift is 2 but must be 0 to 1 core cycles at coreClockMhz 50.")
    )
    assert(EscParams.problems(master.copy(alarm = 1)) == Seq("alarm is 1 but must be 0 if role is 1."))
    assert(EscParams.problems(EscParams(role = 1)) == Seq("ramKiB is 1 but must be 0 if role is 1."))
  }

  it should "have the ranges of its role, written down here a second time" in {
    val master = EscParams(role = 1, ramKiB = 0)
    val limits = this.limits ++ Seq(
      "coreClockMhz"    -> Limits(Seq(50, 100, 125), Seq(0, 25, 75, 126)),
      "maxSubTelegrams" -> between(10, 128),
      "rmiiPorts"       -> between(0, 0x7),
      "hostInterface"   -> between(0, 5)
    )
    for (info <- ParamTable.all if info.roles(1) && info.name != "role") {
      val here  = info.in(1)
      val limit = limits(info.name)
      val base = info.name match {
        case "txShift"                => master.copy(coreClockMhz = 125)
        case "rmiiPorts"              => master.copy(linePorts = 2)
        case "hostInterface"          => master.copy(dataBusWidth = 32)
        case n if n.startsWith("spi") => master.copy(hostInterface = 4)
        case "busBusyEarly"           => master.copy(hostInterface = 5, busWriteEarly = 1)
        case n if n.startsWith("bus") => master.copy(hostInterface = 5)
        case _                        => master
      }
      for (value <- limit.inside) assert(EscParams.problems(here.set(base, value)).isEmpty, here.name)
      for (value <- limit.outside) {
        val p    = here.set(base, value)
        val role = if (here.range == info.range) "" else " if role is 1"
        assert(
          EscParams.problems(p) == Seq(
            s"${here.name} is ${here.show(p)} but must be ${here.rangeInWords}$role."
          )
        )
      }
    }
  }

  it should "have texts of its own where they differ" in {
    val ranges = Set("maxSubTelegrams", "hostInterface")
    for (name <- ranges.toSeq ++ Seq("dataBusWidth", "escType", "escRevision", "escBuild")) {
      val info = ParamTable.named(name).get
      assert(info.in(0).text != info.in(1).text, name)
      assert((info.in(0).range == info.in(1).range) == !ranges(name), name)
    }
    assert(
      EscParams.problems(EscParams(role = 1, ramKiB = 0, maxSubTelegrams = 9)) ==
        Seq("maxSubTelegrams is 9 but must be 10 to 128 datagrams if role is 1.")
    )
    assert(ParamTable.all.forall(i => i.elsewhere.keySet.subsetOf(i.roles)))
  }

  "NODE-03: a ring node" should "have what its role has, and nothing else" in {
    assert(EscParams.problems(ring).isEmpty)
    for (
      (set, sentence) <- Seq(
        ring.copy(ring = 0)           -> "ring is 0 but must be 1 to 2 if role is 2.",
        ring.copy(ramKiB = 1)         -> "ramKiB is 1 but must be 0 if role is 2.",
        ring.copy(ports = 3)          -> "ports is 3 but must be 2 if role is 2.",
        ring.copy(fxPorts = 1)        -> "fxPorts is 0x0001 but must be 0 if role is 2.",
        ring.copy(nodeIdWidth = 8)    -> "nodeIdWidth is 8 but must be 4 to 7 bit if role is 2.",
        ring.copy(coreClockMhz = 125) -> "coreClockMhz is 125 but must be 50, 100 MHz if role is 2.",
        ring.copy(hostInterface = 4)  -> "hostInterface is 4 but must be 0, 1, 2, 3, 5 if role is 2.",
        ring.copy(toneSearchKhz = 3000, toneRecessiveKhz = 700) ->
          "toneSearchKhz is 3000 but must be 1/8 to 1/4 of toneDominantKhz.",
        ring.copy(toneRecessiveKhz = 1260) ->
          "toneRecessiveKhz is 1260 but must be at most 1/4 of toneSearchKhz.",
        ring.copy(rmiiPorts = 1)                  -> "rmiiPorts is 0x1 but must be 0x0 to 0x0 with 0 ports.",
        ring.copy(txShift = 1)                    -> "txShift is 1 but must be 0 if plant is 0.",
        EscParams(plant = 1)                      -> "plant is 1 but must be 0 if role is 0.",
        EscParams(demodulator = 1)                -> "demodulator is 1 but must be 0 if ring is 0.",
        EscParams(bridge = 1)                     -> "bridge is 1 but must be 0 if ring is 0.",
        EscParams(canPorts = 2)                   -> "canPorts is 2 but must be 1 if ring is 0.",
        EscParams(role = 1, ramKiB = 0, ring = 1) -> "ring is 1 but must be 0 if role is 1."
      )
    ) assert(EscParams.problems(set) == Seq(sentence))
    for (width <- Seq(8, 16, 32); clock <- Seq(50, 100); ports <- 1 to 2; bits <- 4 to 7)
      assert(
        EscParams
          .problems(
            ring.copy(dataBusWidth = width, coreClockMhz = clock, canPorts = ports, nodeIdWidth = bits)
          )
          .isEmpty
      )
  }

  "GW-01: a slave with a ring" should "have what a node has, for a host that can wait" in {
    val gateway = Presets.gateway
    assert(EscParams.problems(gateway).isEmpty && EscParams.problems(gateway.ringNode).isEmpty)
    for (
      (set, sentence) <- Seq(
        gateway.copy(hostInterface = 4) -> "hostInterface is 4 but must be 0, 1, 2, 3, 5 if ring is 2.",
        gateway.copy(ramKiB = 29)       -> "ramKiB is 29 but must be 0 to 28 KiB if ring is 2.",
        gateway.copy(plant = 1)         -> "plant is 1 but must be 0 if role is 0.",
        gateway.copy(bridge = 1)        -> "canPorts is 1 but must be 2 if bridge is 1.",
        gateway.copy(alarm = 1)         -> "alarm is 1 but must be 0 if ring is 2.",
        gateway.copy(coreClockMhz = 125) ->
          "coreClockMhz is 125 but must be 50 or 100 MHz if ring is 2."
      )
    ) assert(EscParams.problems(set).contains(sentence), EscParams.problems(set))
    for (
      set <- Seq(gateway.copy(ring = 1), gateway.copy(canPorts = 2, bridge = 1), gateway.copy(ramKiB = 28))
    )
      assert(EscParams.problems(set).isEmpty && EscParams.problems(set.ringNode).isEmpty)
    val ring = Seq("ring", "canPorts", "demodulator", "rxFrames", "filters", "bridge", "toneSearchKhz")
    def told(p: EscParams) = ParamTable.told(p).map(_.name)
    assert(ring.forall(told(gateway).contains) && !ring.exists(told(EscParams()).contains))
    assert(!told(gateway).contains("plant"))
  }

  "FMMUs and SyncManagers" should "need a core clock of 100 MHz" in {
    for (clock <- Seq(25, 50, 100, 125); p <- Seq(local.copy(fmmus = 1), local.copy(syncManagers = 1))) {
      val problems = EscParams.problems(p.copy(coreClockMhz = clock))
      if (clock >= 100) assert(problems.isEmpty)
      else
        assert(problems.size == 1 && problems.head.endsWith(s" is 1 but must be 0 at coreClockMhz $clock."))
    }
  }
  "SyncManagers, watchdogs and LEDs" should "need the application layer" in {
    for (p <- Seq(EscParams(syncManagers = 1), EscParams(watchdogs = 1), EscParams(leds = 1)))
      assert(
        EscParams.problems(p).map(_.split(" is 1 ")(1)) == Seq("but must be 0 if applicationLayer is 0.")
      )
  }

  "Options" should "be refused without what they change" in {
    val clocks = EscParams(clocks = 2)
    for (
      (set, sentence) <- Seq(
        EscParams(sequentialMode = 1)    -> "sequentialMode is 1 but must be 0 if syncManagers is 0.",
        EscParams(deactivationDelay = 1) -> "deactivationDelay is 1 but must be 0 if syncManagers is 0.",
        EscParams(openBuffers = 1)       -> "openBuffers is 1 but must be 0 if syncManagers is 0.",
        EscParams(acknowledgeByWrite = 1) -> ("acknowledgeByWrite is 1 but must be 0 if applicationLayer, " +
          "alarm, syncSignals and latchSignals are 0."),
        EscParams(readWriteOffset = 1) ->
          "readWriteOffset is 1 but must be 0 if fmmus and syncManagers are 0.",
        local.copy(hostInterface = 2, dataBusWidth = 32) ->
          "acknowledgeByWrite is 0 but must be 1 if hostInterface is 2.",
        EscParams(hostInterface = 2) -> "hostInterface is 2 but must be 0, 1 or 3 to 6 at dataBusWidth 8.",
        EscParams(spiSelHigh = 1)    -> "spiSelHigh is 1 but must be 0 if hostInterface is 0.",
        EscParams(spiLateSample = 1, hostInterface = 5) ->
          "spiLateSample is 1 but must be 0 if hostInterface is 5.",
        EscParams(busBusyDriver = 3, hostInterface = 4) ->
          "busBusyDriver is 3 but must be 0 if hostInterface is 4.",
        noHost.copy(hostInterface = 5, digitalInputs = 1) ->
          "digitalInputs is 1 but must be 0 if hostInterface is 5.",
        noHost.copy(applicationLayer = 0, watchdogs = 0, digitalOutputs = 0, digitalInputs = 1) ->
          "applicationLayer is 0 but must be 1 if hostInterface is 6.",
        noHost.copy(watchdogs = 0)      -> "watchdogs is 0 but must be 1 if hostInterface is 6.",
        noHost.copy(digitalOutputs = 0) -> "digitalOutputs is 0 but must be 1 to 4 if hostInterface is 6.",
        noHost.copy(acknowledgeByWrite = 1) -> "acknowledgeByWrite is 1 but must be 0 if hostInterface is 6.",
        noHost.copy(alarm = 1)              -> "alarm is 1 but must be 0 if hostInterface is 6.",
        noHost.copy(sii = 2)                -> "sii is 2 but must be 0 or 1 if hostInterface is 6.",
        noHost.copy(mi = 2)                 -> "mi is 2 but must be 0 or 1 if hostInterface is 6.",
        noHost.copy(ramKiB = 0, digitalInputs = 1) -> "digitalInputs is 1 but must be 0 if ramKiB is 0.",
        noHost.copy(digitalInputEvent = 1) -> "digitalInputEvent is 1 but must be 0 if digitalInputs is 0.",
        noHost.copy(digitalOutputs = 0, digitalInputs = 1, digitalOutputEvent = 1) ->
          "digitalOutputEvent is 1 but must be 0 if digitalOutputs is 0.",
        noHost.copy(clocks = 2, syncSignals = 1, digitalOutputEvent = 3) ->
          "digitalOutputEvent is 3 but must be 0 to 2 if syncSignals is 1.",
        onBus.copy(busBusyEarly = 1)         -> "busBusyEarly is 1 but must be 0 if busWriteEarly is 0.",
        EscParams(meanWays = 1)              -> "meanWays is 1 but must be 0 if clocks is 0.",
        clocks.copy(meanWays = 1, ports = 1) -> "meanWays is 1 but must be 0 if ports is 1.",
        local.copy(syncManagers = 1, eventTimes = 1) -> "eventTimes is 1 but must be 0 if clocks is 0.",
        clocks.copy(eventTimes = 1)                  -> "eventTimes is 1 but must be 0 if syncManagers is 0.",
        clocks.copy(timeByPdi = 1)                   -> "timeByPdi is 1 but must be 0 if latchSignals is 0.",
        clocks.copy(directSpeed = 1, clocks = 1)     -> "directSpeed is 1 but must be 0 if clocks is 1.",
        EscParams(directSpeed = 1)                   -> "directSpeed is 1 but must be 0 if clocks is 0.",
        EscParams(role = 1, ramKiB = 0, writeProtection = 1) ->
          "writeProtection is 1 but must be 0 if role is 1.",
        EscParams(role = 1, ramKiB = 0, acknowledgeByWrite = 1) ->
          "acknowledgeByWrite is 1 but must be 0 if role is 1."
      )
    ) assert(EscParams.problems(set) == Seq(sentence))
    for (set <- Seq(EscParams(alarm = 1), clocks.copy(latchSignals = 1), clocks.copy(syncSignals = 1)))
      assert(EscParams.problems(set.copy(acknowledgeByWrite = 1)).isEmpty)
  }

  "Several problems" should "be told one by one" in {
    assert(
      EscParams.problems(EscParams(ports = 0, ramKiB = 61)).map(_.takeWhile(_ != ' ')) == Seq(
        "ports",
        "ramKiB"
      )
    )
    assert(
      EscParams.problems(EscParams(coreClockMhz = 25, txShift = 1, registerWritesPerFrame = 100)).size == 2
    )
  }

  "Reported values" should "follow the hardware unless given" in {
    val p = EscParams(ports = 3, ramKiB = 5)
    assert((p.ramSizeReported, p.portDescriptor, p.features) == ((5, 0x3f, 0x80)))
    val setByUser = p.copy(reportedRamKiB = 8, reportedPorts = 0x3b, reportedFeatures = 0xfc)
    assert((setByUser.ramSizeReported, setByUser.portDescriptor, setByUser.features) == ((8, 0x3b, 0xfc)))
  }

  "DC-06: SYNC and LATCH signals" should "need the system time, and that a core clock of 100 MHz or more" in {
    val p = EscParams(clocks = 1, coreClockMhz = 50)
    assert(
      EscParams.problems(p.copy(syncSignals = 1)) == Seq("syncSignals is 1 but must be 0 if clocks is 1.")
    )
    assert(
      EscParams.problems(p.copy(latchSignals = 2)) == Seq("latchSignals is 2 but must be 0 if clocks is 1.")
    )
    assert(
      EscParams.problems(p.copy(clocks = 2)) == Seq("clocks is 2 but must be 0 to 1 at coreClockMhz 50.")
    )
  }
  "DC-42: times of SyncManagers' buffers" should "have clocks and SyncManagers" in {
    val p = EscParams(eventTimes = 1)
    assert(
      EscParams.problems(p) == Seq(
        "eventTimes is 1 but must be 0 if clocks is 0.",
        "eventTimes is 1 but must be 0 if syncManagers is 0."
      )
    )
    assert(EscParams.problems(p.copy(clocks = 1, syncManagers = 1, applicationLayer = 1)) == Nil)
  }
  "DC-06: units that the EEPROM switches" should "be there, and an EEPROM" in {
    val p = EscParams(clocks = 2, clockPowerSaving = 1)
    assert(
      EscParams.problems(p.copy(sii = 1)) == Seq(
        "clockPowerSaving is 1 but must be 0 if syncSignals and latchSignals are 0."
      )
    )
    assert(
      EscParams.problems(p.copy(latchSignals = 1)) == Seq("clockPowerSaving is 1 but must be 0 if sii is 0.")
    )
  }
}
