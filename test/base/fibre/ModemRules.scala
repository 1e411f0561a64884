package flyframe.fibre

import flyframe.params.FibreParams
import scala.util.Random

/** Rules of modulator and demodulators (FR-01 to FR-08, FB-01). */
abstract class ModemRules extends FibreCases {
  private def name(p: FibreParams) = s"at ${p.coreClockMhz} MHz"

  for (p <- clocks) {
    s"FR-01: the tones ${name(p)}" should "have 25, 1 and 5 MHz, and be square" in line(p) { ring =>
      def periods(light: Scope) = {
        light.clear()
        ring.runUs(6)
        light.pulses.distinct
      }
      val first = new Scope(ring, () => ring.nodes(0).light(1))
      val open  = new Scope(ring, () => ring.nodes(0).light(0)) // hears nothing
      assert(periods(first) == Seq(500.0))
      assert(periods(open) == Seq(100.0))
      ring.dominant(0)
      ring.runUs(1)
      assert(periods(first) == Seq(20.0))
    }

    s"FR-02, FB-01: a tone ${name(p)}" should "begin anew with each change, without short pulses" in line(p) {
      ring =>
        val period = 1000.0 / p.coreClockMhz
        val light  = new Scope(ring, () => ring.nodes(0).light(1))
        val random = new Random(2)
        for (_ <- 0 until 400) {
          ring.runUs((20 + random.nextInt(1400)) / 1000.0)
          ring.dominant(0)
          val start = ring.now / 1000.0
          light.clear()
          ring.runUs(0.4)
          // The level is taken with the end of the cycle in which it comes.
          assert(light.rises.head <= start + period + 20 + period, "the first rising edge")
          ring.dominant(0, isSo = false)
        }
        light.clear()
        for (_ <- 0 until 2000) {
          ring.dominant(0, random.nextBoolean())
          ring.run(random.nextInt(8) * period.toLong * 1000)
        }
        assert(light.pulses.min >= 20)
    }

    s"FR-03: an input ${name(p)}" should "hear a dominant tone at every phase, and of clocks apart" in
      withNodes(p, 3) { nodes =>
        val period = 1000000L / p.coreClockMhz
        val ring = new RingBench(p, nodes, Seq.fill(3)(100000L), Seq(period, period + period / 10000, period))
        ring.cut(2)
        ring.nodes.foreach(_.setBit(100, 100))
        ring.runUs(30)
        ring.dominant(0)
        ring.runUs(1)
        val level = new Scope(ring, () => ring.bus(1))
        ring.runUs(400) // four periods of slip in 400 us
        assert(!ring.bus(1) && level.changes.isEmpty)
      }

    s"FR-06, FR-07: a level ${name(p)}" should "pass a node in time, and keep its length" in {
      val (most, apart, longer) = if (p.coreClockMhz == 100) (160, 50, 50) else (240, 80, 60)
      val period                = 1000000L / p.coreClockMhz
      val slow                  = period + period / 10000 // 100 ppm
      for ((source, passing) <- Seq(period -> period, slow -> period, period -> slow); delayNs <- phases)
        withNodes(p, 3) { nodes =>
          val delay = delayNs * 1000
          val ring  = new RingBench(p, nodes, Seq(delay, 0L, 0L), Seq(source, passing, source))
          ring.cut(2)
          ring.nodes.foreach(_.setBit(100, 10))
          ring.runUs(30)
          val in     = new Scope(ring, () => ring.nodes(0).light(1))
          val out    = new Scope(ring, () => ring.nodes(1).light(1))
          val level  = new Scope(ring, () => ring.bus(1))
          val random = new Random(7)
          var delays = Seq.empty[Double]
          for (_ <- 0 until 15) {
            ring.runUs((600 + random.nextInt(1200)) / 1000.0)
            Seq(in, out, level).foreach(_.clear())
            val length = 250 + random.nextInt(10) * 10 + random.nextInt(2) * 500
            val start  = ring.now + 1
            ring.dominant(0)
            ring.run(length * 1000)
            val end = ring.now + 1
            ring.dominant(0, isSo = false)
            ring.runUs(0.6)
            assert(level.changes.map(_._2) == Seq(false, true), s"$length ns")
            // A tone follows its level by a cycle, at the source as at the output of the node.
            val changes = Seq(start, end).map(t => math.ceil(t * 1.0 / source) * source / 1000)
            delays ++= level.changes.map(_._1 + passing / 1000.0).zip(changes).map { case (to, from) =>
              to - from - delayNs
            }
            val first =
              out.rises.find(_ > level.changes.head._1).get - in.rises.find(_ > changes.head).get - delayNs
            assert(first <= most, "ns between the first rising edges")
            val heard = level.changes(1)._1 - level.changes(0)._1
            val sent  = changes(1) - changes(0)
            assert(math.abs(heard - sent) <= longer + 0.1, s"$length ns became $heard ns")
          }
          assert(delays.max <= most, "ns at most")
          assert(delays.max - delays.min <= apart, "ns apart")
        }
    }
  }

