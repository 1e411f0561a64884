package flyframe

import org.scalatest.flatspec.AnyFlatSpec

class PairwiseSpec extends AnyFlatSpec {
  private val values = Seq(Seq(1, 2, 3), Seq(1, 2, 3), Seq(1, 2), Seq(1, 2, 3))

  /** Every pair of a value of one parameter and a value of another. */
  private val all = for {
    i <- values.indices
    j <- i + 1 until values.size
    a <- values(i)
    b <- values(j)
  } yield (i, a, j, b)

  "A pairwise sample" should "have each pair of values, in few points" in {
    val sample = Pairwise[Int](values, _ => true)
    assert(all.filterNot(sample.flatMap(Pairwise.pairs(_)).toSet) == Nil)
    assert(sample.size >= 9 && sample.size <= 12)
  }

  it should "leave out only what cannot be built" in {
    def allowed(point: Seq[Int]) = point(0) != 1 || point(2) == 1
    val sample                   = Pairwise[Int](values, allowed)
    assert(sample.forall(allowed))
    assert(all.filterNot(sample.flatMap(Pairwise.pairs(_)).toSet) == Seq((0, 1, 2, 2)))
  }
}
