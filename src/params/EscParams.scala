package flyframe.params

/** All parameters of one EtherCAT slave controller. A value, checked by [[EscParams.problems]]; behaviour is
  * a function of it.
  *
  * Every field has an entry in [[ParamTable.all]], from which the command line, its help, the checks and the
  * documentation are made.
  */
final case class EscParams(
    preset: String = "custom",
    dataBusWidth: Int = 8,
    maxSubTelegrams: Int = 15,
    nodeIdWidth: Int = 16,
    ports: Int = 2,
    coreClockMhz: Int = 100,
    ramKiB: Int = 1,
    registerWritesPerFrame: Int = 0,
    txShift: Int = 0,
    temporaryLoopMs: Int = 1000,
    escType: Int = 0xf1,
    escRevision: Int = 0,
    escBuild: Int = 1,
    reportedFmmus: Int = 0,
    reportedSyncManagers: Int = 0,
    reportedRamKiB: Int = -1,
    reportedPorts: Int = -1,
    reportedFeatures: Int = -1
) {

  /** Core clock cycles per nibble slot (40 ns on the wire): 1, 2, 4 or 5. */
  def cyclesPerNibble: Int = coreClockMhz / 25

  /** Bytes moved per access on the path between frame processor, memory and host: 1, 2 or 4. */
  def lanes: Int = dataBusWidth / 8

  /** Process data RAM in bytes, from 0x1000 on. */
  def ramBytes: Int = ramKiB * 1024

  /** Register bytes one frame may write; more are refused without a working counter. The log must be
    * committed before the next frame can reach a register: 88 nibble slots lie between, of which 64 are used.
    */
  def writeLogDepth: Int =
    if (registerWritesPerFrame > 0) registerWritesPerFrame else (64 * cyclesPerNibble) min 256

  /** Byte 0x0006 as reported, KiB. */
  def ramSizeReported: Int = if (reportedRamKiB >= 0) reportedRamKiB else ramKiB

  /** Byte 0x0007 as reported: two bits per port, 11 = MII. */
  def portDescriptor: Int = if (reportedPorts >= 0) reportedPorts else (1 << (2 * ports)) - 1

  /** Word 0x0008 as reported (GEN-07); derived: bit 7, separate counting of forwarded errors. */
  def features: Int = if (reportedFeatures >= 0) reportedFeatures else 0x0080

  /** Verilog name of the top module. */
  def topName: String = preset.replaceAll("[^A-Za-z0-9]", "_")
}

/** Everything about one parameter: its name, text, unit, range, and how to read and change it in an
  * [[EscParams]].
  */
final case class ParamInfo(
    name: String,
    text: String,
    unit: String,
    range: String,
    allowed: Int => Boolean,
    get: EscParams => Int,
    set: (EscParams, Int) => EscParams,
    hex: Boolean = false
) {

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

  val all: Seq[ParamInfo] = Seq(
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
    info("ports", "MII ports", "ports", between(1, 4))(_.ports)((p, v) => p.copy(ports = v)),
    info("coreClockMhz", "core clock", "MHz", oneOf(25, 50, 100, 125))(_.coreClockMhz)((p, v) =>
      p.copy(coreClockMhz = v)
    ),
    info("ramKiB", "process data RAM from 0x1000", "KiB", between(0, 60))(_.ramKiB)((p, v) =>
      p.copy(ramKiB = v)
    ),
    info(
      "registerWritesPerFrame",
      "register bytes one frame may write (0: as many as the core clock can commit, at most 256)",
      "bytes",
      ("0 (derived) or 16 to 352", v => v == 0 || (v >= 16 && v <= 352))
    )(_.registerWritesPerFrame)((p, v) => p.copy(registerWritesPerFrame = v)),
    info("txShift", "delay of TXD and TX_EN against the nibble slot", "core cycles", between(0, 4))(
      _.txShift
    )((p, v) => p.copy(txShift = v)),
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
    info("reportedFmmus", "FMMUs as 0x0004 reports them (replay identities only)", "FMMUs", between(0, 16))(
      _.reportedFmmus
    )((p, v) => p.copy(reportedFmmus = v)),
    info(
      "reportedSyncManagers",
      "SyncManagers as 0x0005 reports them (replay identities only)",
      "SyncManagers",
      between(0, 16)
    )(_.reportedSyncManagers)((p, v) => p.copy(reportedSyncManagers = v)),
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
  )

  def named(name: String): Option[ParamInfo] = all.find(_.name == name)
}

object EscParams {

  /** Why `p` cannot be built: one sentence per problem, naming the parameter, its value and the allowed
    * range. Empty = fine.
    */
  def problems(p: EscParams): Seq[String] = {
    val single = ParamTable.all.filterNot(i => i.allowed(i.get(p))).map { i =>
      s"${i.name} is ${i.show(p)} but must be ${i.range}${if (i.unit == "code") "" else " " + i.unit}."
    }
    if (single.nonEmpty) single
    else
      Seq(
        Option.when(p.writeLogDepth > 88 * p.cyclesPerNibble)(
          s"registerWritesPerFrame is ${p.registerWritesPerFrame} but must be 0 (derived) or 16 to ${88 * p.cyclesPerNibble} bytes at coreClockMhz ${p.coreClockMhz}."
        ),
        Option.when(p.txShift >= p.cyclesPerNibble)(
          s"txShift is ${p.txShift} but must be 0 to ${p.cyclesPerNibble - 1} core cycles at coreClockMhz ${p.coreClockMhz}."
        )
      ).flatten
  }

  /** `p` if it can be built, else the first problem. */
  def check(p: EscParams): Either[String, EscParams] = problems(p).headOption.toLeft(p)
}
