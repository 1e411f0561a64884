package flyframe.rules

import flyframe.params.EscParams
import flyframe.protocol.Command._

/** Logical addressing: rule group FMMU. */
object FmmuRules extends Rules {
  private def fmmus(p: EscParams) = p.fmmus >= 4 && p.ramKiB >= 1
  private def bits(p: EscParams)  = fmmus(p) && p.hasBitwiseFmmus
  private def both(p: EscParams)  = fmmus(p) && p.syncManagers >= 2
  private val Read                = 1
  private val Write               = 2
  private val ReadWrite           = 3

  rule("FMMU-01: one run of logical bytes is mapped to one run of local bytes", fmmus) { s =>
    import s._
    hostPut(0x1010, 0x11, 0x22, 0x33, 0x44)
    fmmu(0, 0x12340000L, 3, 0x1010, Read)
    val r = logical(Lrd, 0x1233ffffL, 1, 2, 3, 4, 5)
    assert(r.data == Seq(1, 0x11, 0x22, 0x33, 5) && r.workingCounter == 1)
    assert(logical(Lrd, 0x12340002L, 0).data == Seq(0x33))
  }
  rule("FMMU-01, OP-13, B-45: length 0 maps nothing, and addresses do not wrap", fmmus) { s =>
    import s._
    fmmu(0, 0x100, 0, 0x1000, ReadWrite)
    assert(logical(Lrw, 0x100, 0).workingCounter == 0)
    fmmu(0, 0xffffffffL, 2, 0x1000, ReadWrite)
    hostPut(0x1000, 0xab, 0xcd)
    assert(logical(Lrd, 0xffffffffL, 0, 7).data == Seq(0xab, 7))
    assert(logical(Lrd, 0, 7).workingCounter == 0)
    fmmu(0, 0x100, 4, 0xfffe, Read)
    if (p.ramKiB < 60) assert(logical(Lrd, 0x100, 1, 2, 3, 4).workingCounter == 0)
    else {
      hostPut(0xfffe, 0xab, 0xcd)
      assert(logical(Lrd, 0x100, 1, 2, 3, 4).data == Seq(0xab, 0xcd, 3, 4))
    }
  }
  rule("FMMU-01, FMMU-05: the last FMMU maps as the first does, and comes last", fmmus) { s =>
    import s._
    val last = p.fmmus - 1
    hostPut(0x1000, 0x5a, 0xa5)
    fmmu(last, 0x100, 2, 0x1000, ReadWrite)
    val r = logical(Lrw, 0x100, 0x12, 0x34)
    assert(r.data == Seq(0x5a, 0xa5) && r.workingCounter == 3 && hostGet(0x1000, 2) == Seq(0x12, 0x34))
    hostPut(0x1010, 0x77)
    for (n <- 0 until last) {
      fmmu(n, 0x101, 1, 0x1010, Read)
      assert(logical(Lrd, 0x100, 0, 0).data == Seq(0x12, 0x77), s"FMMU $n")
      assert(put(0x060c + 16 * n, 0))
    }
    assert(logical(Lrd, 0x100, 0, 0).data == Seq(0x12, 0x34))
    assert(put(0x060c + 16 * last, 0) && logical(Lrd, 0x100, 0).workingCounter == 0)
  }
  rule("FMMU-02: the last FMMU maps bits, too", bits) { s =>
    import s._
    hostPut(0x1000, 0x08, 0x00)
    fmmu(p.fmmus - 1, 0x100, 2, (1, 0, 3), 0x1000, Read)
    assert(logical(Lrd, 0x100, 0xff, 0xff).data == Seq(0x03, 0xfe))
    hostPut(0x1000, 0xf0, 0x07)
    assert(logical(Lrd, 0x100, 0, 0).data == Seq(0xfc, 0x01))
  }
  rule("FMMU-01: an FMMU acts only while it is active", fmmus) { s =>
    import s._
    fmmu(1, 0x100, 4, 0x1000, ReadWrite)
    assert(logical(Lrd, 0x100, 0).workingCounter == 1)
    assert(put(0x061c, 0))
    assert(logical(Lrd, 0x100, 0).workingCounter == 0)
  }
  rule("FMMU-02: bit i of the run is local bit start + i", bits) { s =>
    import s._
    for ((start, stop, local, length) <- Seq((2, 5, 0, 1), (2, 5, 6, 1), (7, 0, 3, 2), (5, 6, 7, 3))) {
      val count   = (length - 1) * 8 + stop - start + 1
      val content = 0xb2d5a6c3L
      hostPut(0x1020, (0 until 4).map(i => (content >> 8 * i & 0xff).toInt): _*)
      fmmu(0, 0x100, length, (start, stop, local), 0x1020, Read)
      val mask                   = ((1L << count) - 1) << start
      val expected               = content >> local << start & mask
      val zeros                  = logical(Lrd, 0x100, Seq.fill(length)(0): _*).data
      val ones                   = logical(Lrd, 0x100, Seq.fill(length)(0xff): _*).data
      def whole(bytes: Seq[Int]) = bytes.zipWithIndex.map { case (b, i) => b.toLong << 8 * i }.sum
      assert(whole(zeros) == expected)
      assert(whole(ones) == (expected | ~mask & ((1L << 8 * length) - 1)))
    }
  }
  rule("FMMU-03: the vector of 14 bits, at another local address", bits) { s =>
    import s._
    fmmu(0, 0x00010011L, 3, (3, 0, 1), 0x1001, Read)
    hostPut(0x1001, 0x02, 0x00)
    assert(logical(Lrd, 0x00010011L, 0, 0, 0).data == Seq(0x08, 0, 0))
    hostPut(0x1001, 0x00, 0x40)
    assert(logical(Lrd, 0x00010011L, 0, 0, 0).data == Seq(0, 0, 0x01))
    hostPut(0x1001, 0xfe, 0x7f)
    assert(logical(Lrd, 0x00010011L, 0, 0, 0).data == Seq(0xf8, 0xff, 0x01))
    hostPut(0x1001, 0x01, 0x80) // what is not mapped
    assert(logical(Lrd, 0x00010011L, 0, 0, 0).data == Seq(0, 0, 0))
  }
  rule("FMMU-02, FMMU-10: a run written across local bytes arrives whole", bits) { s =>
    import s._
    fmmu(0, 0x00010011L, 3, (3, 0, 1), 0x1001, Write)
    hostPut(0x1000, 0xee, 0xff, 0xff, 0xee)
    assert(logical(Lwr, 0x00010011L, 0xa8, 0x5a, 0x01).workingCounter == 1)
    // 14 bits 10101 01011010 1, from the lowest on, behind local bit 1
    val run = (0xa8 | 0x5a << 8 | 1 << 16) >> 3 << 1
    assert(hostGet(0x1000, 4) == Seq(0xee, run & 0xff, run >> 8, 0xee))
  }
  rule("FMMU-04: start bit 0, stop bit 7 and local bit 0 map whole bytes, all else maps bits", bits) { s =>
    import s._
    hostPut(0x1000, 0x00)
    for (
      ((start, stop, local), expected) <- Seq(
        (0, 7, 0) -> 0x00,
        (1, 7, 0) -> 0x01,
        (0, 6, 0) -> 0x80,
        (3, 4, 2) -> 0xe7
      )
    ) {
      fmmu(0, 0x100, 1, (start, stop, local), 0x1000, Read)
      assert(logical(Lrd, 0x100, 0xff).data == Seq(expected))
    }
  }
  rule(
    "FMMU-04, B-46: without bit-wise mapping the bit registers have no effect",
    p => fmmus(p) && !p.hasBitwiseFmmus
  ) { s =>
    import s._
    hostPut(0x1000, 0x5a, 0xa5)
    fmmu(0, 0x100, 2, (3, 1, 5), 0x1000, ReadWrite)
    assert((bench.hostRead(8) & 1) == 1)
    assert(logical(Lrd, 0x100, 0, 0).data == Seq(0x5a, 0xa5))
    assert(logical(Lwr, 0x100, 0x12, 0x34).workingCounter == 1 && hostGet(0x1000, 2) == Seq(0x12, 0x34))
  }
  rule("FMMU-05, OP-14: of several for one byte and direction the lowest number acts", fmmus) { s =>
    import s._
    hostPut(0x1000, 0x10, 0x20, 0x30, 0x40)
    fmmu(2, 0x100, 2, 0x1000, Read)
    fmmu(1, 0x101, 2, 0x1002, Read)
    fmmu(3, 0x100, 3, 0x1008, Write)
    assert(logical(Lrd, 0x100, 0, 0, 0).data == Seq(0x10, 0x30, 0x40))
    assert(logical(Lrw, 0x100, 1, 2, 3).data == Seq(0x10, 0x30, 0x40))
    assert(hostGet(0x1008, 3) == Seq(1, 2, 3))
  }
  rule("B-48: a byte is read before the one in front of it is written", fmmus) { s =>
    import s._
    hostPut(0x100f, 0x11, 0x22, 0x33, 0x44, 0x55)
    fmmu(0, 0x100, 4, 0x100f, Read)
    fmmu(1, 0x100, 4, 0x1010, Write)
    assert(logical(Lrw, 0x100, 0xd1, 0xd2, 0xd3, 0xd4).data == Seq(0x11, 0x22, 0x33, 0x44))
    assert(hostGet(0x100f, 5) == Seq(0x11, 0xd1, 0xd2, 0xd3, 0xd4))
  }
  rule("B-48: of a shifted run, a local byte is written before the next byte is read", bits) { s =>
    import s._
    hostPut(0x100f, 0x11, 0x22, 0x33, 0x44, 0x55)
    fmmu(0, 0x100, 4, 0x100f, Read)
    fmmu(1, 0x100, 4, (0, 7, 2), 0x1010, Write)
    assert(logical(Lrw, 0x100, 0xd1, 0xd2, 0xd3, 0xd4).data == Seq(0x11, 0x44, 0x4b, 0x4f))
    assert(hostGet(0x100f, 6) == Seq(0x11, 0x44, 0x4b, 0x4f, 0x53, 0x03))
  }
  rule("FMMU-06, B-48: one for reads and writes equals two at the same place", fmmus) { s =>
    import s._
    fmmu(0, 0x100, 2, 0x1000, ReadWrite)
    fmmu(1, 0x200, 2, 0x1010, Read)
    fmmu(2, 0x200, 2, 0x1010, Write)
    for ((at, local) <- Seq(0x100L -> 0x1000, 0x200L -> 0x1010)) {
      hostPut(local, 0x12, 0x34)
      val r = logical(Lrw, at, 0x56, 0x78)
      assert(r.data == Seq(0x12, 0x34) && r.workingCounter == 3)
      assert(hostGet(local, 2) == Seq(0x56, 0x78))
      assert(logical(Lrd, at, 0, 0).data == Seq(0x56, 0x78))
      assert(logical(Lwr, at, 1, 2).workingCounter == 1)
    }
  }
  rule("FMMU-07: several may reach the same local memory", fmmus) { s =>
    import s._
    hostPut(0x1000, 0x77)
    fmmu(0, 0x100, 1, 0x1000, ReadWrite)
    fmmu(1, 0x200, 1, 0x1000, ReadWrite)
    fmmu(2, 0x101, 1, 0x1000, Read)
    assert(logical(Lrd, 0x100, 0, 0).data == Seq(0x77, 0x77))
    assert(logical(Lwr, 0x200, 0x12).workingCounter == 1)
    assert(logical(Lrd, 0x100, 0, 0).data == Seq(0x12, 0x12))
  }
  rule("FMMU-08: byte-wise ones may be adjacent, bit-wise ones need three bytes between", bits) { s =>
    import s._
    hostPut(0x1000, 1, 2, 3, 4)
    fmmu(0, 0x100, 2, 0x1002, Read)
    fmmu(1, 0x102, 2, 0x1000, Read)
    assert(logical(Lrd, 0x100, 0, 0, 0, 0).data == Seq(3, 4, 1, 2))
    hostPut(0x1000, 0xff, 0xff, 0xff, 0xff)
    fmmu(0, 0x00010011L, 3, (3, 0, 1), 0x1000, Read)
    fmmu(1, 0x00010017L, 1, (2, 3, 5), 0x1000, Read)
    assert(logical(Lrd, 0x00010011L, 0, 0, 0, 0, 0, 0, 0).data == Seq(0xf8, 0xff, 1, 0, 0, 0, 0x0c))
  }
  rule("FMMU-09: bit-wise reading works at any address, registers included", bits) { s =>
    import s._
    fmmu(0, 0x100, 1, (4, 7, 0), 0x0004, Read) // number of FMMUs
    assert(logical(Lrd, 0x100, 0x05).data == Seq((p.fmmus & 0xf) << 4 | 5))
    hostPut(0x0f80, 0x08)
    fmmu(0, 0x100, 1, (1, 1, 3), 0x0f80, Read)
    assert(logical(Lrd, 0x100, 0xf0).data == Seq(0xf2))
  }
  rule(
    "FMMU-09, B-55: bit-wise reading through a SyncManager gets all bits of the last byte",
    p => bits(p) && both(p)
  ) { s =>
    import s._
    syncManager(0, 0x1000, 2, 0x00)
    fmmu(0, 0x100, 2, (0, 7, 4), 0x1000, Read)
    hostPut(0x1000, 0xa5, 0x3c)
    hostPut(0x1002, 0) // behind it
    assert(logical(Lrd, 0x100, 0, 0, 0x77).data == Seq(0xca, 0x03, 0x77))
    assert((bench.hostRead(0x0805) & 2) == 2 && get(0x1001, 1).isEmpty)
  }
  rule("FMMU-10, B-47, OP-14: bit-wise writing writes whole bytes, bits not mapped become 0", bits) { s =>
    import s._
    hostPut(0x1000, 0xff, 0xff)
    fmmu(0, 0x100, 1, (2, 4, 3), 0x1000, Write)
    assert(logical(Lwr, 0x100, 0xff).workingCounter == 1)
    assert(hostGet(0x1000, 2) == Seq(0x38, 0xff))
    fmmu(0, 0x100, 1, (0, 3, 6), 0x1000, Write)
    assert(logical(Lwr, 0x100, 0x0e).workingCounter == 1)
    assert(hostGet(0x1000, 2) == Seq(0x80, 0x03))
  }
  rule("FMMU-11: logical accesses that nobody maps change nothing", fmmus) { s =>
    import s._
    fmmu(0, 0x100, 1, 0x1000, Read)
    fmmu(1, 0x200, 1, 0x1001, Write)
    hostPut(0x1000, 0x11, 0x22)
    for (
      (command, address) <- Seq(Lrd -> 0x200L, Lwr -> 0x100L, Lrw -> 0x300L, Lrd -> 0x101L, Lwr -> 0x1ffL)
    ) {
      val r = logical(command, address, 0x5a)
      assert(r.data == Seq(0x5a) && r.workingCounter == 0, s"command $command at $address")
    }
    assert(hostGet(0x1000, 2) == Seq(0x11, 0x22))
  }
  rule("FMMU-12: behind the translation SyncManagers rule as for direct accesses", both) { s =>
    import s._
    syncManager(0, 0x1000, 4, 0x04)
    syncManager(1, 0x1100, 4, 0x00)
    fmmu(0, 0x100, 4, 0x1000, Write)
    fmmu(1, 0x200, 4, 0x1100, Read)
    assert(logical(Lwr, 0x101, 1, 2, 3).workingCounter == 0, "not opened")
    assert(logical(Lwr, 0x100, 1, 2, 3, 4).workingCounter == 1)
    assert(hostGet(0x1000, 4) == Seq(1, 2, 3, 4))
    val nothing = logical(Lrd, 0x200, 9, 9, 9, 9)
    assert(nothing.workingCounter == 0 && nothing.data == Seq(9, 9, 9, 9))
    hostPut(0x1100, 5, 6, 7, 8)
    assert(logical(Lrd, 0x200, 0, 0, 0, 0).data == Seq(5, 6, 7, 8))
  }
  rule("FMMU-12: an FMMU for reads and writes serves only one direction of a SyncManager", both) { s =>
    import s._
    syncManager(0, 0x1000, 2, 0x04)
    fmmu(0, 0x100, 2, 0x1000, ReadWrite)
    val r = logical(Lrw, 0x100, 0x12, 0x34)
    assert(r.workingCounter == 2 && r.data == Seq(0x12, 0x34))
    assert(hostGet(0x1000, 2) == Seq(0x12, 0x34))
  }
  rule("FMMU-13, FP-27: the working counter counts the device, not its FMMUs", fmmus) { s =>
    import s._
    for (n <- 0 until 4) fmmu(n, 0x100 + n, 1, 0x1000 + n, ReadWrite)
    val data = Seq(1, 2, 3, 4, 5)
    assert(logical(Lrd, 0x100, data: _*).workingCounter == 1)
    assert(logical(Lwr, 0x100, data: _*).workingCounter == 1)
    assert(logical(Lrw, 0x100, data: _*).workingCounter == 3)
    assert(put(0x060b, Read) && put(0x061b, Read))
    assert(logical(Lrw, 0x100, 1, 2).workingCounter == 1)
    assert(put(0x060b, Write) && put(0x061b, Write))
    assert(logical(Lrw, 0x100, 1, 2).workingCounter == 2)
    assert(logical(Lrw, 0x101, 1, 2).workingCounter == 3)
  }
  rule("FMMU-14, SYS-06: memory is reached directly, by SyncManager, by FMMU, and by both", both) { s =>
    import s._
    assert(put(0x1080, 0x11) && bench.hostRead(0x1080) == 0x11)
    fmmu(0, 0x100, 1, 0x1080, ReadWrite)
    assert(logical(Lwr, 0x100, 0x22).workingCounter == 1 && bench.hostRead(0x1080) == 0x22)
    syncManager(0, 0x1000, 2, 0x04)
    assert(put(0x1000, 0x33, 0x44) && hostGet(0x1000, 2) == Seq(0x33, 0x44))
    fmmu(1, 0x200, 2, 0x1000, Write)
    assert(logical(Lwr, 0x200, 0x55, 0x66).workingCounter == 1 && hostGet(0x1000, 2) == Seq(0x55, 0x66))
  }
  rule("FP-19, GEN-08: registers are reached by FMMU, absent ones do not count", fmmus) { s =>
    import s._
    fmmu(0, 0x100, 2, 0x0010, ReadWrite)
    assert(logical(Lrw, 0x100, 0x34, 0x02).workingCounter == 3)
    assert(word(0x0010) == (0x0234 & (1 << p.nodeIdWidth) - 1))
    fmmu(0, 0x100, 2, 0x0e80, ReadWrite)
    assert(logical(Lrw, 0x100, 1, 2).workingCounter == 0)
  }
  rule("FMMU-01, FP-32: configuration takes effect after the frame", fmmus) { s =>
    import s._
    import flyframe.model.Datagram
    fmmu(0, 0x100, 1, 0x1000, Read)
    assert(put(0x060c, 0))
    val r = exchange(Datagram(Apwr, 0, 0x060c, Seq(1)), Datagram(Lrd, 0x100L, Seq(0)))
    assert(r.map(_.workingCounter) == Seq(1, 0))
    assert(logical(Lrd, 0x100, 0).workingCounter == 1)
  }
}
