package flyframe.rules

import flyframe.model._
import flyframe.params.EscParams
import flyframe.protocol.Command._
import flyframe.registers.RegisterMap

/** Frame formats, datagrams, addressing, commands, working counter, commit: rule groups GEN and FP. */
object FrameRules extends Rules {
  private val User                       = RegisterMap.UserRamStart
  private val Ram                        = RegisterMap.ProcessRamStart
  private def several(p: EscParams)      = p.maxSubTelegrams >= 4
  private def ram(p: EscParams)          = p.ramKiB >= 1
  private def station(p: EscParams): Int = 0x1065 & ((1 << p.nodeIdWidth) - 1)
  private def etherCatAt(form: Encapsulation): Int =
    14 + (if (form.vlan) 4 else 0) + (if (form.udp) 28 else 0)

  rule(
    "GEN-01, GEN-02: a frame at port 0 goes through the processing unit once and leaves at the next port"
  ) { s =>
    import s._
    val r = read(Brd, 0, 0x0000, 1)
    assert(r.workingCounter == 1 && r.adp == 1)
  }
  rule("GEN-04: registers end at 0x0F7F, user RAM at 0x0FFF, process data RAM behind it", ram) { s =>
    import s._
    assert(read(Aprd, 0, 0x0f7f, 1).workingCounter == 0)
    for (address <- Seq(0x0f80, 0x0fff, 0x1000, 0x0fff + p.ramBytes)) {
      assert(write(Apwr, 0, address, 0xa5).workingCounter == 1)
      assert(bench.hostRead(address) == 0xa5)
      bench.hostWrite(address, 0x5a)
      assert(read(Aprd, 0, address, 1).data == Seq(0x5a))
    }
    if (p.ramKiB < 60) assert(read(Aprd, 0, Ram + p.ramBytes, 1).workingCounter == 0)
  }
  rule("GEN-05: the number of ports is a parameter, reported in 0x0007") { s =>
    import s._
    assert(bench.hostRead(0x0007) == p.portDescriptor)
    assert(p.portDescriptor == (1 << 2 * p.ports) - 1 || p.reportedPorts >= 0)
  }
  rule("GEN-06: frames of any length pass without being stored") { s =>
    import s._
    for (length <- Seq(1, 100, 1486))
      assert(one(Datagram(Nop, 0, 0, (0 until length).map(_ & 0xff))).data == (0 until length).map(_ & 0xff))
  }
  rule("GEN-07: 0x0000 to 0x0009 report the identity and features of the parameters") { s =>
    import s._
    val expected = Seq(
      p.escType,
      p.escRevision,
      p.escBuild & 0xff,
      p.escBuild >> 8,
      p.fmmus,
      p.syncManagers
    ) ++
      Seq(p.ramSizeReported, p.portDescriptor, p.features & 0xff, p.features >> 8)
    assert(read(Aprd, 0, 0, 10).data == expected)
    assert((0 to 9).map(bench.hostRead) == expected)
  }
  rule("GEN-08, FP-31: an access that touches nothing implemented does not count") { s =>
    import s._
    val firstAbsent = Seq(0x0600 + 16 * p.fmmus, 0x0800 + 8 * p.syncManagers)
    for (address <- Seq(0x000a, 0x0940, 0x0f7f) ++ firstAbsent) {
      assert(read(Aprd, 0, address, 1).workingCounter == 0)
      assert(write(Apwr, 0, address, 1).workingCounter == 0)
    }
    assert(read(Aprd, 0, 0x0800, 256).workingCounter == (if (p.syncManagers > 0) 1 else 0))
  }
  rule("GEN-09: reserved bits read 0 and take no writes") { s =>
    import s._
    write(Apwr, 0, 0x0100, 0xfd, 0x00, 0xff, 0xff)
    assert(bench.hostRead(0x0100) == 1)
    assert(bench.hostRead(0x0102) == 7)
    assert(bench.hostRead(0x0103) == 1)
  }
  rule("FP-01, FP-02: all four forms of frame are processed") { s =>
    import s._
    for (form <- Encapsulation.all) {
      val bytes = good(send(EtherCatFrame(Seq(Datagram(Brd, 0, 0, Seq(0))), form)))
      val reply = replies(bytes, etherCatAt(form) + 2).head
      assert(reply.workingCounter == 1 && reply.data == Seq(p.escType), s"in $form")
    }
  }
  rule("FP-03: the contents of a VLAN tag are neither looked at nor changed") { s =>
    import s._
    for (tag <- Seq(Seq(0, 0), Seq(0xff, 0xff), Seq(0x88, 0xa4))) {
      val frame = EtherCatFrame(Seq(Datagram(Brd, 0, 0, Seq(0))), Encapsulation.Vlan).patch(14, tag, 2)
      val bytes = good(send(frame))
      assert(bytes.slice(12, 18) == Seq(0x81, 0) ++ tag ++ Seq(0x88, 0xa4))
      assert(replies(bytes, 20).head.workingCounter == 1)
    }
  }
  rule(
    "FP-04: UDP is EtherCAT by IP version, header length, protocol and destination port, and nothing else"
  ) { s =>
    import s._
    val frame = EtherCatFrame(Seq(Datagram(Brd, 0, 0, Seq(0))), Encapsulation.Udp)
    for (
      at <- Seq(15, 18, 22, 24, 26, 30, 34)
    ) // type of service, identification, TTL, checksum, addresses, source port
      assert(
        replies(good(send(frame.updated(at, frame(at) ^ 0xff))), 44).head.workingCounter == 1,
        s"byte $at"
      )
    write(Apwr, 0, 0x0100, 0) // pass other frames
    for (at <- Seq(14, 23, 36, 37)) {
      val other = frame.updated(at, frame(at) ^ 0x10)
      assert(good(send(other)).dropRight(4) == other, s"byte $at")
    }
  }
  rule("FP-05: the UDP checksum becomes 0 in every EtherCAT frame, and stays in others") { s =>
    import s._
    val frame = EtherCatFrame(Seq(Datagram(Brd, 0, 0, Seq(0))), Encapsulation.Udp)
    assert(good(send(frame)).slice(40, 42) == Seq(0, 0))
    write(Apwr, 0, 0x0100, 0)
    assert(good(send(frame)).slice(40, 42) == Seq(0, 0))
    val other = frame.updated(36, 0x12)
    assert(good(send(other)).slice(40, 42) == other.slice(40, 42))
  }
  rule(
    "FP-05, B-12, OP-02: a UDP frame with another EtherCAT type passes with a right FCS, all else unchanged"
  ) { s =>
    import s._
    write(Apwr, 0, 0x0100, 0)
    for (count <- Seq(1, 40, 300)) {
      val other =
        EtherCatFrame(Seq(Datagram(Brd, 0, 0, Seq.fill(count)(0xa5))), Encapsulation.Udp, headerType = 5)
      assert(good(send(other)).dropRight(4) == other.patch(40, Seq(0, 0), 2))
      for (length <- Seq(0, 9, 1000)) marked(send(other.patch(38, Seq(length >> 8, length & 0xff), 2)))
    }
    assert(epuErrors == 9)
  }
  rule("FP-06: only header type 1 is processed, its length field is ignored") { s =>
    import s._
    val frame = EtherCatFrame(Seq(Datagram(Brd, 0, 0, Seq(0))))
    for (length <- Seq(0, 5, 0x7ff)) {
      val changed = frame.patch(14, Seq(length & 0xff, 0x10 | length >> 8), 2)
      assert(replies(good(send(changed))).head.workingCounter == 1)
    }
    write(Apwr, 0, 0x0100, 0)
    for (kind <- Seq(0, 2, 4, 5, 15)) {
      val other = EtherCatFrame(Seq(Datagram(Brd, 0, 0, Seq(0))), headerType = kind)
      assert(good(send(other)).dropRight(4) == other)
    }
  }
  rule(
    "FP-07, B-14, ERR-02: padding up to 64 bytes is in order, more is a length error of the processing unit"
  ) { s =>
    import s._
    val content = EtherCatFrame(Seq(Datagram(Brd, 0, 0, Seq.fill(100)(0))))
    good(send(content ++ Seq.fill(64)(0)))
    assert(epuErrors == 0)
    marked(send(content ++ Seq.fill(65)(0)))
    assert(epuErrors == 1 && invalid(0) == 0)
  }
  rule("FP-08: MAC and IP addresses do not matter") { s =>
    import s._
    val frame = EtherCatFrame(Seq(Datagram(Brd, 0, 0, Seq(0))), Encapsulation.Udp)
    val other = frame.patch(0, Seq.fill(6)(0xfe), 6).patch(26, Seq.fill(8)(0x77), 8)
    assert(replies(good(send(other)), 44).head.workingCounter == 1)
  }
  rule("FP-09: SOURCE_MAC bit 1 is set while 0x0100[0]=1, and left alone while 0") { s =>
    import s._
    val frame = EtherCatFrame(Seq(Datagram(Brd, 0, 0, Seq(0))))
    assert(frame(6) == 0x10 && good(send(frame))(6) == 0x12)
    write(Apwr, 0, 0x0100, 0)
    assert(good(send(frame))(6) == 0x10)
  }
  rule("FP-10, LP-16: 0x0100[0]=1 destroys other frames and counts them, 0 forwards them unchanged") { s =>
    import s._
    val arp = Seq.fill(6)(0xff) ++ Seq(0, 1, 2, 3, 4, 5, 0x08, 0x06) ++ Seq.fill(46)(0x33)
    assert(marked(send(arp)).payload.size < 64)
    assert(epuErrors == 1)
    write(Apwr, 0, 0x0100, 0)
    assert(good(send(arp)).dropRight(4) == arp)
    assert(epuErrors == 1)
  }
  rule("B-10, B-11: what is not EtherCAT is cut off, as a bad frame, with the nibble that tells so") { s =>
    import s._
    def plain(form: Encapsulation) = EtherCatFrame(Seq(Datagram(Brd, 0, 0, Seq(0))), form)
    val taggedTwice                = plain(Encapsulation.Vlan).patch(16, Seq(0x81, 0), 2)
    val udp                        = plain(Encapsulation.Udp)
    for (
      (frame, byte) <- Seq(
        plain(Encapsulation.Basic).updated(12, 0x08)                    -> 13, // EtherType
        plain(Encapsulation.Vlan).updated(16, 0x08)                     -> 17,
        taggedTwice                                                     -> 17,
        udp.updated(14, 0x46)                                           -> 14, // IP header length
        udp.updated(23, 0x06)                                           -> 23, // TCP
        udp.updated(36, 0x12)                                           -> 37, // UDP destination port
        EtherCatFrame(Seq(Datagram(Brd, 0, 0, Seq(0))), headerType = 4) -> 15
      )
    ) // one nibble more is the mark (B-04)
      assert(marked(send(frame)).payload.size == 2 * (byte + 1) + 1, s"decided at byte $byte")
  }
  rule("FP-11: frames below 64 bytes and above 2 KiB are errors") { s =>
    import s._
    marked(send(EtherCatFrame(Seq(Datagram(Brd, 0, 0, Seq(0)))).take(59)))
    assert(epuErrors == 1 && invalid(0) == 0)
    marked(send(Seq.fill(14)(0x11) ++ Seq.fill(2031)(0)))
    assert(epuErrors == 2)
    write(Apwr, 0, 0x0100, 0)
    good(send(Seq.fill(2044)(0x11)))
    val before = invalid(0)
    marked(send(Seq.fill(2045)(0x11)))
    assert(invalid(0) == before + 1)
  }
  rule("FP-12: index is kept; reserved bits and M travel unchanged", several) { s =>
    import s._
    val Seq(a, b) =
      exchange(Datagram(Brd, 0L, Seq(0), index = 0xa7, reserved = 5), Datagram(Nop, 0L, Seq(9), index = 3))
    assert(a.index == 0xa7 && a.more && (a.bytes(7) >> 3 & 7) == 5 && b.index == 3 && !b.more)
  }
  rule("FP-13: the smallest datagram has 12 bytes", several) { s =>
    import s._
    val rs = exchange(Seq.fill(3)(Datagram(Brd, 0, 0, Nil)) :+ Datagram(Brd, 0, 0, Seq(0)): _*)
    assert(rs.map(_.adp) == Seq(1, 1, 1, 1) && rs.map(_.workingCounter) == Seq(0, 0, 0, 1))
  }
  rule("FP-14: position addressing takes ADP 0 on arrival and increments it in any case") { s =>
    import s._
    for ((adp, count) <- Seq(0 -> 1, 1 -> 0, 0xffff -> 0, 0x8000 -> 0, 0x0010 -> 0)) {
      val r = read(Aprd, adp, 0, 1)
      assert(r.adp == (adp + 1 & 0xffff) && r.workingCounter == count, f"ADP 0x$adp%04x")
    }
  }
  rule("FP-15: station address, and the alias while 0x0100[24] allows it; only the host changes the alias") {
    s =>
      import s._
      val (address, alias) = (station(p), 0x0b & ((1 << p.nodeIdWidth) - 1))
      stationAddress(address)
      bench.hostWrite(0x0012, alias)
      assert(read(Fprd, address, 0, 1).workingCounter == 1)
      assert(read(Fprd, alias, 0, 1).workingCounter == 0)
      assert(write(Fpwr, address, 0x0012, 1).workingCounter == 0)
      write(Fpwr, address, 0x0103, 1)
      assert(read(Fprd, alias, 0, 1).workingCounter == 1)
      bench.hostWrite(0x0010, 0x55)
      assert(word(0x0010) == address && word(0x0012) == alias)
  }
  rule("FP-15: an address with a bit above nodeIdWidth set never matches", _.nodeIdWidth < 16) { s =>
    import s._
    stationAddress(station(p))
    assert(read(Fprd, station(p), 0, 1).workingCounter == 1)
    for (bit <- p.nodeIdWidth until 16)
      assert(read(Fprd, station(p) | 1 << bit, 0, 1).workingCounter == 0, s"bit $bit")
    write(Apwr, 0, 0x0010, 0xff, 0xff)
    assert(word(0x0010) == (1 << p.nodeIdWidth) - 1)
  }
  rule("FP-16: the alias is 0 after reset, no EEPROM image having been loaded") { s =>
    s.bench.reset()
    assert(s.word(0x0012) == 0)
  }
  rule("FP-17: broadcast addresses every ESC and increments ADP") { s =>
    import s._
    for (adp <- Seq(0, 1, 0xfffe)) assert(read(Brd, adp, 0, 1) match {
      case r => r.workingCounter == 1 && r.adp == adp + 1
    })
  }
  rule(
    "FP-18, FP-30, B-18: ADO is the address of the first byte; " +
      "a datagram may span several areas and does not wrap",
    ram
  ) { s =>
    import s._
    for (i <- 0 until 16) bench.hostWrite(0x0ff8 + i, 0x40 + i)
    assert(read(Aprd, 0, 0x0ff8, 16).data == (0x40 to 0x4f))
    val r = one(Datagram(Aprd, 0, 0xfffe, Seq.fill(4)(0x77)))
    assert(r.data.takeRight(2) == Seq(0x77, 0x77))
    if (p.ramKiB < 60) assert(r.workingCounter == 0)
  }
  rule("FP-19, FP-25, FP-26, FMMU-11, B-19: logical commands that no FMMU maps change nothing") { s =>
    import s._
    for (command <- Seq(Lrd, Lwr, Lrw)) {
      val r = one(Datagram(command, 0x10001000L, Seq(1, 2, 3)))
      assert(r.workingCounter == 0 && r.data == Seq(1, 2, 3) && r.adp == 0x1000 && r.ado == 0x1000)
    }
  }
  rule("FP-20, B-19: reserved commands pass like NOP and the next datagram is processed", several) { s =>
    import s._
    for (command <- Seq(0, 15, 16, 17, 0x27, 0x87, 255)) {
      val Seq(a, b) = exchange(Datagram(command, 0, 0, Seq(5, 6)), Datagram(Brd, 0, 0, Seq(0)))
      assert(a.adp == 0 && a.data == Seq(5, 6) && a.workingCounter == 0, s"command $command")
      assert(b.workingCounter == 1)
    }
  }
  rule("FP-21: read-write commands read before they write; BRW writes what it received") { s =>
    import s._
    stationAddress(station(p))
    for ((command, adp) <- Seq(Aprw -> 0, Fprw -> station(p), Brw -> 0)) {
      bench.hostWrite(User, 0x0f)
      val r = write(command, adp, User, 0x31)
      assert(r.data == Seq(if (command == Brw) 0x3f else 0x0f) && r.workingCounter == 3, s"command $command")
      assert(bench.hostRead(User) == 0x31)
    }
  }
  rule("FP-22: ADP is incremented by auto-increment and broadcast commands and ARMW only") { s =>
    import s._
    val incremented = (0 to 15).filter(c => one(Datagram(c, 5, 0x0f00, Seq(0))).adp == 6)
    assert(incremented == Seq(1, 2, 3, 7, 8, 9, 13))
  }
  rule("FP-23: bytes that are not read leave the datagram unchanged") { s =>
    import s._
    assert(one(Datagram(Aprd, 1, 0, Seq(7, 8))).data == Seq(7, 8))
    assert(one(Datagram(Aprd, 0, 0x0007, Seq.fill(5)(0x5a))).data.drop(3) == Seq(0x5a, 0x5a))
  }
  rule("FP-24: ARMW and FRMW read where addressed and write everywhere else, +1 each") { s =>
    import s._
    stationAddress(station(p))
    for ((command, mine, other) <- Seq((Armw, 0, 1), (Frmw, station(p), station(p) ^ 1))) {
      bench.hostWrite(User, 0x42)
      val r = write(command, mine, User, 0x99)
      assert(r.data == Seq(0x42) && r.workingCounter == 1 && bench.hostRead(User) == 0x42)
      val w = write(command, other, User, 0x99)
      assert(w.data == Seq(0x99) && w.workingCounter == 1 && bench.hostRead(User) == 0x99)
    }
  }
  rule("FP-27, FP-29: the working counter of every command, once per datagram") { s =>
    import s._
    stationAddress(station(p))
    val hit = Seq(0, 1, 1, 3, 1, 1, 3, 1, 1, 3, 0, 0, 0, 1, 1)
    for ((count, command) <- hit.zipWithIndex) {
      val adp = if (Seq(Fprd, Fpwr, Fprw, Frmw).contains(command)) station(p) else 0
      assert(one(Datagram(command, adp, User, Seq(1, 2, 3, 4))).workingCounter == count, s"command $command")
    }
    val full = one(Datagram(Brw, (User.toLong << 16), Seq(0), workingCounter = 0xfffe))
    assert(full.workingCounter == 1)
  }
  rule("FP-28: partial success counts fully, read and write apart") { s =>
    import s._
    assert(read(Aprd, 0, 0x0f7f, 2).workingCounter == 1)
    assert(write(Apwr, 0, 0x0f7f, 1, 2).workingCounter == 1)
    assert(write(Aprw, 0, 0x0000, 1).workingCounter == 1) // readable, not writable
  }
  rule(
    "FP-31, B-20, SII-09, PDI-04, PDI-08: process data RAM is closed until the EEPROM is loaded, " +
      "user RAM is not",
    ram
  ) { s =>
    import s._
    bench.hostWrite(Ram, 0x11)
    bench.setLoaded(false)
    assert(bench.hostRead(0x0110) % 2 == 0)
    assert(write(Apwr, 0, Ram, 0x22).workingCounter == 0 && read(Aprd, 0, Ram, 1).workingCounter == 0)
    bench.hostWrite(Ram, 0x33)
    assert(write(Apwr, 0, User, 0x22).workingCounter == 1)
    bench.setLoaded(true)
    assert(bench.hostRead(Ram) == 0x11 && bench.hostRead(0x0110) % 2 == 1)
  }
  rule("FP-32, B-21: register writes take effect after the frame, memory writes as they pass", several) { s =>
    import s._
    val rs = exchange(
      Datagram(Bwr, 0, 0x0010, Seq(9, 0)),
      Datagram(Brd, 0, 0x0010, Seq(0, 0)),
      Datagram(Bwr, 0, User, Seq(9, 8)),
      Datagram(Brd, 0, User, Seq(0, 0))
    )
    assert(rs.map(_.workingCounter) == Seq(1, 1, 1, 1))
    assert(rs(1).data == Seq(0, 0) && rs(3).data == Seq(9, 8))
    assert(word(0x0010) == 9)
  }
  rule(
    "FP-33, FP-34, FP-35, FP-36, FP-37: a bad frame changes memory but no register and starts nothing",
    several
  ) { s =>
    import s._
    val frame = WireFrame.withFcs(
      EtherCatFrame(
        Seq(
          Datagram(Bwr, 0, 0x0010, Seq(9, 0)),
          Datagram(Bwr, 0, 0x0101, Seq(0xff)),
          Datagram(Bwr, 0, User, Seq(0x77))
        )
      )
    )
    val last = frame.symbols.size - 1
    marked(bench.send(0, WireFrame(frame.symbols.updated(last, Symbol(frame.symbols(last).nibble ^ 1)))))
    assert(word(0x0010) == 0 && bench.hostRead(0x0101) == 0 && bench.hostRead(User) == 0x77)
    marked(bench.send(0, WireFrame(frame.symbols.updated(last, frame.symbols(last).copy(error = true)))))
    marked(bench.send(0, WireFrame(frame.symbols.dropRight(10))))
    assert(word(0x0010) == 0 && bench.hostRead(0x0101) == 0)
    good(bench.send(0, WireFrame(frame.symbols)), nextPort)
    assert(word(0x0010) == 9)
  }
  rule("B-20: a frame that ends inside its data has written every byte that came, its FCS included") { s =>
    import s._
    val cut = EtherCatFrame(Seq(Datagram(Bwr, 0, User, Seq.fill(100)(0xa5)))).take(14 + 2 + 10 + 60)
    hostPut(User, Seq.fill(80)(0x11): _*)
    marked(send(cut))
    assert(hostGet(User, 80) == Seq.fill(60)(0xa5) ++ Fcs.of(cut) ++ Seq.fill(16)(0x11))
  }
  rule("B-16: datagrams beyond maxSubTelegrams pass untouched and are counted") { s =>
    import s._
    val rs = exchange(Seq.fill(p.maxSubTelegrams + 1)(Datagram(Brd, 0, 0, Seq(0))): _*)
    assert(rs.init.forall(r => r.workingCounter == 1 && r.adp == 1))
    assert(rs.last.workingCounter == 0 && rs.last.adp == 0 && rs.last.data == Seq(0))
    assert(epuErrors == 1)
    exchange(Seq.fill(p.maxSubTelegrams)(Datagram(Bwr, 0, 0x0010, Seq(7))): _*)
    assert(epuErrors == 1 && word(0x0010) == 7)
  }
  rule("B-17: register bytes beyond registerWritesPerFrame are refused", p => p.maxSubTelegrams >= 100) { s =>
    import s._
    val each =
      2 + p.ports.min(
        1
      ) // 0x030C, and the address pair behind it do not adjoin: use the four bytes of DL control
    val rs  = exchange(Seq.fill(90)(Datagram(Bwr, 0, 0x0100, Seq(1, 0, 7, 0))): _*)
    val fit = p.writeLogDepth / 4
    assert(each > 0 && rs.map(_.workingCounter) == Seq.tabulate(90)(i => if (i < fit) 1 else 0))
  }
  rule("B-13: padding beyond the minimum leaves the frame in order") { s =>
    import s._
    val bytes = good(send(EtherCatFrame(Seq(Datagram(Brd, 0, 0, Seq.fill(80)(0)))) ++ Seq.fill(20)(0xee)))
    assert(bytes.takeRight(20).take(16) == Seq.fill(16)(0xee))
  }

