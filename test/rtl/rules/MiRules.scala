package flyframe.rules

import flyframe.model.Datagram
import flyframe.params.EscParams
import flyframe.protocol.Command._

/** Management of the PHYs by commands of bus and host: rule group MI. */
object MiRules extends Rules {
  private def mi(p: EscParams)    = p.hasMi
  private def byPdi(p: EscParams) = p.hasMiByPdi

  private val Read  = 1
  private val Write = 2

  /** Without link detection nobody else writes to the PHYs. */
  private def alone(p: EscParams)     = p.hasMi && !p.hasMiLinks
  private def status(s: Steps): Int   = s.bench.hostRead(0x0511)
  private def data(s: Steps): Int     = s.word(0x0514)
  private def phyOf(s: Steps, y: Int) = s.p.phyAddress(y)

  /** Waits for the interface: a command with all accesses of the controller takes well below a millisecond.
    */
  private def done(s: Steps): Unit = {
    var left = 500
    while ((status(s) & 0x80) != 0) {
      left -= 1
      assert(left > 0, "the management interface stays busy")
      s.bench.advanceUs(2)
    }
  }

  /** A command by ECAT as a master gives it: what it is for, then the command. */
  private def command(
      s: Steps,
      code: Int,
      phy: Int,
      register: Int,
      data: Seq[Int] = Nil,
      enable: Int = 0
  ): Unit = {
    assert(s.put(0x0512, phy +: register +: data: _*))
    assert(s.put(0x0510, enable, code))
    done(s)
  }
  private def readPhy(s: Steps, phy: Int, register: Int): Int = {
    command(s, Read, phy, register)
    data(s)
  }
  private def bytes(word: Int) = Seq(word & 0xff, word >> 8)

