package flyframe.rules

import flyframe.mi.Phys
import flyframe.model._
import flyframe.params.EscParams
import flyframe.protocol.Command._

/** Links as inputs, MI and enhanced link detection make them: rule group LNK. */
object LinkRules extends Rules {
  private def polled(p: EscParams)   = p.hasMiLinks && p.ports >= 2
  private def copper(p: EscParams)   = polled(p) && p.fxPorts == 0
  private def fibre(p: EscParams)    = polled(p) && p.isFx(1)
  private def enhanced(p: EscParams) = p.hasEnhancedLinks && p.ports >= 2
  private def loaded(p: EscParams)   = enhanced(p) && p.hasI2c

  /** Enough RX_ER for one interval of 10 us, wherever that begins. */
  private val many = 63

  /** Enhanced link detection is on at all ports. */
  private def start(s: Steps): Unit = if (s.p.hasI2c) start(s, EepromImage(0x0200)) else s.bench.reset()
  private def start(s: Steps, image: Seq[Int]): Unit = {
    s.bench.powerOn(image)
    s.eepromDone()
  }

  /** Time for all PHYs to be asked. */
  private def poll(s: Steps): Unit = s.bench.advanceMs(2)

  private def physical(s: Steps, y: Int): Boolean      = (s.dlStatus >> (4 + y) & 1) == 1
  private def communication(s: Steps, y: Int): Boolean = (s.dlStatus >> (9 + 2 * y) & 1) == 1
  private def status(s: Steps, y: Int): Int            = s.bench.hostRead(0x0518 + y)

  /** What the PHY of port `y` says of its link. */
  private def phy(s: Steps, y: Int, link: Boolean, complete: Boolean = true, partner: Int = 0x45e1): Unit = {
    s.bench.phys.set(s.p.phyAddress(y), 1, 0x7949 | (if (link) 4 else 0) | (if (complete) 0x20 else 0))
    s.bench.phys.set(s.p.phyAddress(y), 5, partner)
  }
  private def basic(s: Steps, y: Int): Int = s.bench.phys.get(s.p.phyAddress(y), 0)

