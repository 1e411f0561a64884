package flyframe.report

import flyframe.HostPinSets

/** `docs/report.md`. */
object Page {
  import Tables._
  private def ns(v: Double): String = f"$v%.1f"
  private val base                  = Points.base

  private def presets(r: Results): String =
    table(
      Seq(
        "Preset",
        "Forwarding ns",
        "Processing ns",
        "LUTs",
        "Registers",
        "Logic elements",
        "M9K",
        "Logic elements with carry chains",
        "ECP5 MHz"
      ),
      Points.presets.map { p =>
        val delays = r.delays(p).fold(Seq("-", "-"))(_.map(ns))
        (s"`${p.preset}`" +: delays) ++ cells(r.area(p.preset)) ++
          Seq(n(r.withCarry(p.preset).logicElements), f"${r.speed(p.preset).mhz}%.1f")
      }
    )

  private def clockNote(r: Results): String = {
    val s    = r.speed(base.preset)
    val slow = Points.presets.filter(p => r.speed(p.preset).mhz < p.coreClockMhz)
    val verdict =
      if (slow.isEmpty) "Every preset reaches its core clock there."
      else
        slow
          .map(p => f"`${p.preset}` reaches ${r.speed(p.preset).mhz}%.1f of ${p.coreClockMhz} MHz")
          .mkString("**", ", ", " there**: ") +
          "whether a Cyclone IV runs at the core clock must be shown by the timing analyser of Quartus " +
          "before hardware is built on it."
    s"""The clock figure is a proxy: open tools have no timing model of Cyclone IV, so it is what nextpnr
       |reaches for the core clock on a Lattice ECP5-85, speed grade 6, where every path is timed as one core
       |cycle, also between registers that load once a nibble slot.
       |$verdict
       |The slowest path of `${base.preset}` goes from `${s.from}` to `${s.to}`,
       |${ns(s.logicNs)} ns of it in cells and ${ns(s.routingNs)} ns in wires.
       |""".stripMargin
  }

  private def clocks(r: Results): String =
    table(
      Seq(
        "Core clock MHz",
        "Forwarding worst",
        "best",
        "pin to pin",
        "Processing worst",
        "best",
        "pin to pin"
      ),
      Points.clocks.map { p =>
        val l               = r.latency(p.preset)
        def three(d: Delay) = Seq(d.worstNs, d.bestNs, d.pinToPinNs).map(ns)
        s"${p.coreClockMhz}" +: (three(l.forwarding) ++ three(l.processing))
      }
    )

  private def steps(r: Results): String = {
    val rows = Steps.titles.zipWithIndex.map { case ((title, why), i) =>
      Seq(title, why) ++ Points.clocks.map(p => Steps.processing(p).cycles(i).toString)
    }
    def whole(name: String, values: Seq[String]) = Seq(s"**$name**", "") ++ values
    val sums = Seq(
      whole("Sum, cycles", Points.clocks.map(p => Steps.processing(p).total.toString)),
      whole("Sum, ns", Points.clocks.map(p => ns(Steps.processing(p).total * 1000.0 / p.coreClockMhz))),
      whole("Measured, ns", Points.clocks.map(p => ns(r.latency(p.preset).processing.worstNs)))
    )
    table(Seq("Step", "Why") ++ Points.clocks.map(p => s"${p.coreClockMhz} MHz"), rows ++ sums, texts = 2)
  }

  /** Says whether the explanation and the measurement are the same number. */
  private def stepsNote(r: Results): String = {
    val wrong = Points.clocks.flatMap { p =>
      val l = r.latency(p.preset)
      Seq(
        ("processing", Steps.processing(p), l.processing),
        ("forwarding", Steps.forwarding(p), l.forwarding)
      ).collect {
        case (name, s, d) if math.abs(s.total - d.worstCycles) > 0.1 =>
          f"$name at ${p.coreClockMhz} MHz is ${d.worstCycles}%.2f cycles, not ${s.total}"
      }
    }
    if (wrong.isEmpty) "The sums are what is measured, at every clock, for processing and for forwarding."
    else s"**The steps do not explain the measurement**: ${wrong.mkString("; ")}."
  }

