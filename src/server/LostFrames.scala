package flyframe.server

/** How many frames a master has lately sent in vain (SRV-26).
  *
  * @param rises
  *   of the counter in reports, the oldest first: when the report before came (monotonic, ms), and by how
  *   much
  */
final case class LostFrames(rises: Vector[(Long, Long)] = Vector.empty) {
  import LostFrames._

  /** After a report.
    *
    * @param sinceMs
    *   when the report before came, monotonic; the counter was `before` then
    */
  def after(sinceMs: Long, before: Long, now: Long): LostFrames = {
    val by = (now - before) & (Counters - 1)
    // Each is one or more: so many are enough to tell whether they are too many.
    if (by == 0) this else copy((rises :+ (sinceMs -> by)).takeRight(TooMany.toInt))
  }

  /** Too many in the last `WithinMs`, as far as that is known. */
  def areTooMany(nowMs: Long): Boolean =
    rises.collect { case (since, by) if nowMs - since <= WithinMs => by }.sum >= TooMany
}

object LostFrames {

  /** So many within so long, ms, are a fault: some are lost whenever a cable is cut. */
  val TooMany  = 50L
  val WithinMs = 20000L

  private val Counters = 1L << 16
}
