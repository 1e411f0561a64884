package flyframe.replay

import java.nio.file.{Files, Paths}
import org.pcap4j.core.PcapHandle.TimestampPrecision
import org.pcap4j.core.Pcaps
import org.pcap4j.packet.UnknownPacket
import org.pcap4j.packet.namednumber.DataLinkType
import org.scalatest.flatspec.AnyFlatSpec
import scala.sys.process._
import flyframe.cosim.Harness
import flyframe.model.{Datagram, Encapsulation, EtherCatFrame}
import flyframe.params.Presets

/** A dissector we did not write reads what the RTL sends: every command in every form of FP-02. */
class DissectionSpec extends AnyFlatSpec {
  private val slave   = Presets.default.params
  private val harness = new Harness("dissection", Seq(slave))
  private val folder  = Paths.get("build/replay")

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
    Files.createDirectories(folder)
    val (sent, back) = (folder.resolve("forms-in.pcap"), folder.resolve("forms-out.pcap"))
    val network =
      Files.writeString(folder.resolve("forms.json"), s"""{"slaves": [{"preset": "${slave.preset}"}]}""")
    val handle = Pcaps.openDead(DataLinkType.EN10MB, 2048, TimestampPrecision.NANO)
    val dump   = handle.dumpOpen(sent.toString)
    frames.zipWithIndex.foreach { case (f, i) =>
      dump.dump(UnknownPacket.newPacket(f.map(_.toByte).toArray, 0, f.size), new java.sql.Timestamp(i.toLong))
    }
    dump.close()
    handle.close()
    harness.replay(network, sent, back)

    def tshark(options: String*): Seq[String] =
      (Seq("tshark", "-r", back.toString) ++ options).!!(ProcessLogger(_ => ())).linesIterator.toSeq
    assert(tshark("-Y", "ecat").size == frames.size)
    assert(tshark("-Y", "_ws.malformed || _ws.expert.severity >= 0x600000") == Nil)
    // Each datagram is seen, and the working counters are not all zero: the frames have been processed.
    val counters = tshark("-T", "fields", "-e", "ecat.cnt").map(_.split(",").length)
    assert(counters == frames.indices.map(i => Seq(1, 2, 15)(i % 3)))
    assert(tshark("-T", "fields", "-e", "ecat.cnt").mkString(",").split(",").count(_ != "0") > frames.size)
  }
}