  "FR-04: a level" should "change after two short distances, and 100 ns without an edge" in line() { ring =>
    val level = new Scope(ring, () => ring.bus(1))
    // Pulses into the silence between two edges of the recessive tone, at the input of the node.
    def played(edges: Int*): Seq[Boolean] = {
      level.clear()
      val start = ring.now + 700000
      ring.there(0).isCut = true
      ring.there(0).disturbed =
        (time, _) => edges.exists(e => time >= start + e * 1000 && time < start + e * 1000 + 20000)
      ring.runUs(1.5)
      ring.there(0).disturbed = (_, light) => light
      ring.there(0).isCut = false
      ring.runUs(2)
      level.changes.map(_._2)
    }
    assert(played(0, 40) == Nil)
    assert(played(0, 40, 80) == Seq(false, true))
    assert(played(0, 60, 120) == Seq(false, true))
    assert(played(0, 70, 140, 210) == Nil)
    assert(played(0, 40, 110, 150) == Nil)
    assert(played(0, 40, 80, 170) == Seq(false, true))
    val length = level.changes(1)._1 - level.changes(0)._1
    assert(length == 190.0) // the last edge comes after 90 ns, so that it ends 100 ns behind that
    assert(played(0, 40, 80, 190) == Seq(false, true))
    assert(level.changes(1)._1 - level.changes(0)._1 == 100.0)
  }

  for (isDominant <- Seq(true, false)) {
    val tone = if (isDominant) "dominant" else "recessive"

    def steady(change: RingBench => Unit): Unit = for (delayNs <- phases) line(delayNs = delayNs) { ring =>
      ring.nodes.foreach(_.setBit(100, 10)) // so that dominance is not cut off
      ring.dominant(0, isDominant)
      ring.runUs(2)
      val level = new Scope(ring, () => ring.bus(1))
      assert(ring.bus(1) != isDominant)
      change(ring)
      assert(level.changes == Nil)
      assert(ring.isUp(1, 0))
    }

    s"FR-05: one pulse missing from a $tone tone" should "change nothing" in steady { ring =>
      val fibre = ring.there(0)
      for (_ <- 0 until 10) {
        // The light of a whole pulse, and of nothing else, is missing.
        var ends     = false
        var isInside = false
        var before   = true
        fibre.disturbed = (_, light) => {
          if (light && !before && !ends) isInside = true
          if (!light && isInside) { isInside = false; ends = true }
          before = light
          light && !isInside
        }
        ring.runUs(3.3)
        assert(ends)
        fibre.disturbed = (_, light) => light
        ring.runUs(2)
      }
    }

    s"FR-05: one extra pulse in a $tone tone" should "change nothing" in steady { ring =>
      val random = new Random(5)
      for (_ <- 0 until 15) {
        val start = ring.now + 500000 + random.nextInt(1000000)
        val end   = start + 10000 + random.nextInt(20000)
        ring.there(0).disturbed = (time, light) => light || time >= start && time < end
        ring.runUs(3)
      }
    }

    for (duty <- Seq(40, 50, 60))
      s"FR-05: a $tone tone with a duty cycle of $duty % and jitter" should "change nothing" in
        steady { ring =>
          val random = new Random(duty)
          val period = if (isDominant) 40000 else 1000000
          ring.there(0).lateness =
            light => period / 8 + (if (light) 0 else period / 100 * (duty - 50)) + random.nextInt(4001) - 2000
          ring.runUs(40)
        }
  }

  "FR-08: the counting demodulator" should "decide once in 2 us, by 20 rising edges in one" in
    line(quick.copy(coreClockMhz = 50, demodulator = 1)) { ring =>
      val level  = new Scope(ring, () => ring.bus(1))
      val random = new Random(8)
      for (_ <- 0 until 50) {
        ring.dominant(0)
        ring.runUs(5 + random.nextInt(300) / 100.0)
        ring.dominant(0, isSo = false)
        ring.runUs(5 + random.nextInt(300) / 100.0)
      }
      assert(level.changes.size == 100)
      assert(level.changes.forall { case (time, _) => (time - level.changes.head._1) % 2000 == 0 })
      // Bits of 400 kbit/s do not keep their length, even over one fibre.
      level.clear()
      for (_ <- 0 until 50) {
        ring.dominant(0)
        ring.runUs(2.5)
        ring.dominant(0, isSo = false)
        ring.runUs(2.5)
      }
      assert(level.pulses.exists(length => math.abs(length - 2500) > 1250))
    }

  it should "let 19 edges be recessive, and 20 dominant" in
    line(quick.copy(coreClockMhz = 50, demodulator = 1)) { ring =>
      val level = new Scope(ring, () => ring.bus(1))
      for (edges <- Seq(19, 20)) {
        level.clear()
        // A burst each two microseconds, at every phase of the decision in turn.
        for (phase <- 0 until 20) {
          val start = ring.now + 2000000 + phase * 100000
          ring.there(0).disturbed = (time, light) => {
            val at = time - start
            if (at < -1000000 || at > 1800000) light
            else at >= 0 && at < edges * 40000L && at / 20000 % 2 == 0
          }
          ring.runUs(10)
        }
        assert(level.changes.nonEmpty == (edges == 20), s"$edges edges")
      }
    }
}
