package flyframe

import java.io.ByteArrayOutputStream
import java.nio.file.{Files, Path}
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.params.{ParamTable, Presets}

/** The command line, and the Verilog it emits. */
class MainSpec extends AnyFlatSpec {
  private case class Result(code: Int, out: String, err: String)
  private def run(args: Any*): Result = {
    val (out, err) = (new ByteArrayOutputStream, new ByteArrayOutputStream)
    val code       = Console.withOut(out)(Console.withErr(err)(Main.run(args.map(_.toString))))
    Result(code, out.toString, err.toString)
  }

  private def files(directory: Path): Set[String] = directory.toFile.list.toSet

  /** Refused: code 2, one sentence with all of `words`, nothing written. */
  private def refused(args: Any*)(words: String*): Unit = Directory { directory =>
    val result = run(args ++ Seq("--out", directory): _*)
    assert(result.code == 2)
    assert(result.out.isEmpty)
    assert(result.err.endsWith(".\n") && result.err.count(_ == '\n') == 1, result.err)
    assert(!result.err.dropRight(2).contains(". "), result.err)
    for (word <- words) assert(result.err.contains(word), result.err)
    assert(files(directory).isEmpty)
  }

  "--help" should "show every option and parameter with default and range" in {
    val result = run("--help")
    assert(result.code == 0 && result.err.isEmpty)
    for (option <- Seq("help", "list", "preset", "all", "name", "out", "docs"))
      assert(result.out.contains(s"--$option"))
    for (i <- ParamTable.all) {
      val from = result.out.linesIterator.dropWhile(!_.contains(s"--${i.name} "))
      val line = from.next() + from.takeWhile(!_.trim.startsWith("--")).mkString(" ")
      val kinds =
        Seq("slave" -> Presets.default.params, "master" -> Presets.master, "ring node" -> Presets.ring)
      for (((kind, preset), role) <- kinds.zipWithIndex if i.roles(role) && (role == 0 || i.name != "role")) {
        val told = line.drop(line.indexOf(s"Of a $kind: ") max 0)
        for (text <- Seq(i.in(role).text, s"default ${i.show(preset)}", s"range ${i.in(role).range}"))
          assert(told.contains(text), i.name)
        assert(line.contains(s"${kind}s only") == (i.roles.size == 1), i.name)
      }
    }
  }

  "--list" should "show every preset with its text and note" in {
    val result = run("--list")
    assert(result.code == 0 && result.err.isEmpty)
    for (preset <- Presets.all; text <- Seq(preset.name, preset.text) ++ preset.note)
      assert(result.out.contains(text))
  }

  "--board" should "also emit what a board needs around the controller" in Directory { directory =>
    val result =
      run("--preset", "alarm-slave", "--name", "x", "--dataBusWidth", 16, "--board", "--out", directory)
    assert(result.code == 0, result.err)
    assert(files(directory) == Set("x.v", "x.h", "x.json", "x.core", "protocol.h", "board_support.v"))
    val text = Files.readString(directory.resolve("board_support.v"))
    assert(text.contains("module board_support(") && text.contains("[15:0] bus_d_in"))
  }
  "--board with --all" should "be refused" in refused("--all", "--board")("--all", "--board")

  "A value out of range" should "be refused" in refused("--ports", 5)("ports", "5", "1 to 4")
  "A hexadecimal value out of range" should "be refused" in
    refused("--escType", "0x100")("escType", "0x0100", "0 to 255")
  "A value out of the range of its role" should "be refused" in
    refused("--preset", "alarm-master", "--coreClockMhz", 25)(
      "coreClockMhz",
      "25",
      "50, 100, 125 MHz",
      "role is 1"
    )
  "Values that do not fit each other" should "be refused" in
    refused("--coreClockMhz", 25, "--txShift", 1)("txShift", "1", "0 to 0", "coreClockMhz 25")
  "An unknown preset" should "be refused" in
    refused("--preset", "et1201")("et1201", Presets.all.map(_.name).mkString(", "))
  "What is no number" should "be refused" in refused("--ports", "two")("ports", "two", "whole number")
  "A number beyond 32 bit" should "be refused" in refused("--ramKiB", "4294967297")("ramKiB", "4294967297")
  "A hexadecimal number without digits" should "be refused" in refused("--ports", "0x")("ports", "0x")
  "An option without its value" should "be refused" in {
    val result = run("--list", "--ports")
    assert(result.code == 2 && result.err == "Missing value after --ports.\n", result.err)
  }
  "An empty number" should "be refused" in refused("--ports", "")("ports", "whole number")
  "An unknown option" should "be refused" in refused("--portz", 2)("--portz")
  "A name that Verilog does not allow" should "be refused" in {
    for (name <- Seq("", "1st", "a.b", "../up", "a b", "ä")) refused("--name", name)("name")
  }
  "The name of the protocol's header" should "be refused" in refused("--name", "protocol")("name", "protocol")
  "--all" should "be refused together with a name or a parameter" in {
    refused("--all", "--name", "x")("--all", "--name")
    refused("--all", "--ports", 1)("--all")
  }

