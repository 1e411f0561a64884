package flyframe

import flyframe.fibre.Reach
import flyframe.registers.CanRegisters
import flyframe.relay.LinkFrame
import scopt.{OEffect, OParser, OParserBuilder}

/** A ring to be planned.
  *
  * @param metres
  *   of fibre all round, the gap included
  */
final case class RingPlan(nodes: Int = 0, metres: Int = 0, coreClockMhz: Int = 100) {

  /** What it can do, line by line. */
  def lines: Seq[String] = Seq(
    f"A ring of $nodes nodes and $metres%,d m of fibre, core clocks of $coreClockMhz MHz:",
    busMode,
    "Relay mode, a frame to the farthest node when nothing else is sent (FR-46):"
  ) ++ Seq(2000, 1000, 400).map(relayMode)

  /** FR-38 */
  private def busMode: String = {
    // Not above 1 Mbit/s.
    val least = Reach.prescaler(metres, nodes, coreClockMhz, quanta) max (coreClockMhz / quanta)
    val usual = Reach.Rates.find(Reach.metres(_, nodes, coreClockMhz) >= metres)
    if (least > RingPlan.MostPrescaler) "Bus mode: too long for any bit rate (FR-38)."
    else
      f"Bus mode (FR-38): at most ${rate(least)}%.1f kbit/s with ${timing(least)}" +
        usual.fold("; slower than all usual rates.")(kbps =>
          s"; of the usual rates $kbps kbit/s with ${timing(RingPage.prescaler(coreClockMhz, kbps))}."
        )
  }

  private def quanta = RingPage.timing.length

  private def rate(prescaler: Long) = coreClockMhz * 1000.0 / (quanta * prescaler)

  private def timing(prescaler: Long) = {
    val value = prescaler - 1 | RingPage.timingBytes.toLong << 16
    val bytes = (0 until 4).map(i => f"0x${value >> 8 * i & 0xff}%02X").mkString(" ")
    f"$bytes at 0x${CanRegisters.PortStarts.head + CanRegisters.Timing}%04X"
  }

  private def relayMode(kbps: Int): String = {
    def ms(hops: Int, metres: Int) =
      (hops * RingPlan.BitsOfNode + LinkFrame.MostLevels).toDouble / kbps + metres * Reach.NsPerMetre / 1e6
    val (whole, broken) = (ms(nodes / 2, metres / 2), ms(nodes - 1, metres))
    f"  at $kbps%,d kbit/s at most $whole%.2f ms, broken $broken%.2f ms"
  }
}

/** `make ring-plan`: prints the plan. Exit code 0, or 2 with one sentence on standard error. */
object RingPlan {
  private val BitsOfNode = 60 // FR-46
  private val MostNodes  = 125
  private val MostMetres = 1000000

  /** Core cycles of a quantum (CAN-01). */
  private val MostPrescaler = 2048

  /** The ring that arguments ask for, or why there is none. */
  def parse(arguments: Seq[String]): Either[String, RingPlan] = {
    val builder: OParserBuilder[RingPlan] = OParser.builder[RingPlan]
    import builder._
    def in(name: String, value: Int, range: Range) =
      if (range.contains(value)) success
      else failure(f"$name is $value but must be from ${range.start} to ${range.end}%,d.")
    val parser = OParser.sequence(
      programName("ring-plan"),
      opt[Int]("nodes")
        .required()
        .validate(in("nodes", _, 2 to MostNodes))
        .action((n, r) => r.copy(nodes = n)),
      opt[Int]("metres")
        .required()
        .validate(in("metres", _, 0 to MostMetres))
        .action((m, r) => r.copy(metres = m)),
      opt[Int]("mhz")
        .validate(m => if (m == 50 || m == 100) success else failure(s"mhz is $m but must be 50 or 100."))
        .action((m, r) => r.copy(coreClockMhz = m))
    )
    val (result, effects) = OParser.runParser(parser, arguments, RingPlan())
    // Some of the library's own sentences end without a full stop.
    result.toRight(effects.collectFirst { case OEffect.ReportError(text) => text.stripSuffix(".") + "." }.get)
  }

  def main(arguments: Array[String]): Unit = parse(arguments.toSeq) match {
    case Right(ring) => ring.lines.foreach(println)
    case Left(why) =>
      System.err.println(why)
      sys.exit(2)
  }
}
