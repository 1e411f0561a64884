package flyframe.registers

import flyframe.params.EscParams
import RegisterTable._

/** The registers of a ring node (NODE): its identity, time and events, and those of its units. */
object NodeRegisters {
  val Identity = 0x0000
  val Time     = 0x001c

  /** Events, write 1 clears; those of them that interrupt the host. */
  val Events: Int = RingRegisters.Events
  val Mask: Int   = RingRegisters.Mask

  /** First bit of the events of each CAN port, in the order of [[CanEvents]]. */
  val CanEventBits: Seq[Int] = Seq(0, 8)

  /** Names and meanings of a CAN port's events. */
  val CanEvents: Seq[(String, String)] = Seq(
    "received"  -> "a frame was received",
    "slot_done" -> "a slot was sent or has failed",
    "state"     -> "the state or the warning changed",
    "bus_error" -> "there was a bus error",
    "overrun"   -> "a frame was dropped as the FIFO was full"
  )

  private val ringEvents = Seq(
    ("ring_event_port", RingRegisters.PortEvent, "a port came up or went down"),
    ("ring_event_mode", RingRegisters.ModeEvent, "mode or guard changed")
  )

  private val relayEvents = Seq(
    ("ring_event_conflict", RingRegisters.ConflictEvent, "another node has the address")
  )

  /** First bit of the events of the plant port. */
  val PlantEventBits = 13

  private val plantEvents = Seq(
    "received" -> "a datagram of the server has come",
    "sent"     -> "the datagram has been made, and the next one may be sent",
    "link"     -> "the link to the plant network came up or went down"
  ).zipWithIndex.map { case ((name, text), i) => (s"plant_event_$name", PlantEventBits + i, text) }

  /** Name, bit and meaning of each event of a node. */
  def events(p: EscParams): Seq[(String, Int, String)] = {
    val can = for (port <- 0 until p.canPorts; ((name, text), i) <- CanEvents.zipWithIndex) yield {
      val of = CanRegisters.Ports(port)
      (s"${of}_event_$name", CanEventBits(port) + i, s"$of: $text")
    }
    (can ++ ringEvents ++ (if (p.hasRelay) relayEvents else Nil) ++ (if (p.hasPlant) plantEvents else Nil))
      .sortBy(_._2)
  }

  // format: off
  def apply(p: EscParams): Seq[Register] = Seq(
    register(Identity,     1, "node_type",     no, r,  "NODE-04", "Family",
      field("node_type",      7, 0, constant, p.escType,     "Controller family")),
    register(Identity + 1, 1, "node_revision", no, r,  "NODE-04", "Revision",
      field("node_revision",  7, 0, constant, p.escRevision, "Family revision")),
    register(Identity + 2, 2, "node_build",    no, r,  "NODE-04", "Build",
      field("node_build",    15, 0, constant, p.escBuild,    "Build number")),
    register(Time,         4, "node_time",     no, r,  "CAN-45",  "Time",
      field("node_time",     31, 0, status,   0,             "us since the reset")),
    register(Events,       2, "node_events",   no, rw, "FB-10",   "Events; write 1 clears",
      events(p).map { case (name, bit, text) => field(name, bit, bit, status, 0, s"1: $text") }: _*),
    register(Mask,         2, "node_mask",     no, rw, "FB-10",   "Events that interrupt the host",
      events(p).map { case (name, bit, text) =>
        field(name.replace("_event", "_mask"), bit, bit, stored, 0, s"1: $text") }: _*)
  ) ++ RingRegisters(p.nodeIdWidth, p.hasRelay) ++
    (if (p.hasRelay) RingRegisters.relay ++ RingRegisters.distances else Nil) ++
    (0 until p.canPorts).flatMap(CanRegisters(_, p.can)) ++ (if (p.hasPlant) PlantRegisters.all else Nil)
  // format: on
}
