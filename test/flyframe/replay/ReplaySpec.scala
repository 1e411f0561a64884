package flyframe.replay

import java.nio.file.{Files, Path, Paths}
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.Recordings
import flyframe.cosim.Harness
import flyframe.params.{EscParams, Presets}
import flyframe.rules.Reply

/** Traffic recorded on silicon, replayed through the RTL at the recorded times: every datagram must come back
  * as it did then, in working counter, position address and data, but for the reasons listed here; times in
  * kind ([[Times]]).
  */
class ReplaySpec extends AnyFlatSpec {
  private val folder = Paths.get("build/replay")

  // The slaves of the recordings use two ports.
  private val ek1100  = Presets.named("et1100").get.params.copy(preset = "ek1100", ports = 2)
  private val el1004  = Presets.named("et1200").get.params.copy(preset = "el1004")
  private val el2828  = el1004.copy(preset = "el2828", digitalOutputs = 4)
  private val el2889  = el2828.copy(preset = "el2889", reportedFeatures = 0x00fc, clockPowerSaving = 0)
  private val lan9252 = Presets.named("lan9252").get.params
  private val harness = new Harness("replay", Seq(ek1100, el2828, el2889, el1004, lan9252))

  /** Watchers of something slow: what the poll ends with counts. */
  private val watched = Seq(
    Watched("AL status", 0x0130 to 0x0131, Seq(0x0120 to 0x0131)),
    Watched("EEPROM busy", 0x0502 to 0x0503, Seq(0x0500 to 0x050f)),
    Watched("DL status", 0x0110 to 0x0111, Seq(0x0100 to 0x0103)),
    Watched("mailbox status", 0x0805 to 0x0805, Seq(0x1000 to 0x1fff), readsEnd = true),
    Watched("mailbox status", 0x080d to 0x080d, Seq(0x1000 to 0x1fff), readsEnd = true)
  )

  private object Reason {
    val Watching = "a watcher of something slow, before what it waits for"
    val Reserved = "0x0502[4]: a reserved bit"
    val EightBytes =
      "0x0502[6]: EEPROM reads return eight bytes, the LAN9252's four"
    val Mask    = "IRQ field: 0x0200 had been set before the recording began"
    val Outside = "IRQ field: DL status changed from outside, a link or the PDI watchdog"
    val all     = Seq(Watching, Reserved, EightBytes, Mask, Outside)
  }

  /** What differs in one datagram, with the reason if one is listed. */
  private case class Difference(text: String, reason: Option[String])

  /** Why a byte may differ in these bits. */
  private def byteReason(address: Int, bits: Int): Option[String] = address match {
    case 0x0502 if bits == 0x10 => Some(Reason.Reserved)
    case 0x0502 if bits == 0x40 => Some(Reason.EightBytes)
    case _                      => None
  }

  private def compare(
      d: Addressed,
      actual: Reply,
      irqReason: Option[String]
  ): Seq[Difference] = {
    val e       = d.reply
    val logical = e.command >= 10 && e.command <= 12
    val where   = f"frame ${d.frame} command ${e.command} ADP 0x${e.adp}%04x ADO 0x${e.ado}%04x: "
    val frame = Seq(
      Option.when(e.adp != actual.adp)(Difference(where + f"ADP is 0x${actual.adp}%04x", None)),
      Option.when(e.irq != actual.irq)(
        Difference(where + f"IRQ is 0x${e.irq}%04x, got 0x${actual.irq}%04x", irqReason)
      ),
      Option.when(e.workingCounter != actual.workingCounter)(
        Difference(where + s"working counter ${e.workingCounter}, got ${actual.workingCounter}", None)
      )
    ).flatten
    frame ++ e.data.zip(actual.data).zipWithIndex.collect {
      case ((x, y), i) if x != y && (logical || !Times.isTime(e.ado + i)) =>
        val address = e.ado + i
        Difference(
          where + f"byte ${if (logical) i else address}%04x is 0x$x%02x, got 0x$y%02x",
          if (logical) None else byteReason(address, x ^ y)
        )
    }
  }

  /** A slave of a network: its image, and what its host program does. */
  private case class Member(p: EscParams, image: Line => Seq[Int], keys: Line => String = _ => "")

  private def network(name: String, members: Seq[Member], line: Line): Path = {
    Files.createDirectories(folder)
    val list = members.zipWithIndex.map { case (m, i) =>
      val image = folder.resolve(s"$name-$i.bin")
      Files.write(image, m.image(line).map(_.toByte).toArray)
      val ppm = (m.p.preset.hashCode & 0x3f) - 32
      s"""{"preset": "${m.p.preset}", "eeprom": "${image.getFileName}", "clock_ppm": $ppm${m.keys(line)}}"""
    }
    Files.writeString(folder.resolve(s"$name.json"), list.mkString("{\"slaves\": [", ",\n", "]}\n"))
  }

  /** What tshark's dissectors find wrong. */
  private def complaints(file: Path): Seq[String] = {
    val fields = Seq("-T", "fields", "-e", "_ws.expert.message", "-e", "_ws.malformed")
    Recording.tshark(file, Seq("-Y", Recording.Wrong) ++ fields: _*).distinct
  }