  rule(
    "LNK-01: a link input alone is a link, with the polarity of its port",
    p => p.hasMi && p.linkLowPorts != 0
  ) { s =>
    import s._
    for (y <- 0 until p.ports) {
      assert(physical(s, y) && communication(s, y))
      bench.setLink(y, up = false)
      assert(!physical(s, y) && !communication(s, y))
    }
  }
  rule("LNK-05, LNK-06, B-93: every PHY is configured once, and then reports its link", copper) { s =>
    import s._
    poll(s)
    for (y <- 0 until p.ports) {
      def register(r: Int) = bench.phys.get(p.phyAddress(y), r)
      assert((register(9), register(4), register(0)) == ((0, 0x0101, 0x1200)), s"port $y")
      assert(status(s, y) == 0x23)
    }
    assert((bench.hostRead(0x0510) & 4) == 4)
    val other = p.ports - 1
    assert(put(0x0518 + other, 0x55) && status(s, 0) == 3 && status(s, other) == 3, "any of them clears all")
    bench.phys.set(p.phyAddress(0), 4, 0x01e1)
    poll(s)
    assert(bench.phys.get(p.phyAddress(0), 4) == 0x01e1, "once")
  }
  rule("LNK-06, B-93: a PHY that has lost its link is configured again before the next one counts", copper) {
    s =>
      import s._
      poll(s)
      put(0x0518, 0)
      for (y <- 0 until p.ports) for ((r, v) <- Phys.PowerOn) bench.phys.set(p.phyAddress(y), r, v)
      poll(s)
      assert(status(s, 0) == 3 && basic(s, 0) == 0x3100, "with its link it is left alone")
      phy(s, 1, link = false)
      poll(s)
      def register(r: Int) = bench.phys.get(p.phyAddress(1), r)
      assert((register(9), register(4), register(0)) == ((0, 0x0101, 0x1200)))
      assert(status(s, 1) == 0x20 && basic(s, 0) == 0x3100, "the others are left alone")
      for ((r, v) <- Phys.PowerOn if r != 1) bench.phys.set(p.phyAddress(1), r, v)
      poll(s)
      assert(register(4) == 0x01e1, "once, while there is no link")
      phy(s, 1, link = true)
      poll(s)
      assert(status(s, 1) == 0x23 && physical(s, 1) && register(4) == 0x01e1, "its bits may be fixed")
      phy(s, 1, link = false)
      poll(s)
      assert(register(4) == 0x0101, "another loss")
  }
  rule("LNK-06, B-93, B-94: a PHY that resets itself is configured when it is out of its reset", copper) {
    s =>
      import s._
      def resets(control: Int, link: Boolean): Unit = {
        for ((r, v) <- Phys.PowerOn if r != 1) bench.phys.set(p.phyAddress(1), r, v)
        bench.phys.set(p.phyAddress(1), 0, control)
        phy(s, 1, link)
      }
      poll(s)
      put(0x0518, 0)
      for (link <- Seq(false, true)) { // it may tell anything meanwhile
        resets(0xb100, link)
        poll(s)
        if (!link) assert((status(s, 1) & 0xf) == 8 && basic(s, 1) == 0xb100, "no answer yet")
      }
      assert((status(s, 1) & 0xf) == 8 && basic(s, 1) == 0xb100)
      resets(0x3100, link = true)
      poll(s)
      assert(basic(s, 1) == 0x1200 && bench.phys.get(p.phyAddress(1), 4) == 0x0101)
      assert((status(s, 1) & 7) == 3 && physical(s, 1))
  }
  rule("LNK-06, B-93, B-94: a link that has gone between two polls has gone", copper) { s =>
    import s._
    poll(s)
    bench.phys.set(p.phyAddress(1), 4, 0x01e1)
    bench.phys.blink(p.phyAddress(1))
    poll(s)
    assert(bench.phys.get(p.phyAddress(1), 4) == 0x0101 && status(s, 1) % 8 == 3 && physical(s, 1))
  }
  rule("LNK-06, B-93: a PHY that is as wanted is not written", copper) { s =>
    import s._
    for ((register, value) <- Seq(0 -> 0x3300, 4 -> 0x0d01, 9 -> 0x0c00)) {
      bench.reset()
      for ((r, v) <- Seq(0 -> 0x3000, 4 -> 0x0101, 9 -> 0)) bench.phys.set(p.phyAddress(0), r, v)
      bench.phys.set(p.phyAddress(0), register, value)
      poll(s)
      assert(status(s, 0) == 3 && bench.phys.get(p.phyAddress(0), register) == value)
    }
  }
  rule("LNK-01, LNK-04: a link that does not suit is none, whatever the input says", copper) { s =>
    import s._
    poll(s)
    put(0x0518, 0)
    for ((complete, partner, shown) <- Seq((false, 0x45e1, 5), (true, 0x40a1, 0x15), (true, 0, 0x15))) {
      phy(s, 1, link = true, complete, partner)
      poll(s)
      assert(status(s, 1) == shown && !physical(s, 1) && !communication(s, 1))
      phy(s, 1, link = true)
      poll(s)
      assert(status(s, 1) == 3 && physical(s, 1) && communication(s, 1))
    }
    phy(s, 1, link = false)
    poll(s)
    assert(status(s, 1) == 0 && !physical(s, 1), "read, and no link")
  }
  rule(
    "LNK-04, B-94: a PHY that cannot be read leaves the link to its input, and is configured when it can",
    copper
  ) { s =>
    import s._
    poll(s)
    put(0x0518, 0)
    bench.phys.remove(p.phyAddress(1))
    poll(s)
    assert(status(s, 1) == 8 && physical(s, 1))
    bench.setLink(1, up = false)
    assert(!physical(s, 1))
    bench.setLink(1, up = true)
    assert(physical(s, 1) && status(s, 0) == 3)
    bench.phys.set(p.phyAddress(1), 4, 0x01e1)
    bench.phys.insert(p.phyAddress(1))
    poll(s)
    assert(status(s, 1) == 0x2b && bench.phys.get(p.phyAddress(1), 4) == 0x0101, "the error stays")
    put(0x0518, 0)
    assert(status(s, 1) == 3)
  }
  rule("LNK-01, LNK-03, OP-15, OP-16: the falling input takes the link, until MI has read none", copper) {
    s =>
      import s._
      poll(s)
      bench.setLink(1, up = false)
      assert(!physical(s, 1) && !communication(s, 1), "at once")
      poll(s)
      assert(status(s, 1) % 8 == 3 && !physical(s, 1), "though MI still finds one")
      bench.setLink(1, up = true)
      assert(physical(s, 1), "the input is back")
      bench.setLink(1, up = false)
      phy(s, 1, link = false)
      poll(s)
      assert(!physical(s, 1))
      phy(s, 1, link = true)
      poll(s)
      assert(physical(s, 1) && communication(s, 1), "a link by MI alone")
  }
  rule("LNK-06, MI-02, B-95: commands of the master are served between the polls", polled) { s =>
    import s._
    poll(s)
    for (i <- 0 until 8) {
      bench.phys.set(p.phyAddress(0), 16 + i, 0x1100 + i)
      assert(put(0x0510, 0, 1, 0, 16 + i))
      bench.advanceUs(200)
      assert(bench.hostRead(0x0511) == 0 && word(0x0514) == 0x1100 + i)
    }
    assert(put(0x0514, 0xee, 0x77))
    poll(s)
    assert(word(0x0514) == 0x77ee, "polls leave the data alone")
    assert(put(0x0510, 1, 2, 0, 27))
    bench.advanceUs(200)
    assert(bench.phys.get(p.phyAddress(0), 27) == 0x77ee && status(s, 1) % 8 == 3)
  }
  rule(
    "LNK-06: a fibre PHY is fixed to 100 Mbit/s full duplex, and its link needs no partner",
    fibre
  ) { s =>
    import s._
    poll(s)
    assert(basic(s, 1) == 0x2100 && status(s, 1) == 0x23 && basic(s, 0) == 0x1200)
    phy(s, 1, link = true, complete = false, partner = 0)
    poll(s)
    assert(status(s, 1) == 0x23 && physical(s, 1))
    phy(s, 1, link = false)
    poll(s)
    assert(status(s, 1) == 0x20 && !physical(s, 1))
  }
  rule(
    "LNK-08, LNK-09: 32 RX_ER within 10 us close the port, until its link has gone and come",
    enhanced
  ) { s =>
    import s._
    start(s)
    poll(s)
    bench.falseCarrier(1, 31)
    bench.advanceUs(20)
    bench.falseCarrier(1, 31)
    bench.advanceUs(20)
    assert(communication(s, 1))
    bench.falseCarrier(1, many)
    assert(physical(s, 1) && !communication(s, 1) && (dlStatus >> 10 & 1) == 1)
    val plain = EtherCatFrame(Seq(Datagram(Brd, 0, 0, Seq(0))))
    assert(send(plain).get._1 != 1)
    poll(s)
    assert(physical(s, 1) && !communication(s, 1), "it stays closed")
    bench.setLink(1, up = false)
    bench.setLink(1, up = true)
    assert(communication(s, 1))
  }
  rule("LNK-08, B-96: symbols with RX_ER within a frame close the port like those between frames", enhanced) {
    s =>
      import s._
      start(s)
      poll(s)
      val symbols = WireFrame.withFcs(EtherCatFrame(Seq(Datagram(Brd, 0, 0, Seq.fill(1200)(0))))).symbols
      def damaged(from: Int, count: Int) = WireFrame(symbols.zipWithIndex.map { case (n, i) =>
        n.copy(error = i >= from && i < from + count)
      })
      bench.send(1, damaged(1000, 31))
      bench.advanceUs(20)
      assert(communication(s, 1))
      bench.send(1, damaged(1000, many))
      assert(physical(s, 1) && !communication(s, 1) && communication(s, 0))
      poll(s)
      bench.setLink(1, up = false)
      bench.setLink(1, up = true)
      assert(communication(s, 1))
  }
  rule(
    "LNK-08, MI-10: the PHY of a closed port restarts its auto-negotiation",
    p => enhanced(p) && !p.resetsPhys
  ) { s =>
    import s._
    start(s)
    poll(s)
    for (y <- 0 until p.ports) bench.phys.set(p.phyAddress(y), 0, 0x3000)
    bench.falseCarrier(1, many)
    poll(s)
    assert(basic(s, 1) == 0x1200 && basic(s, 0) == 0x3000)
    if (p.hasMiLinks) assert(status(s, 1) % 8 == 3 && !communication(s, 1))
  }
  rule(
    "LNK-10, B-97: with a fibre port the PHYs of closed ports are reset instead",
    p => enhanced(p) && p.resetsPhys
  ) { s =>
    import s._
    start(s)
    poll(s)
    assert(bench.phyResets == 0)
    for (y <- 0 until p.ports) {
      val before = basic(s, y)
      bench.falseCarrier(y, many)
      assert(bench.phyResets == 1 << y, s"port $y")
      bench.advanceMs(1)
      assert(bench.phyResets == 1 << y, "long enough for every PHY")
      bench.advanceMs(2)
      assert(bench.phyResets == 0 && basic(s, y) == before)
      bench.setLink(y, up = false)
      bench.setLink(y, up = true)
    }
  }
  rule("LNK-11, B-96: enhanced link detection is on where the first load says so", loaded) { s =>
    import s._
    def closes(y: Int) = {
      bench.falseCarrier(y, many)
      val closed = !communication(s, y)
      bench.setLink(y, up = false)
      bench.setLink(y, up = true)
      bench.advanceUs(20)
      closed
    }
    for ((a0, ports) <- Seq(0x0200 -> 3, 0x1000 -> 1, 0x2000 -> 2, 0x3000 -> 3, 0xc000 -> 0, 0x0000 -> 0)) {
      start(s, EepromImage(a0))
      assert((dlStatus >> 2 & 1) == (if (a0 == 0) 0 else 1), f"A0 $a0%04x")
      for (y <- 0 until 2) assert(closes(y) == ((ports >> y & 1) == 1), f"A0 $a0%04x, port $y")
    }
  }
  rule("LNK-11: it is off after a first load that failed, and a later one changes nothing", loaded) { s =>
    import s._
    start(s, EepromImage(0x0200).updated(14, 0x11))
    assert((dlStatus & 5) == 0)
    assert(put(0x0508, 0xa4, 0x88) && put(0x0502, 1, 2, 7, 0)) // no checksum
    eepromDone()
    assert(put(0x0502, 0, 4))
    eepromDone()
    assert((dlStatus & 5) == 1, "loaded now")
    bench.falseCarrier(1, many)
    assert(communication(s, 1))
  }
  rule("LNK-11, B-96: without an EEPROM it is on", p => enhanced(p) && !p.hasSii) { s =>
    assert((s.dlStatus >> 2 & 1) == 1)
  }
  rule("LNK-13: DL status shows links before, communication behind enhanced link detection", enhanced) { s =>
    import s._
    start(s)
    bench.falseCarrier(1, many)
    assert(physical(s, 1) && !communication(s, 1))
    loops(2 << 2) // open
    assert(
      physical(s, 1) && !communication(s, 1) && (dlStatus >> 10 & 1) == 0,
      "the loop setting does not matter"
    )
  }
}
