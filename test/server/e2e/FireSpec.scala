package flyframe.e2e

import FireBench._

/** The table of issue 12, the rows about slaves and people: what fails first, then a fire. See [[FireBench]];
  * the others are in [[FireServerSpec]].
  */
class FireSpec extends FireBench("fire") {
  "DET-07, ALARM-11: a host that dies after it switched the detector off" should "be seen; it comes back" in
    row { system =>
      system.bench("host 2 stop")
      isFault(system, "1B", "host dead")
      isLogged(system, 2, 1)(fire(system, 2)) // it needs no host
      system.bench("smoke 2 off")
      system.bench("write 2 0x0ea6 0")
      system.within(Soon, "the supply is off")(!system.slave(2)("supply").bool)
      silence(system)
      system.bench("press reset")
      isFault(system, "1B", "off")
      system.await("a fault on the page")(stateOf(system, 2) == "fault")
      isLogged(system, 3, 1)(fire(system, 3))
      system.bench("host 2 start")
      system.within(Soon, "the supply is on")(system.slave(2)("supply").bool)
      isLogged(system, 2, 1)(fire(system, 2))
    }

  "LM-02, DET-07: a host slower than 1,023 bus cycles" should "be waited for, and keep nobody waiting" in {
    val system =
      new AlarmSystem("slow-host", Seq("--slaves", "2", "--bus-cycle-us", "40"), isAttacked = false)
    try {
      system.await("both slaves are normal")(system.shown.exists(_("slaves").arr.count(isNormal) == 2))
      system.bench("host 1 boot 45")
      system.bench("restart 1")
      val begin = system.timeUs
      isFault(system, "1A", "wrong") // its ID is 0 until it has a host
      isLogged(system, 2, 1)(fire(system, 2))
      silence(system)
      system.bench("smoke 1 on")
      system.within(Soon, "the alarm of the slave whose host is slow")(system.master("sounder").bool)
      system.await("it is on the page")(stateOf(system, 1) == "alarm" && entry(system, 1)("node").num == 0)
      assert(system.timeUs - begin < 45000 && system.slave(1)("epoch").num == 0)
      system.await("its host is there")(system.slave(1)("epoch").num == 2)
      system.await("its ID is on the page")(entry(system, 1)("node").num == 1)
      assert(system.timeUs - begin > 1023 * 40)
    } finally system.close()
  }

  private def isNormal(slave: ujson.Value) = slave("state").str == "normal" && slave("status").num == 0

  "LM-05, LM-08: two slaves with one node ID" should "each sound, be shown and be logged" in row { system =>
    system.bench("node 3 2")
    system.bench("restart 3")
    isFault(system, "1B", "wrong")
    system.await("the fault on the page")(
      entry(system, 3)("wrong").arr.exists(_.str.contains("same ID as 1B"))
    )
    isLogged(system, 2, 2) {
      fire(system, 2)
      silence(system)
      system.bench("smoke 3 on")
      system.within(Soon, "the second one sounds, too")(
        system.master("sounder").bool && system.slave(3)("buzzer").bool
      )
      system.await("both on the page")(stateOf(system, 2) == "alarm" && stateOf(system, 3) == "alarm")
    }
    assert(records(system, 2).takeRight(2).map(_.position) == Seq(1, 2))
    system.bench("node 3 3")
    system.bench("restart 3")
  }

  "DET-05, LM-06: smoke that is still there after a reset" should "be a new alarm" in row { system =>
    isLogged(system, 2, 2) {
      fire(system, 2)
      silence(system)
      system.order("command" -> "reset")
      system.await("the reset is done")(orders(system).exists(o => o("state").str == "done"))
      burns(system, 2)
    }
  }

  private def orders(system: AlarmSystem) = system.shown.get("orders").arr

  "ALARM-06, LM-06: silence" should "leave lamps, fire output and page as they are" in row { system =>
    fire(system, 2)
    silence(system)
    system.within(Displayed, "the panel")(display(system).head.startsWith("FIRE 1 silenced"))
    system.await("the page")(system.shown.get("fire").objOpt.exists(!_("sounding").bool))
    assert(system.slave(2)("lamp").bool && system.master("fire").bool && stateOf(system, 2) == "alarm")
  }

  "HOST-12, ALARM-08: memories that are worn out" should "stop orders, not detection" in row { system =>
    for (node <- Seq("2", "master")) {
      system.bench(s"storage $node fail")
      system.bench(s"restart $node")
    }
    isFault(system, "Memory failed")
    isLogged(system, 2, 1)(fire(system, 2))
    system.order("command" -> "silence")
    system.await("an order is refused")(orders(system).exists(_("state").str == "failed"))
    assert(system.master("sounder").bool)
    silence(system) // the button works
    for (node <- Seq("2", "master")) {
      system.bench(s"storage $node ok")
      system.bench(s"restart $node")
    }
  }

  it should "not come from many starts" in row { system =>
    for ((node, name) <- Seq("2" -> "slave2", "master" -> "master"); starts <- Seq(65535L, 0xffffffffL)) {
      system.bench(s"off $node")
      remember(system, name, starts)
      system.bench(s"on $node")
      system.await("its host has started")(system.status(if (node == "2") "slaves" else "master") match {
        case all: ujson.Arr => all(1)("self_test").num == 1
        case master         => master("self_test").num == 1
      })
    }
    isLogged(system, 2, 1)(fire(system, 2))
  }

  "DET-03: a current that flickers between alarm and short faster than the debounce" should "count" in
    row { system =>
      system.bench("off 2")
      system.bench("smoke 2 on")
      system.bench("chatter 2 10000 short")
      isLogged(system, 2, 1) {
        system.bench("on 2")
        burns(system, 2)
      }
      system.bench("chatter 2 off")
    }

  "LM-11: a slave that stays dead after a power cut" should "be missed, at panel and page" in row { system =>
    for (node <- Seq("master", "1", "2", "3")) system.bench(s"off $node")
    for (node <- Seq("master", "1", "2")) system.bench(s"on $node")
    isFault(system, "2A", "missing")
    system.await("it is lost on the page")(stateOf(system, 3) == "lost")
    assert(system.shown.get("notices").arr.exists(_.str.contains("Slaves are missing")))
    isLogged(system, 2, 1)(fire(system, 2))
    system.bench("on 3")
  }
}