  /** `outsideEvent`: frames with an event in their IRQ field whose cause is not in the recording. */
  private def replay(
      name: String,
      members: Seq[Member],
      outsideEvent: Range = 0 until 0
  ): Unit =
    s"Recording $name" should "come back as from the silicon" in {
      val recording        = Recordings.file(s"$name.pcapng")
      val frames           = Recording.read(recording)
      val (sent, answered) = frames.partition(_.fromMaster)
      val expected         = Recording.pair(sent, answered)
      val line             = new Line(members.size, expected)
      val result           = folder.resolve(s"$name.pcap")
      harness.replay(network(name, members, line), recording, result)

      val returned = Recording.read(result)
      val actual   = Recording.pair(sent, returned)
      val polls    = line.polls(watched)
      val masked   = line.datagrams.find(d => d.writes && d.touches(0x0200 to 0x0201)).fold(0)(_.frame)
      def irqReason(d: Addressed): Option[String] =
        if (d.frame <= masked) Some(Reason.Mask)
        else Option.when(outsideEvent.contains(d.frame))(Reason.Outside)
      val outcomes = line.datagrams.map { d =>
        d -> (actual(d.frame) match {
          case None    => Seq(Difference(s"frame ${d.frame} did not come back", None))
          case Some(a) =>
            // What may be watched is the data, not who answers.
            val early =
              polls.get(d).contains(false) && a.datagrams(d.number).workingCounter == d.reply.workingCounter
            compare(d, a.datagrams(d.number), irqReason(d)).map { x =>
              if (early && x.reason.isEmpty && x.text.contains("byte")) x.copy(reason = Some(Reason.Watching))
              else x
            }
        })
      }
      info(
        s"${sent.size} EtherCAT frames sent, ${expected.count(_.isDefined)} answered then, " +
          s"${actual.count(_.isDefined)} now"
      )
      // DL control keeps its default: what is not EtherCAT is destroyed (FP-10).
      val times   = Times.check(line.datagrams.flatMap(d => actual(d.frame).map(d -> _.datagrams(d.number))))
      val foreign = Recording.foreign(recording)
      assert(Recording.foreign(result) == 0, "non-EtherCAT frames came back")
      if (foreign > 0) info(s"$foreign frames are not EtherCAT: none comes back")
      val (equal, unequal)    = outcomes.partition(_._2.isEmpty)
      val (excepted, differs) = unequal.partition(_._2.forall(_.reason.isDefined))
      info(
        s"${outcomes.size} datagrams compared: ${equal.size} equal, ${excepted.size} excepted, " +
          s"${differs.size} differ"
      )
      Reason.all.foreach { r =>
        val n = excepted.count(_._2.exists(_.reason.contains(r)))
        if (n > 0) info(s"excepted: $n datagrams, $r")
      }
      val open = differs.flatMap(_._2).filter(_.reason.isEmpty).map(_.text)
      Files.writeString(
        folder.resolve(s"$name.differences"),
        unequal
          .flatMap(_._2)
          .map(x => s"${x.text}: ${x.reason.getOrElse("no reason")}")
          .mkString("", "\n", "\n")
      )
      assert(equal.nonEmpty)
      assert(actual.zip(expected).forall { case (a, e) => a.isDefined || e.isEmpty }, "frames were lost")
      assert(open.isEmpty, s"${open.size} differences:" + open.take(20).mkString("\n", "\n", "\n"))

      if (times.compared > 0) info(s"${times.compared} times compared in kind")
      assert(times.wrong.isEmpty, times.wrong.take(20).mkString("times:\n", "\n", "\n"))

      // SOEM sends from a group address, which tshark finds wrong in the recording too.
      assert(complaints(result).toSet -- complaints(recording) == Set.empty, "tshark complains")
    }

  private def file(image: String): Seq[Int] =
    Files.readAllBytes(Recordings.file(s"sii/$image")).toSeq.map(_ & 0xff)

  // Digital I/O hardware keeps the PDI watchdog running.
  private def io(line: Line): String = """, "host": "alive""""

  // The configuration follows from what 0x0140 and 0x0102 read; the firmware answers within 10 ms.
  replay(
    "soem-single-lan9252",
    Seq(
      Member(
        lan9252,
        _.image(0, Map(0 -> 0x0e89)),
        line => {
          val replies = line.mailbox(0, 0x1080).map(_.map(b => f"$b%02x").mkString("\"", "", "\""))
          s""", "eeprom_chip": "24C32", "host": "io", "host_delay_us": 10000, "host_replies": [${replies
              .mkString(", ")}]"""
        }
      )
    )
  )
  private val three = Seq(
    Member(ek1100, _ => file("ek1100.bin")),
    Member(el2828, _ => file("el2828.bin"), io),
    Member(el2889, _ => file("el2889.bin"), io)
  )
  replay("replay-ek1100-el2828-el2889", three)
  replay("replay-dc", three)
  replay(
    "twincat-scan-boxes",
    Seq(
      Member(ek1100, _.image(0, Map(0 -> 0x0d00, 5 -> 0x00c0), file("ek1100.bin"))),
      Member(el1004, _.image(1, Map(0 -> 0x0104, 5 -> 0x00c0)), io)
    ),
    outsideEvent = 287 to 297
  )
}
