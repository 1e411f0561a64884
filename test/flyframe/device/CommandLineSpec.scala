package flyframe.device

import java.io.ByteArrayOutputStream
import java.nio.file.{Files, Path}
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.{Directory, Main}

/** The command line's part of ESI and SII. */
class CommandLineSpec extends AnyFlatSpec {
  private def file(name: String, bytes: Seq[Int]): Path = {
    val path = Directory.lasting().resolve(name)
    Files.write(path, bytes.map(_.toByte).toArray)
  }

  /** Exit code, standard output and standard error. */
  private def run(args: String*): (Int, String, String) = {
    val (out, err) = (new ByteArrayOutputStream, new ByteArrayOutputStream)
    val code       = Console.withOut(out)(Console.withErr(err)(Main.run(args)))
    (code, out.toString, err.toString)
  }

  private val image = DeviceSii.image(Devices.io, 2)

  "--print-sii" should "print an image with exit code 0" in {
    val (code, out, err) = run("--print-sii", file("good.bin", SiiCodec.encode(image)).toString)
    assert(code == 0 && err.isEmpty && out == SiiText.print(image))
  }

  it should "print the images of real devices" in {
    for (name <- Devices.realImages) {
      val (code, out, _) = run("--print-sii", Devices.realPath(name).toString)
      assert(code == 0 && out.contains(s"    1  ${name.toUpperCase}\n"))
    }
  }

  it should "refuse what is no image with one sentence and exit code 2" in {
    val bad = Seq(
      file("empty.bin", Nil),
      file("short.bin", SiiCodec.encode(image).take(200)),
      file("garbage.bin", "no image at all".map(_.toInt)),
      file("checksum.bin", SiiCodec.encode(image).updated(14, 0)),
      file("large.bin", Seq.fill(SiiCodec.MaxBytes + 1)(0)),
      Directory.lasting().resolve("absent.bin"),
      Directory.lasting()
    )
    for (path <- bad) {
      val (code, out, err) = run("--print-sii", path.toString)
      assert(
        code == 2 && out.isEmpty && err.startsWith(s"$path: ") && err.endsWith(".\n") && err.count(
          _ == '\n'
        ) == 1,
        err
      )
    }
  }

  "--device" should "refuse a wrong file with one sentence and exit code 2, writing nothing" in {
    val out = Directory.lasting().resolve("out")
    val wrong = Seq(
      file("broken.json", "{".map(_.toInt)),
      file("many.json", Devices.json("io")(_("fmmus") = Seq.fill(17)("unused")).map(_.toInt)),
      file("beyond.json", Devices.json("io")(_("syncManagers")(0)("start") = "0xfff8").map(_.toInt)),
      // Two PDOs with the same entry.
      file(
        "overlap.json",
        Devices.json("io")(d => d("txPdos")(0)("entries") = d("rxPdos")(0)("entries")).map(_.toInt)
      ),
      Directory.lasting().resolve("absent.json")
    )
    for (path <- wrong) {
      val (code, _, err) =
        run("--preset", "frame-processor", "--device", path.toString, "--out", out.toString)
      assert(code == 2 && err.endsWith(".\n") && err.count(_ == '\n') == 1 && !Files.exists(out), err)
    }
  }

  it should "not go with --all" in
    assert(run("--all", "--device", "x.json")._1 == 2)

  "A controller that lacks SyncManagers" should "get no ESI and SII files, and refuse a chosen device" in {
    val p = Devices.params.copy(ramKiB = 0)
    assert(DeviceFiles.of(p, None) == Right(Nil))
    assert(DeviceFiles.of(p, Some(Devices.io)).isLeft)
  }

  "The files of a controller" should "be NAME.xml and NAME.sii.bin" in {
    val files = DeviceFiles.make(Devices.io, Devices.params, 2, 2).fold(s => fail(s), identity).toMap
    assert(files.keySet == Set("cyclone4-min.xml", "cyclone4-min.sii.bin"))
    assert(files("cyclone4-min.sii.bin").toSeq.map(_ & 0xff) == SiiCodec.encode(image))
    assert(new String(files("cyclone4-min.xml"), "UTF-8") == Esi.xml(Devices.io, Devices.params, 2, 2))
  }
}
