package flyframe.rules

import flyframe.params.EscParams

/** RUN and ERR LED as their registers show them: rule group LED. */
object LedRules extends Rules {
  private def leds(p: EscParams)      = p.hasLeds && p.hasApplicationLayer && !p.hasSii
  private def watchdogs(p: EscParams) = leds(p) && p.hasWatchdogs && p.syncManagers >= 1 && p.ramKiB >= 1
  private def override0(code: Int)    = 0x10 | code

  rule("LED-01: RUN shows AL status", leds) { s =>
    import s._
    for ((state, code) <- Seq(1 -> 0, 2 -> 13, 4 -> 1, 8 -> 15, 3 -> 14, 0x12 -> 13, 0x14 -> 1, 5 -> 0)) {
      hostPut(0x0130, state)
      assert(bench.hostRead(0x0138) == code, s"state $state")
      assert(get(0x0138, 1).contains(Seq(code)))
    }
  }
  rule("LED-02: RUN is overridden by both sides until the state changes", leds) { s =>
    import s._
    hostPut(0x0130, 2)
    assert(put(0x0138, override0(5)) && bench.hostRead(0x0138) == override0(5))
    hostPut(0x0130, 2)
    assert(bench.hostRead(0x0138) == override0(5), "the same state")
    hostPut(0x0130, 4)
    assert(bench.hostRead(0x0138) == 1)
    bench.hostWrite(0x0138, override0(13))
    assert(get(0x0138, 1).contains(Seq(override0(13))) && bench.hostRead(0x0139) == 0, "not the other LED")
    bench.hostWrite(0x0138, 13)
    assert(bench.hostRead(0x0138) == 1, "taken back")
  }
  rule("LED-03: ERR shows the error bit of AL status", leds) { s =>
    import s._
    for ((status, code) <- Seq(0x11 -> 1, 1 -> 0, 0x14 -> 1, 0x18 -> 1, 8 -> 0)) {
      hostPut(0x0130, status)
      assert(bench.hostRead(0x0139) == code, s"status $status")
    }
  }
  rule("LED-04: ERR is overridden by both sides until an error appears", leds) { s =>
    import s._
    assert(put(0x0139, override0(7)) && bench.hostRead(0x0139) == override0(7))
    hostPut(0x0130, 2)
    assert(bench.hostRead(0x0139) == override0(7), "a state is no error")
    hostPut(0x0130, 0x12)
    assert(bench.hostRead(0x0139) == 1)
    bench.hostWrite(0x0139, override0(0))
    assert(get(0x0139, 1).contains(Seq(override0(0))), "the error is known")
    hostPut(0x0130, 2)
    assert(bench.hostRead(0x0139) == override0(0), "an error that ends is none")
    bench.hostWrite(0x0139, 0)
    assert(bench.hostRead(0x0139) == 0)
  }
  rule(
    "LED-03, B-69: ERR shows the process data watchdog expired in Op, until the state changes",
    watchdogs
  ) { s =>
    import s._
    assert(put(0x0420, 5, 0) && put(0x0410, 0, 0))
    syncManager(0, 0x1000, 2, 0x44)
    for ((state, code) <- Seq(4 -> 0, 8 -> 2)) {
      hostPut(0x0130, state)
      assert(put(0x1000, 1, 2) && bench.hostRead(0x0139) == 0)
      bench.advanceMs(1)
      assert(bench.hostRead(0x0139) == code, s"state $state")
    }
    assert(put(0x1000, 1, 2) && bench.hostRead(0x0139) == 2, "an edge: running again ends nothing")
    hostPut(0x0130, 4)
    assert(bench.hostRead(0x0139) == 0)
  }
  rule("LED-03, LED-04: ERR shows the PDI watchdog expired, whatever the state", watchdogs) { s =>
    import s._
    bench.hostWrite(0x0139, override0(3))
    assert(put(0x0410, 5, 0) && get(0x0139, 1).contains(Seq(override0(3))))
    bench.advanceMs(1)
    assert(get(0x0139, 1).contains(Seq(15)))
    assert(bench.hostRead(0x0139) == 15, "an edge: running again ends nothing")
    hostPut(0x0130, 2)
    assert(bench.hostRead(0x0139) == 0)
  }
}
