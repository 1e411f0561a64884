package flyframe.replay

import java.nio.file.{Files, Path, Paths}
import org.scalatest.flatspec.AnyFlatSpec
import scala.sys.process._
import flyframe.cosim.Harness
import flyframe.params.{EscParams, Presets}
import flyframe.registers.RegisterMap
import flyframe.rules.Reply

/** Traffic recorded on silicon, replayed through the RTL: everything that addresses what is built must come
  * back as it did then.
  */
class ReplaySpec extends AnyFlatSpec {
  private val captures = Paths.get("../shared/captures")

  // The slaves of the recordings, as far as their identity is known. They exist for replay only.
  private val et1100 = Presets.named("et1100").get.params.copy(ports = 2, maxSubTelegrams = 128)
  private val ek1100 = et1100.copy(preset = "ek1100")
  private val el1004 = et1100.copy(
    preset = "el1004",
    escType = 0x12,
    escRevision = 1,
    escBuild = 1,
    fmmus = 3,
    syncManagers = 4,
    ramKiB = 1,
    reportedPorts = 0x4a,
    reportedFeatures = 0x01fc
  )
  private val el2828 = el1004.copy(preset = "el2828")
  private val el2889 = el1004.copy(preset = "el2889", reportedFeatures = 0x00fc)
  private val lan9252 = et1100.copy(
    preset = "lan9252",
    escType = 0xc0,
    escRevision = 2,
    escBuild = 1,
    fmmus = 3,
    syncManagers = 4,
    ramKiB = 4,
    reportedPorts = 0x1f,
    reportedFeatures = 0x01cc
  )
  private val harness = new Harness("replay", Seq(ek1100, el2828, el2889, el1004, lan9252))

  private val built: Set[Int] = RegisterMap(et1100).flatMap(_.range).toSet

  /** What is not built yet, by address. */
  private def group(d: Reply): String =
    if (d.command >= 10 && d.command <= 12) "FMMU (logical addressing)"
    else
      d.ado match {
        case a if a >= 0x1000 => "SyncManager (process data RAM)"
        case a if a >= 0x0f00 => "I/O"
        case a if a >= 0x0900 => "distributed clocks"
        case a if a >= 0x0800 => "SyncManager"
        case a if a >= 0x0600 => "FMMU"
        case a if a >= 0x0510 => "MII management"
        case a if a >= 0x0500 => "SII EEPROM"
        case a if a >= 0x0400 => "watchdogs"
        case a if a >= 0x0200 => "events"
        case a if a >= 0x0140 => "PDI and ESC configuration"
        case _                => "AL state machine"
      }

  /** Without bits of units not built: PDI watchdog and enhanced link detection in DL status; what the SII
    * EEPROM presets in the upper half of 0x0102.
    */
  private def comparable(address: Int, byte: Int): Int = address match {
    case 0x0110 => byte & ~0x06
    case 0x0102 => byte & 0x0f
    case _      => byte
  }

  private def isBuilt(d: Reply): Boolean =
    d.command == 0 || (d.command <= 9 && (d.ado until d.ado + d.length).exists(built) && built(d.ado))

  private def differs(expected: Reply, actual: Reply): Option[String] = {
    val problems = Seq(
      Option.when(expected.adp != actual.adp)(f"ADP 0x${expected.adp}%04x, got 0x${actual.adp}%04x"),
      Option.when(expected.workingCounter != actual.workingCounter)(
        s"working counter ${expected.workingCounter}, got ${actual.workingCounter}"
      )
    ).flatten ++ expected.data.zip(actual.data).zipWithIndex.collect {
      case ((e, a), i)
          if built(expected.ado + i) && comparable(expected.ado + i, e) != comparable(expected.ado + i, a) =>
        f"byte 0x${expected.ado + i}%04x is 0x$e%02x, got 0x$a%02x"
    }
    Option.when(problems.nonEmpty)(problems.mkString("; "))
  }

