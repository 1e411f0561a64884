package flyframe.board

import java.nio.file.{Files, Paths}
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.params.EscParams
import flyframe.report.{Area, Device, Goals}
import flyframe.{Directory, Documents, Tier}

/** The board project in `fpga/ring` without Quartus. */
class RingBoardSpec extends AnyFlatSpec with BoardBehaviour {
  import Shell.{ends, output}
  private val roles = Seq("bus", "node", "node-tp", "server", "gateway")
  private val page  = Files.readString(Paths.get("fpga/README.md"))

  /** What `make quartus` would run last, in words. */
  private def made(settings: String*): Seq[String] =
    output(Seq("make", "-s", "-n", "quartus", "BOARD=ring", "QUARTUS=true") ++ settings: _*)
      .split('\n')
      .last
      .split(' ')
      .toSeq
  private def board(role: String, width: Int) = new RingBoard(role, width, Seq(made(s"ROLE=$role").last))
  private val boards                          = roles.map(board(_, 8)) :+ board("node-tp", 16)

  // A layout for all: what an EP4CE15 has no pin for is not used in the others either.
  private val all     = BoardFiles.userPins("ep4ce15e22")
  private val smaller = BoardFiles.userPins("ep4ce6e22")
  assert(all.keySet.subsetOf(smaller.keySet))

  for (board <- boards if Tier.isSoak || board.role != "node" && board.role != "bus") {
    board.name should behave like aBoard(board, all)

    it should "leave the pin alone that tells of a damaged configuration" in {
      assert(board.project.contains("global CRC_ERROR_CHECKING ON"))
      assert(!board.pins.exists(_._2 == 99))
    }
  }

  for (board <- boards)
    board.name should "have the pins and the device of fpga/README.md" in {
      val row =
        s"\\| `${board.role}` \\| ${board.width} \\| (\\d+) \\| (\\w+) \\|".r.findFirstMatchIn(page).get
      assert((board.pins.size, board.device) == (row.group(1).toInt, row.group(2)))
    }

  // Sizes are those of the report, and of what a board has beside its preset those of the goals.
  for (board <- boards.filter(_.width == 8))
    board.name should s"fit into its device, and into no smaller one" in {
      val entry =
        ujson.read(Files.readString(Paths.get("docs/ring-report.json")))("presets")(s"ring-${board.role}")
      val size = entry("logic_elements").num.toInt + Goals.Board
      val area = Area(luts = size, m9k = entry("m9k").num.toInt)
      val fits = Device.all.find(_.fits(area)).get
      assert(Device.named(board.device) == fits, s"$size logic elements")
    }

  for (
    role <- Seq("gateway") ++ Option.when(Tier.isSoak)("node-tp"); board = boards.filter(_.role == role).last
  )
    board.name should "answer its host through the pins, and bring its optical ports up" in {
      val node = if (role == "gateway") EscParams.RingSpace else 0
      val told = output(board.boardProgram, "--node", s"$node", "--identity", s"${EscParams.NodeType}")
      assert(told.startsWith("2000 accesses") && told.trim.endsWith("errors 0"), told)
      info(told.trim)
    }

  "The project script of the ring" should "say in a sentence what is wrong" in {
    val dir = Directory.lasting("flyframe-board")
    def refusal(role: String, width: Int, device: String) = {
      Files.writeString(dir.resolve(s"ring-$role.json"), Documents.json(board(role, 8).p))
      ends("tclsh", "test/flyframe/board/pins.tcl", "fpga/ring/ring.tcl", role, s"$width", device, s"$dir")
    }
    assert(
      refusal("gateway", 16, "EP4CE15E22C8") ==
        (1 -> "dataBusWidth is 16 but must be 8 on the ring board with ROLE gateway.\n")
    )
    assert(
      refusal("server", 32, "EP4CE10E22C8") ==
        (1 -> "dataBusWidth is 32 but must be 8 or 16 on the ring board with ROLE server.\n")
    )
    val other = "device is EP4CE22F17C6 but must be an EP4CE6, EP4CE10 or EP4CE15 with E22 on the ring board."
    assert(refusal("server", 8, "EP4CE22F17C6") == (1 -> s"$other\n"))
  }

  "make quartus" should "take the board, its role and its parameters from the command line" in {
    assert(
      made("ROLE=server", "dataBusWidth=16").tail == Seq(
        "-t",
        "fpga/ring/ring.tcl",
        "server",
        "16",
        "EP4CE10E22C8"
      )
    )
    val text = output("make", "-n", "quartus", "BOARD=ring", "ROLE=gateway", "rxFrames=16", "filters=4")
    for (word <- Seq("--preset ring-gateway", "--rxFrames 16", "--filters 4", "--coreClockMhz 100"))
      assert(text.contains(word), word)
    def clock(more: String*) =
      output(Seq("make", "-n", "quartus", "BOARD=ring") ++ more: _*)
        .split("--coreClockMhz ")(1)
        .takeWhile(_.isDigit)
    assert(
      (clock("ROLE=server"), clock("ROLE=node"), clock("ROLE=node", "coreClockMhz=50")) == ((
        "50",
        "100",
        "50"
      ))
    )
  }

  it should "say in a sentence that there is no such board" in {
    val (code, text) = ends("make", "-s", "quartus", "BOARD=wheel")
    assert(code == 2 && text.contains("BOARD is wheel but must be alarm or ring."), text)
  }
}
