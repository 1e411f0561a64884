package flyframe.relay

import flyframe.Tier
import flyframe.can.CanFrame
import scala.util.Random

/** Broken and forged frames on both links of a node, good ones between them. */
trait MutationRules extends RelayCases {

  /** How many broken frames. */
  protected def mutations: Tier

  private def some(random: Random, count: Int) = Seq.fill(count)(random.nextBoolean())

  private def any(random: Random): CanFrame = {
    val extended = random.nextBoolean()
    val id       = random.nextInt(1 << (if (extended) 29 else 11))
    val dlc      = random.nextInt(16)
    if (random.nextInt(8) == 0) CanFrame(id, extended, remote = true, dlc, Nil)
    else CanFrame(id, extended, remote = false, dlc, Seq.fill(dlc min 8)(random.nextInt(256)))
  }

  /** Levels in which something is wrong. */
  private def broken(random: Random, good: Seq[Boolean]): Seq[Boolean] = {
    // Often in the end, where all CRCs were right.
    val at = if (random.nextInt(3) == 0) good.size - 1 - random.nextInt(8) else random.nextInt(good.size)
    random.nextInt(8) match {
      case 0 => good.updated(at, !good(at))
      case 1 =>
        (0 to random.nextInt(8)).foldLeft(good) { (levels, _) =>
          val i = random.nextInt(levels.size)
          levels.updated(i, !levels(i))
        }
      case 2 => good.patch(at, Nil, 1 + random.nextInt(12))                // bits are missing
      case 3 => good.patch(at, some(random, 1 + random.nextInt(12)), 0)    // there are more
      case 4 => good.take(at)                                              // cut
      case 5 => good ++ good.drop(at)                                      // oversized
      case 6 => good.patch(at, Seq.fill(1 + random.nextInt(60))(false), 0) // stuck for a while
      case _ => some(random, 1 + random.nextInt(400))
    }
  }

  // Addresses that nobody may have, and others. A source has one port, so that its frames come in the order
  // of their sequences.
  private val Forged   = Seq(Seq(0, 126, 2, 8, 64, 124), Seq(127, 1, 5, 9, 63, 125))
  private val PerChunk = 20

  /** Right in every bit, but of nobody: of any kind, with any hops. */
  private def forged(random: Random, port: Int, sequence: Int): Seq[Boolean] = {
    val source = Forged(port)(random.nextInt(Forged(port).size))
    val hops   = Seq(0, 1, 255, random.nextInt(256))(random.nextInt(4))
    RelayBench.levels(LinkHeader(random.nextInt(4), random.nextInt(2), source, sequence, hops), any(random))
  }

  /** Identifier, length and data of a CAN frame in a link frame. */
  private def inside(frame: CanFrame): Seq[Boolean] = {
    val body = LinkBody.of(from(3, 0), frame)
    (0 until body.total - 32).map(body(_))
  }

  /** How many frames of `all` are those of `a` and of `b`, each in its order. Frames may be equal. */
  private def merging[A](all: Seq[A], a: Seq[A], b: Seq[A]): Int = {
    // How many of them may have been those of `a`.
    val steps = all.zipWithIndex.scanLeft(Set(0)) { case (counts, (frame, n)) =>
      counts.filter(a.lift(_).contains(frame)).map(_ + 1) ++ counts.filter(i => b.lift(n - i).contains(frame))
    }
    steps.indexWhere(_.isEmpty) match {
      case -1   => all.size
      case step => step - 1
    }
  }

  "FR-42, FR-45, FR-47, FR-59: broken and forged frames" should
    "leave nothing behind, whatever they are" in
    mutations.run("one node", mutations.size, Some(1))(bench() { b =>
      val random = new Random(1)
      val idle   = Seq.fill(24)(true)
      var number = 0
      def next(port: Int) = {
        number += 1
        from(3 + port, number & 0x3fff, hops = 1 + random.nextInt(255))
      }
      for (_ <- 0L until (mutations.size + 2 * PerChunk - 1) / (2 * PerChunk)) {
        b.bits.foreach(_.clear())
        val good = Seq.fill(2)(Seq.newBuilder[LinkHeader])
        val sent =
          for (port <- 0 to 1)
            yield Seq
              .fill(PerChunk) {
                val base = next(port)
                val wrong =
                  if (random.nextInt(6) == 0) forged(random, port, base.sequence)
                  else
                    broken(random, RelayBench.levels(base, any(random)) ++ Seq.fill(LinkFrame.EndBits)(true))
                val header = next(port)
                good(port) += header
                wrong ++ idle ++ RelayBench.levels(header, any(random)) ++ idle
              }
              .flatten
        for (port <- 0 to 1) b.send(port, sent(port))
        b.finish()

        // The reader says which frames are whole: a bit more or less behind the end breaks none.
        val whole =
          sent.map(levels => RelayBench.read((idle ++ levels ++ idle).toIndexedSeq, 0).filter(_.isGood))
        for (port <- 0 to 1) {
          def text(frames: Seq[(LinkHeader, Seq[Boolean])]) = frames.map(_.toString).sorted
          assert(good(port).result().diff(whole(port).map(_.header)) == Nil, "what was sent is whole")
          val passed = whole(port).filter(_.header.hops > 0)
          assert(
            text(b.frames(1 - port).filter(_.isGood).map(f => f.header -> f.body)) ==
              text(passed.map(f => f.header.copy(hops = f.header.hops - 1) -> f.body)),
            s"passed on by port ${2 - port}, up to frame $number"
          )
        }
        val got = b.received().map(inside)
        val wanted = whole.map(
          _.filter(f => f.header.kind == LinkKind.Data && f.header.source != 0)
            .distinctBy(f => (f.header.source, f.header.sequence))
            .map(_.body.dropRight(32))
        )
        val merged = merging(got, wanted(0), wanted(1))
        assert(
          merged == got.size,
          s"in order, up to frame $number: what is delivered at place $merged is not next"
        )
        assert(got.size == wanted.map(_.size).sum, s"delivered, up to frame $number")
      }
      val counters = Seq(RelayCounter.BadHeader, RelayCounter.BadFrame).flatMap(c => Seq(c, c + 1))
      assert(counters.forall(counter(b, _) > 0), counters.map(counter(b, _)))
    })

  "RB-27: frames from addresses that nobody may have" should "pass, and be received but for those of 0" in
    bench() { b =>
      val first = b.now
      for ((source, n) <- Seq(0, 126, 127).zipWithIndex) b.send(0, from(source, 1), data(5 + n, n))
      b.finish()
      assert(b.frames(1, first).filter(_.isGood).map(_.header.source) == Seq(0, 126, 127))
      assert(b.received() == Seq(data(6, 1), data(7, 2)))
    }
}
