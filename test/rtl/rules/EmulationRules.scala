package flyframe.rules

import flyframe.params.EscParams

/** A controller whose EEPROM the host emulates, as master and host see it (SII-21 to SII-25). */
object EmulationRules extends Rules {
  private def all(p: EscParams) = p.hasEmulation && p.hasApplicationLayer && p.ramKiB >= 1

  private val image  = EepromImage(0x0c80, 0x3412, 0x5555, 0x7856, 0x0234, 0x0ab0, 0x009a)
  private val Read   = 1
  private val Write  = 2
  private val Reload = 4

  private def control(s: Steps): Int = s.bench.hostRead(0x0502) | s.bench.hostRead(0x0503) << 8
  private def errors(s: Steps): Int  = control(s) & 0x7800
  private def event(s: Steps)        = (s.bench.hostRead(0x0220) & 0x20) != 0

  /** What the host is asked for: command and word address. */
  private def asked(s: Steps): (Int, Int) = {
    var left = 1000
    while (!event(s)) {
      left -= 1
      assert(left > 0, "no command")
    }
    assert((control(s) & 0x8000) != 0, "busy")
    (control(s) >> 8 & 7, s.word(0x0504))
  }

  /** The host puts words where a read command wants them, and says that it has carried out `code`. */
  private def answer(s: Steps, code: Int, data: Seq[Int] = Nil, failure: Boolean = false): Unit = {
    for ((b, i) <- data.zipWithIndex) s.bench.hostWrite(0x0508 + i, b)
    s.bench.hostWrite(0x0503, code | (if (failure) 0x20 else 0))
  }
  private def half(content: Seq[Int], word: Int) = content.slice(2 * word, 2 * word + 8)

  /** Answers a load, or a try of it. */
  private def load(s: Steps, content: Seq[Int]): Unit = for (word <- Seq(0, 4)) {
    assert(asked(s) == ((Reload, word)))
    answer(s, Reload, half(content, word))
  }
  private def idle(s: Steps): Unit = {
    s.eepromDone()
    assert(!event(s))
  }
  private def start(s: Steps): Unit = {
    load(s, image)
    idle(s)
    assert((s.dlStatus & 1) == 1 && errors(s) == 0)
  }
  private def command(s: Steps, code: Int, address: Int = 0, enable: Int = 0): Boolean =
    s.put(0x0502, enable, code, address & 0xff, address >> 8, 0, 0)

  rule(
    "SII-21, SII-23, SII-05, B-67: after reset the host gives words 0 to 7, which configure and open the RAM",
    all
  ) { s =>
    import s._
    assert(asked(s) == ((Reload, 0)))
    assert((control(s) & 0x20) != 0, "0x0502[5]: emulation")
    assert((dlStatus & 1) == 0 && get(0x1000, 1).isEmpty && errors(s) == 0x1000)
    assert(!put(0x0508, 1, 2), "ECAT does not answer")
    start(s)
    assert(hostGet(0x0140, 2) == Seq(0x80, 0x0c) && hostGet(0x0150, 4) == Seq(0x12, 0x34, 0x56, 0x78))
    assert(word(0x0012) == (0x0234 & (1 << p.nodeIdWidth) - 1))
    assert(put(0x1000, 0x5a) && bench.hostRead(0x1000) == 0x5a)
  }
  rule("SII-23, SII-06, B-67: with a wrong checksum the load is tried twice, then given up", all) { s =>
    val wrong = image.updated(14, image(14) ^ 1)
    load(s, wrong)
    load(s, wrong)
    idle(s)
    assert(errors(s) == 0x1800 && (s.dlStatus & 1) == 0 && s.get(0x1000, 1).isEmpty)
    assert(command(s, Reload))
    load(s, wrong)
    load(s, image)
    idle(s)
    assert(errors(s) == 0 && (s.dlStatus & 1) == 1, "the second try was right")
  }
  rule("SII-21, SII-06: a host that fails to load is asked twice", all) { s =>
    for (_ <- 0 to 1) {
      assert(asked(s) == ((Reload, 0)))
      answer(s, Reload, failure = true)
    }
    idle(s)
    assert(errors(s) == 0x3000 && (s.dlStatus & 1) == 0)
  }
  rule("SII-21, SII-14, B-67: a read command is busy until the host has put eight bytes there", all) { s =>
    start(s)
    assert(command(s, Read, 0x0123))
    assert(asked(s) == ((Read, 0x0123)) && !command(s, Read, 0x0456), "busy: refused")
    answer(s, Write)
    assert(asked(s) == ((Read, 0x0123)), "not the command that was asked for")
    answer(s, Read, 1 to 8)
    idle(s)
    assert(s.get(0x0508, 8).contains(1 to 8) && errors(s) == 0)
  }
  rule("SII-21: a write command gives the host one word", all) { s =>
    start(s)
    assert(s.put(0x0508, 0xcd, 0xab) && command(s, Write, 0x0040, enable = 1))
    assert(asked(s) == ((Write, 0x0040)) && s.hostGet(0x0508, 2) == Seq(0xcd, 0xab))
    answer(s, Write)
    idle(s)
    assert(errors(s) == 0)
  }
  rule("SII-21, SII-15: a host that fails sets 0x0502[13], which the next command clears", all) { s =>
    start(s)
    assert(command(s, Read))
    asked(s)
    answer(s, Read, failure = true)
    idle(s)
    assert(errors(s) == 0x2000)
    assert(command(s, Read))
    asked(s)
    answer(s, Read, 1 to 8)
    idle(s)
    assert(errors(s) == 0)
  }
  rule("SII-25: invalid commands and writes without enable are rejected without the host", all) { s =>
    start(s)
    for (code <- Seq(3, 5, 6, 7)) {
      assert(command(s, code))
      idle(s)
      assert(errors(s) == 0x2000)
    }
    assert(command(s, 0))
    assert(errors(s) == 0)
    assert(command(s, Write))
    idle(s)
    assert(errors(s) == 0x4000)
  }
  rule("SII-24: a host that has the interface issues commands and answers them itself", all) { s =>
    import s._
    start(s)
    assert(put(0x0500, 1))
    bench.hostWrite(0x0501, 1)
    assert(!command(s, Read), "not the master's")
    bench.hostWrite(0x0504, 0x77)
    bench.hostWrite(0x0503, Read)
    assert(asked(s) == ((Read, 0x77)))
    answer(s, Read, 11 to 18)
    idle(s)
    assert(hostGet(0x0508, 8) == (11 to 18))
  }
  rule("SII-08, SII-23: a reload changes neither alias nor 0x0141[7:4,1]", all) { s =>
    import s._
    start(s)
    assert(command(s, Reload, 0x0040), "the address does not matter")
    load(s, EepromImage(0x0505, 0x4321, 0x5555, 0x8765, 0x0bcd, 0x0040, 0x00a9))
    idle(s)
    assert(errors(s) == 0)
    assert(hostGet(0x0140, 2) == Seq(0x05, 0x05 & 0x0d) && hostGet(0x0150, 2) == Seq(0x21, 0x43))
    assert(word(0x0012) == (0x0234 & (1 << p.nodeIdWidth) - 1))
  }
  rule("IRQ-02: 0x0220[5] raises the interrupt if 0x0204[5] is set, until the answer", all) { s =>
    import s._
    start(s)
    bench.hostWrite(0x0204, 0x20)
    assert(!bench.interrupt && command(s, Read))
    asked(s)
    assert(bench.interrupt)
    answer(s, Read, 1 to 8)
    idle(s)
    assert(!bench.interrupt)
  }
}
