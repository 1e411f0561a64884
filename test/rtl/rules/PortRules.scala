package flyframe.rules

import flyframe.model._
import flyframe.params.EscParams
import flyframe.protocol.Command._

/** Ports and loops, circulating frames, errors, PHY side: rule groups LP, ERR and PHY. */
object PortRules extends Rules {
  private def two(p: EscParams)  = p.ports >= 2
  private def four(p: EscParams) = p.ports >= 4
  private val plain              = EtherCatFrame(Seq(Datagram(Brd, 0, 0, Seq(0))))
  private def circling(bit: Boolean) = EtherCatFrame(
    Seq(Datagram(Bwr, 0x0f80L << 16, Seq(0x61), circulating = bit))
  )

  rule("LP-01: auto follows the link, open and closed do not", two) { s =>
    import s._
    def leaves = send(plain).get._1
    for (y <- 2 until p.ports) bench.setLink(y, up = false)
    assert(leaves == 1)
    bench.setLink(1, up = false)
    assert(leaves == 0)
    loops(2 << 2) // port 1 open
    assert(leaves == 1)
    bench.setLink(1, up = true)
    loops(3 << 2) // port 1 closed
    assert(leaves == 0)
    bench.send(1, WireFrame.withFcs(plain.dropRight(1)))
    assert(invalid(1) == 0, "a closed port ignores frames")
  }
  rule("LP-02: DL status shows link, loop and communication of every port") { s =>
    import s._
    val all    = (1 << p.ports) - 1
    val loops  = (0 until 4).map(y => (if (y < p.ports) 2 else 1) << 2 * y).sum
    def status = dlStatus & ~2 // without the watchdog of the host
    val on     = p.enhancedLinkDetection << 2
    assert(status == (1 | on | all << 4 | loops << 8))
    bench.setLink(p.ports - 1, up = false)
    val last = p.ports - 1
    assert(status == (1 | on | (all & ~(1 << last)) << 4 | (loops & ~(3 << 2 * last) | 1 << 2 * last) << 8))
  }
  rule("LP-03, LP-04, B-33: auto close opens again only when written or after a good frame", two) { s =>
    import s._
    for (y <- 2 until p.ports) bench.setLink(y, up = false)
    def opened = (dlStatus >> 10 & 1) == 0
    loops(1 << 2)
    assert(opened, "written while the link is up")
    bench.setLink(1, up = false)
    assert(!opened)
    bench.setLink(1, up = true)
    assert(!opened, "closed wait")
    assert(send(plain).get._1 == 0)
    good(send(EtherCatFrame(Seq(Datagram(Bwr, 0, 0x0100, Seq(1))))), 0)
    assert(!opened, "not the byte of the loop settings")
    loops(1 << 2)
    assert(opened)
    bench.setLink(1, up = false)
    bench.setLink(1, up = true)
    bench.send(1, WireFrame.ofBytes(plain ++ Seq(1, 2, 3, 4)))
    assert(!opened, "a bad frame does not open")
    assert(bench.send(1, WireFrame.withFcs(plain)).isEmpty, "the opening frame is not forwarded")
    assert(opened)
  }
  rule("LP-05, PHY-06: ports that do not exist behave as closed", _.ports < 4) { s =>
    import s._
    assert((dlStatus >> (8 + 2 * 3) & 3) == 1)
    assert(send(plain).get._1 == nextPort)
  }
  rule(
    "LP-06, HINT-01, HINT-03: with all ports closed port 0 opens as recovery port, " +
      "and DL status shows the truth"
  ) { s =>
    import s._
    for (y <- 0 until p.ports) bench.setLink(y, up = false)
    assert(replies(good(send(plain), 0)).head.workingCounter == 1)
    assert((dlStatus >> 8 & 0xff) == 0x55)
    for (y <- 0 until p.ports) bench.setLink(y, up = true)
    loops(0xff)
    assert(replies(good(send(plain), 0)).head.workingCounter == 1)
    loops(0)
    assert(send(plain).get._1 == nextPort)
  }
  rule("LP-07, LP-08: processing order of every set of open ports") { s =>
    import s._
    // In the order of the rule: the frame goes P, 3, 1, 2, 0; a closed loop passes on.
    for (set <- 0 until 1 << (p.ports - 1)) {
      val openPorts = 0 +: (1 until p.ports).filter(y => (set >> (y - 1) & 1) == 1)
      for (y <- 1 until p.ports) bench.setLink(y, openPorts.contains(y))
      val cycle = Seq(0, 3, 1, 2).filter(openPorts.contains)
      for ((from, to) <- cycle.zip(cycle.tail :+ 0)) {
        val bytes = good(send(plain, from), to)
        assert(
          replies(bytes).head.workingCounter == (if (from == 0) 1 else 0),
          s"from $from, open $openPorts"
        )
      }
    }
  }
  rule("LP-09: with port 0 closed frames from elsewhere still reach the processing unit", two) { s =>
    import s._
    bench.setLink(0, up = false)
    for (y <- 2 until p.ports) bench.setLink(y, up = false)
    val bytes = good(send(plain, 1), 1)
    assert(replies(bytes).head.workingCounter == 1)
  }
  rule("LP-10: permanent ports start in auto") { s =>
    s.bench.reset()
    assert(s.bench.hostRead(0x0101) == 0)
  }
  rule(
    "LP-11, LP-14, LP-15, LP-17, HINT-02, OP-03: a frame circulates once if port 0 closed by itself",
    two
  ) { s =>
    import s._
    for (y <- 2 until p.ports) bench.setLink(y, up = false)
    good(send(circling(true)), 1) // port 0 open: the bit does not matter
    bench.hostWrite(0x0f80, 0)
    bench.setLink(0, up = false)
    val first = replies(good(send(circling(false), 1), 1)).head
    assert(first.circulating && first.workingCounter == 1 && bench.hostRead(0x0f80) == 0x61)
    bench.hostWrite(0x0f80, 0)
    val errors = epuErrors
    assert(marked(send(circling(true), 1)).payload.size < 64)
    assert(bench.hostRead(0x0f80) == 0 && epuErrors == errors + 1)
  }
  rule(
    "B-11, OP-03: a frame that circulates is cut off at the first circulating bit; " +
      "memory written before stays",
    p => two(p) && p.maxSubTelegrams >= 3
  ) { s =>
    import s._
    for (y <- 2 until p.ports) bench.setLink(y, up = false)
    bench.setLink(0, up = false)
    val frame = EtherCatFrame(
      Seq(
        Datagram(Bwr, 0, 0x0f80, Seq(0x62)),
        Datagram(Bwr, 0, 0x0010, Seq(9)),
        Datagram(Bwr, 0x0f81L << 16, Seq(0x63), circulating = true)
      )
    )
    hostPut(0x0f80, 0, 0)
    // Behind the headers and two datagrams of 13 bytes the bit is in byte 7; one nibble more is the mark.
    assert(marked(send(frame, 1)).payload.size == 2 * (14 + 2 + 2 * 13 + 8) + 1)
    assert(hostGet(0x0f80, 2) == Seq(0x62, 0) && word(0x0010) == 0)
  }
  rule("LP-14: a manually closed port 0 does not switch the circulating rule on", two) { s =>
    import s._
    for (y <- 2 until p.ports) bench.setLink(y, up = false)
    loops(3)
    assert(replies(good(send(circling(true), 1), 1)).head.workingCounter == 1)
  }
  rule("LP-12, LP-13: 0x0100[18:16] can be lowered and the longest frame still passes") { s =>
    import s._
    assert(bench.hostRead(0x0102) == 7)
    for (size <- 0 to 7) {
      assert(write(Apwr, 0, 0x0102, size).workingCounter == 1)
      assert(one(Datagram(Brd, 0x0f80L << 16, Seq.fill(1486)(0))).workingCounter == 1)
    }
  }
  rule("B-31: a temporary loop setting returns after its time", two) { s =>
    import s._
    write(Apwr, 0, 0x0101, 2 << 2)
    write(Apwr, 0, 0x0100, 3, 3 << 2)
    assert(bench.hostRead(0x0100) == 3 && bench.hostRead(0x0101) == 3 << 2)
    bench.advanceMs(p.temporaryLoopMs)
    assert(bench.hostRead(0x0100) == 1 && bench.hostRead(0x0101) == 2 << 2)
  }

