package flyframe.fibre

/** A fibre with its two modules, from a port to another one. Times are in ps.
  *
  * @param delay
  *   from pin to pin
  */
class Fibre(val delay: Long) {
  // When the edges under way arrive: a ring of them, which alternate. Each sample asks for the first.
  private var edges   = new Array[Long](64)
  private var head    = 0
  private var count   = 0
  private var entered = false
  private var left    = false

  /** No light passes. */
  var isCut = false

  /** By how much an edge is late: of the light behind it. */
  var lateness: Fibre.Lateness = _ => 0

  /** What the receiver makes of the light at a time. */
  var disturbed: Fibre.Disturbance = Fibre.Clear

  /** The light that is sent from `time` on. */
  def send(time: Long, light: Boolean): Unit = if (light != entered) {
    entered = light
    if (count == edges.length) {
      edges = Array.tabulate(2 * count)(i => edges((head + i) % count))
      head = 0
    }
    edges((head + count) % edges.length) = time + delay + lateness(light)
    count += 1
  }

  /** The light that arrives at `time`; times ascend. */
  def receive(time: Long): Boolean = {
    while (count > 0 && edges(head) <= time) {
      left = !left
      head = if (head == edges.length - 1) 0 else head + 1
      count -= 1
    }
    val light = left && !isCut
    if (disturbed eq Fibre.Clear) light else disturbed(time, light)
  }
}

object Fibre {

  /** By how much an edge to a level is late. Like the other one no function, as that would box each level. */
  trait Lateness {
    def apply(light: Boolean): Long
  }

  /** What becomes of the light that arrives at a time. */
  trait Disturbance {
    def apply(time: Long, light: Boolean): Boolean
  }

  /** None. */
  val Clear: Disturbance = (_, light) => light
}
