package flyframe.board

import java.nio.file.{Files, Paths}
import scala.jdk.CollectionConverters._
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.{Directory, PortTable, TestSets, Tier}
import flyframe.params.{EscParams, Presets}
import flyframe.report.{Device, Goals, Netlist}

/** The board project in `fpga/alarm` without Quartus: both roles, every data bus width. */
class BoardSpec extends AnyFlatSpec with BoardBehaviour {
  import Shell.{ends, output}
  private val widths = Seq(8, 16, 32)
  private val page   = Files.readString(Paths.get("fpga/README.md")).replaceAll("\\s+", " ")
  private val lines  = for (role <- Seq("slave", "master"); width <- widths) yield new AlarmBoard(role, width)
  private val rings  = for (width <- Seq(8, 16)) yield new AlarmBoard("master", width, linePorts = 2)
  private val rmii = Seq(
    new AlarmBoard("slave", 8, rmii = true),
    new AlarmBoard("master", 16, linePorts = 2, rmii = true)
  )
  private val boards = lines ++ rings ++ rmii

  /** The goals for whole boards with a host bus of 8 bits, logic elements. */
  private val goals = Seq(
    new AlarmBoard("slave", 8)                 -> Goals.AlarmSlave,
    new AlarmBoard("master", 8)                -> Goals.AlarmMaster,
    new AlarmBoard("master", 8, linePorts = 2) -> Goals.AlarmMaster
  ).map { case (board, most) => board -> (most + Goals.Board) }

  /** User pins of the package by number, with their kind. */
  private val userPins = BoardFiles.userPins("ep4ce6e22")
  assert(userPins.size == 92)

  for (board <- boards) {
    board.name should behave like aBoard(board, userPins)

    it should "have as many pins as fpga/README.md says" in {
      val free = userPins.values.count(_ != "memory")
      assert(page.contains(s"has ${userPins.size} user pins") && page.contains(s"so $free remain"))
      val number =
        """takes (\d+), (\d+) or (\d+) of them.*?; a ring has (\d+) more\. RMII saves (\d+) at each port""".r
          .findFirstMatchIn(page)
          .get
      def told(i: Int) = number.group(i).toInt
      val ring         = if (board.isRing) told(4) else 0
      val saved        = if (board.rmii) told(5) * (1 + board.linePorts) else 0
      assert(board.pins.size == told(1 + widths.indexOf(board.width)) + ring - saved)
    }

    it should "have each port's pins, and with RMII the clock that takes them, constrained" in {
      val delayed = board.constraints.collect { case ("input" | "output", name) => name.takeWhile(_ != '_') }
      assert(delayed.toSet == Set(if (board.rmii) "rmii" else "mii"))
    }
  }

  "The project script" should "say in a sentence which core clock is missing or wrong" in {
    val dir  = Directory.lasting("flyframe-board")
    val json = dir.toRealPath().resolve("alarm-slave.json")
    def refusal =
      ends("tclsh", "test/flyframe/board/pins.tcl", "fpga/alarm/alarm.tcl", "slave", "8", dir.toString)
    val missing = s"$json with coreClockMhz is missing: generate the controller again.\n"
    assert(refusal == (1 -> missing))
    Files.writeString(json, "{}")
    assert(refusal == (1 -> missing))
    Files.writeString(json, "{\n  \"coreClockMhz\": 125,\n}")
    assert(refusal == (1 -> "coreClockMhz is 125 but must be 50 or 100 on the alarm board.\n"))
  }

  "A preset alone" should "have its core clock as generated in the constraints" in {
    val preset = "alarm-master"
    val core   = ujson.read(Files.readString(Paths.get(s"generated/$preset.json")))("coreClockMhz").num.toInt
    val told   = output("tclsh", "test/flyframe/board/pins.tcl", "fpga/quartus.tcl", preset)
    assert(told.linesIterator.contains("global SDC_FILE clock.sdc"))
    val sdc = Files.readString(Paths.get(s"build/quartus/$preset/clock.sdc")).linesIterator.toSeq
    assert(sdc.contains(s"set core_mhz $core"))
    assert(sdc.last == s"source {${Paths.get("fpga/flyframe.sdc").toRealPath()}}")
  }

  it should "be made for the device that is asked for, if it is one" in {
    def made(device: String) =
      ends("tclsh", "test/flyframe/board/pins.tcl", "fpga/quartus.tcl", "ring-node", device)
    assert(made("EP4CE10E22C8")._2.linesIterator.contains("global DEVICE EP4CE10E22C8"))
    for (device <- Seq("EP4CE10E22C8N", "5CEBA4"))
      assert(
        made(device) ==
          (1 -> s"DEVICE is $device but must be a Cyclone IV E, such as EP4CE10E22C8.\n")
      )
  }