  private def apart(p: EscParams) = p.hasReadWriteOffset && p.ramKiB >= 1
  rule("B-113: commands that read and write do so at places as far apart as 0x0108 says", apart) { s =>
    import s._
    stationAddress(0x55)
    hostPut(0x1000, 1, 2, 3, 4)
    hostPut(0x1100, 9, 9, 9, 9)
    assert(get(0x0108, 2).contains(Seq(0, 0)) && put(0x0108, 0x00, 0x01) && word(0x0108) == 0x0100)
    hostPut(0x0108, 0, 0)
    assert(word(0x0108) == 0x0100, "the bus's alone")
    for ((command, adp, n) <- Seq((Aprw, 0, 0x10), (Fprw, 0x55, 0x20), (Brw, 0, 0x30))) {
      val reply = one(Datagram(command, adp, 0x1000, Seq(n, n + 1)))
      val read  = if (command == Brw) Seq(n | 1, n + 1 | 2) else Seq(1, 2)
      assert(reply.workingCounter == 3 && reply.data == read, s"command $command")
      assert(hostGet(0x1000, 4) == Seq(1, 2, 3, 4) && hostGet(0x1100, 3) == Seq(n, n + 1, 9))
    }
    assert(put(0x1002, 7) && hostGet(0x1002, 1) == Seq(7) && get(0x1100, 1).contains(Seq(0x30)), "no others")
    assert(write(Frmw, 0x33, 0x1003, 8).workingCounter == 1 && bench.hostRead(0x1003) == 8)
    assert(put(0x0108, 0, 0) && write(Aprw, 0, 0x1000, 5).workingCounter == 3)
    assert(hostGet(0x1000, 1) == Seq(5))
  }
  rule("B-113: where there is nothing to write, reading counts; nothing wraps", apart) { s =>
    import s._
    hostPut(0x0fff, 7)
    hostPut(0x1000, 1)
    for (offset <- Seq(0xefff, 0xf000, 0xffff)) {
      assert(put(0x0108, offset & 0xff, offset >> 8))
      assert(write(Aprw, 0, 0x1000, 9).workingCounter == 1, f"0x$offset%04x")
      assert(hostGet(0x0fff, 2) == Seq(7, 1))
    }
    val reply = Datagram(Aprw, 0, 0x0f80, Seq(3))
    assert(put(0x0108, 0x80, 0) && one(reply).workingCounter == 3 && bench.hostRead(0x1000) == 3)
    // What is written counts from the next frame on.
    val frame = exchange(Datagram(Apwr, 0, 0x0108, Seq(0x81)), reply.copy(data = Seq(4)))
    assert(frame.map(_.workingCounter) == Seq(1, 3) && bench.hostRead(0x1000) == 4)
    assert(one(reply.copy(data = Seq(5))).workingCounter == 3 && hostGet(0x1000, 2) == Seq(4, 5))
  }
  rule(
    "B-113: read from one SyncManager, written to another",
    p => apart(p) && p.syncManagers >= 2 && !p.acknowledgesByWrite
  ) { s =>
    import s._
    syncManager(0, 0x1000, 4, 0x02)
    syncManager(1, 0x1100, 4, 0x06)
    assert(put(0x0108, 0x00, 0x01))
    hostPut(0x1000, 1, 2, 3, 4)
    val both = Datagram(Aprw, 0, 0x1000, Seq(5, 6, 7, 8))
    val once = one(both)
    assert(once.workingCounter == 3 && once.data == Seq(1, 2, 3, 4) && hostGet(0x1100, 4) == Seq(5, 6, 7, 8))
    assert(one(both).workingCounter == 2, "the first one is empty")
    assert(hostGet(0x1100, 4) == Seq(5, 6, 7, 8))
  }
}
