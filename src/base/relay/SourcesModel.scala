package flyframe.relay

/** What a node knows of each source: sequences received, life, distances (FR-59 to FR-61).
  *
  * @param silence
  *   units of silence after which a source is forgotten (RB-23)
  * @param unitCycles
  *   core cycles of a unit
  */
class SourcesModel(silence: () => Int, unitCycles: Long) {
  import SourcesModel._
  private val newest    = Array.fill(Count)(None: Option[Int])
  private val seen      = Array.fill(Count)(0) // bit i: sequence newest - i
  private val lives     = Array.fill(Count)(None: Option[Int])
  private val heard     = Array.fill(Count)(0L)
  private val distances = Array.fill(Count, 2)(0)
  private var cycle     = 0L

  /** The time, in core cycles. */
  def pass(now: Long): Unit = cycle = now

  private def forget(source: Int): Unit = {
    newest(source) = None
    seen(source) = 0
  }

  /** Nothing is known any more. */
  def clear(): Unit = for (s <- 0 until Count) {
    forget(s)
    lives(s) = None
    distances(s)(0) = 0
    distances(s)(1) = 0
  }

  private def unit                  = cycle / unitCycles
  private def isSilent(source: Int) = unit - heard(source) > (silence() min MostUnits)

  /** A frame of a source arrived with a good end. */
  def hears(header: LinkHeader, port: Int): Unit = {
    val source = header.source
    if (isSilent(source)) {
      forget(source)
      lives(source) = None
      distances(source)(0) = 0
      distances(source)(1) = 0
    }
    heard(source) = unit
    if (header.direction != port) distances(source)(port) = (256 - header.hops) min 255
  }

  /** A data frame with a good end.
    *
    * @return
    *   it is to be delivered
    */
  def takes(source: Int, sequence: Int): Boolean = newest(source) match {
    case None =>
      newest(source) = Some(sequence)
      seen(source) = 1
      true
    case Some(n) =>
      val behind = n - sequence & OwnFramesModel.SequenceMask
      if (behind >= 8192) { // ahead by up to 8192
        val ahead = 16384 - behind
        newest(source) = Some(sequence)
        seen(source) = if (ahead < Map) seen(source) << ahead | 1 else 1
        true
      } else if (behind >= Map || (seen(source) >> behind & 1) == 1) false
      else {
        seen(source) |= 1 << behind
        true
      }
  }

  /** A start of a life with a good end. */
  def starts(source: Int, life: Int): Unit = if (!lives(source).contains(life)) {
    forget(source)
    lives(source) = Some(life)
  }

  /** The distance to a source at a port, 0 if it is not known. */
  def distance(source: Int, port: Int): Int = if (isSilent(source)) 0 else distances(source)(port)
}

object SourcesModel {
  private val Count = 128
  private val Map   = 32

  /** As many units at most (RB-23). */
  private val MostUnits = 0xfeff
}
