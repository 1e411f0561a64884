package flyframe

import flyframe.params.{EscParams, Presets}

/** Parameter sets for hosts at their pins (`src/sim/hosts`): what `make hosts` tests and the report measures.
  */
object HostPinSets {

  // Small, as each is a model of its own; what FMMUs and ports do no host sees.
  private val atPins = Presets
    .named("slave")
    .get
    .params
    .copy(
      ports = 1,
      leds = 0,
      watchdogs = 0,
      sii = 0,
      ramKiB = 1,
      fmmus = 0,
      syncManagers = 4
    )

  /** Each host interface, mode and width, for hosts at their pins. */
  val all: Seq[EscParams] = {
    def set(name: String, interface: Int, width: Int) =
      atPins.copy(preset = s"hosts-$name", hostInterface = interface, dataBusWidth = width)
    val widths =
      for ((name, interface) <- Seq("port" -> 0, "avalon" -> 1, "wb" -> 3); width <- Seq(8, 16, 32))
        yield set(s"$name-$width", interface, width)
    widths ++ Seq(
      set("axi", 2, 32).copy(acknowledgeByWrite = 1),
      set("spi-0", 4, 8).copy(spiMode = 0),
      set("spi-1", 4, 32).copy(spiMode = 1, spiLateSample = 1),
      set("spi-2", 4, 16).copy(spiMode = 2, spiSelHigh = 1),
      set("spi-3", 4, 8).copy(spiMode = 3),
      set("bus-8", 5, 8).copy(busWriteEarly = 1, busBusyEarly = 1, busBusyDriver = 2, busReadHigh = 1),
      set("bus-16", 5, 16),
      set("bus-32", 5, 32).copy(busBusyDriver = 1, busByteEnableHigh = 1, busReadDelay = 1)
    )
  }

  /** Of them, one of each interface, for a short run. */
  val short: Seq[EscParams] = all.filter(p =>
    Set("port-8", "avalon-32", "axi", "wb-16", "spi-0", "bus-16").contains(p.preset.stripPrefix("hosts-"))
  )

  /** Of them, those whose times are measured: other widths, and SPI modes, take what lies between, or the
    * same.
    */
  val measured: Seq[(String, EscParams)] = Seq(
    "port-8"    -> "Port, 8 bits",
    "port-32"   -> "Port, 32 bits",
    "avalon-8"  -> "Avalon-MM, 8 bits",
    "avalon-32" -> "Avalon-MM, 32 bits",
    "axi"       -> "AXI4-Lite, 32 bits",
    "wb-8"      -> "Wishbone B4, 8 bits",
    "wb-32"     -> "Wishbone B4, 32 bits",
    "spi-0"     -> "SPI",
    "bus-8"     -> "Microcontroller bus, 8 bits",
    "bus-16"    -> "Microcontroller bus, 16 bits",
    "bus-32"    -> "Microcontroller bus, 32 bits"
  ).map { case (name, title) => title -> all.find(_.preset == s"hosts-$name").get }
}
