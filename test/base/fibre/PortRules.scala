package flyframe.fibre

import flyframe.registers.RingRegisters

/** Rules of the ports (FR-10 to FR-15, FB-02 to FB-07, FB-16). */
abstract class PortRules extends FibreCases {

  /** Light as pulses of `high` ns, one each `period` ns. */
  private def pulses(high: Int, period: Int)(time: Long): Boolean = time / 1000 % period < high

  /** What port 1 of node 1 hears comes from here. */
  private def input(ring: RingBench)(light: Long => Boolean): Unit =
    ring.there(0).disturbed = (time, _) => light(time)

  "FR-10, FB-12: a port" should "have signal while edges come every 2.5 us" in line() { ring =>
    for (period <- Seq(1000, 2490)) {
      input(ring)(pulses(period / 2, period))
      ring.runUs(20)
      val signal = new Scope(ring, () => ring.signal(1, 0))
      ring.runUs(50)
      assert(ring.signal(1, 0) && signal.changes == Nil)
    }
    input(ring)(pulses(1000, 2900))
    val signal = new Scope(ring, () => ring.signal(1, 0))
    ring.runUs(50)
    assert(signal.changes.size > 10)
    input(ring)(_ => true)
    ring.runUs(5)
    assert(!ring.signal(1, 0))
  }

  "FR-10, FB-02: a port" should "have no signal while over 8 distances in 64 us are below 25 ns" in line() {
    ring =>
      // A pulse of 10 ns, and 20 ns later the regular edge; `every` n-th period of the recessive tone.
      def withShort(every: Int)(time: Long) = {
        val ns = time / 1000
        ns % 1000 >= 500 || ns / 1000 % every == 0 && ns % 1000 >= 480 && ns % 1000 < 490
      }
      input(ring)(withShort(8)) // 8 in 64 us
      ring.runUs(300)
      assert(ring.signal(1, 0) && ring.isUp(1, 0))
      assert(ring.nodes(1).read(RingRegisters.Noise1) == 0)
      input(ring)(withShort(4))
      ring.await(130, "noise")(!ring.signal(1, 0))
      ring.runUs(300)
      assert(!ring.signal(1, 0) && !ring.isUp(1, 0))
      assert(ring.nodes(1).read(RingRegisters.Noise1) == 1)
      assert(ring.nodes(1).read(RingRegisters.Noise2) == 0)
      input(ring)(pulses(500, 1000))
      ring.await(130, "signal again")(ring.signal(1, 0))
  }

  "FR-10: a port" should "have no signal while `optical_signal` is low" in line() { ring =>
    ring.optical(1) = 2
    ring.runUs(1)
    assert(!ring.signal(1, 0) && ring.signal(1, 1))
    assert(!ring.isUp(1, 0) && ring.isUp(1, 1))
    ring.optical(1) = 3
    ring.await(40, "up")(ring.isUp(1, 0))
  }

  for ((period, isSearch) <- Seq(180 -> true, 200 -> true, 220 -> true, 170 -> false, 230 -> false))
    s"FR-11: edges each $period ns" should s"${if (isSearch) "" else "not "}be search" in line() { ring =>
      input(ring)(pulses(100, period))
      val start = ring.now
      ring.runUs(3)
      assert(!ring.hearsSearch(1, 0))
      ring.runUs(2)
      assert(ring.hearsSearch(1, 0) == isSearch)
      assert(ring.isUp(1, 0) != isSearch)
      assert(ring.now > start)
    }

  "FR-11, FB-03: search" should "take 16 distances, and end with another one" in line() { ring =>
    for (distances <- Seq(15, 16)) {
      val start = ring.now + 2000000
      input(ring)(time =>
        time >= start && time < start + distances * 200000L + 100000 && (time - start) / 100000 % 2 == 0
      )
      val heard = new Scope(ring, () => ring.hearsSearch(1, 0))
      ring.runUs(6.5)
      assert(heard.changes.map(_._2) == (if (distances == 16) Seq(true, false) else Nil))
    }
  }

