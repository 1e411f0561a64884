package flyframe.replay

import java.nio.file.{Files, Path, Paths}
import scala.util.Random
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.{Recordings, Tier}
import flyframe.cosim.Harness
import flyframe.model.{Datagram, Encapsulation, EtherCatFrame}
import flyframe.params.{EscParams, Presets}
import flyframe.registers.AlarmRegisters

/** The plain slaves, with and without a smoke detector, in one harness. */
object Plain {
  val ordinary: EscParams   = Tier.slowest(Presets.default.params)
  val alarm: EscParams      = Tier.slowest(Presets.named("alarm-slave").get.params)
  lazy val harness: Harness = new Harness("plain", Seq(ordinary, alarm))
}

/** AP-01: frames pass an alarm slave that has nothing to report as they pass an ordinary one. What a network
  * card at the master gets is compared, every byte and every time.
  */
class AlarmPassSpec extends AnyFlatSpec {
  private val folder = Paths.get("build/replay")

  /** What comes back for a recording from a line of these slaves. */
  private def play(name: String, recording: Path, line: EscParams*): Path = {
    val title = s"pass-$name-" + line.map(p => if (p.hasAlarm) "a" else "o").mkString
    val network = Files.writeString(
      Files.createDirectories(folder).resolve(s"$title.json"),
      line
        .map { p =>
          val host = if (p.hasAlarm) "mute" else "none"
          s"""{"preset": "${p.preset}", "clock_ppm": 40, "host": "$host"}"""
        }
        .mkString("{\"slaves\": [", ", ", "]}")
    )
    val result = folder.resolve(s"$title.pcap")
    Plain.harness.replay(network, recording, result)
    result
  }
  private def same(name: String, recording: Path): Unit = {
    import Plain.{alarm, ordinary}
    for (
      (ours, theirs) <- Seq(
        Seq(alarm)                     -> Seq(ordinary),
        Seq(ordinary, alarm, ordinary) -> Seq(ordinary, ordinary, ordinary)
      )
    ) {
      val (a, b) = (play(name, recording, ours: _*), play(name, recording, theirs: _*))
      assert(Recording.read(b).size > 100, "frames come back")
      assert(Files.mismatch(a, b) == -1, s"$a and $b differ")
    }
  }

  for (name <- Seq("soem-single-lan9252", "replay-ek1100-el2828-el2889"))
    s"AP-01: frames of a real master, $name" should "pass an alarm slave as they pass an ordinary one" in
      same(name, Recordings.file(s"$name.pcapng"))

  "AP-01, ALARM-01: random frames" should "pass an alarm slave as they pass an ordinary one" in {
    val random = new Random(1)
    val own    = AlarmRegisters.all.flatMap(_.range).toSet ++ (0x0100 to 0x0103)
    def datagram(): Datagram = {
      val length  = random.nextInt(if (random.nextInt(8) == 0) 300 else 12)
      val address = if (random.nextBoolean()) random.nextInt(0x1400) else 0x0f80 + random.nextInt(0x100)
      val adp     = if (random.nextBoolean()) 0 else random.nextInt(0x10000)
      Datagram(random.nextInt(16), adp, address, Seq.fill(length)(random.nextInt(256)))
    }
    val frames = Seq.fill(600) {
      val datagrams = Seq
        .fill(random.nextInt(5))(datagram())
        .filterNot(d => d.data.indices.exists(i => own(((d.address >> 16) + i).toInt)))
      EtherCatFrame(datagrams, Encapsulation.all(random.nextInt(4)))
    }
    same("random", Recording.write(folder.resolve("pass-random.pcap"), frames))
  }
}
