package flyframe.replay

import java.io.EOFException
import java.nio.file.Path
import org.pcap4j.core.PcapHandle.TimestampPrecision
import org.pcap4j.core.Pcaps
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

  /** The EtherCAT frames of a pcap or pcapng file, in order. */
  def read(file: Path): Seq[RecordedFrame] = {
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
        .filter(b => b.size >= 28 && b(12) == 0x88 && b(13) == 0xa4 && b(15) >> 4 == 1)
        .map(RecordedFrame)
        .toVector
    finally handle.close()
  }

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