  "FR-12: a port" should "send search without signal, and its levels when it is up" in
    ring(3, isLine = true) { ring =>
      def tone(n: Int, port: Int): Seq[Double] = {
        val light = new Scope(ring, () => ring.nodes(n).light(port))
        ring.runUs(4)
        light.pulses.distinct
      }
      assert(tone(0, 0) == Seq(100.0)) // nothing is there
      assert(tone(0, 1) == Seq(500.0))
      // One fibre: node 1 hears nothing, node 0 hears its search and sends recessive.
      ring.there(0).isCut = true
      ring.runUs(10)
      assert(!ring.signal(1, 0) && !ring.isUp(1, 0) && !ring.isUp(0, 1))
      assert(ring.signal(0, 1) && ring.hearsSearch(0, 1))
      assert(tone(1, 0) == Seq(100.0))
      ring.dominant(0)
      assert(tone(0, 1) == Seq(500.0))
      ring.dominant(0, isSo = false)
      ring.there(0).isCut = false
      val up = ring.await(20, "both up")(ring.isUp(1, 0) && ring.isUp(0, 1))
      assert(up >= 10000) // upMs of 1 us each
      ring.dominant(0)
      assert(tone(0, 1).contains(20.0))
    }

  for (upMs <- Seq(0, 3, 40))
    s"FR-12, FB-04: a port with an `upMs` of $upMs" should "come up after that much signal without search" in
      ring(2, isLine = true) { ring =>
        ring.nodes.foreach(_.write(RingRegisters.UpMs, upMs))
        ring.cut(0)
        ring.runUs(10)
        ring.cut(0, isCut = false)
        val signal = new Scope(ring, () => ring.signal(1, 0) && !ring.hearsSearch(1, 0))
        val up     = new Scope(ring, () => ring.isUp(1, 0))
        ring.runUs(60)
        val took = up.rises.head - signal.rises.last
        assert(took > upMs * 1000 && took < (upMs + 1) * 1000 + 50, s"$took ns")
      }

  for (p <- clocks)
    s"FR-13: a cut of one fibre at ${p.coreClockMhz} MHz" should "take both ends down" in
      ring(3, home = None, delayNs = 700, p = p) { ring =>
        ring.there(0).isCut = true
        assert(ring.await(3, "the receiving end")(!ring.isUp(1, 0)) > 1000)
        ring.await(4.7, "the other end")(!ring.isUp(0, 1))
        ring.runUs(100)
        assert(ring.nodes.map(_.read(RingRegisters.Losses1)) == Seq(0, 1, 0))
        assert(ring.nodes.map(_.read(RingRegisters.Losses2)) == Seq(1, 0, 0))
      }

  "FR-13: cut of both fibres and a dead neighbour" should "be the same case" in
    ring(3, home = None) { ring =>
      ring.cut(0)
      ring.await(3, "one end")(!ring.isUp(1, 0))
      ring.await(3, "the other end")(!ring.isUp(0, 1))
      ring.cut(0, isCut = false)
      ring.await(30, "up again")(ring.isUp(1, 0) && ring.isUp(0, 1))
      ring.isDead(2) = true
      ring.await(3, "at port 2 of the neighbour")(!ring.isUp(1, 1))
      ring.await(3, "at port 1 of the other one")(!ring.isUp(0, 0))
    }

  "FR-14, FB-04: three losses within a second" should "keep a port down for a second" in ring(
    2,
    isLine = true
  ) { ring =>
    def lose(): Double = {
      ring.cut(0)
      ring.runUs(10)
      ring.cut(0, isCut = false)
      ring.await(1350, "up again")(ring.isUp(1, 0))
    }
    assert(lose() < 20000)
    assert(lose() < 20000)
    val third = lose()
    assert(third > 1000000 && third < 1320000)
    assert(ring.nodes(1).read(RingRegisters.Losses1) == 3)
    // Three in more than a second.
    for (_ <- 0 until 3) {
      ring.runUs(700)
      assert(lose() < 20000)
    }
    assert(ring.nodes(1).read(RingRegisters.Losses1) == 6)
  }