  "A directory that cannot be written" should "be named" in Directory { directory =>
    // Not by access rights, which do not stop root.
    val file = Files.writeString(directory.resolve("file"), "")
    for (args <- Seq(Seq("--out", file.resolve("x")), Seq("--out", directory, "--docs", file.resolve("x")))) {
      val result = run("--preset" +: "frame-processor" +: args: _*)
      assert(result.code == 2)
      assert(result.err.startsWith(file.toString) && result.err.contains("cannot be written"), result.err)
      assert(result.err.count(_ == '\n') == 1)
      assert(files(directory) == Set("file"))
    }
  }

  "Parameters" should "start from the preset, may be hexadecimal, not octal; the last counts" in Directory {
    directory =>
      val result = run(
        "--preset",
        "frame-processor",
        "--ports",
        "01",
        "--escBuild",
        "0x1f",
        "--escRevision",
        1,
        "--escRevision",
        "0x2",
        "--name",
        "my-core_1",
        "--out",
        directory.resolve("deep/er")
      )
      assert(result.code == 0, result.err)
      assert(files(directory.resolve("deep/er")) == Set("v", "h", "json", "core").map("my-core_1." + _))
      def text(end: String) = Files.readString(directory.resolve(s"deep/er/my-core_1.$end"))
      val json              = ujson.read(text("json"))
      val expected = Presets
        .named("frame-processor")
        .get
        .params
        .copy(preset = "my-core_1", ports = 1, escBuild = 31, escRevision = 2)
      assert(json("preset").str == "my-core_1" && json("top").str == "my_core_1")
      for (i <- ParamTable.told(expected)) assert(json(i.name).num.toInt == i.get(expected), i.name)
      assert("""(?m)^module my_core_1\(""".r.findAllIn(text("v")).size == 1)
      assert(text("h").contains("FLYFRAME_MY_CORE_1_H"))
  }

  "A changed preset without a name" should "not overwrite the preset" in {
    val request = Request(preset = "et1100", overrides = Seq(ParamTable.named("ports").get -> 2))
    assert(Main.resolve(request).toOption.get.map(_.preset) == Seq("et1100-custom"))
    assert(Main.resolve(Request(preset = "et1100")).toOption.get.map(_.preset) == Seq("et1100"))
  }

  // ---- the Verilog ----

  private val custom       = Presets.named("et1100").get.params.copy(preset = "mine", ports = 2, ramKiB = 1)
  private lazy val verilog = Emit.verilog(custom)
  private lazy val header  = verilog.linesIterator.takeWhile(_.startsWith("//")).toSeq
  private lazy val code    = verilog.linesIterator.map(_.takeWhile(_ != '/')).mkString("\n")

  "The Verilog" should "begin with version and parameters" in {
    assert(header.head.contains(s"flyframe ${BuildInfo.version}"))
    assert(header(1) == "// Preset mine")
    for (i <- ParamTable.told(custom))
      assert(header.exists(_.matches(s"//   ${i.name} +${i.show(custom)} .*")), i.name)
  }

  it should "warn of another maker's identity under any name" in {
    assert(header.exists(_.contains("Reports another maker's identity")))
    val own = Emit.verilog(Presets.named("frame-processor").get.params.copy(ports = 1))
    assert(!own.contains("another maker"))
  }

  it should "hold the top module once and nothing SystemVerilog alone has" in {
    assert(s"""(?m)^module ${custom.topName}\\(""".r.findAllIn(code).size == 1)
    for (
      construct <- Seq(
        """\blogic\b""",
        """\balways_\w+""",
        """'[01xz](?!\w)""",
        """\bstruct\b""",
        """\btypedef\b""",
        """\benum\b""",
        """\bassert\b""",
        """\bunique\b""",
        """\bpriority\b""",
        """\bint\b""",
        """\bbit\b""",
        """(?m)^\s*`""",
        """\bautomatic\b""",
        """\binitial\b"""
      )
    )
      assert(construct.r.findFirstIn(code).isEmpty, construct)
  }

  it should "be the same each time" in assert(Emit.verilog(custom) == verilog)
}
