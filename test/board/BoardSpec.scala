package flyframe.board

import java.nio.file.{Files, Paths}
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.report.Netlist

/** The board project in `fpga/alarm` without Quartus: both roles, every data bus width. */
class BoardSpec extends AnyFlatSpec {
  import Shell.{ends, output}
  private val widths = Seq(8, 16, 32)
  private val boards = for (role <- Seq("slave", "master"); width <- widths) yield new BoardFiles(role, width)

  /** Memory blocks of an EP4CE6. */
  private val LogicElements = 6272
  private val M9k           = 30

  /** User pins of the package by number, with their kind. */
  private val userPins: Map[Int, String] = Files
    .readString(Paths.get("test/board/ep4ce6e22.txt"))
    .linesIterator
    .filterNot(_.startsWith("#"))
    .flatMap { line =>
      val words = line.split(' ')
      words.tail.map(_.toInt -> words.head)
    }
    .toMap
  assert(userPins.size == 92)

  for (board <- boards) {
    val name = s"The ${board.role}'s board with ${board.width} bits"

    s"$name" should "have no missing module but the PLL" in {
      val modules = board.design("modules").obj
      val missing = modules.values
        .flatMap(_("cells").obj.values.map(_("type").str))
        .toSet
        .filterNot(kind => kind.startsWith("$") || modules.contains(kind))
      val boxes = modules.filter(_._2("attributes").obj.contains("blackbox")).keySet
      assert(missing.isEmpty)
      assert(boxes.map(Netlist.plainName) == Set("altpll"))
    }

    it should "lint without a warning" in assert(board.lint() == "")

    it should "have a user pin of the package for every port" in {
      val script =
        output("tclsh", "test/board/pins.tcl", "fpga/alarm/alarm.tcl", board.role, board.width.toString)
      val pins =
        script.linesIterator.map(_.split(' ')).collect { case Array("pin", n, port) => port -> n.toInt }.toSeq
      assert(pins.map(_._1).sorted == board.ports.keys.toSeq.sorted)
      assert(pins.map(_._2).distinct.size == pins.size, pins.groupBy(_._2).filter(_._2.size > 1))
      for ((port, pin) <- pins) {
        assert(userPins.get(pin).exists(_ != "memory"), s"$port on pin $pin")
        assert(userPins(pin) == "io" || board.ports(port) == "input", s"$port on pin $pin")
      }
      for (clock <- Seq("clk_50", "mii_0_rx_clk", "mii_1_rx_clk"))
        assert(userPins(pins.toMap.apply(clock)) == "in", clock)
      info(s"${pins.size} of ${userPins.values.count(_ != "memory")} pins")
    }

    it should "match every name in the constraints" in {
      val told        = output("tclsh", "test/board/timing.tcl", board.names.toString, "fpga/alarm/board.sdc")
      val constraints = told.linesIterator.map(_.split(" ", 3)).map(w => (w(0), w.last)).toSeq
      // No pin is left without one; the clocks' pins have a clock.
      val named = constraints.map(_._2).toSet
      val bare  = board.ports.keySet -- named - "clk_50" - "mii_0_rx_clk" - "mii_1_rx_clk"
      assert(bare.isEmpty)
    }
  }

  // These take longer: each role once in simulation, with different widths, and once mapped, with the default width.
  for ((role, width) <- Seq("slave" -> 8, "master" -> 32))
    s"The $role's board with $width bits" should "answer its host through the pins" in {
      val board = new BoardFiles(role, width)
      // Memory without any other effect: user RAM, request_data.
      val (address, bytes) = if (role == "slave") (0x0f80, 128) else (0x0058, 8)
      val values           = Seq("--identity" -> board.identity, "--address" -> address, "--bytes" -> bytes)
      val told =
        output(board.boardProgram +: values.flatMap { case (name, value) => Seq(name, s"$value") }: _*)
      assert(told.startsWith("5000 accesses") && told.trim.endsWith("errors 0"), told)
    }

  // Goals for the controllers alone stand in docs/report.md.
  for (role <- Seq("slave", "master"))
    s"The $role's board" should f"fit into an EP4CE6: $LogicElements%,d logic elements and its RAM" in {
      val area = Netlist.own(new BoardFiles(role, widths.head).mapped)
      info(s"${area.logicElements} logic elements, ${area.m9k} M9K")
      assert(area.logicElements <= LogicElements)
      assert(area.m9k > 0 && area.m9k <= M9k)
    }

  "The crossings of the host bus" should "all be constrained" in {
    val board = boards.head
    val told  = output("tclsh", "test/board/timing.tcl", board.names.toString, "fpga/alarm/board.sdc")
    val named = told.linesIterator.map(_.split(" ", 3).last).toSet
    val first = board.registers.filter(r => r.matches(".*Crossing:[^|]*\\|(meta|taken)[^|]*"))
    assert(first.size > 13 + 8 + 3)
    for (register <- first if !register.contains("ResetCrossing"))
      assert(named(register), register)
  }

  for (board <- boards if board.role == "slave")
    s"HB-01 to HB-06: a host bus of ${board.width} bits" should "carry out 100,000 accesses, each once and right" in {
      val told = output(board.busProgram, "--accesses", "100000", "--seed", s"${board.width}")
      assert(told.startsWith("accesses 100000 ") && told.trim.endsWith("errors 0"), told)
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
