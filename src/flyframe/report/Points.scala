package flyframe.report

import flyframe.params.{EscParams, ParamInfo, ParamTable, Preset, Presets}

/** A preset, `base`, with one parameter changed; `preset` in `params` is the name of its files.
  *
  * @param needs
  *   in words: what else is changed, as that parameter needs it
  */
final case class Variant(
    base: EscParams,
    info: ParamInfo,
    value: Int,
    params: EscParams,
    needs: Option[String] = None
) {
  def title: String = (if (base == Points.base) "" else s"${base.preset}, ") + s"${info.name} $value"
}

/** A host interface that is measured alone: what it takes beside a controller with a plain host port.
  *
  * @param module
  *   its Verilog module
  * @param params
  *   a controller that has it
  * @param goal
  *   most logic elements it should take
  */
final case class HostPoint(title: String, module: String, params: EscParams, goal: Int)

/** What is measured. */
object Points {

  /** The preset the goals are set for and the variants start from. */
  val base: EscParams = Presets.named("cyclone4-min").map(_.params).get

  /** What a frame may take through `base`, both ways, in ns. */
  val latencyNs = 100

  /** The preset with everything a master needs. */
  val complete: EscParams = Presets.named("slave").map(_.params).get

  private def variant(base: EscParams, short: String, name: String)(value: Int): Variant = {
    val info = ParamTable.named(name).get
    Variant(base, info, value, info.set(base, value).copy(preset = s"$short-$name-$value"))
  }

  /** The base with digital I/O in place of a host. */
  val digital: Variant = {
    val v = variant(base, "min", "hostInterface")(6)
    v.copy(
      params = v.params.copy(applicationLayer = 1, watchdogs = 1, digitalOutputs = 4, digitalInputs = 4),
      needs = Some("applicationLayer, watchdogs, 32 outputs, 32 inputs")
    )
  }

  /** One row each in "What a feature costs". */
  val variants: Seq[Variant] = Seq(
    "dataBusWidth"    -> Seq(16, 32),
    "ports"           -> Seq(1, 4),
    "maxSubTelegrams" -> Seq(1, 128),
    "nodeIdWidth"     -> Seq(4, 8),
    "ramKiB"          -> Seq(8),
    "coreClockMhz"    -> Seq(25, 50, 125),
    "rmiiPorts"       -> Seq(3)
  ).flatMap { case (name, values) => values.map(variant(base, "min", name)) } :+ digital

  /** The same from the complete slave. */
  val completeVariants: Seq[Variant] = Seq(
    "fmmus"              -> Seq(0, 3, 16),
    "fmmuBitwise"        -> Seq(0),
    "syncManagers"       -> Seq(2, 4, 16),
    "sequentialMode"     -> Seq(1),
    "deactivationDelay"  -> Seq(1),
    "openBuffers"        -> Seq(1),
    "acknowledgeByWrite" -> Seq(1),
    "watchdogs"          -> Seq(0),
    "leds"               -> Seq(0),
    "digitalOutputs"     -> Seq(4),
    "sii"                -> Seq(0, 2),
    "mi"                 -> Seq(1, 2),
    "clocks"             -> Seq(1, 2),
    "resetRegisters"     -> Seq(1),
    "writeProtection"    -> Seq(1),
    "hostInterface"      -> Seq(1, 3, 4, 5),
    "dataBusWidth"       -> Seq(32)
  ).flatMap { case (name, values) => values.map(variant(complete, "slave", name)) }

  /** Each host interface. AXI4-Lite has 32 bits and no reading without effects. */
  val hosts: Seq[HostPoint] = {
    def of(title: String, module: String, value: Int, goal: Int) =
      HostPoint(title, module, variant(complete, "slave", "hostInterface")(value).params, goal)
    val wide = of("AXI4-Lite, 32 bits", "AxiLiteInterface", 2, 150)
    Seq(
      of("SPI", "SpiInterface", 4, 250),
      of("Microcontroller bus, 8 bits", "MicrocontrollerInterface", 5, 200),
      of("Avalon-MM, 8 bits", "AvalonInterface", 1, 60),
      wide.copy(params = wide.params.copy(dataBusWidth = 32, acknowledgeByWrite = 1)),
      of("Wishbone B4, 8 bits", "WishboneInterface", 3, 60)
    )
  }