  private def damaged(bytes: Seq[Int]): WireFrame = WireFrame.ofBytes(bytes ++ Fcs.of(bytes).map(_ ^ 0x10))

  rule(
    "ERR-01, ERR-03, ERR-05: RX_ER in a frame at port 0 counts invalid frame, RX errors and processing unit"
  ) { s =>
    import s._
    val frame = WireFrame.withFcs(plain).symbols
    val hit   = frame.zipWithIndex.map { case (n, i) => if (i >= 60 && i < 65) n.copy(error = true) else n }
    val sent  = marked(bench.send(0, WireFrame(hit)))
    assert(sent.payload.size < 60, "sending is aborted")
    assert((invalid(0), rxErrors(0), epuErrors, forwarded(0)) == ((1, 5, 1, 0)))
  }
  rule(
    "ERR-02, ERR-06, ERR-07: a bad CRC counts invalid frame and is sent with a wrong CRC and one extra nibble"
  ) { s =>
    import s._
    val sent = marked(bench.send(0, damaged(plain)))
    assert(sent.payload.size == 129)
    assert((invalid(0), rxErrors(0), forwarded(0), epuErrors) == ((1, 0, 0, 1)))
  }
  rule("ERR-02: no SFD counts invalid frame") { s =>
    import s._
    bench.send(0, WireFrame(Vector.fill(40)(Symbol(5))))
    assert((invalid(0), epuErrors) == ((1, 1)))
    bench.send(0, WireFrame(Vector.fill(10)(Symbol(5)) ++ Vector.fill(100)(Symbol(7))))
    assert((invalid(0), epuErrors) == ((2, 2)))
  }
  rule("ERR-02, B-14: a length error counts at the processing unit only") { s =>
    import s._
    val cut = EtherCatFrame(Seq(Datagram(Brd, 0, 0, Seq.fill(100)(0)))).take(80)
    marked(send(cut))
    assert((invalid(0), forwarded(0), epuErrors) == ((0, 0, 1)))
  }
  rule(
    "ERR-04, B-06, HINT-04: RX_ER outside a frame raises only the RX counter, and only at an open port",
    two
  ) { s =>
    import s._
    bench.falseCarrier(1, 7)
    assert((invalid(1), rxErrors(1), epuErrors) == ((0, 7, 0)))
    for (y <- 2 until p.ports) bench.setLink(y, up = false)
    bench.setLink(1, up = false)
    bench.falseCarrier(1, 7)
    assert(rxErrors(1) == 7)
  }
  rule("ERR-08, ERR-09, B-15: a marked error counts as forwarded and is passed on marked", two) { s =>
    import s._
    val sent = marked(bench.send(0, damaged(plain)))
    bench.reset()
    val again = marked(bench.send(0, sent.onWire))
    assert(again.payload.size == sent.payload.size)
    assert((invalid(0), forwarded(0), epuErrors) == ((0, 1, 1)))
    marked(bench.send(1, sent.onWire))
    assert((invalid(1), forwarded(1), epuErrors) == ((0, 1, 1)))
  }
  rule(
    "ERR-10, HINT-05: counters stop at 0xFF; a write of any value clears the group",
    !_.hasEnhancedLinks // which would close the port
  ) { s =>
    import s._
    for (_ <- 0 until 13) bench.falseCarrier(0, 20)
    assert(rxErrors(0) == 0xff)
    bench.send(0, damaged(plain))
    marked(bench.send(0, damaged(plain)))
    assert(invalid(0) == 2 && epuErrors == 2)
    assert(write(Apwr, 0, 0x0300, 0x55).workingCounter == 1)
    assert((invalid(0), rxErrors(0), epuErrors) == ((0, 0, 2)))
    assert(write(Apwr, 0, 0x030c, 0).workingCounter == 1)
    assert(epuErrors == 0)
  }
  rule("ERR-11, B-32, OP-09: a lost link counts while the loop is auto", two) { s =>
    import s._
    bench.setLink(1, up = false)
    bench.setLink(1, up = true)
    assert(lostLinks(1) == 1)
    for (setting <- Seq(1, 2)) { // auto close, open
      loops(setting << 2)
      bench.setLink(1, up = false)
      bench.setLink(1, up = true)
      assert(lostLinks(1) == 1)
    }
    assert(write(Bwr, 0, 0x0310, 0).workingCounter == 1)
    assert(lostLinks(1) == 0)
  }
  rule("OP-10, B-03: a frame with half a byte behind a good FCS is good, and leaves as it came") { s =>
    import s._
    val frame        = WireFrame.withFcs(plain).symbols :+ Symbol(3)
    val (port, sent) = bench.send(0, WireFrame(frame)).get
    assert(port == nextPort && sent.good && sent.payload.size == 129 && sent.payload.last == 3)
    assert(epuErrors == 0 && invalid(0) == 0 && forwarded(0) == 0)
  }
  rule("PHY-02, PHY-03: a short preamble, or none, is enough", _ => true) { s =>
    import s._
    for (nibbles <- Seq(0, 1, 2, 7, 15, 31)) {
      val (port, sent) = bench.send(0, WireFrame.withFcs(plain, nibbles)).get
      assert(port == nextPort && sent.good && sent.preamble == nibbles)
    }
  }
  rule("PHY-04, PHY-05, PHY-07: ports report MII, whatever they have, and a link by pin only", four) { s =>
    assert(s.bench.hostRead(0x0007) == s.p.portDescriptor)
    s.bench.setLink(2, up = false)
    assert((s.dlStatus >> 6 & 1) == 0)
  }
}