  private def network(name: String, slaves: Seq[(EscParams, Option[String])]): Path = {
    val list = slaves.map { case (p, image) =>
      val eeprom = image
        .map(i => s""", "eeprom": "${captures.toAbsolutePath.normalize.resolve(s"sii/$i")}"""")
        .getOrElse("")
      s"""{"preset": "${p.preset}"$eeprom, "clock_ppm": ${(p.preset.hashCode & 0x3f) - 32}}"""
    }
    Files.createDirectories(Paths.get("build/replay"))
    Files.writeString(Paths.get(s"build/replay/$name.json"), list.mkString("{\"slaves\": [", ", ", "]}\n"))
  }

  /** What tshark's dissectors find wrong. */
  private def complaints(file: Path): Seq[String] = {
    val fields = Seq("-T", "fields", "-e", "_ws.expert.message", "-e", "_ws.malformed")
    val filter = "_ws.malformed || _ws.expert.severity >= 0x600000"
    (Seq("tshark", "-r", file.toString, "-Y", filter) ++ fields)
      .!!(ProcessLogger(_ => ()))
      .linesIterator
      .toSeq
      .distinct
  }

  private def replay(name: String, slaves: Seq[(EscParams, Option[String])]): Unit =
    s"Recording $name" should "come back as from the silicon, in what is built" in {
      val recording = captures.resolve(s"$name.pcapng")
      assume(Files.exists(recording), s"no recording at $recording: skipped")
      val result = Paths.get(s"build/replay/$name.pcap")
      harness.replay(network(name, slaves), recording, result)

      val frames           = Recording.read(recording)
      val (sent, answered) = frames.partition(_.fromMaster)
      val expected         = Recording.pair(sent, answered)
      val actual           = Recording.pair(sent, Recording.read(result))
      val triples = for {
        ((_, e), a) <- sent.zip(expected).zip(actual)
        e           <- e.toSeq
        (d, i)      <- e.datagrams.zipWithIndex
      } yield (d, a.map(_.datagrams(i)))

      val (covered, open) = triples.partition { case (d, _) => isBuilt(d) }
      // DL status is watched while links settle: what the watching ends with counts (captures/README.md).
      val (watched, steady) = covered.partition { case (d, _) =>
        d.command <= 9 && d.ado >= 0x0110 && d.ado <= 0x0111
      }
      val lastWatched = watched.groupBy { case (d, _) => (d.command, d.adp, d.ado) }.values.map(_.last)
      val differences = (steady ++ lastWatched).flatMap {
        case (e, Some(a)) => differs(e, a).map(p => f"command ${e.command} ADO 0x${e.ado}%04x: $p")
        case (e, None)    => Some(f"command ${e.command} ADO 0x${e.ado}%04x: the frame did not come back")
      }
      info(
        s"${sent.size} frames sent, ${expected.count(_.isDefined)} answered then, ${actual.count(_.isDefined)} now"
      )
      info(s"${covered.size} datagrams address what is built, ${differences.size} differ")
      open.groupBy(t => group(t._1)).toSeq.sortBy(-_._2.size).foreach { case (g, ds) =>
        info(s"not covered yet: $g, ${ds.size} datagrams")
      }
      assert(covered.nonEmpty)
      assert(actual.zip(expected).forall { case (a, e) => a.isDefined || e.isEmpty }, "frames were lost")
      assert(differences.isEmpty, differences.distinct.take(20).mkString("\n", "\n", "\n"))

      // SOEM sends from a group address, which tshark finds wrong in the recording too.
      assert(complaints(result).toSet -- complaints(recording) == Set.empty, "tshark complains")
    }

  replay("soem-single-lan9252", Seq(lan9252 -> None))
  private val three =
    Seq(ek1100 -> Some("ek1100.bin"), el2828 -> Some("el2828.bin"), el2889 -> Some("el2889.bin"))
  replay("replay-ek1100-el2828-el2889", three)
  replay("replay-dc", three)
  replay("twincat-scan-boxes", Seq(ek1100 -> Some("ek1100.bin"), el1004 -> None))
}
