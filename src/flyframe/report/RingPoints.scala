package flyframe.report

import flyframe.params.{EscParams, ParamTable, Presets}

/** What is measured of the fibre ring (section 15 of its specification). */
object RingPoints {

  /** The presets, with the most logic elements and M9K that each should take. */
  val goals: Seq[(EscParams, Int, Int)] = Seq(
    ("ring-bus", 1600, 5),
    ("ring-node", 2800, 9),
    ("ring-node-tp", 3800, 13),
    ("ring-server", 5200, 26),
    ("ring-gateway", 8500, 30)
  ).map { case (name, elements, blocks) => (Presets.named(name).map(_.params).get, elements, blocks) }

  val presets: Seq[EscParams] = goals.map(_._1)

  /** The node with relay mode, from which the variants start. */
  val base: EscParams = presets(1)

  private def variant(base: EscParams, name: String)(value: Int): Variant = {
    val info = ParamTable.named(name).get
    Variant(base, info, value, info.set(base, value).copy(preset = s"${base.preset}-$name-$value"))
  }

  /** One row each in "What a feature costs". */
  val variants: Seq[Variant] = Seq(
    "ring"         -> Seq(1),
    "canPorts"     -> Seq(2),
    "coreClockMhz" -> Seq(50),
    "demodulator"  -> Seq(1),
    "rxFrames"     -> Seq(16, 128),
    "filters"      -> Seq(4, 32),
    "nodeIdWidth"  -> Seq(4),
    "dataBusWidth" -> Seq(32)
  ).flatMap { case (name, values) => values.map(variant(base, name)) }

  val all: Seq[EscParams] = presets ++ variants.map(_.params)

  private def Connects = "What connects, time, host"
  private def Slave    = "EtherCAT slave"

  /** The units that the area is split into, with the modules that they begin at, as [[Points.units]]. */
  val units: Seq[(String, Set[String])] = Seq(
    "Optical ports: tones, signal, states" -> Set("OpticalPort"),
    "Bus mode, guard"                      -> Set("BusMode", "BitClock"),
    "CAN: bits and frames"                 -> Set("BitTiming", "ProtocolEngine", "FrameShift"),
    "CAN: slots, filters, FIFO, memory" ->
      Set("SlotStates", "SlotOrder", "AcceptanceFilter", "ReceiveFifo", "PortMemory"),
    "CAN: records and counters"      -> Set("EventRecorder", "WordCounters"),
    "CAN: registers"                 -> Set("PortHost"),
    "CAN: what connects"             -> Set("CanPort"),
    "Bridge"                         -> Set("Bridge"),
    "Link receivers"                 -> Set("LinkInput"),
    "Link senders"                   -> Set("LinkSender"),
    "Passing on"                     -> Set("PassingOn"),
    "Own frames: slots, confirming"  -> Set("OwnFrames", "SlotList", "OwnBytes"),
    "Receiving: sources, delivering" -> Set("Receiving", "Sources"),
    "Relay mode: what connects"      -> Set("RelayMode"),
    "Plant network"                  -> Set("PlantNetwork"),
    "Registers of ring and node"     -> Set("RingHost", "RelayHost", "NodeHost"),
    Connects                         -> Set("ring_gateway_node"),
    Slave                            -> Set.empty
  )

  /** The unit of everything in a preset that is in no other. */
  def rest(p: EscParams): String = if (p.isRing) Connects else Slave

  def unitOf(module: String): Option[String] = units.collectFirst {
    case (unit, modules) if modules(module) => unit
  }
}