  private def hosts(r: Results): String =
    table(
      Seq("Interface", "LUTs", "Registers", "Logic elements", "Goal"),
      Points.hosts.map { h =>
        val a = r.hosts(h.module)
        h.title +: Seq(a.luts, a.ffs, a.logicElements, h.goal).map(n)
      }
    )

  private def hostTimes(r: Results): String = {
    def row(times: Seq[AccessTime]) = {
      def cell(write: Boolean, bytes: Int) = {
        val Seq(quiet, beside) = Seq(false, true).map(b =>
          times.find(t => t.beside == b && t.isWrite == write && t.bytes == bytes).get
        )
        f"${quiet.meanNs}%,.0f / ${beside.worstNs}%,.0f"
      }
      val block = times.filter(t => !t.isWrite && t.bytes == 64 && !t.beside).head
      Seq(1, 2, 4, 64).map(cell(false, _)) ++ Seq(1, 2, 4, 64).map(cell(true, _)) :+
        f"${block.mbytePerS}%.1f"
    }
    val bytes = Seq("1 byte", "2", "4", "64")
    table(
      ("Interface" +: bytes.map(b => s"Read $b")) ++ bytes.map(b => s"Write $b") :+ "MByte/s",
      HostPinSets.measured.map { case (title, p) => title +: row(r.hostTimes(p.preset)) }
    )
  }

  private def units(r: Results): String = Tables.units(
    Points.units.map(_._1),
    Points.presets.map(_.preset),
    r.units,
    a => Seq(a.logicElements, a.ffs, a.m9k),
    p => Seq(s"`$p` logic elements", "registers", "M9K")
  )

  private def unitsNote(r: Results): String = Points.presets
    .map(p => f"${r.area(p.preset).logicElements}%,d for `${p.preset}`")
    .mkString("as a whole, where synthesis works across units, it is ", ", ", "")

  /** The page. */
  def apply(r: Results): String = Wrap(text(r))

