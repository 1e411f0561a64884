package flyframe.replay

import java.io.EOFException
import java.nio.file.{Files, Path}
import scala.sys.process._
import org.pcap4j.core.PcapHandle.TimestampPrecision
import org.pcap4j.core.Pcaps
import org.pcap4j.packet.UnknownPacket
import org.pcap4j.packet.namednumber.DataLinkType
import flyframe.rules.Reply

/** An EtherCAT frame of a recording. */
final case class RecordedFrame(bytes: Seq[Int]) {

  /** It left the master: bit 1 of the first source address byte is clear. */
  def fromMaster: Boolean = (bytes(6) & 2) == 0

  lazy val datagrams: Seq[Reply] = {
    def from(at: Int): Seq[Reply] =
      if (at + 12 > bytes.size) Nil
      else {
        val d = Reply(bytes.drop(at))
        if (at + 12 + d.length > bytes.size) Nil else d +: (if (d.more) from(at + 12 + d.length) else Nil)
      }
    from(16)
  }

  /** What stays the same on the way through the slaves. */
  def key: Seq[(Int, Int, Int)] = datagrams.map(d => (d.command, d.index, d.length))
}

object Recording {

  /** Writes a pcap file of frames without FCS, a millisecond apart. */
  def write(file: Path, frames: Seq[Seq[Int]], link: DataLinkType = DataLinkType.EN10MB): Path = {
    Files.createDirectories(file.getParent)
    val handle = Pcaps.openDead(link, 2048, TimestampPrecision.NANO)
    val dump   = handle.dumpOpen(file.toString)
    frames.zipWithIndex.foreach { case (f, i) =>
      dump.dump(UnknownPacket.newPacket(f.map(_.toByte).toArray, 0, f.size), new java.sql.Timestamp(i.toLong))
    }
    dump.close()
    handle.close()
    file
  }

  /** What tshark says of a file. */
  def tshark(file: Path, options: String*): Seq[String] =
    (Seq("tshark", "-r", file.toString) ++ options).!!(ProcessLogger(_ => ())).linesIterator.toSeq

  /** For [[tshark]]: frames in which its dissectors find something wrong. */
  val Wrong = "_ws.malformed || _ws.expert.severity >= 0x600000"

  /** All frames of a pcap or pcapng file, in order. */
  private def frames(file: Path): Seq[Seq[Int]] = {
    val handle = Pcaps.openOffline(file.toString, TimestampPrecision.NANO)
    try
      Iterator
        .continually(
          try Option(handle.getNextRawPacketEx)
          catch { case _: EOFException => None }
        )
        .takeWhile(_.isDefined)
        .flatten
        .map(_.toSeq.map(_ & 0xff))
        .toVector
    finally handle.close()
  }

  private def isEtherCat(b: Seq[Int]): Boolean =
    b.size >= 28 && b(12) == 0x88 && b(13) == 0xa4 && b(15) >> 4 == 1

  private def isUdp(b: Seq[Int]): Boolean =
    b.size >= 44 && b(12) == 8 && b(13) == 0 && b(14) == 0x45 && b(23) == 0x11 && b(36) == 0x88 && b(
      37
    ) == 0xa4

  /** The EtherCAT frames of a file, in order. */
  def read(file: Path): Seq[RecordedFrame] = frames(file).filter(isEtherCat).map(RecordedFrame)

  /** How many frames of a file, left from the master, are no EtherCAT, plain or in UDP. */
  def foreign(file: Path): Int =
    frames(file).count(b => b.size > 14 && !isEtherCat(b) && !isUdp(b) && (b(6) & 2) == 0)

  /** For each frame of the master the answer with the same datagrams that comes next among `answers`. */
  def pair(sent: Seq[RecordedFrame], answers: Seq[RecordedFrame]): Seq[Option[RecordedFrame]] = {
    var rest = answers
    sent.map { frame =>
      val (skipped, found) = rest.span(_.key != frame.key)
      if (found.isEmpty || skipped.size > 8) None
      else {
        rest = found.tail
        Some(found.head)
      }
    }
  }
}
