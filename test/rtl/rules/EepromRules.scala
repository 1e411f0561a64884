package flyframe.rules

import flyframe.model.Datagram
import flyframe.params.EscParams
import flyframe.protocol.Command._

/** A controller with its EEPROM, as master and host see them: rule group SII, and what else a configuration
  * decides. Not part of the parameter matrix, whose vectors know no EEPROM.
  */
object EepromRules extends Rules {
  private def all(p: EscParams)  = p.hasI2c && p.hasApplicationLayer && p.ramKiB >= 1
  private def leds(p: EscParams) = all(p) && p.hasLeds

  private val First  = EepromImage(0x0c80, 0x3412, 0x5555, 0x7856, 0x0234, 0x0ab0, 0x009a)
  private val Second = EepromImage(0x0505, 0x4321, 0x5555, 0x8765, 0x0bcd, 0x0040, 0x00a9)
  private val Read   = 1
  private val Write  = 2
  private val Reload = 4

  private def start(s: Steps, image: Seq[Int]): Unit = {
    s.bench.powerOn(image)
    s.eepromDone()
  }
  private def wrong(image: Seq[Int]) = image.updated(14, image(14) ^ 1)

  /** 0x0503: command and errors; in the low byte, to read as in the specification, 0. */
  private def status(s: Steps): Int = s.bench.hostRead(0x0503) << 8

  /** What a master does: one datagram with command and address, as the usual ones send it. */
  private def command(s: Steps, code: Int, address: Int = 0, enable: Int = 0): Unit = {
    import s._
    assert(put(0x0502, enable, code, address & 0xff, address >> 8, 0, 0))
    eepromDone()
  }
  private def writeWord(s: Steps, address: Int, word: Int): Unit = {
    assert(s.put(0x0508, word & 0xff, word >> 8))
    command(s, Write, address, enable = 1)
    assert(status(s) == 0)
  }
  private def words(image: Seq[Int]) = image.take(16).grouped(2).map(w => w.head | w(1) << 8).toSeq

