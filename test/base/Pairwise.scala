package flyframe

/** Samples of a product of parameters in which each pair of values of two parameters stands. */
object Pairwise {

  /** Few points of the product, always the same ones: the next is the one with most pairs that no earlier one
    * has, the first of these in the order of the product.
    *
    * @param values
    *   of each parameter
    * @param allowed
    *   whether a point can be built; pairs that are in no such point are left out
    */
  def apply[A](values: Seq[Seq[A]], allowed: Seq[A] => Boolean): Seq[Seq[A]] = {
    val product = values
      .foldLeft(Seq(Vector.empty[A]))((points, more) => points.flatMap(p => more.map(p :+ _)))
      .filter(allowed)
    val numbers = product.flatMap(pairs(_)).distinct.zipWithIndex.toMap
    val indexed = product.map(p => p -> pairs(p).map(numbers).toArray).toArray
    val open    = Array.fill(numbers.size)(true)
    val chosen  = Seq.newBuilder[Seq[A]]
    while (open.contains(true)) {
      val (point, own) = indexed.maxBy(_._2.count(open(_)))
      own.foreach(open(_) = false)
      chosen += point
    }
    chosen.result()
  }

  /** The pairs of a point: two parameters by number, with their values. */
  def pairs[A](point: Seq[A]): Seq[(Int, A, Int, A)] =
    for (i <- point.indices; j <- i + 1 until point.size) yield (i, point(i), j, point(j))
}
