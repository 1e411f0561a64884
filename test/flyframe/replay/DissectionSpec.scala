package flyframe.replay

import java.nio.file.{Files, Paths}
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.model.{Datagram, Encapsulation, EtherCatFrame}

/** A dissector we did not write reads what the RTL sends: every command in every form of FP-02. */
class DissectionSpec extends AnyFlatSpec {
  private val slave  = Plain.ordinary
  private val folder = Paths.get("build/replay")

  private val commands = 0 to 14
  private val frames = for {
    form  <- Encapsulation.all
    count <- Seq(1, 2, 15)
  } yield EtherCatFrame(
    Seq.tabulate(count)(i =>
      Datagram(commands((i + count) % commands.size), 0, 0x0f80 + i, Seq.fill(1 + 7 * i)(i)).copy(index = i)
    ),
    form
  )

  "tshark" should "dissect all that the RTL sends without a warning" in {
    val (sent, back) = (folder.resolve("forms-in.pcap"), folder.resolve("forms-out.pcap"))
    Recording.write(sent, frames)
    val network =
      Files.writeString(folder.resolve("forms.json"), s"""{"slaves": [{"preset": "${slave.preset}"}]}""")
    Plain.harness.replay(network, sent, back)

    def tshark(options: String*): Seq[String] = Recording.tshark(back, options: _*)
    assert(tshark("-Y", "ecat").size == frames.size)
    assert(tshark("-Y", Recording.Wrong) == Nil)
    // Each datagram is seen, and the working counters are not all zero: the frames have been processed.
    val counters = tshark("-T", "fields", "-e", "ecat.cnt").map(_.split(",").length)
    assert(counters == frames.indices.map(i => Seq(1, 2, 15)(i % 3)))
    assert(tshark("-T", "fields", "-e", "ecat.cnt").mkString(",").split(",").count(_ != "0") > frames.size)
  }
}
