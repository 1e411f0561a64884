package flyframe.can

import flyframe.params.CanParams
import java.nio.file.Files
import scala.sys.process.Process
import scala.util.Random

/** What the CAN decoder of sigrok, which we did not write, makes of the frames that a controller sends and
  * receives. It takes remote frames with a DLC wrongly, and checks no CRC but shows it.
  */
abstract class SigrokCases extends CanCases {

  /** Frames to read. */
  protected def frames: Int = 2000

  /** What is to be read of a frame. */
  private case class Reading(id: Int, isRemote: Boolean, dlc: Int, data: Seq[Int], crc: Int, stuff: String)

  private def expected(wire: Wire) = Reading(
    wire.frame.id,
    wire.frame.remote,
    wire.frame.dlc,
    wire.frame.data,
    wire.crc,
    wire.bits.filter(_.isStuff).map(_.level).mkString
  )

  private def any(random: Random): CanFrame = {
    val extended = random.nextBoolean()
    val id       = random.nextInt() & (if (extended) 0x1fffffff else 0x7ff)
    val data     = Seq.fill(random.nextInt(9))(Seq(0, 0xff, random.nextInt(256))(random.nextInt(3)))
    if (random.nextInt(5) == 0) CanFrame(id, extended, remote = true, 0, Nil)
    else CanFrame(id, extended, remote = false, data.size, data)
  }

  private val Number = "(?:.*: )(?:.*\\()?(?:0x)?([0-9a-f]+)\\)?".r

  /** The lines of a frame. */
  private def reading(lines: Seq[String]): Reading = {
    def all(title: String, base: Int = 16) = lines.collect {
      case line @ Number(digits) if line.startsWith(title) => Integer.parseInt(digits, base)
    }
    Reading(
      (all("Full Identifier") ++ all("Identifier")).head,
      lines.contains("Remote transmission request: remote frame"),
      all("Data length code", 10).head,
      all("Data byte"),
      all("CRC-15 sequence").head,
      lines.filter(Set("0", "1")).mkString
    )
  }

  "CAN-07, CAN-09: sigrok" should "read frames as they were meant" in withDevice(CanParams()) { device =>
    val random   = new Random(1)
    val recorder = new Recorder(device)
    val t        = new LowerTester(recorder, Rate.Fast)
    t.start()
    t.idle(12)
    val wires = Seq.fill(frames)(Wire(any(random)))
    for ((wire, n) <- wires.zipWithIndex) {
      if (n % 2 == 0) {
        t.request(wire.frame)
        t.awaitSof()
        t.hearRest(wire)
      } else t.sendAcked(wire)
      t.intermission()
      t.release()
    }
    val read = decode(recorder)
    assert(read.size == wires.size)
    for ((lines, wire) <- read.zip(wires)) assert(reading(lines) == expected(wire), lines.mkString("\n"))
  }

  /** The lines of each frame. */
  private def decode(recorder: Recorder): Seq[Seq[String]] = {
    val file = Files.createTempFile("can", ".vcd")
    try {
      recorder.writeVcd(file, Rate.Fast.prescaler)
      val decoder = "can:nominal_bitrate=1000000:can_rx=bus"
      val shown   = "can=sof:id:full-id:dlc:data:crc-sequence:stuff-bit:rtr:warnings"
      val text = Process(Seq("sigrok-cli", "-I", "vcd", "-i", file.toString, "-P", decoder, "-A", shown)).!!
      text.linesIterator
        .map(_.stripPrefix("can-1: "))
        .foldLeft(Vector.empty[Vector[String]]) { (frames, line) =>
          if (line == "Start of frame") frames :+ Vector.empty else frames.init :+ (frames.last :+ line)
        }
    } finally Files.delete(file)
  }
}