  /** What the constraints of a controller alone name, by its ports. */
  private def constrained(p: EscParams): Set[String] = {
    val dir   = Directory.lasting("flyframe-board")
    val ports = PortTable(p).flatMap(_.names(p)).map(n => s"port {$n}")
    // Of the crossings one register each: only pins are looked at here.
    val registers = Seq("writeSide|gray", "writeSide|storage_0", "readSide|meta", "LevelCrossing:c|meta") ++
      Seq("received[0]", "firstBit", "bits[0]").map("SpiShift:s|" + _) ++ Seq("SpiInterface:h|next[0]") ++
      Seq("meta_ne", "taken_a[0]").map("MemoryBusCrossing:c|" + _)
    val names = Files.write(dir.resolve("names"), (ports ++ registers.map(r => s"register {$r}")).asJava)
    val file = Files.writeString(
      dir.resolve("a.sdc"),
      s"set core_mhz ${p.coreClockMhz}\nset tx_shift ${p.txShift}\n" +
        s"source {${Paths.get("fpga/flyframe.sdc").toRealPath()}}"
    )
    output("tclsh", "test/flyframe/board/timing.tcl", names.toString, file.toString).linesIterator.toSet
  }

  "Ports with RMII" should "have every pin constrained, against the clock of the PHY" in {
    val told = constrained(Presets.named("slave").get.params.copy(rmiiPorts = 0x3))
    for (y <- 0 to 1; edge <- Seq("min", "max")) {
      for (pin <- Seq("crs_dv", "rx_er", "rxd")) assert(told(s"input $edge rmii_${y}_$pin"))
      for (pin <- Seq("tx_en", "txd")) assert(told(s"output $edge rmii_${y}_$pin"))
      assert(told(s"false from rmii_${y}_link"))
    }
  }

  "Every pin of every preset" should "be constrained, and those that no preset has" in {
    val most = Presets.allRegisters.copy(clocks = 2, syncSignals = 2, latchSignals = 2, fxPorts = 0x1)
    for (
      p <- Presets.all.map(_.params) ++ Seq(most, most.copy(sii = 0), Presets.master.copy(linePorts = 2)) ++
        (0 to 5).map(interface => most.copy(preset = s"host $interface", hostInterface = interface)) ++
        TestSets.digital :+ Presets.ring.copy(canPorts = 2)
    ) {
      val told  = constrained(p).map(_.split(' ').last)
      val plain = PortTable(p).flatMap(_.names(p)).filterNot(n => n == "clock" || n.endsWith("_clk"))
      assert(plain.filterNot(told) == Nil, p.preset)
    }
    val told = constrained(most)
    for (pin <- Seq("mi_mdc", "mi_mdio_out", "mi_mdio_enable", "phy_port_reset_n_3", "reset_request"))
      assert(told(s"false to $pin"))
    for (pin <- Seq("mi_mdio_in", "clock_signals_latch_1")) assert(told(s"false from $pin"))
    for (n   <- 0 to 1) assert(told(s"max=15 to clock_signals_sync_$n"))
  }

  // These take longer: each role once in simulation, with different widths, and mapped with the default
  // width.
  for ((role, width) <- Seq("slave" -> 8, "master" -> 32))
    s"The $role's board with $width bits" should "answer its host through the pins" in {
      val board = new AlarmBoard(role, width)
      // Memory without any other effect: user RAM, request_data.
      val (address, bytes) = if (role == "slave") (0x0f80, 128) else (0x0058, 8)
      val values           = Seq("--identity" -> board.identity, "--address" -> address, "--bytes" -> bytes)
      val told =
        output(board.boardProgram +: values.flatMap { case (name, value) => Seq(name, s"$value") }: _*)
      assert(told.startsWith("5000 accesses") && told.trim.endsWith("errors 0"), told)
      info(told.trim)
    }

  // The master's boards in `make soak` only: mapping them takes minutes.
  for ((board, most) <- goals if Tier.isSoak || board.role != "master")
    board.name should f"fit into an EP4CE6: at most $most%,d logic elements, and its RAM" in {
      val area = Netlist.own(board.mapped)
      info(s"${area.logicElements} logic elements, ${area.m9k} M9K")
      assert(area.logicElements <= most)
      assert(area.m9k > 0 && area.m9k <= Device.named(board.device).m9k)
    }

  for (board <- boards)
    s"HB-01 to HB-06: ${board.name} at ${board.coreClockMhz} MHz" should "do all accesses once" in {
      val count = if (Tier.isSoak) 100000 else 20000
      val told  = output(board.busProgram, "--accesses", s"$count", "--seed", s"${board.width}")
      assert(told.startsWith(s"accesses $count ") && told.trim.endsWith("errors 0"), told)
      info(told.trim)
    }

  "make quartus" should "say in a sentence that Quartus is missing" in {
    val (code, text) = ends("make", "-s", "quartus", "QUARTUS=no-such-quartus")
    assert(code == 2)
    assert(
      text.linesIterator
        .next() == "Quartus is needed to compile the board, but no-such-quartus is not on PATH."
    )
  }

  it should "take role and parameters from the command line" in {
    val text =
      output("make", "-n", "quartus", "ROLE=master", "dataBusWidth=8", "maxSubTelegrams=4", "nodeIdWidth=12")
    for (
      word <- Seq(
        "--preset alarm-master",
        "--dataBusWidth 8",
        "--maxSubTelegrams 4",
        "--nodeIdWidth 12",
        "alarm.tcl master 8"
      )
    ) assert(text.contains(word), word)
  }
}
