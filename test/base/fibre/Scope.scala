package flyframe.fibre

/** Records a signal of a ring: the times at which it changes, in ns, and to what. */
class Scope(ring: RingBench, signal: () => Boolean) {
  private val start = signal()
  private var last  = start
  private var all   = Vector.empty[(Double, Boolean)]
  ring.watches :+= { (time: Long, _: Int) =>
    val now = signal()
    if (now != last) all :+= (time / 1000.0) -> now
    last = now
  }

  def changes: Seq[(Double, Boolean)] = all
  def rises: Seq[Double]              = all.collect { case (time, true) => time }
  def clear(): Unit                   = all = Vector.empty

  /** Lengths of the pulses, high or low, between the changes. */
  def pulses: Seq[Double] = all.map(_._1).zip(all.drop(1).map(_._1)).map { case (a, b) => b - a }
}
