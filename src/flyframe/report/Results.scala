package flyframe.report

import flyframe.clocks.MiiRxCrossing
import flyframe.params.EscParams

/** All figures of one run. Keys of the maps are file names of parameter sets, as in
  * [[flyframe.params.EscParams.preset]].
  *
  * @param hosts
  *   the area of each of [[Points.hosts]], by its module
  * @param hostTimes
  *   what accesses of [[flyframe.HostPinSets.measured]] take
  * @param withCarry
  *   the area of presets with carry chains; goals are for `area`, without them
  */
final case class Results(
    version: String,
    tools: Seq[(String, String)],
    area: Map[String, Area],
    hosts: Map[String, Area],
    hostTimes: Map[String, Seq[AccessTime]],
    withCarry: Map[String, Area],
    units: Map[String, Map[String, Area]],
    speed: Map[String, Speed],
    latency: Map[String, Latency],
    alarm: AlarmResults
) {

  /** Forwarding and processing, worst, ns; none for a master. */
  def delays(p: EscParams): Option[Seq[Double]] =
    latency.get(p.preset).map(l => Seq(l.forwarding.worstNs, l.processing.worstNs))
}

/** A goal, what was measured, and whether that is good enough. */
final case class Goal(title: String, goal: String, measured: String, reached: Boolean)

/** Core cycles from the receive clock edge that samples a nibble to the edge after which it is on TXD, in the
  * worst phase.
  */
final case class Steps(synchroniser: Int, margin: Int, slot: Int, process: Int, transmit: Int) {
  def cycles: Seq[Int] = Seq(synchroniser, margin, slot, process, transmit)
  def total: Int       = cycles.sum
}

object Steps {

  /** Titles and explanations, in the order of [[Steps.cycles]]. */
  val titles: Seq[(String, String)] = Seq(
    "Synchroniser" -> "the write pointer misses a core clock edge by nothing, then passes two flip-flops",
    "Wait for the margin" ->
      "so that the symbols of a whole frame never run out while the clocks drift (LP-12)",
    "Wait for the slot" -> "the symbol is ready just after a slot was; it is taken one slot later",
    "Processing step"   -> "one register, in the processing unit or waiting beside it",
    "Transmit register" -> "the register behind TXD"
  )

  /** The steps of a nibble that goes through the processing unit, as the source has them. */
  def processing(p: EscParams): Steps =
    Steps(2, MiiRxCrossing.margin(p.coreClockMhz), p.cyclesPerNibble, 1, 1 + p.txShift)

  /** The same for a nibble that is only forwarded: with one cycle per slot it does not wait for the
    * processing step.
    */
  def forwarding(p: EscParams): Steps =
    processing(p).copy(process = if (p.cyclesPerNibble == 1) 0 else 1)
}

object Goals {

  /** Most logic elements of an alarm slave, and of an alarm master with a ring. */
  val AlarmSlave  = 3150
  val AlarmMaster = 5600

  /** Most logic elements that a board has around them. */
  val Board = 200

  /** What the project promises for [[Points.base]] and [[Points.complete]]. */
  def apply(r: Results): Seq[Goal] = {
    val p       = Points.base
    val latency = r.latency(p.preset)
    val memory  = r.units(p.preset)("Memory and host port")
    val ramBits = 8 * (p.ramBytes + userRamBytes)
    def delay(name: String, limit: Int, d: Delay) =
      Goal(
        s"$name at ${p.coreClockMhz} MHz, dataBusWidth ${p.dataBusWidth}",
        s"at most $limit ns",
        f"${d.worstNs}%.0f ns",
        d.worstNs <= limit
      )
    def size(preset: String, limit: Int) = {
      val measured = r.area(preset).logicElements
      Goal(s"Size of $preset", f"at most $limit%,d logic elements", f"$measured%,d", measured <= limit)
    }
    def host(h: HostPoint) = {
      val measured = r.hosts(h.module).logicElements
      Goal(
        s"${h.title}, alone",
        s"at most ${h.goal} logic elements",
        s"$measured",
        measured <= h.goal
      )
    }
    def blocks(preset: String, limit: Int) = {
      val measured = r.area(preset).m9k
      Goal(s"Memory of $preset", s"at most $limit M9K", s"$measured", measured <= limit)
    }
    def speed(p: EscParams) = {
      val mhz = r.speed(p.preset).mhz
      Goal(
        s"Core clock of ${p.preset}, on the ECP5",
        s"at least ${p.coreClockMhz} MHz",
        f"$mhz%.1f MHz",
        mhz >= p.coreClockMhz
      )
    }
    val figures = Seq(
      delay("Forwarding latency", Points.latencyNs, latency.forwarding),
      delay("Processing latency", Points.latencyNs, latency.processing),
      size(p.preset, 1500),
      size(Points.digital.params.preset, 2000),
      size(Points.complete.preset, 3600),
      blocks(Points.complete.preset, 24),
      size(Points.largest.preset, 5000),
      blocks(Points.largest.preset, 28),
      size("alarm-slave", AlarmSlave),
      size("alarm-master", AlarmMaster),
      size(Points.ring.preset, AlarmMaster)
    )
    val inBlocks = Goal(
      s"Memory of ${p.preset}",
      f"all $ramBits%,d bits in M9K blocks",
      f"${memory.ramBits}%,d bits in ${memory.m9k} blocks",
      memory.ramBits >= ramBits
    )
    (figures :+ inBlocks) ++ Points.hosts.map(host) ++ (Points.presets :+ Points.ring).map(
      speed
    ) ++ AlarmSection.goals(r.alarm)
  }

  /** User RAM, 0x0F80 to 0x0FFF, lies in front of the process data RAM. */
  private val userRamBytes = 128
}
