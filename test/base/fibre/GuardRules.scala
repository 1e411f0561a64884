package flyframe.fibre

import flyframe.registers.RingRegisters

/** Rules of the guard: who opens the ring, and when it is closed (FR-30 to FR-36, FB-05, FB-06, FB-09, FB-14,
  * FB-15).
  */
abstract class GuardRules extends FibreCases {

  /** Node `n` is dominant for a time. */
  private def pulse(ring: RingBench, n: Int, us: Double): Unit = {
    ring.dominant(n)
    ring.runUs(us)
    ring.dominant(n, isSo = false)
  }

  "FR-30: a node with `home`" should "be guard whenever both its ports come up" in ring(3) { ring =>
    assert(ring.guards == Seq(0) && ring.modes == Seq(2, 1, 1))
    for (link <- Seq(0, 2)) {
      ring.cut(link)
      ring.runUs(10)
      assert(ring.guards == Nil)
      ring.cut(link, isCut = false)
      ring.runUs(20)
      assert(ring.guards.contains(0))
    }
  }

  "FR-30, FB-05: `home` that is written later" should "make a guard at once" in ring(3, home = None) { ring =>
    ring.control(0, home = true)
    ring.runUs(1)
    assert(ring.guards == Seq(0))
  }

  it should "open a ring that has latched" in ring(3, home = None) { ring =>
    pulse(ring, 2, 3)
    ring.runUs(3)
    assert(ring.nodes.indices.forall(!ring.bus(_)))
    ring.control(1, home = true)
    ring.runUs(3)
    assert(ring.guards == Seq(1) && ring.nodes.indices.forall(ring.bus))
  }

  it should "close in the first frame where the ring is broken elsewhere" in ring(3, home = None) { ring =>
    ring.cut(1)
    ring.runUs(10)
    ring.control(0, home = true)
    ring.runUs(1)
    assert(ring.guards == Seq(0))
    pulse(ring, 2, 2)
    ring.runUs(1)
    assert(ring.guards == Nil)
  }

  "FB-05, FB-09: `home`" should "act again behind a forced mode" in ring(3) { ring =>
    ring.control(0, home = true, forced = 1)
    ring.runUs(1)
    assert(ring.guards == Nil)
    ring.control(0, home = true)
    ring.runUs(1)
    assert(ring.guards == Seq(0))
  }

  "FR-30: a guard" should "open the ring" in ring(3) { ring =>
    pulse(ring, 1, 3)
    ring.runUs(2)
    assert(ring.nodes.indices.forall(ring.bus) && ring.guards == Seq(0))
  }

  "FR-32, FR-33: a guard with `home`" should "close when its two sides differ for more than 1.5 T" in ring(
    4
  ) { ring =>
    ring.cut(1)
    ring.runUs(10)
    for (_ <- 0 until 5) {
      pulse(ring, 3, 1.4)
      ring.runUs(1)
    }
    assert(ring.guards == Seq(0))
    pulse(ring, 3, 1.9) // the two dominant bits of a frame, less what nodes and clocks take
    ring.runUs(1)
    assert(ring.guards == Nil && ring.mode(0) == 1)
    assert(ring.nodes(0).read(RingRegisters.Closings) == 1)
    ring.dominant(1)
    ring.runUs(1)
    assert(ring.nodes.indices.forall(!ring.bus(_)))
  }

  "FR-32: a guard without `home`" should "wait 2 T for each of its address modulo 8" in
    ring(4) { ring =>
      ring.control(0) // it stays guard
      for ((address, isLast) <- Seq(8 -> false, 3 -> false, 125 -> true)) {
        ring.nodes(0).write(RingRegisters.Address, address)
        ring.cut(1)
        ring.runUs(10)
        ring.dominant(3)
        val waits  = 2.0 * (address % 8)
        val closed = ring.await(waits + 6, "closed")(!ring.isGuard(0)) / 1000
        assert(closed > waits + 2.5 && closed < waits + 4.5, s"$address: $closed of $waits")
        ring.dominant(3, isSo = false)
        if (!isLast) { // for the next address: guard again
          ring.control(0, home = true)
          ring.cut(0)
          ring.cut(1, isCut = false)
          ring.runUs(30)
          ring.cut(0, isCut = false)
          ring.runUs(30)
          assert(ring.isGuard(0))
          ring.control(0)
        }
      }
    }

