package flyframe.rules

import flyframe.params.EscParams

/** Watchdogs: rule group WD. The names must hold the word watchdog: time passes in them. */
object WatchdogRules extends Rules {
  private def some(p: EscParams) =
    p.hasWatchdogs && p.hasApplicationLayer && p.syncManagers >= 1 && p.ramKiB >= 1

  /** A tick of half a millisecond, and watchdog times in ticks. */
  private def times(s: Steps, pdi: Int, processData: Int): Unit = {
    import s._
    assert(put(0x0400, 12498 & 0xff, 12498 >> 8) && put(0x0410, pdi, 0) && put(0x0420, processData, 0))
    syncManager(0, 0x1000, 2, 0x44)
  }

  rule("WD-01, WD-02: a watchdog expires after time to time + 1 ticks of (divider + 2) * 40 ns", some) { s =>
    import s._
    times(s, pdi = 0, processData = 3)
    def alive = get(0x0440, 1).contains(Seq(1))
    assert(put(0x1000, 1, 2) && alive)
    bench.advanceMs(1)
    assert(alive, "1 of 1.5 to 2 ms")
    bench.advanceMs(1)
    assert(!alive)
    // Twice the divider, twice the time.
    assert(put(0x0400, 24998 & 0xff, 24998 >> 8) && put(0x1000, 1, 2) && alive)
    bench.advanceMs(2)
    assert(alive, "2 of 3 to 4 ms")
    bench.advanceMs(2)
    assert(!alive)
  }
  rule("WD-03: a watchdog with time 0 is off", some) { s =>
    import s._
    times(s, pdi = 0, processData = 0)
    assert(get(0x0440, 1).contains(Seq(1)) && get(0x0448, 1).contains(Seq(1)), "even before a trigger")
    assert(put(0x1000, 1, 2))
    bench.advanceMs(3)
    assert(get(0x0440, 4).contains(Seq(1, 0, 0, 0)) && get(0x0448, 1).contains(Seq(1)))
  }
  rule("WD-05: expiry of the process data watchdog: status 0, counted once", some) { s =>
    import s._
    times(s, pdi = 0, processData = 1)
    for (n <- 1 to 2) {
      assert(put(0x1000, 1, 2) && get(0x0440, 1).contains(Seq(1)))
      bench.advanceMs(3)
      assert(get(0x0440, 4).contains(Seq(0, 0, n, 0)), s"expiry $n")
    }
  }
  rule("WD-06, B-62: host accesses trigger the PDI watchdog, ECAT's do not", some) { s =>
    import s._
    times(s, pdi = 3, processData = 0)
    def alive = get(0x0448, 1).contains(Seq(1))
    // The last two are denied by the SyncManager, whose buffer ECAT writes.
    val accesses = Seq[() => Any](
      () => bench.hostRead(0),
      () => bench.hostWrite(0x0f80, 1),
      () => bench.hostWrite(0x1000, 1),
      () => bench.hostWrite(0x1001, 1)
    )
    for (access <- accesses) {
      access()
      for (_ <- 0 until 3) {
        bench.advanceMs(1)
        assert(alive)
        access()
      }
    }
    bench.advanceMs(1)
    assert(alive && put(0x0f80, 1) && put(0x1000, 1, 2))
    bench.advanceMs(1)
    assert(!alive && (get(0x0110, 1).get.head & 2) == 0, "WD-07")
    assert(get(0x0443, 1).contains(Seq(1)))
  }
  rule("B-62: a host's read of the PDI watchdog's status sees what was before it", some) { s =>
    import s._
    def status = (bench.hostRead(0x0448) & 1, bench.hostRead(0x0110) >> 1 & 1)
    assert((bench.hostRead(0x0110) & 2) == 0, "the very first access")
    assert(status == (1, 1))
    for (address <- Seq(0x0448, 0x0110)) {
      times(s, pdi = 1, processData = 0)
      bench.advanceMs(3)
      assert((bench.hostRead(address) & (if (address == 0x0110) 2 else 1)) == 0, "after it has expired")
      assert(status == (1, 1))
    }
  }
  rule("WD-09, ERR-10: the watchdog counters stop at 0xFF; a write clears both", some) { s =>
    import s._
    times(s, pdi = 1, processData = 1)
    assert(put(0x0400, 0, 0)) // ticks of 80 ns, from the next tick on
    bench.advanceMs(1)
    assert(put(0x0442, 0) && put(0x1000, 1, 2))
    bench.advanceUs(1)
    for (n <- 1 to 260) {
      bench.hostRead(0)
      bench.advanceUs(1)
      if (n == 200) assert(get(0x0443, 1).exists(_.head < 0xff))
    }
    assert(get(0x0442, 2).contains(Seq(1, 0xff)))
    assert(put(0x0442, 0x55) && get(0x0442, 2).contains(Seq(0, 0)))
  }
}
