package flyframe.model

/** How long frames take from port 0 to another port, on the mean (B-100). */
class MeanWay {
  import MeanWay._
  private var mean    = 0L    // 1/4096 of a core cycle
  private var frames  = 0     // that have taken about that way, as far as they matter
  private var inRow   = 0     // frames in succession that were off; below 0: early
  private var isTaken = false // since a frame has begun at port 0

  /** A frame begins at port 0. */
  def begins(): Unit = isTaken = false

  /** Nothing is known of the way any more. */
  def forget(): Unit = frames = 0

  /** A frame begins at the port, so many core cycles behind one at port 0: by how much that is more than the
    * mean, in 1/64 of a core cycle, or 0 if the mean does not count.
    */
  def late(cycles: Long): Long = if (isTaken || cycles >= Longest) 0
  else {
    isTaken = true
    val way   = cycles * 4096
    val late  = way - mean
    val known = frames
    if (frames == 0 || late < -Window || late >= Window) {
      inRow = 0
      if (frames > 1) frames /= 2 else restart(way)
      0
    } else {
      inRow = if (late >= -Off && late < Off) 0 else if (late < 0) inRow.min(0) - 1 else inRow.max(0) + 1
      if (inRow.abs == Row) {
        inRow = 0
        restart(way)
        0
      } else {
        mean += Math.floorDiv(late, if (frames == 63) 256L else 16L)
        frames = (frames + 1) min 63
        if (known < Enough) 0 else Math.floorDiv(late, 64L)
      }
    }
  }

  private def restart(way: Long): Unit = {
    mean = way
    frames = 1
  }
}

private[model] object MeanWay {

  /** Ways that are too long to count, in core cycles. */
  val Longest = 65535L

  /** A frame that is early or late by more takes another way; so many in succession that are off by more than
    * the second do, too. In 1/4096 of a core cycle.
    */
  val Window: Long = 64 * 4096
  val Off: Long    = 8 * 4096
  val Row          = 16

  /** Frames behind which the mean counts. */
  val Enough = 4
}