  it should "wait no more when both sides are dominant together" in ring(4) { ring =>
    ring.control(0)
    ring.nodes(0).write(RingRegisters.Address, 7)
    ring.cut(1)
    ring.runUs(10)
    pulse(ring, 3, 2)
    ring.runUs(1)
    ring.dominant(1)
    pulse(ring, 3, 2)
    ring.dominant(1, isSo = false)
    ring.runUs(20)
    assert(ring.guards == Seq(0))
    // And it does begin anew.
    pulse(ring, 3, 2)
    ring.runUs(20)
    assert(ring.guards == Seq(0)) // FB-17
    pulse(ring, 3, 1)
    ring.runUs(1)
    assert(ring.guards == Nil)
  }

  "FR-34, FB-06: a node whose port 2 was lost" should "be guard when it comes up, the other one not" in
    ring(4, home = None) { ring =>
      assert(ring.guards == Nil)
      for (link <- Seq(2, 0)) {
        ring.cut(link)
        ring.runUs(10)
        // What was guard before closes.
        for (_ <- 1 to 2) {
          pulse(ring, (link + 1) % 4, 3)
          ring.runUs(30)
        }
        assert(ring.guards == Nil)
        ring.cut(link, isCut = false)
        val heard = new Scope(ring, () => ring.nodes.indices.forall(ring.bus))
        ring.runUs(40)
        assert(ring.guards == Seq(link) && heard.changes == Nil)
        pulse(ring, 3, 3)
        ring.runUs(2)
        assert(ring.nodes.indices.forall(ring.bus) && ring.guards == Seq(link))
      }
    }

  it should "hold for a neighbour that died and comes back" in ring(4, home = None) { ring =>
    ring.isDead(2) = true
    ring.runUs(10)
    assert(ring.modes == Seq(1, 2, 1, 3))
    ring.isDead(2) = false
    ring.runUs(40)
    // Node 1 lost its port 2; so did node 2, which heard its neighbours all the time.
    assert(ring.guards.contains(1))
  }

  for (first <- Seq(1, 2))
    s"FR-34, FB-14: node $first that comes up a millisecond before its neighbour" should "disturb nothing" in
      ring(3, home = None, ahead = Map(first -> 90)) { ring =>
        ring.nodes.foreach(_.setBit(40)) // so that most of a millisecond of these is more than 1.5 T
        ring.nodes(1).write(RingRegisters.Address, 8) // it would not wait
        ring.cut(1)
        ring.runUs(20)
        ring.cut(1, isCut = false)
        val (left, right) = (() => ring.isUp(1, 1), () => ring.isUp(2, 0))
        ring.runUs(9)
        assert(!left() && !right())
        ring.dominant(0) // a frame has begun
        ring.await(4, "one is up")(left() || right())
        assert(left() == (first == 1) && left() != right())
        ring.runUs(3)
        assert(left() && right() && ring.nodes.indices.forall(!ring.bus(_)))
        ring.dominant(0, isSo = false)
        ring.runUs(3)
        assert(ring.guards == Seq(1) && ring.nodes.indices.forall(ring.bus))
        assert(ring.nodes.forall(n => n.read(RingRegisters.Closings) + n.read(RingRegisters.Latches) == 0))
      }

  /** Node 0 has just become guard of a ring that is broken behind node 2. */
  private def comesUpInBrokenRing(ring: RingBench): Unit = {
    ring.nodes.foreach(_.setBit(40))
    ring.control(0, home = true, off = true)
    ring.cut(2)
    ring.runUs(10)
    ring.control(0, home = true)
    ring.await(40, "guard")(ring.isGuard(0))
  }

  "FB-14: a guard that has come up" should "watch port 2 two milliseconds later at the latest" in ring(4) {
    ring =>
      comesUpInBrokenRing(ring)
      ring.dominant(3)
      ring.runUs(1.9)
      assert(ring.isGuard(0))
      assert(ring.await(1, "closed")(!ring.isGuard(0)) > 500) // 1.5 T behind the two
  }

