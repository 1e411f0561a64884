package flyframe.campaign

import java.nio.file.{Files, Path, Paths, StandardCopyOption}
import java.security.MessageDigest
import scala.jdk.CollectionConverters._
import scala.util.Using
import flyframe.TestSets
import flyframe.cosim.Harness
import flyframe.params.EscParams

/** Builds what a campaign runs: `flyframe-fuzz`, `flyframe-smsoak`, `flyframe-faults`, the writer of vectors
  * with its jars, and `sets.json`, which tells what has been built and from what.
  */
object Programs {

  // What is computed from these can change a result, besides the Verilog.
  private val sources = Seq("src/base", "test/base/ParameterSets.scala", "test/base/campaign", "src/sim")

  private def filesOf(root: Path): Seq[Path] =
    Using.resource(Files.walk(root))(_.iterator.asScala.filter(Files.isRegularFile(_)).toVector.sorted)

  /** SHA-256 of the given files' names and contents, in hexadecimal. */
  private def hash(files: Seq[Path]): String = {
    val digest = MessageDigest.getInstance("SHA-256")
    for (file <- files; part <- Seq(file.getFileName.toString.getBytes, Files.readAllBytes(file))) {
      digest.update(s"${part.length} ".getBytes)
      digest.update(part)
    }
    digest.digest.map(b => f"$b%02x").mkString
  }

  /** Copies the jars that hold what [[Vectors]] uses, so that a later compilation does not change a campaign
    * under way. A jar of an earlier build may stay there; those that count are returned, for `sets.json`.
    */
  private def copyJars(to: Path): Seq[String] = {
    Files.createDirectories(to)
    val used =
      Seq[Class[_]](Vectors.getClass, classOf[EscParams], classOf[scopt.OParser[_, _]], classOf[Seq[_]])
    for (location <- used.map(_.getProtectionDomain.getCodeSource.getLocation).distinct) yield {
      val jar   = Paths.get(location.toURI)
      val fresh = Files.copy(jar, to.resolve("new"), StandardCopyOption.REPLACE_EXISTING)
      Files.move(fresh, to.resolve(jar.getFileName), StandardCopyOption.REPLACE_EXISTING)
      jar.getFileName.toString
    }
  }

  private def setsNamed(name: String): Seq[EscParams] = name match {
    case "fuzz"   => TestSets.fuzz.map(_._1)
    case "soak"   => TestSets.soak.map(_._1)
    case "faults" => TestSets.faults
    case _ =>
      val set = TestSets.named(name).getOrElse(stop(s"The set is $name, which no set is called."))
      if (set.role != 0) stop(s"The set is $name, which is no slave; random frames are for slaves.")
      Seq(set)
  }

  private def stop(sentence: String): Nothing = {
    Console.err.println(sentence)
    sys.exit(2)
  }

  /** Arguments: a folder below `build`, and sets, where `fuzz`, `soak` and `faults` mean all of their kind.
    */
  def main(arguments: Array[String]): Unit = {
    val sets = arguments.toSeq.drop(1).flatMap(setsNamed).distinct
    if (sets.isEmpty) stop("A folder below build and at least one set must be named.")
    new Harness(arguments.head, sets).longRuns()
    val out = Paths.get("build").resolve(arguments.head)

    val jars     = copyJars(out.resolve("jars"))
    val programs = hash(sources.map(Paths.get(_)).flatMap(filesOf))
    def kind(p: EscParams) =
      if (TestSets.soak.exists(_._1 == p)) "soak" else if (TestSets.faults.contains(p)) "faults" else "fuzz"
    val document = ujson.Obj(
      "jars" -> jars,
      "sets" -> ujson.Obj.from(sets.map { p =>
        val verilog = out.resolve(s"verilog/${p.preset}.v")
        p.preset -> ujson.Obj(
          "kind" -> kind(p),
          "hash" -> hash(Seq(verilog)).take(16).concat(programs.take(16))
        )
      })
    )
    Files.writeString(out.resolve("sets.json"), document.render(indent = 2) + "\n")
  }
}
