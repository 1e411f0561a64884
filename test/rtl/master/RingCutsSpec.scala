package flyframe.master

import flyframe.master.TimedLine.started
import flyframe.protocol.{EventKind, SlaveStatus}
import flyframe.{SharedSimulation, Tier}
import org.scalatest.flatspec.AnyFlatSpec

/** A ring of 64 slaves that is cut, and mended, at each place and at any time of a frame. */
class RingCutsSpec extends AnyFlatSpec with SharedSimulation {
  private val Slaves = 64
  private val Phases = 20

  /** More than the time from the beginning of a frame until it has come back; a cycle has two of them. */
  private val Flight = 760
  private val Cycle  = 2200

  private val tier =
    Tier("a ring of 64 slaves, cut and mended", "places and phases", test = 13, soak = (Slaves + 1L) * Phases)

  together("64 slaves", new LineMaster(Slaves, 16, 2))(
    "LM-03, LM-04: a cut anywhere at any time loses no slave and one frame at most, and is located" -> {
      dut =>
        val line = new TimedLine(Seq.tabulate(Slaves)(i => started(i + 1)), ring = true)
        val b    = new LineBench(dut, line, ports = 2, cycle = Cycle)
        b.settle()
        b.settle()
        assert(b.ringClosed && b.present == Slaves && b.known == Slaves)
        b.seen()
        var hit = 0

        /** Passes the rest of the cycle, and then some of the next frame. */
        def toPhase(phase: Int): Unit = {
          while (b.leaves) b.slot()
          while (!b.leaves) b.slot()
          for (_ <- 1 to phase * Flight / Phases) b.slot()
        }

        /** Cycles since the frame `first`, each with its repetitions, in which somebody was not reached. */
        def missed(first: Int): Int = {
          val sent = b.frames.zip(b.reached).drop(first)
          val cycles = sent.scanLeft((0, -1, 0)) { case ((cycle, last, _), ((port, datagrams), _)) =>
            val index = datagrams.head.index
            if (port == 0 && index != last) (cycle + 1, index, 0) else (cycle, last, 0)
          }
          val ofCycle = sent.zip(cycles.tail.map(_._1)).groupMap(_._2)(_._1)
          val last    = ofCycle.keys.max // it has not ended
          ofCycle.count { case (cycle, frames) =>
            def most(port: Int) = frames.collect { case ((p, _), n) if p == port => n }.maxOption.getOrElse(0)
            cycle != last && most(0) + most(1) < Slaves
          }
        }
        def look(what: String, first: Int): Unit = {
          val gone = b.seen().filter(e => e.kind == EventKind.Slave && (e.sequence & SlaveStatus.Absent) != 0)
          assert(gone.isEmpty && b.present == Slaves && b.known == Slaves && !b.dead, what)
          val count = missed(first)
          assert(count <= 1, what)
          hit += count
        }
        val all = for (phase <- 0 until Phases; place <- 0 to Slaves) yield (place, phase)
        tier.run("all", tier.size) {
          for ((place, phase) <- all.indices.by(all.size / tier.size.toInt).map(all)) {
            val what = s"place $place, phase $phase"
            toPhase(phase)
            val before = b.frames.size
            b.setCable(place, intact = false)
            b.until(3)(b.ringOpen)
            b.cycles(2)
            assert(b.cut == place && !b.ringClosed, what)
            look(what, before)
            toPhase(phase)
            val cut = b.frames.size
            b.setCable(place, intact = true)
            b.until(3)(b.ringClosed)
            b.cycles(2)
            assert(!b.ringOpen, what)
            look(s"$what, mended", cut)
          }
        }
        // Those of all that are read in turns, too.
        b.settle()
        look("at the end", b.frames.size - 5)
        assert((0 until Slaves).forall(i => !b.isAbsent(i) && b.node(i) == i + 1))
        info(s"$hit cycles in which somebody was not reached")
    }
  )
}