  for (ns <- Seq(2900, 4000, 6000))
    s"FR-13, FB-16: light that is missing for $ns ns" should "take both ends down" in line() { ring =>
      ring.there(0).isCut = true
      ring.run(ns * 1000L)
      ring.there(0).isCut = false
      ring.runUs(10)
      assert(!ring.isUp(1, 0) && !ring.isUp(0, 1))
      ring.await(40, "one end is up")(ring.isUp(1, 0) || ring.isUp(0, 1))
      ring.runUs(1.5)
      assert(ring.isUp(1, 0) && ring.isUp(0, 1))
      assert(ring.nodes.map(_.read(RingRegisters.Losses1)) == Seq(0, 1, 0))
      assert(ring.nodes.map(_.read(RingRegisters.Losses2)) == Seq(1, 0, 0))
    }

  "FR-13, FB-16: a port that is switched off and on at once" should "take its neighbour down" in
    line() { ring =>
      ring.control(0, off = true)
      ring.runUs(0.1)
      ring.control(0)
      ring.runUs(8)
      assert(!ring.isUp(1, 0) && !ring.isUp(0, 1))
      ring.await(40, "up again")(ring.isUp(1, 0) && ring.isUp(0, 1))
    }

  "FR-14, FB-16: a port that is kept down" should "keep its neighbour's down, too" in ring(
    2,
    isLine = true
  ) { ring =>
    for (_ <- 0 until 3) { // a neighbour that starts anew loses nothing itself
      ring.control(0, off = true)
      ring.runUs(10)
      ring.control(0)
      ring.runUs(20)
    }
    assert(ring.nodes(1).read(RingRegisters.Losses1) == 3 && ring.nodes(0).read(RingRegisters.Losses2) == 0)
    assert(!ring.isUp(1, 0) && !ring.isUp(0, 1) && ring.hearsSearch(0, 1))
    ring.await(1350, "up again")(ring.isUp(0, 1) || ring.isUp(1, 0))
    ring.runUs(1.5)
    assert(ring.isUp(0, 1) && ring.isUp(1, 0))
  }

  "FR-15: a node without any port up" should "hear itself" in ring(2) { ring =>
    ring.cut(0)
    ring.cut(1)
    ring.runUs(10)
    assert((ring.state(0) & 0xb) == 9) // alone, mode 1
    assert(ring.bus(0))
    ring.dominant(0)
    ring.runUs(1)
    assert(!ring.bus(0) && ring.bus(1))
  }

  "FB-07: ports that are off" should "be dark, and their neighbours down" in ring(2, isLine = true) { ring =>
    ring.control(0, off = true)
    ring.runUs(1)
    val light = new Scope(ring, () => ring.nodes(0).light(1))
    ring.runUs(10)
    assert(light.changes == Nil && !ring.nodes(0).light(1))
    assert(!ring.isUp(0, 1) && !ring.signal(1, 0))
    assert(ring.nodes(0).read(RingRegisters.Losses2) == 0)
    ring.control(0)
    ring.await(30, "up again")(ring.isUp(0, 1) && ring.isUp(1, 0))
  }

  "FB-10: events" should "tell of ports and modes, and interrupt the host as the mask says" in ring(3) {
    ring =>
      val node = ring.nodes(1)
      node.write(RingRegisters.Events, 0xff)
      ring.runUs(1)
      assert(node.read(RingRegisters.Events) == 0)
      ring.cut(1)
      ring.runUs(10)
      assert(node.read(RingRegisters.Events) == 0x60 && !node.interrupt)
      for (bit <- Seq(0x20, 0x40)) {
        node.write(RingRegisters.Mask, bit)
        ring.runUs(1)
        assert(node.interrupt)
        node.write(RingRegisters.Events, bit)
        ring.runUs(1)
        assert(!node.interrupt)
      }
      assert(node.read(RingRegisters.Events) == 0)
  }
}
