package flyframe.rules

import flyframe.model._
import flyframe.params.EscParams
import flyframe.protocol.Command._

/** Distributed clocks: rule group DC. */
object ClockRules extends Rules {
  private def built(p: EscParams)   = p.hasClocks
  private def several(p: EscParams) = p.hasClocks && p.ports > 1

  private class Times(s: Steps) {
    import s._
    private def number(bytes: Seq[Int]) = bytes.foldRight(BigInt(0))((byte, rest) => rest << 8 | byte)

    def port(y: Int): BigInt    = number(get(0x0900 + 4 * y, 4).get)
    def ofPorts: Seq[BigInt]    = (0 until 4).map(port)
    def processingUnit: BigInt  = number(get(0x0918, p.clockBytes).get)
    def low: BigInt             = processingUnit & 0xffffffffL
    val trigger: Datagram       = Datagram(Bwr, 0, 0x0900, Seq(0, 0, 0, 0))
    def stamp(): Unit           = assert(one(trigger).workingCounter == 1)
    def nothingAt(y: Int): Unit = send(EtherCatFrame(Seq(Datagram(Nop, 0, 0, Seq(0)))), y)
  }

  rule("DC-05, B-83: the features tell of clocks and of the width of times", built) { s =>
    import s._
    assert((word(0x0008) & 0x000c) == (if (p.clockBits == 64) 0x000c else 0x0004))
    assert(get(0x0910, 1).isEmpty, "receive times only")
  }
  rule("DC-05: without clocks there are none of their registers", p => !p.hasClocks && !p.hasAlarm) { s =>
    import s._
    for (address <- Seq(0x0900, 0x0910, 0x0918)) {
      assert(write(Bwr, 0, address, 0, 0, 0, 0).workingCounter == 0)
      assert(get(address, 4).isEmpty)
    }
  }
  rule("DC-01: times have 64 bits, or their low half", built) { s =>
    import s._
    new Times(s).stamp()
    assert(get(0x091c, 4).isDefined == (p.clockBits == 64))
  }
  rule("DC-03, DC-07, DC-10, B-81: a BWR keeps the local time of its beginning, which runs freely", built) {
    s =>
      import s._
      val times = new Times(s)
      import times._
      var before = BigInt(0)
      for (us <- Seq(100, 400, 100)) {
        stamp()
        assert(port(0) == low, "a frame at port 0 is in the processing unit at once")
        val now = processingUnit
        if (before != 0) assert(now - before > 1000 * us && now - before < 1000 * (us + 100), s"$us us")
        assert(port(0) == (now & 0xffffffffL), "it stays while other frames pass")
        assert(hostGet(0x0918, 4) == get(0x0918, 4).get, "the host reads the same")
        before = now
        bench.advanceUs(if (us == 100) 400 else 100)
      }
  }
  rule("DC-07: FPWR does the same, other writes keep the time of the processing unit only", built) { s =>
    import s._
    val times = new Times(s)
    import times._
    stationAddress(0x55)
    def after(command: Int, adp: Int, ado: Int = 0x0900): (Boolean, Boolean, Int) = {
      val (atPort, atUnit) = (port(0), processingUnit)
      val counter          = write(command, adp, ado, 0).workingCounter
      (port(0) != atPort, processingUnit != atUnit, counter)
    }
    stamp()
    assert(after(Fpwr, 0x55) == ((true, true, 1)))
    assert(after(Apwr, 0) == ((false, true, 1)))
    assert(after(Brw, 0) == ((false, true, 3)))
    assert(after(Fprw, 0x55) == ((false, true, 3)))
    assert(after(Frmw, 0x33) == ((false, true, 1)))
    assert(after(Fpwr, 0x33) == ((false, false, 0)), "of another")
    assert(after(Brd, 0) == ((false, false, 1)))
    assert(after(Bwr, 0, 0x08ff) == ((false, false, 0)))
    for (ado <- Seq(0x0901, 0x0904, 0x0918)) assert(after(Bwr, 0, ado) == ((false, false, 0)))
    bench.hostWrite(0x0900, 0)
    val (atPort, atUnit) = (port(0), processingUnit)
    assert(port(0) == atPort && processingUnit == atUnit, "nor does the host")
    // Where the write stands in its frame does not matter.
    val other = Datagram(Brd, 0, 0x0000, Seq(0))
    exchange(other, trigger, other)
    assert(port(0) > atPort && low == port(0))
    assert(one(Datagram(Bwr, 0, 0x08fe, Seq(1, 2, 3))).workingCounter == 1)
    assert(low == port(0) && port(0) > atPort)
  }
  rule("DC-08: a frame in error keeps nothing; none reads its own times", built) { s =>
    import s._
    val times = new Times(s)
    import times._
    stamp()
    val (atPort, atUnit) = (port(0), processingUnit)
    spoiled(trigger)
    assert(port(0) == atPort && processingUnit == atUnit)
    val replies = exchange(trigger, Datagram(Aprd, 0, 0x0900, Seq(0, 0, 0, 0)))
    assert(replies(1).data.zipWithIndex.map { case (b, i) => BigInt(b) << (8 * i) }.sum == atPort)
    assert(port(0) > atPort && processingUnit > atUnit)
  }
  rule("DC-08, B-80: on its way back the frame is stamped where it comes in", several) { s =>
    import s._
    val times = new Times(s)
    import times._
    nothingAt(nextPort) // one before does not count
    stamp()
    val unknown = port(nextPort)
    assert(unknown == 0)
    bench.advanceUs(20)
    nothingAt(nextPort)
    val back = port(nextPort) - port(0)
    assert(back > 20000 && back < 60000, s"$back ns")
    bench.advanceUs(20)
    nothingAt(nextPort)
    assert(port(nextPort) - port(0) == back, "only once")
    stamp()
    assert(port(nextPort) < port(0), "again to come")
    nothingAt(nextPort)
    assert(port(nextPort) > port(0))
  }
  rule("B-80: nothing is waited for at a port without link", several) { s =>
    import s._
    val times = new Times(s)
    import times._
    stamp()
    bench.setLink(nextPort, up = false)
    bench.setLink(nextPort, up = true)
    nothingAt(nextPort)
    assert(port(nextPort) == 0)
  }
  rule("B-80: a frame that enters elsewhere is stamped there", several) { s =>
    import s._
    val times = new Times(s)
    import times._
    // Without port 0 the processing unit is behind the other ports. Time 0 would look like none.
    bench.advanceUs(1)
    bench.setLink(0, up = false)
    (1 until p.ports).filter(_ != nextPort).foreach(bench.setLink(_, up = false))
    assert(bench.send(nextPort, WireFrame.withFcs(EtherCatFrame(Seq(trigger)))).isDefined)
    val bytes = hostGet(0x0900, 16).grouped(4).toSeq
    assert(bytes(nextPort) == hostGet(0x0918, 4) && bytes(nextPort).exists(_ != 0))
    assert(bytes(0).forall(_ == 0))
  }
  rule("B-82: times are 0 until there are some, and always for ports that do not exist", built) { s =>
    import s._
    val times = new Times(s)
    import times._
    assert(ofPorts.forall(_ == 0) && processingUnit == 0)
    stamp()
    (1 until p.ports).foreach(nothingAt)
    assert(processingUnit != 0)
    assert(ofPorts.map(_ != 0) == (0 until 4).map(_ < p.ports))
  }
}