  it should "watch it as soon as both sides were dominant together for 1.5 T" in ring(4) { ring =>
    comesUpInBrokenRing(ring)
    for (n <- Seq(1, 3)) ring.dominant(n)
    ring.runUs(1)
    ring.dominant(1, isSo = false)
    assert(ring.isGuard(0))
    assert(ring.await(1, "closed")(!ring.isGuard(0)) > 500)
  }

  "FB-15: a node without a possible bit timing" should "be no guard" in ring(3) { ring =>
    ring.nodes(0).setBit(0)
    ring.runUs(1)
    assert(ring.guards == Nil) // it was
    ring.cut(0)
    ring.runUs(10)
    ring.cut(0, isCut = false)
    ring.runUs(40)
    assert(ring.guards == Nil) // by FR-34 it would be
    ring.nodes(0).setBit(100)
    ring.runUs(1)
    assert(ring.guards == Seq(0)) // it has `home`
  }

  "FR-34: a guard with `home` beside another guard" should "close" in ring(4) { ring =>
    ring.cut(2)
    ring.runUs(10)
    pulse(ring, 1, 3)
    ring.runUs(2)
    assert(ring.guards == Nil)
    ring.cut(2, isCut = false)
    ring.runUs(30)
    assert(ring.guards == Seq(2))
    // The server comes back.
    ring.control(0, home = true, off = true)
    ring.runUs(10)
    ring.control(0, home = true)
    ring.runUs(40)
    assert(ring.guards.contains(0) && ring.guards.size > 1)
    for (_ <- 0 until 3) { pulse(ring, 1, 3); ring.runUs(40) }
    assert(ring.guards.size == 1)
    pulse(ring, 1, 3)
    ring.runUs(2)
    assert(ring.nodes.indices.forall(ring.bus))
  }

  for (address <- 8 to 15)
    s"FR-34, FB-17: a guard of address $address beside one with `home`" should "not close with it" in ring(
      4
    ) { ring =>
      ring.nodes(3).write(RingRegisters.Address, address)
      ring.control(0, home = true, off = true)
      ring.runUs(10)
      ring.control(0, home = true) // it starts anew; node 3 is guard by FR-34
      ring.runUs(40)
      assert(ring.guards == Seq(0, 3))
      for (_ <- 0 until 8) { // no more than two dominant bits in a row
        pulse(ring, 1, 2)
        ring.runUs(3)
      }
      assert(ring.guards == Seq(3) && ring.nodes.indices.forall(ring.bus))
      assert(ring.nodes.forall(_.read(RingRegisters.Latches) == 0))
    }

  "FB-17, FB-05: a guard with its wait behind it" should "not close when `home` is set" in ring(4) { ring =>
    ring.control(0)
    ring.cut(1)
    ring.runUs(10)
    pulse(ring, 3, 2)
    ring.runUs(20)
    assert(ring.guards == Seq(0))
    ring.control(0, home = true)
    ring.runUs(20)
    assert(ring.guards == Seq(0))
    pulse(ring, 3, 1)
    ring.runUs(1)
    assert(ring.guards == Nil)
  }

  "FR-36: a latched ring" should "make one node guard, and the level falls" in ring(5, home = None) { ring =>
    pulse(ring, 2, 3)
    ring.runUs(3)
    assert(ring.nodes.indices.forall(!ring.bus(_)) && ring.guards == Nil)
    // Node 0 has the lowest address, 2.
    val took = ring.await(45, "guard")(ring.guards.nonEmpty) / 1000
    assert(took > 36 && took < 42)
    ring.runUs(5)
    assert(ring.guards == Seq(0) && ring.nodes.indices.forall(ring.bus))
    assert(ring.nodes.map(_.read(RingRegisters.Latches)) == Seq(1, 0, 0, 0, 0))
    pulse(ring, 3, 3)
    ring.runUs(3)
    assert(ring.nodes.indices.forall(ring.bus) && ring.guards == Seq(0))
  }

  "FR-36, FB-09: a ring of the published nodes" should "latch" in ring(5, home = None) { ring =>
    for (n <- ring.nodes.indices) ring.control(n, forced = 1)
    ring.runUs(1)
    pulse(ring, 2, 3)
    ring.runUs(200)
    assert(ring.nodes.indices.forall(!ring.bus(_)))
  }
}
