package flyframe.system

/** Something that happens to a system from outside. Times in us. Slaves have the number of the position in
  * which they belong, and keep it wherever they are.
  */
sealed trait Act

object Act {
  final case class Cable(number: Int, isWhole: Boolean)      extends Act
  final case class Power(slave: Int, on: Boolean)            extends Act
  final case class Host(slave: Int, startsAfter: Long)       extends Act
  final case class Boot(slave: Int, time: Long)              extends Act
  final case class Flap(slave: Int, state: Int, half: Long)  extends Act
  final case class Smoke(slave: Int, on: Boolean)            extends Act
  final case class Node(slave: Int, id: Int)                 extends Act
  final case class Mode(slave: Int, mode: Int, seconds: Int) extends Act
  final case class Swap(a: Int, b: Int)                      extends Act
  final case class Noise(cable: Int, rate: Double)           extends Act
  final case class Server(state: ServerState)                extends Act

  /** Forged datagrams fill the plant network: of the others this share gets lost. */
  final case class Forge(share: Double) extends Act

  /** The master is off for some time. */
  final case class Restart(time: Long) extends Act
  case object Silence                  extends Act
  case object Reset                    extends Act

  /** Somebody at the page orders; see [[flyframe.protocol.Order]]. */
  final case class Page(order: Int) extends Act
}

/** What happens, and when: whoever drives a bench, be it model or RTL, needs nothing else.
  *
  * @param size
  *   slaves
  * @param acts
  *   in order of their times
  * @param faultFrom
  *   faults begin then
  * @param end
  *   when to look at the result
  */
final case class Plan(
    name: String,
    size: Int,
    ring: Boolean,
    seed: Long,
    acts: Seq[(Long, Act)],
    faultFrom: Long,
    end: Long
)
