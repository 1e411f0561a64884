package flyframe.model

import java.io.{OutputStream, PrintStream}
import scala.util.Random
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.TestSets
import flyframe.params.{EscParams, Presets}

/** Random traffic must get to the states that matter. */
class UnitTrafficSpec extends AnyFlatSpec {
  for (
    p <- Seq(
      EscParams(preset = "byte-wise", ramKiB = 1, fmmus = 8, syncManagers = 8, applicationLayer = 1),
      TestSets.named("complete-125").get
    )
  ) s"FMMU, SM, AL, IRQ: 3,000 random frames, ${p.preset}" should "reach every state of every unit" in {
    val random    = new Random(3)
    val model     = new EscModel(p)
    val writer    = new VectorWriter(p, 3, new PrintStream(OutputStream.nullOutputStream), model)
    val generator = new FrameGenerator(p, model, random)
    val units     = new UnitTraffic(p, model, random)
    val seen      = scala.collection.mutable.Map.empty[String, Int].withDefaultValue(0)
    def note(what: String, when: Boolean): Unit = if (when) seen(what) += 1
    // Of protected registers and memory fewer are written.
    for (_ <- 0 until (if (p.hasWriteProtection) 6000 else 3000)) {
      if (random.nextInt(4) == 0) units.host(writer)
      val sent = model.receive(0, generator.next())
      for (n <- 0 until p.syncManagers) {
        val status = model.registers.byte(0x0805 + 8 * n)
        note(s"last buffer ${status >> 4}", when = true)
        note("full", (status & 8) != 0)
        note("written", (status & 1) != 0)
        note("read", (status & 2) != 0)
        note(
          "locked",
          model.registers.byte(0x0807 + 8 * n) == 1 && (model.registers.byte(0x0806 + 8 * n) & 1) == 1
        )
      }
      for (n <- 0 until p.fmmus) {
        val start = model.registers.value(s"fmmu${n}_physical_start")
        note("FMMU in user RAM", start >= 0x0f80 && start < 0x1000)
        note("FMMU at the end of RAM", start > 0x0ff0 + p.ramBytes && start < 0x1000 + p.ramBytes)
        note("FMMU at the last addresses", start >= 0xfffc)
      }
      for (bit <- Seq(0, 4)) note(s"AL event $bit", (model.registers.byte(0x0220) >> bit & 1) == 1)
      for (bit <- Seq(2, 3)) {
        note(s"ECAT event $bit", (model.registers.byte(0x0210) >> bit & 1) == 1)
        note(s"no ECAT event $bit", (model.registers.byte(0x0210) >> bit & 1) == 0)
      }
      note("interrupt", model.interrupt)
      sent.filter(_._2.good).foreach { case (_, s) =>
        val b = s.bytes
        if (b(12) == 0x88 && b(13) == 0xa4 && b(15) >> 4 == 1 && b.size > 28) {
          val length  = b(22) | (b(23) & 7) << 8
          val command = b(16)
          if (b.size > 28 + length && command >= 10 && command <= 12)
            note(s"logical $command counts ${b(26 + length)}", when = true)
          note("IRQ field", b(24) != 0)
        }
      }
    }
    info(seen.toSeq.sorted.map { case (k, v) => s"$k: $v" }.mkString(", "))
    val wanted = (0 to 3)
      .map(k => s"last buffer $k") ++ Seq("full", "written", "read", "locked", "interrupt") ++
      Seq("AL event 0", "AL event 4", "ECAT event 2", "ECAT event 3", "no ECAT event 2", "no ECAT event 3") ++
      Seq("FMMU in user RAM", "FMMU at the end of RAM", "FMMU at the last addresses") ++
      Seq("IRQ field", "logical 10 counts 1", "logical 11 counts 1") ++ (0 to 3).map(k =>
        s"logical 12 counts $k"
      )
    // DL status changes only once, at the start, and the master soon reads it.
    for (state <- wanted) assert(seen(state) >= (if (state == "ECAT event 2") 1 else 5), s"too rare: $state")
  }

  "AP, ALARM, DET: random frames" should "reach every way of appending" in {
    val p   = Presets.named("alarm-slave").get.params
    val out = new java.io.ByteArrayOutputStream
    FuzzVectors.write(p, 4, 1500, new PrintStream(out))
    val lines                                  = out.toString.linesIterator.toSeq
    def times(what: String, at: Int = 5): Unit = assert(lines.count(_.matches(what)) >= at, what)
    times("X .* T\\d+", 200)      // appended
    times("X .* \\?", 1)          // a time has been read
    times("F .* G\\d+:\\d+", 100) // a record is acknowledged
    times("R 0ea9 (4|0).", 2)     // no record waits; nothing was dropped
    times("R 0eae 0[1-9a-f]", 1)  // the queue has been full
    times("D .*", 200)
    times("A 1100") // the supply has been off
    val waited = lines.sliding(3).count(l => l.head.matches("X .* T\\d+") && l(1).startsWith("F"))
    assert(waited > 50, "frames behind an extended one")
  }

  "WD, SII: random traffic for a complete slave" should "keep watchdogs and EEPROM quiet" in {
    for (name <- Seq("slave", "et1100", "et1200")) {
      val preset = Presets.named(name).get.params
      val out    = new java.io.ByteArrayOutputStream
      FuzzVectors.write(preset, 5, 600, new PrintStream(out))
      val lines = out.toString.linesIterator.toSeq
      // The first checkpoint has read all times as 0, and so does the last one.
      for (address <- Seq(0x0410, 0x0411, 0x0420, 0x0421)) {
        val reads = lines.filter(_.startsWith(f"R $address%04x"))
        assert(reads.nonEmpty && reads.forall(_.endsWith(" 00")), name)
      }
      assert(!lines.exists(l => UnitTraffic.WatchdogStates.exists(a => l.startsWith(f"R $a%04x"))))
    }
  }
}