  private def text(r: Results): String = {
    val blocks = base.ramBytes + 128
    s"""# Measured figures
       |
       |Generated by `make report` from version ${r.version}; do not edit. The same figures as data:
       |[report.json](report.json); earlier ones: [report-history.csv](report-history.csv).
       |
       |## Goals
       |
       |${block(Tables.goals(Goals(r)))}
       |## Presets
       |
       |${block(presets(r))}
       |Goals are for the logic elements without carry chains.
       |
       |${clockNote(r)}
       |## Latency at each core clock
       |
       |`${base.preset}`, in ns. *Worst* and *best* are over all phases of the receive clock, from the receive
       |clock edge that samples the second half of the SFD to the core clock edge after which it is on TXD.
       |*Pin to pin* starts when the PHY puts it on RXD, half a nibble (20 ns) earlier.
       |
       |${block(clocks(r))}
       |![Latency at each core clock](report-latency.svg)
       |
       |## Where the time goes
       |
       |Core cycles in the worst phase, through the processing unit.
       |
       |${block(steps(r))}
       |${stepsNote(r)} At 25 MHz a forwarded nibble does not wait for the processing step.
       |
       |## From smoke to the page
       |
       |${block(AlarmSection.text(r.alarm))}
       |The page's times are real time on the machine that makes the report; simulated time passes far slower,
       |so the way there is measured in two parts. Not counted: debouncing, and the network between master and
       |server.
       |
       |## What a feature costs
       |
       |`${base.preset}` with one parameter changed.
       |
       |${block(features(r.area, base, Points.variants))}
       |
       |The same for the complete slave, a row per feature:
       |
       |${block(features(r.area, Points.complete, Points.completeVariants))}
       |
       |And the alarm master:
       |
       |${block(features(r.area, Points.masterVariants.head.base, Points.masterVariants))}
       |
       |And the largest controller:
       |
       |${block(features(r.area, Points.largestVariants.head.base, Points.largestVariants))}
       |
       |![Logic elements with one parameter changed](report-features.svg)
       |
       |## Host interfaces
       |
       |What each takes by itself. In the tables above there are the counter of its errors (0x030D) and what
       |synthesis makes of a host port that is not at pins beside it.
       |
       |${block(hosts(r))}
       |What an access to the process data RAM takes at the pins, ns, until the next one may begin: the mean
       |while the wire is quiet, and the longest of ${n(Measure.Accesses)} beside frames without a pause; 64
       |bytes are one access of SPI, else as many as the width needs. MByte/s is that of 64 bytes read. The
       |core clock is ${Points.complete.coreClockMhz} MHz. SPI has a quarter of it, and reads with a byte of
       |pause; the SPI clock of a bought controller, the ET1100, is 20 MHz at most. A strobe of the
       |microcontroller bus is low for six core cycles or until BUSY ends, then high for three. AXI4-Lite
       |reads whole words. A write by the microcontroller bus with 16 and 32 bits (`busWriteEarly` 0) is
       |over for its host before it is carried out; a second one waits. An access to a register waits for
       |the end of a frame that is being taken over.
       |
       |${block(hostTimes(r))}
       |## Where the area goes
       |
       |${block(units(r))}
       |![Logic elements of each unit](report-units.svg)
       |
       |Synthesised with the hierarchy kept, so that every cell belongs to a unit. The sum differs from the
       |size in the tables above:
       |${unitsNote(r)}.
       |
       |## How the figures are made
       |
       |Tools: ${r.tools.map { case (t, v) => s"$t $v" }.mkString(", ")}.
       |
       |- **LUTs, registers, M9K**: `yosys`, the stages of `synth_intel -family cycloneive`, cells counted in
       |  the flattened netlist: `cycloneive_lcell_comb`, `dffeas`, `altsyncram`. Memory is mapped by
       |  `src/flyframe/report/cyclone4/m9k.v`, which connects every port of a block, so that all logic around
       |  it counts: the map of yosys leaves the read address open. Adders and comparators are LUTs. A LUT
       |  used as inverter counts; an unmapped word-level cell such as `$$not` counts as one LUT for each bit.
       |  Every `altsyncram` is one M9K block: the program reads words and width from the parameters of each
       |  and stops if one is over ${n(Netlist.M9kBits)} bits or ${Netlist.M9kWidth} bits wide.
       |  (${n(blocks)} bytes need two blocks: they are ${n(8 * blocks)} bits, but 8 bits wide a block
       |  has 1,024 words.)
       |- **Logic elements**: one holds one LUT and one register. A register shares the logic element of the
       |  LUT that drives its D input, each LUT taking at most one register; every other register takes one of
       |  its own. So logic elements = LUTs + registers not so paired. Quartus also packs LUTs and registers
       |  that have nothing to do with each other, so the figure is on the safe side.
       |- **Logic elements with carry chains**: counted in the same way, but mapped closer to what a Cyclone
       |  IV has, by `carry.v` and `clear.v` beside it. An adder or comparator of four bits or more takes one
       |  element per bit, in arithmetic mode; comparisons with constants remain LUTs. Four registers or more
       |  that are cleared together use the synchronous clear of their elements.
       |- **ECP5 MHz**: `synth_ecp5 -no-rw-check`, as a M9K gives the old word of an address that is written
       |  at the same time without logic around it; then `nextpnr-ecp5 --85k --package CABGA756 --speed 6
       |  --freq 125`; core clock only; the median of ${Measure.Seeds.size} seeds, which differ by some per
       |  cent.
       |- **Latency**: the Verilated RTL in the network simulator (`flyframe-latency`), 400 phases of the
       |  receive clock for each direction; *processing* is from port 0 to port 1, through the processing
       |  unit, *forwarding* back from port 1 to port 0.
       |- **Detector to report**: events one after the other at random times and slaves. *RTL*: Verilated
       |  master and slaves with their host programs (`flyframe-alarm --measure`). *Model*: Verilated master,
       |  slaves in the model with the latencies above (`flyframe.master.AlarmLatency`). Every report is
       |  acknowledged.
       |- **Report to page**: a real server with its log, reports over UDP one after the other at random
       |  times, headless Chromium. A MutationObserver in the page notes the time by the clock of the same
       |  machine; *screen*: after the next frame is drawn.
       |""".stripMargin
  }
}
