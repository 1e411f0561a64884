package flyframe.params

import ParamTable.{between, hosts, oneOf}

/** In which controllers a parameter has an effect, and what is different about it there. */
private[params] object ParamRoles {

  /** Parameters that have an effect in all controllers. */
  private val ofAll = Set(
    "role",
    "dataBusWidth",
    "coreClockMhz",
    "hostInterface",
    "spiMode",
    "spiLateSample",
    "spiSelHigh",
    "busWriteEarly",
    "busBusyEarly",
    "busBusyDriver",
    "busReadDelay",
    "busReadAll",
    "busReadHigh",
    "busByteEnableHigh",
    "escType",
    "escRevision",
    "escBuild"
  )

  /** Parameters that have an effect in one kind of controller only, or in some. */
  private val ofMastersOnly = Set("maxSlaves", "linePorts")
  private val ofMasters     = ofAll ++ ofMastersOnly ++ Seq("maxSubTelegrams", "txShift", "rmiiPorts")

  /** What a node of a fibre ring is made of, alone or in a slave. */
  private val ofNodes = Set(
    "ring",
    "canPorts",
    "demodulator",
    "toneDominantKhz",
    "toneSearchKhz",
    "toneRecessiveKhz",
    "rxFrames",
    "filters",
    "bridge"
  )
  private val ofRingsOnly = Set("plant")
  private val ofRings =
    ofAll.filterNot(_.startsWith("spi")) ++ ofNodes ++ ofRingsOnly ++
      Seq("nodeIdWidth", "txShift", "rmiiPorts")

  /** What is different in a master. */
  private val inMasters: Map[String, ParamInfo => ParamInfo] = {
    def text(text: String)(i: ParamInfo) = i.copy(text = text)
    val (clocks, isClock)                = oneOf(50, 100, 125)
    val (threePorts, isOfThree)          = between(0, 0x7)
    val (withHost, hasHost)              = between(0, 5)
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
      "coreClockMhz"  -> (_.copy(range = clocks, allowed = isClock)),
      "hostInterface" -> (_.copy(text = hosts, range = withHost, allowed = hasHost)),
      "rmiiPorts"     -> (_.copy(range = threePorts, allowed = isOfThree)),
      "escType"       -> text("identity: type, 0x00 of the host's registers") _,
      "escRevision"   -> text("identity: revision, 0x01 of the host's registers") _,
      "escBuild"      -> text("identity: build, 0x02:0x03 of the host's registers") _
    )
  }

  /** What is different in a node of a ring. */
  private val inRings: Map[String, ParamInfo => ParamInfo] = {
    def identity(bytes: String, what: String)(i: ParamInfo) = i.copy(text = s"identity: $what, $bytes")
    val (clocks, isClock)                                   = oneOf(50, 100)
    val (withHost, hasHost)                                 = oneOf(0, 1, 2, 3, 5)
    val (widths, isWidth)                                   = between(4, 7)
    val (onePort, isOfOne)                                  = between(0, 0x1)
    Map(
      "dataBusWidth" -> (_.copy(text = "bits moved per access of the host")),
      "nodeIdWidth" -> (_.copy(
        text = "implemented bits of the node's address",
        range = widths,
        allowed = isWidth
      )),
      "coreClockMhz" -> (_.copy(range = clocks, allowed = isClock)),
      // SPI cannot wait, as accesses to a CAN port may have to.
      "hostInterface" -> (_.copy(
        text = hosts.replace(" 4 SPI;", ""),
        range = withHost,
        allowed = hasHost
      )),
      "rmiiPorts"   -> (_.copy(range = onePort, allowed = isOfOne)),
      "escType"     -> identity("0x0000", "family") _,
      "escRevision" -> identity("0x0001", "revision") _,
      "escBuild"    -> identity("0x0002:0x0003", "build") _
    )
  }

  private def rolesOf(name: String): Set[Int] = Map(
    0 -> !(ofMastersOnly ++ ofRingsOnly)(name),
    1 -> ofMasters(name),
    2 -> ofRings(name)
  ).collect { case (role, true) => role }.toSet

  /** A parameter of slaves with what it is in controllers of all roles. */
  def apply(i: ParamInfo): ParamInfo = {
    val others = Seq(1 -> inMasters, 2 -> inRings).collect {
      case (role, changes) if changes.contains(i.name) => role -> changes(i.name)(i)
    }
    i.copy(
      roles = rolesOf(i.name),
      elsewhere = others.toMap.map { case (role, o) =>
        role -> o.copy(roles = rolesOf(i.name))
      }
    )
  }

  /** Nodes of a ring have it, and controllers without a ring do not. */
  def isOfNodes(name: String): Boolean = ofNodes(name) || ofRingsOnly(name)
}