  rule("MI-02, MI-06, MI-10: a read command brings the register of the port's PHY", mi) { s =>
    import s._
    for (y <- 0 until p.ports) {
      bench.phys.set(phyOf(s, y), 2, 0xa501 + y)
      bench.phys.set(phyOf(s, y), 31, 0x8000 >> y)
      assert(readPhy(s, y, 2) == 0xa501 + y && readPhy(s, y, 31) == 0x8000 >> y)
    }
    assert(status(s) == 0 && get(0x0514, 2).contains(bytes(0x8000 >> (p.ports - 1))))
  }
  rule("MI-02, MI-03: a write command with its enable in the same frame writes to the PHY", mi) { s =>
    import s._
    command(s, Write, 1 % p.ports, 18, Seq(0x34, 0x92), enable = 1)
    assert(status(s) == 0 && bench.phys.get(phyOf(s, 1 % p.ports), 18) == 0x9234)
    assert(data(s) == 0x9234, "what was written stays")
    assert(get(0x0510, 1).exists(b => (b.head & 1) == 0), "the enable clears itself")
  }
  rule("B-90, MI-02: a command sees all that its frame writes behind it", mi) { s =>
    import s._
    command(s, Write, 0, 17, Seq(1, 1), enable = 1)
    assert(put(0x0510, 1, Write, 0, 19, 0x78, 0x56))
    done(s)
    assert(bench.phys.get(phyOf(s, 0), 19) == 0x5678 && bench.phys.get(phyOf(s, 0), 17) == 0x0101)
    assert(put(0x0510, 0, Read, 0, 17))
    done(s)
    assert(data(s) == 0x0101)
  }
  rule("MI-03, MI-04, MI-05: a write without enable is a command error, until a valid command or none", mi) {
    s =>
      import s._
      for (next <- Seq(0, Read)) {
        command(s, Write, 0, 20, Seq(1, 2))
        assert(status(s) == 0x40 && bench.phys.get(phyOf(s, 0), 20) == 0)
        command(s, next, 0, 20)
        assert(status(s) == 0, s"command $next")
      }
      assert(put(0x0510, 1) && put(0x0511, Write))
      assert(status(s) == 0x40, "the enable was that of another frame")
  }
  rule("MI-03: enable and command may be two datagrams of one frame", p => mi(p) && p.maxSubTelegrams > 1) {
    s =>
      import s._
      assert(put(0x0512, 0, 21, 0xcd, 0xab))
      exchange(Datagram(Apwr, 0, 0x0510, Seq(1)), Datagram(Apwr, 0, 0x0511, Seq(Write)))
      done(s)
      assert(status(s) == 0 && bench.phys.get(phyOf(s, 0), 21) == 0xabcd)
  }
  rule("MI-04, MI-05, B-91: invalid commands are an error", mi) { s =>
    import s._
    for (code <- 3 to 7; next <- Seq(0, Read)) {
      command(s, code, 0, 1, enable = 1)
      assert(status(s) == 0x40, s"command $code")
      command(s, next, 0, 1)
      assert(status(s) == 0)
    }
  }
  rule("B-91: of two commands in one frame the first is carried out", p => mi(p) && p.maxSubTelegrams > 1) {
    s =>
      import s._
      assert(put(0x0512, 0, 22, 0x21, 0x43))
      exchange(Datagram(Apwr, 0, 0x0510, Seq(1, Write)), Datagram(Apwr, 0, 0x0510, Seq(0, Read)))
      done(s)
      assert(status(s) == 0 && bench.phys.get(phyOf(s, 0), 22) == 0x4321)
  }
  rule("MI-01, MI-05: a PHY that does not answer is a read error, and the line reads as ones", mi) { s =>
    import s._
    bench.phys.remove(phyOf(s, 0))
    assert(readPhy(s, 0, 2) == 0xffff && status(s) == 0x20)
    assert(put(0x0510, 0) && status(s) == 0x20, "not the byte of the command")
    assert(put(0x0511, 0) && status(s) == 0)
    assert(readPhy(s, 0, 2) == 0xffff && status(s) == 0x20)
    bench.phys.insert(phyOf(s, 0))
    bench.phys.set(phyOf(s, 0), 2, 0x1357)
    assert(readPhy(s, 0, 2) == 0x1357 && status(s) == 0)
    bench.phys.remove(phyOf(s, 0))
    command(s, Write, 0, 2, Seq(0, 0), enable = 1)
    assert(status(s) == 0, "nobody answers a write")
  }
  rule("MI-08, MI-09, OP-21: PHY addresses are those of ports, or have that of port 0 added", mi) { s =>
    import s._
    val free =
      (4 until 32).find(a => !(0 until p.ports).map(p.phyAddress).contains((a + phyOf(s, 0)) % 32)).get
    for (phy <- (0 until p.ports) :+ free :+ 31) {
      val address = if (phy < 4) p.phyAddress(phy) else (phy + phyOf(s, 0)) % 32
      bench.phys.insert(address)
      bench.phys.set(address, 23, 0x4000 | phy)
      assert(readPhy(s, phy, 23) == (0x4000 | phy) && status(s) == 0, s"PHY $phy")
    }
    if (p.phyAddressOffset == 16)
      assert(Seq(0, 3, 4, 15, 16, 31).map(a => (a + 16) % 32) == Seq(16, 19, 20, 31, 0, 15))
  }
  rule("OP-21, B-92: with 0x0512[7] the address is used as it is, and 0x0510[7:3] shows that of a port", mi) {
    s =>
      import s._
      assert(bench.hostRead(0x0510) >> 3 == phyOf(s, 0))
      for (y <- 0 until p.ports) {
        bench.phys.set(phyOf(s, y), 24, 0x2000 | y)
        assert(readPhy(s, 0x80 | phyOf(s, y), 24) == (0x2000 | y) && status(s) == 0)
        assert(put(0x0512, 0x80 | y) && bench.hostRead(0x0510) >> 3 == phyOf(s, y))
      }
      assert(put(0x0512, p.ports - 1) && bench.hostRead(0x0510) >> 3 == phyOf(s, 0))
  }
  rule("MI-07: the PDI takes the interface after power-on, needs no enable, and gives it back", byPdi) { s =>
    import s._
    assert((bench.hostRead(0x0510) & 2) == 2)
    bench.hostWrite(0x0512, 5)
    assert(bench.hostRead(0x0512) == 0, "the interface is ECAT's")
    bench.hostWrite(0x0517, 1)
    assert(bench.hostRead(0x0517) == 1 && (bench.hostRead(0x0510) & 1) == 1)
    assert(!put(0x0512, 1) && !put(0x0511, Read) && !put(0x0516, 1))
    hostPut(0x0512, 0, 25, 0xfe, 0xca)
    hostPut(0x0510, 0, Write)
    done(s)
    assert(status(s) == 0 && bench.phys.get(phyOf(s, 0), 25) == 0xcafe)
    bench.phys.set(phyOf(s, 0), 25, 0x0bad)
    hostPut(0x0511, Read)
    done(s)
    assert(hostGet(0x0514, 2) == bytes(0x0bad))
    bench.hostWrite(0x0517, 0)
    assert(bench.hostRead(0x0517) == 0 && put(0x0512, 1))
  }
  rule("MI-07, B-92: ECAT forbids the PDI to take the interface, and takes it back by force", byPdi) { s =>
    import s._
    assert(put(0x0516, 1))
    bench.hostWrite(0x0517, 1)
    assert(bench.hostRead(0x0517) == 0)
    assert(put(0x0516, 0))
    bench.hostWrite(0x0517, 3)
    assert(bench.hostRead(0x0517) == 1, "the host writes bit 0 only")
    assert(put(0x0517, 2) && bench.hostRead(0x0517) == 2 && put(0x0512, 0))
    bench.hostWrite(0x0517, 1)
    assert(bench.hostRead(0x0517) == 2, "while force is set")
    assert(put(0x0517, 1) && bench.hostRead(0x0517) == 0, "ECAT writes bit 1 only")
  }
  rule("MI-07, LNK-05, B-92: who has the interface clears what ports show", p => byPdi(p) && p.hasMiLinks) {
    s =>
      import s._
      def errs() = (bench.hostRead(0x0518) & 8) != 0
      bench.phys.remove(p.phyAddress(0))
      bench.advanceMs(2)
      assert(errs())
      bench.phys.insert(p.phyAddress(0))
      bench.advanceMs(2)
      bench.hostWrite(0x0518, 0)
      assert(errs(), "the interface is ECAT's")
      bench.hostWrite(0x0517, 1)
      assert(!put(0x0518, 0) && errs(), "it is the PDI's")
      bench.hostWrite(0x0518, 0)
      assert(!errs())
  }
  rule(
    "MI-02, B-92: what ECAT may write while a command runs does not change within a frame",
    p => mi(p) && p.maxSubTelegrams > 2
  ) { s =>
    import s._
    def write(register: Int) = Datagram(Apwr, 0, 0x0513, Seq(register))
    for (fill <- Seq(1, 1200)) { // the command runs all the time, or ends between the two
      bench.phys.set(phyOf(s, 0), 26, 0x1c00 + fill)
      assert(put(0x0510, 0, Read, 0, 26))
      val replies = exchange(write(3), Datagram(Nop, 0, 0, Seq.fill(fill)(0)), write(4))
      assert(replies.map(_.workingCounter) == Seq(0, 0, 0))
      done(s)
      assert(bench.hostRead(0x0513) == 26 && data(s) == 0x1c00 + fill)
    }
    assert(exchange(write(3), write(4)).forall(_.workingCounter == 1) && bench.hostRead(0x0513) == 4)
  }
  rule(
    "MI-07, B-92: the PDI's interface is so for all datagrams of a frame",
    p => byPdi(p) && p.maxSubTelegrams > 1
  ) { s =>
    import s._
    bench.hostWrite(0x0517, 1)
    val replies = exchange(Datagram(Apwr, 0, 0x0517, Seq(2)), Datagram(Apwr, 0, 0x0512, Seq(1, 1)))
    assert(replies.map(_.workingCounter) == Seq(1, 0) && bench.hostRead(0x0517) == 2)
    val free = exchange(Datagram(Apwr, 0, 0x0516, Seq(1)), Datagram(Apwr, 0, 0x0512, Seq(1, 1)))
    assert(free.map(_.workingCounter) == Seq(1, 1))
  }
  rule("MI-07: without the PDI's part the host only looks on", p => mi(p) && !p.hasMiByPdi) { s =>
    import s._
    assert((bench.hostRead(0x0510) & 2) == 0 && get(0x0516, 2).isEmpty)
    hostPut(0x0512, 3, 3, 3, 3)
    bench.hostWrite(0x0511, Read)
    assert(hostGet(0x0511, 5) == Seq(0, 0, 0, 0, 0))
  }
  rule("MI-02, MI-11: busy ends within 100 us, whatever the PHY does", alone) { s =>
    import s._
    for (there <- Seq(true, false)) {
      if (!there) bench.phys.remove(phyOf(s, 0))
      assert(put(0x0512, 0, 2) && put(0x0511, Read))
      bench.advanceUs(100)
      assert((status(s) & 0x87) == 0 && bench.hostRead(0x0511) == (if (there) 0 else 0x20))
    }
  }
}
