package flyframe.campaign

import java.io.{BufferedOutputStream, PrintStream}
import scopt.OParser
import flyframe.TestSets
import flyframe.model.FuzzVectors
import flyframe.params.EscParams

/** Writes the vectors of random frames for one set to standard output. The same set, seed and number give the
  * same vectors; a larger number gives those and more.
  */
object Vectors {
  private final case class Options(set: Option[EscParams] = None, seed: Long = 1, frames: Int = 1)

  /** `--set NAME --seed N --frames N`; exit code 2 and one sentence for an impossible argument. */
  def main(arguments: Array[String]): Unit = {
    val builder = OParser.builder[Options]
    import builder._
    val parser = OParser.sequence(
      programName("Vectors"),
      opt[String]("set")
        .required()
        .action((name, o) => o.copy(set = TestSets.named(name)))
        .validate(name =>
          if (TestSets.named(name).isDefined) success else failure(s"set is $name, which no set is called.")
        ),
      opt[Long]("seed").required().action((v, o) => o.copy(seed = v)),
      opt[Int]("frames")
        .required()
        .action((v, o) => o.copy(frames = v))
        .validate(v => if (v > 0) success else failure(s"frames is $v but must be 1 or more."))
    )
    for (o <- OParser.parse(parser, arguments, Options()).orElse(sys.exit(2)); set <- o.set) {
      val out = new PrintStream(new BufferedOutputStream(System.out, 1 << 16))
      FuzzVectors.write(set, o.seed, o.frames, out)
      out.close()
    }
  }
}
