package flyframe.fibre

import flyframe.registers.RingRegisters

/** Rules of the modes (FR-20 to FR-22, FR-31, FR-35, FR-37, FB-05, FB-08, FB-18). */
abstract class BusModeRules extends FibreCases {

  /** Nodes that hear dominant when node `n` sends it for a while. */
  private def hear(ring: RingBench, n: Int): Set[Int] = {
    ring.dominant(n)
    ring.runUs(1.5)
    val all = ring.nodes.indices.filterNot(ring.bus).toSet
    ring.dominant(n, isSo = false)
    ring.runUs(1.5)
    assert(ring.nodes.indices.forall(ring.bus), "dominant stays")
    all
  }

  for (
    (mode, fromLeft, fromRight, own) <- Seq(
      (1, Set(0, 1, 2), Set(0, 1, 2), Set(0, 1, 2)),
      (2, Set(0, 1), Set(2), Set(0, 1)),
      (3, Set(0), Set(1, 2), Set(1, 2))
    )
  )
    s"FR-20, FR-21: mode $mode" should "pass what its row of the table says" in line() { ring =>
      ring.control(1, forced = mode)
      ring.runUs(1)
      assert(ring.mode(1) == mode)
      assert(hear(ring, 0) == fromLeft)
      assert(hear(ring, 2) == fromRight)
      assert(hear(ring, 1) == own)
    }

  "FR-21: mode 1" should "send back nothing to where it came from" in line() { ring =>
    val light = new Scope(ring, () => ring.nodes(1).light(0))
    ring.dominant(0)
    ring.runUs(2)
    assert(!ring.bus(1) && !ring.bus(2))
    assert(!light.pulses.contains(20.0))
  }

  "FR-22: the mode" should "follow from the ports that are up" in ring(3) { ring =>
    assert(ring.modes == Seq(2, 1, 1) && ring.guards == Seq(0))
    ring.cut(1)
    ring.runUs(10)
    assert(ring.modes == Seq(2, 2, 3))
    ring.cut(2)
    ring.runUs(10)
    assert(ring.modes == Seq(3, 2, 1) && (ring.state(2) >> 3 & 1) == 1)
    assert(ring.guards == Nil)
  }

  "FR-22, FB-09: the mode" should "be that of the register, if it is forced" in ring(3) { ring =>
    for (mode <- 1 to 3) {
      ring.control(0, home = true, forced = mode)
      ring.runUs(1)
      assert(ring.mode(0) == mode && !ring.isGuard(0))
      ring.control(0, home = true)
    }
  }

  "FR-31: a break" should "leave a line of two pieces that meet at the guard" in ring(4) { ring =>
    for (n <- 0 until 4) assert(hear(ring, n) == Set(0, 1, 2, 3))
    ring.cut(1)
    ring.runUs(10)
    assert(ring.modes == Seq(2, 2, 3, 1) && ring.guards == Seq(0))
    // The guard closes within a frame; 1.4 T at most tell nothing.
    ring.nodes.foreach(_.setBit(100, 10))
    assert(hear(ring, 1) == Set(1))
    assert(hear(ring, 3) == Set(2, 3, 0))
  }

  "FR-35: a second break" should "leave two pieces, each a working bus" in ring(6) { ring =>
    ring.cut(1)
    ring.cut(3)
    ring.runUs(10)
    ring.dominant(0)
    ring.runUs(3) // 2 T and more close the guard
    ring.dominant(0, isSo = false)
    ring.runUs(12)
    assert(ring.guards == Nil)
    for (n <- Seq(2, 3)) assert(hear(ring, n) == Set(2, 3))
    for (n <- Seq(0, 1, 4, 5)) assert(hear(ring, n) == Set(0, 1, 4, 5))
  }

  "FR-37, FB-08: what a controller sends" should "be cut off after 32 T, until 11 T of recessive" in line() {
    ring =>
      ring.dominant(1)
      ring.runUs(31.5)
      assert(!ring.bus(0) && !ring.bus(1) && !ring.bus(2) && (ring.state(1) >> 5 & 1) == 0)
      ring.runUs(9)
      assert(ring.bus(0) && ring.bus(1) && ring.bus(2) && (ring.state(1) >> 5 & 1) == 1)
      for ((recessive, isCut) <- Seq(10.5 -> true, 16.5 -> false)) {
        ring.dominant(1, isSo = false)
        ring.runUs(recessive)
        ring.dominant(1)
        ring.runUs(1)
        assert(ring.bus(0) == isCut)
      }
  }

  "FR-37: a port that hears dominant for 320 T" should "be recessive, until 11 T of recessive" in line() {
    ring =>
      ring.control(1, forced = 1) // else it takes this for a latch, again and again
      ring.there(0).disturbed = (time, _) => time / 20000 % 2 == 0
      ring.runUs(315)
      assert(!ring.bus(1) && !ring.bus(2) && !ring.isStuck(1, 0))
      ring.runUs(75)
      assert(ring.bus(1) && ring.bus(2) && ring.isStuck(1, 0) && !ring.isStuck(1, 1))
      ring.there(0).disturbed = (_, light) => light
      ring.runUs(10.5)
      assert(ring.isStuck(1, 0))
      ring.runUs(6)
      assert(!ring.isStuck(1, 0))
      ring.await(40, "up again")(ring.isUp(1, 0) && ring.isUp(0, 1))
      ring.runUs(1)
      assert(hear(ring, 0) == Set(0, 1, 2))
  }

  "FR-37, FB-18: a transmitter that is stuck dominant" should "be a break" in ring(5) { ring =>
    ring.there(1).disturbed = (time, _) => time / 20000 % 2 == 0
    ring.await(600, "down at both ends")(!ring.isUp(2, 0) && !ring.isUp(1, 1))
    ring.runUs(10)
    for (_ <- 0 until 3; n <- ring.nodes.indices) {
      ring.dominant(n)
      ring.runUs(4)
      ring.dominant(n, isSo = false)
      ring.runUs(4)
    }
    assert(ring.guards == Nil && ring.isStuck(2, 0))
    for (n <- ring.nodes.indices) assert(hear(ring, n) == ring.nodes.indices.toSet)
    ring.runUs(1000)
    assert(ring.nodes(2).read(RingRegisters.Losses1) == 1)
    ring.there(1).disturbed = (_, light) => light
    ring.await(60, "up again")(ring.isUp(2, 0) && ring.isUp(1, 1))
    ring.runUs(5)
    assert(ring.guards == Seq(1))
  }

  "FR-22: a port that is down" should "count as recessive" in line() { ring =>
    ring.dominant(0)
    ring.runUs(2)
    assert(!ring.bus(1))
    ring.optical(1) = 2
    ring.runUs(1)
    assert(ring.bus(1) && ring.bus(2))
  }
}