  /** The same from the alarm master. */
  val masterVariants: Seq[Variant] =
    Seq(variant(Presets.named("alarm-master").map(_.params).get, "alarm-master", "linePorts")(2))

  /** An alarm master with a ring. */
  val ring: EscParams = masterVariants.head.params

  /** The same from the largest controller. */
  val largestVariants: Seq[Variant] = Seq(
    "ports"                 -> 2,
    "latchSignals"          -> 0,
    "enhancedSync"          -> 1,
    "clockBits"             -> 32,
    "meanWays"              -> 1,
    "eventTimes"            -> 1,
    "timeByPdi"             -> 1,
    "directSpeed"           -> 1,
    "miLinkDetection"       -> 1,
    "enhancedLinkDetection" -> 0
  ).map { case (name, value) => variant(Presets.named("et1100").map(_.params).get, "et1100", name)(value) }

  /** It with two ports. */
  val largest: EscParams = largestVariants.head.params

  /** All variants. */
  def allVariants: Seq[Variant] =
    variants ++ completeVariants ++ masterVariants ++ largestVariants

  /** The base at every core clock, slowest first. */
  val clocks: Seq[EscParams] =
    (variants.filter(_.info.name == "coreClockMhz").map(_.params) :+ base).sortBy(_.coreClockMhz)

  /** Those of EtherCAT alone; the others are [[RingPoints]]. */
  val presets: Seq[EscParams] =
    Presets.all.map { case Preset(p, _, _) => p }.filterNot(RingPoints.presets.contains)

  /** Those that frames pass through. */
  val slaves: Seq[EscParams] = presets.filter(_.role == 0)

  /** Every controller that is mapped as a whole. */
  val all: Seq[EscParams] = presets ++ allVariants.map(_.params)

  /** The units the area is split into, with the modules that they begin at, in the order of the wire path.
    * What lies below such a module belongs to its unit, but for what begins another one.
    */
  val units: Seq[(String, Set[String])] = Seq(
    "Receive crossings"                       -> Set("MiiRxCrossing", "LevelCrossing"),
    "Receivers"                               -> Set("MiiReceiver"),
    "Frame parser"                            -> Set("FrameParser"),
    "Datagram header"                         -> Set("DatagramHeader"),
    "Data access"                             -> Set("DataAccess", "TranslatedAccess"),
    "FMMUs"                                   -> Set("Fmmus"),
    "SyncManagers"                            -> Set("SyncManagers", "AreaScan"),
    "Frame processor: counters, FCS, verdict" -> Set("FrameProcessor"),
    "Transmitters"                            -> Set("MiiTransmitter"),
    "Register file"                           -> Set("RegisterFile", "EventCounters"),
    "Memory and host port" -> Set("EscMemory", "HostSequencer", "MasterHost", "NetworkSettings", "HostEvent"),
    "Host interface" ->
      Set(
        "AvalonInterface",
        "AxiLiteInterface",
        "WishboneInterface",
        "SpiInterface",
        "MicrocontrollerInterface",
        "DigitalInputs",
        "DigitalOutputs"
      ),
    "SII EEPROM"                -> Set("SiiController"),
    "Smoke detector, appending" -> Set("AlarmUnit", "DatagramAppender"),
    "Line master"               -> Set("LineMaster"),
    "Plant network, reports"    -> Set("PlantSide"),
    "Distributed clocks" ->
      Set("LocalClock", "ReceiveTimes", "MeanWays", "WordEngine", "SpeedControl", "SyncSignal", "LatchEdge"),
    "Watchdogs"            -> Set("Watchdog", "WatchdogDivider"),
    "LEDs"                 -> Set("LedControl", "LedPattern"),
    "Write log"            -> Set("WriteLog"),
    "Loops and slot timer" -> Set("LoopControl", "TemporaryLoops", "SlotTimer"),
    "Wire path and glue"   -> Set.empty
  )

  /** The unit of everything that is in no other. */
  val rest: String = units.last._1

  /** The unit of a Verilog module, if it starts one. */
  def unitOf(module: String): Option[String] = units.collectFirst {
    case (unit, modules) if modules(module) => unit
  }
}