  rule("SII-05, SII-07, PDI-04, LP-12: the configuration area goes to the registers and opens the RAM", all) {
    s =>
      import s._
      start(s, First)
      assert(status(s) == 0 && (dlStatus & 1) == 1)
      assert(hostGet(0x0140, 5) == Seq(0x80, 0x0c, 0xb0, 0x0a, 0x9a))
      assert(hostGet(0x0150, 4) == Seq(0x12, 0x34, 0x56, 0x78))
      assert(word(0x0012) == (0x0234 & (1 << p.nodeIdWidth) - 1))
      assert(bench.hostRead(0x0102) == 0xb2, "A5[7:4], and A5[11:9] inverted")
      assert(put(0x1000, 0x5a) && bench.hostRead(0x1000) == 0x5a)
      assert(word(0x0130) == 1 && word(0x0120) == 1)
  }
  rule(
    "SII-06, SII-09, HINT-03: an EEPROM image with a wrong checksum is not taken; all but process data works",
    all
  ) { s =>
    import s._
    start(s, wrong(First))
    assert(status(s) == 0x1800, "checksum error, not loaded")
    assert((dlStatus & 1) == 0)
    assert(hostGet(0x0140, 1) == Seq(0) && word(0x0012) == 0 && bench.hostRead(0x0102) == 0x07)
    assert(!put(0x1000, 1) && get(0x1000, 1).isEmpty)
    bench.hostWrite(0x1000, 1)
    assert(bench.hostRead(0x1000) == 0)
    stationAddress(0x0123)
    assert(read(Fprd, 0x0123, 0x0010, 2).workingCounter == 1)
    assert(put(0x0f80, 0x77) && bench.hostRead(0x0f80) == 0x77 && put(0x0120, 2))
  }
  rule("SII-03: the checksum 0x88A4 is always right", all) { s =>
    start(s, First.updated(14, 0xa4).updated(15, 0x88))
    assert(status(s) == 0 && s.bench.hostRead(0x0140) == 0x80)
  }
  rule("SII-08, SII-07, FP-16: a reload changes neither alias nor 0x0141[7:4,1]", all) { s =>
    import s._
    start(s, First)
    for ((w, i) <- words(Second).zipWithIndex) writeWord(s, i, w)
    assert(bench.hostRead(0x0140) == 0x80, "not before the reload")
    command(s, Reload)
    assert(status(s) == 0)
    assert(hostGet(0x0140, 2) == Seq(0x05, 0x05 & 0x0d) && hostGet(0x0150, 2) == Seq(0x21, 0x43))
    assert(word(0x0012) == (0x0234 & (1 << p.nodeIdWidth) - 1))
    assert(bench.hostRead(0x0102) == 0x42, "RX FIFO size as it was")
  }
  rule("SII-07, OP-06: a reload with a wrong checksum changes nothing but 0x0502[11]", all) { s =>
    import s._
    start(s, First)
    writeWord(s, 0, 0x0505)
    command(s, Reload)
    assert(status(s) == 0x0800 && (dlStatus & 1) == 1 && bench.hostRead(0x0140) == 0x80)
    assert(put(0x1000, 1), "the RAM stays open")
    command(s, 0)
    assert(status(s) == 0x0800, "only a good load clears it")
  }
  rule("OP-06, SII-07: a good reload after a failed first load opens the RAM", all) { s =>
    import s._
    start(s, wrong(First))
    val right = words(First)(7)
    assert(put(0x0508, right & 0xff, right >> 8))
    command(s, Write, 7, enable = 1)
    command(s, Reload)
    assert(status(s) == 0 && (dlStatus & 1) == 1 && bench.hostRead(0x0140) == 0x80)
    assert(put(0x1000, 0x5a) && bench.hostRead(0x1000) == 0x5a)
  }
  rule("SII-12, SII-13, SII-14: a read command gives 8 bytes from the address of its frame", all) { s =>
    import s._
    start(s, First)
    assert((word(0x0502) & 0x40) == 0x40)
    for (address <- Seq(0x20, 0x08, 0x3fc)) {
      command(s, Read, address)
      assert(get(0x0508, 8).contains(First.slice(2 * address, 2 * address + 8)), s"word $address")
    }
    assert(put(0x0504, 0x10, 0, 0, 0) && put(0x0502, 0, Read))
    eepromDone()
    assert(get(0x0508, 2).contains(First.slice(32, 34)), "address first, in a frame of its own")
  }
  rule("SII-13, FP-36: a command in a bad frame does not start", all) { s =>
    import s._
    start(s, First)
    command(s, Read, 0x20)
    s.spoiled(Datagram(Apwr, 0, 0x0502, Seq(0, Read, 0x08, 0, 0, 0)))
    eepromDone()
    assert(get(0x0508, 2).contains(First.slice(64, 66)) && status(s) == 0)
  }
  rule("SII-12, SII-15: ECAT writes with the enable of the same frame only", all) { s =>
    import s._
    start(s, First)
    def content = { command(s, Read, 0x20); get(0x0508, 2).get }
    val before  = content
    assert(put(0x0508, 0xaa, 0x55))
    command(s, Write, 0x20)
    assert(status(s) == 0x4000 && content == before)
    assert(put(0x0508, 0xaa, 0x55) && put(0x0502, 1) && put(0x0503, Write))
    eepromDone()
    assert(status(s) == 0x4000 && content == before, "enable of another frame")
    assert(put(0x0508, 0xaa, 0x55))
    exchange(Datagram(Apwr, 0, 0x0502, Seq(1)), Datagram(Apwr, 0, 0x0503, Seq(Write)))
    eepromDone()
    assert(status(s) == 0 && content == Seq(0xaa, 0x55))
  }
  rule("SII-13, SII-15: invalid commands are an error until command 0 or a valid one", all) { s =>
    import s._
    start(s, First)
    for (code <- Seq(3, 5, 6, 7); next <- Seq(0, Read)) {
      command(s, code)
      assert(status(s) == 0x2000, s"command $code")
      command(s, next)
      assert(status(s) == 0)
    }
  }
  rule("SII-10, SII-11: the interface is handed over, and taken back by force", all) { s =>
    import s._
    start(s, First)
    def byEcat = put(0x0504, 0x20, 0, 0, 0)
    def byHost = { hostPut(0x0504, 0x10, 0, 0, 0); bench.hostRead(0x0504) == 0x10 }
    assert(byEcat && !byHost)
    bench.hostWrite(0x0501, 1)
    assert(bench.hostRead(0x0501) == 0, "not offered")
    assert(put(0x0500, 1) && !byEcat)
    bench.hostWrite(0x0501, 1)
    assert(get(0x0501, 1).contains(Seq(1)) && byHost)
    hostPut(0x0508, 0x12, 0x34)
    hostPut(0x0502, 0, Write)
    eepromDone()
    assert(status(s) == 0 && (word(0x0502) & 1) == 1, "the host needs no enable")
    hostPut(0x0502, 0, Read)
    eepromDone()
    assert(hostGet(0x0508, 2) == Seq(0x12, 0x34))
    assert(put(0x0500, 0) && !byEcat, "until the host gives it back")
    bench.hostWrite(0x0501, 0)
    assert(byEcat && !byHost)
    assert(put(0x0500, 1))
    bench.hostWrite(0x0501, 1)
    assert(put(0x0500, 2) && bench.hostRead(0x0501) == 0)
    bench.hostWrite(0x0501, 1)
    assert(bench.hostRead(0x0501) == 0, "while force is set")
    assert(put(0x0500, 0) && byEcat)
  }
  rule("AL-05, AL-07: with emulation AL status follows AL control, error bit included", all) { s =>
    import s._
    start(s, EepromImage(0x0104))
    for (state <- Seq(2, 4, 0x18, 1)) {
      assert(put(0x0120, state))
      assert(get(0x0130, 1).contains(Seq(state)))
      if (p.hasLeds) assert(bench.hostRead(0x0139) == 0, "no error LED (LED-03)")
    }
    assert((bench.hostRead(0x0220) & 1) == 0 && put(0x0120, 2) && put(0x0120, 4), "it stays open")
    bench.hostWrite(0x0130, 8)
    assert(get(0x0130, 1).contains(Seq(4)), "not the host's")
  }
  rule("LED-03, LED-04, B-69: ERR flickers after a failed load, not after other EEPROM errors", leds) { s =>
    import s._
    start(s, First)
    assert(bench.hostRead(0x0139) == 0)
    command(s, 7)
    assert(status(s) == 0x2000 && bench.hostRead(0x0139) == 0, "an invalid command")
    bench.hostWrite(0x0139, 0x13)
    writeWord(s, 0, 0x0c81)
    command(s, Reload)
    assert(bench.hostRead(0x0139) == 14, "and ends the override")
    writeAnyway(s, 0, 0x0c80)
    command(s, Reload)
    assert(bench.hostRead(0x0139) == 0)
    start(s, wrong(First))
    assert(bench.hostRead(0x0139) == 14)
  }

  /** With [11] set. */
  private def writeAnyway(s: Steps, address: Int, word: Int): Unit = {
    assert(s.put(0x0508, word & 0xff, word >> 8))
    command(s, Write, address, enable = 1)
  }
}
