package flyframe.params

/** What makes a set of parameters impossible: each parameter's own range, and what the parameters ask of each
  * other.
  */
private[params] object ParamChecks {

  def problems(p: EscParams): Seq[String] = {
    val outside = ParamTable.all.filterNot(i => i.in(p.role).allowed(i.get(p))).map { i =>
      val here = i.in(p.role)
      val role = if (here.range == i.range) "" else s" if role is ${p.role}"
      s"${i.name} is ${i.show(p)} but must be ${here.rangeInWords}$role."
    }
    if (outside.nonEmpty) outside
    else {
      val own = p.role match {
        case 1 => ofMaster(p)
        case 2 => ofRing(p)
        case _ => ofSlave(p)
      }
      (txShift(p) ++ rmii(p) ++ hostInterface(p) ++ own).toSeq
    }
  }

  /** `name` is for something that is only there if one of `others` is at least `least`. */
  private case class Need(name: String, others: Seq[String], least: Int = 1) {
    def problem(p: EscParams): Option[String] = {
      val set    = ParamTable(name)
      val values = others.map(ParamTable(_).get(p))
      Option.when(set.get(p) > 0 && values.forall(_ < least)) {
        val missing = others match {
          case Seq(other) => s"$other is ${values.head}"
          case _          => s"${others.init.mkString(", ")} and ${others.last} are 0"
        }
        s"$name is ${set.show(p)} but must be 0 if $missing."
      }
    }
  }

  private val needs = Seq(
    Need("watchdogs", Seq("applicationLayer")),
    Need("leds", Seq("applicationLayer")),
    Need("syncManagers", Seq("applicationLayer")),
    Need("sequentialMode", Seq("syncManagers")),
    Need("deactivationDelay", Seq("syncManagers")),
    Need("openBuffers", Seq("syncManagers")),
    Need("readWriteOffset", Seq("fmmus", "syncManagers")),
    Need("acknowledgeByWrite", Seq("applicationLayer", "alarm", "syncSignals", "latchSignals")),
    Need("syncSignals", Seq("clocks"), least = 2),
    Need("latchSignals", Seq("clocks"), least = 2),
    Need("directSpeed", Seq("clocks"), least = 2),
    Need("enhancedSync", Seq("syncSignals")),
    Need("timeByPdi", Seq("latchSignals")),
    Need("meanWays", Seq("clocks")),
    Need("eventTimes", Seq("clocks")),
    Need("eventTimes", Seq("syncManagers")),
    Need("clockPowerSaving", Seq("syncSignals", "latchSignals")),
    Need("clockPowerSaving", Seq("sii")),
    Need("digitalInputs", Seq("ramKiB")),
    Need("digitalInputEvent", Seq("digitalInputs")),
    Need("digitalOutputEvent", Seq("digitalOutputs")),
    Need("digitalWatchdogLate", Seq("digitalOutputs")),
    Need("miLinkDetection", Seq("mi")),
    Need("enhancedLinkDetection", Seq("mi")),
    Need("phyAddressOffset", Seq("mi")),
    Need("fxPorts", Seq("miLinkDetection", "enhancedLinkDetection"))
  )

  private def txShift(p: EscParams) = Option.when(p.txShift >= p.cyclesPerNibble)(
    s"txShift is ${p.txShift} but must be 0 to ${p.cyclesPerNibble - 1} core cycles at coreClockMhz " +
      s"${p.coreClockMhz}."
  )

  /** What only one host interface has. */
  private val ofInterfaces = Seq("spiLateSample", "spiSelHigh").map(_ -> 4) ++ Seq(
    "busWriteEarly",
    "busBusyEarly",
    "busBusyDriver",
    "busReadDelay",
    "busReadAll",
    "busReadHigh",
    "busByteEnableHigh"
  ).map(_ -> 5) ++
    Seq("digitalInputs", "digitalInputEvent", "digitalOutputEvent", "digitalWatchdogLate").map(_ -> 6)

  private def hostInterface(p: EscParams): Seq[String] = ofInterfaces.collect {
    case (name, interface) if p.hostInterface != interface && ParamTable(name).get(p) != 0 =>
      s"$name is ${ParamTable(name).get(p)} but must be 0 if hostInterface is ${p.hostInterface}."
  } ++ Seq(
    // AXI4-Lite has words of 32 bits.
    Option.when(p.hostInterface == 2 && p.dataBusWidth != 32)(
      s"hostInterface is 2 but must be 0, 1 or 3 to 6 at dataBusWidth ${p.dataBusWidth}."
    ),
    // A host that waits before it ends its write would wait forever.
    Option.when(p.hostInterface == 5 && p.busBusyEarly == 1 && p.busWriteEarly == 0)(
      "busBusyEarly is 1 but must be 0 if busWriteEarly is 0."
    )
  ).flatten

  /** Half a nibble is a whole number of core cycles. */
  private def rmii(p: EscParams) = ofPorts("rmiiPorts", p).orElse(
    Option.when(p.rmiiPorts != 0 && p.coreClockMhz % 50 != 0)(
      f"rmiiPorts is 0x${p.rmiiPorts}%x but must be 0x0 at coreClockMhz ${p.coreClockMhz}."
    )
  )

  /** A parameter with a bit per port has none of ports that are not there. */
  private def ofPorts(name: String, p: EscParams): Option[String] = {
    val (value, all) = (ParamTable(name).get(p), (1 << p.portCount) - 1)
    Option.when(value > all)(
      f"$name is 0x$value%x but must be 0x0 to 0x$all%x with ${p.portCount} ports."
    )
  }

  private def ofSlave(p: EscParams): Seq[String] = {
    val ports = Seq("linkLowPorts", "fxPorts").flatMap(ofPorts(_, p))
    (if (p.hasRing) besideRing(p) else withoutRing(p)) ++ Seq(
      Option.when(p.hasPlant)("plant is 1 but must be 0 if role is 0."),
      Option.when(p.writeLogDepth > p.longestWriteLog)(
        s"registerWritesPerFrame is ${p.registerWritesPerFrame} but must be 0 (derived) or 16 to " +
          s"${p.longestWriteLog} bytes at coreClockMhz ${p.coreClockMhz}."
      ),
      scanned("fmmus", p),
      scanned("syncManagers", p),
      Option.when(p.hasSystemTime && p.coreClockMhz < 100)(
        s"clocks is ${p.clocks} but must be 0 to 1 at coreClockMhz ${p.coreClockMhz}."
      ),
      // Reads of AXI4-Lite take whole words, and would acknowledge what nobody has looked at.
      Option.when(p.hostInterface == 2 && p.isAcknowledged && !p.acknowledgesByWrite)(
        "acknowledgeByWrite is 0 but must be 1 if hostInterface is 2."
      ),
      Option.when(p.hasMeanWays && p.ports == 1)("meanWays is 1 but must be 0 if ports is 1.")
    ).flatten ++ digitalIo(p) ++ ports ++ (if (ports.isEmpty) needs.flatMap(_.problem(p)) else Nil) ++ phys(p)
  }

  /** Without a host: what has no use without one, and what the outputs must have to be safe (B-118). */
  private def digitalIo(p: EscParams): Seq[String] = if (!p.isDigitalIo) Nil
  else {
    def must(name: String, range: String, allowed: Int => Boolean) = {
      val value = ParamTable(name).get(p)
      Option.when(!allowed(value))(s"$name is $value but must be $range if hostInterface is 6.")
    }
    val sync = Seq("digitalInputEvent", "digitalOutputEvent").flatMap { name =>
      val value = ParamTable(name).get(p)
      Option.when(value - 1 > p.syncSignals)(
        s"$name is $value but must be 0 to ${p.syncSignals + 1} if syncSignals is ${p.syncSignals}."
      )
    }
    Seq("acknowledgeByWrite", "timeByPdi", "alarm").flatMap(must(_, "0", _ == 0)) ++
      Seq("mi", "sii").flatMap(must(_, "0 or 1", _ < 2)) ++ must("applicationLayer", "1", _ == 1) ++
      (if (p.digitalOutputs > 0) must("watchdogs", "1", _ == 1)
       else if (p.digitalInputs > 0) None
       else must("digitalOutputs", "1 to 4", _ > 0)) ++ sync
  }

  /** FMMUs and SyncManagers are looked through one per core cycle, in two halves, while a byte passes. */
  private def scanned(name: String, p: EscParams): Option[String] = {
    val value = ParamTable(name).get(p)
    Option.when(value > 0 && p.coreClockMhz < 100)(
      s"$name is $value but must be 0 at coreClockMhz ${p.coreClockMhz}."
    )
  }

  /** Each PHY has an address of its own (LNK-12). */
  private def phys(p: EscParams): Seq[String] = {
    val shown = f"0x${p.phyAddresses}%04x"
    Seq(
      Option.when(p.phyAddresses >= 0 && !p.hasMi)(s"phyAddresses is $shown but must be -1 if mi is 0."),
      Option.when(p.hasMi && p.phyAddresses >= 0 && p.phyAddressOffset != 0)(
        s"phyAddressOffset is ${p.phyAddressOffset} but must be 0 if phyAddresses is $shown."
      ),
      Option.when(p.hasMi && (0 until p.ports).map(p.phyAddress).distinct.size < p.ports)(
        s"phyAddresses is $shown but must have ${p.ports} different addresses for as many ports."
      )
    ).flatten
  }

  /** A master has two ports, and nothing of others. */
  private def ofMaster(p: EscParams): Seq[String] = nothingElse(p)

  /** A ring node has two ports, too. */
  private def ofRing(p: EscParams): Seq[String] =
    nothingElse(p) ++ Need("txShift", Seq("plant")).problem(p) ++ Option.when(!p.hasRing)(
      "ring is 0 but must be 1 to 2 if role is 2."
    ) ++ ofNode(p)

  /** What a node of a ring is made of, alone or in a slave. */
  private def ofNode(p: EscParams): Seq[String] =
    Option.when(p.bridge == 1 && p.canPorts == 1)("canPorts is 1 but must be 2 if bridge is 1.").toSeq ++
      Option.when(p.bridge == 1 && p.filters < CanParams.BridgeFilters.end)(
        s"filters is ${p.filters} but must be ${CanParams.BridgeFilters.end} to 32 if bridge is 1."
      ) ++
      FibreParams.problems(
        p.coreClockMhz,
        p.toneDominantKhz,
        p.toneSearchKhz,
        p.toneRecessiveKhz,
        p.demodulator
      )

  /** A slave with a ring (GW-01): its host reaches both. */
  private def besideRing(p: EscParams): Seq[String] = {
    val hosts = ParamTable("hostInterface").in(2)
    val ram   = EscParams.RingSpace / 1024 - 4
    Seq(
      Option.unless(Set(50, 100)(p.coreClockMhz))(
        s"coreClockMhz is ${p.coreClockMhz} but must be 50 or 100 MHz if ring is ${p.ring}."
      ),
      Option.unless(hosts.allowed(p.hostInterface))(
        s"hostInterface is ${p.hostInterface} but must be ${hosts.range} if ring is ${p.ring}."
      ),
      Option.when(p.ramKiB > ram)(s"ramKiB is ${p.ramKiB} but must be 0 to $ram KiB if ring is ${p.ring}."),
      Option.when(p.hasAlarm)(s"alarm is 1 but must be 0 if ring is ${p.ring}.")
    ).flatten ++ ofNode(p)
  }

  private def withoutRing(p: EscParams): Seq[String] =
    Seq("demodulator" -> 0, "bridge" -> 0, "canPorts" -> 1).flatMap { case (name, least) =>
      val value = ParamTable(name).get(p)
      Option.when(value != least)(s"$name is $value but must be $least if ring is 0.")
    }

  /** What is 0 by default in other controllers is so in this one, and they have no RAM. */
  private def nothingElse(p: EscParams): Seq[String] = {
    val none    = EscParams(ramKiB = 0)
    val role    = s"if role is ${p.role}"
    val nothing = ParamTable.all.filter(i => !i.roles(p.role) && i.get(none) == 0)
    Option.when(p.ports != 2)(s"ports is ${p.ports} but must be 2 $role.").toSeq ++
      nothing.filter(_.get(p) != 0).map(i => s"${i.name} is ${i.show(p)} but must be 0 $role.") ++
      Option.when(p.phyAddresses >= 0)(f"phyAddresses is 0x${p.phyAddresses}%04x but must be -1 $role.")
  }
}
