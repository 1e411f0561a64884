package flyframe.server

import java.util.HexFormat
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.protocol.{EventKind, ServerDatagram}

class ProtocolSpec extends AnyFlatSpec {
  private def bytes(hex: String)  = HexFormat.of.parseHex(hex.filterNot(_.isWhitespace))
  private def hex(b: Array[Byte]) = HexFormat.of.formatHex(b)

  // Master 0x1234, boot 0x5678, events from 0x01020304 on: two; self-test 1, 5 of 6 slaves, time, frames
  // lost.
  private val written = bytes("""
    4641 01 01 1234 5678 01020304 02 01 05 06 a0b0c0d0 00000007
    01 03 0004 0005 02 09 f0000001 80000002
    02 05 0000 0000 00 00 00000000 80000003""")
  private val read = Report(
    Life(0x1234, 0x5678),
    0x01020304L,
    Vector(
      Event(EventKind.Detector, 3, 4, 5, 2, 9, 0xf0000001L, 0x80000002L),
      Event(EventKind.Scanned, 5, masterTime = 0x80000003L)
    ),
    selfTest = 1,
    present = 5,
    known = 6,
    time = 0xa0b0c0d0L,
    lost = 7
  )

  "REP-01: a report" should "be read from its bytes, and be written to the same" in {
    assert(Protocol.report(written).contains(read))
    assert(hex(Protocol.encode(read)) == hex(written))
    assert(Protocol.report(Protocol.encode(read.copy(events = Vector.empty))).exists(_.events.isEmpty))
    assert(Protocol.MostReportBytes == 24 + 64 * 16)
  }

  "SRV-11: what is no report" should "not be read: each wrong byte of the header, each other length" in {
    def changed(at: Int, to: Int) = Protocol.report(written.updated(at, to.toByte))
    for (at <- 0 to 3; to <- 0 to 255 if to != (written(at) & 0xff))
      assert(changed(at, to).isEmpty, s"$at $to")
    for (count  <- 0 to 255 if count != 2) assert(changed(12, count).isEmpty, s"$count events")
    for (length <- 0 until written.length)
      assert(Protocol.report(written.take(length)).isEmpty, s"$length bytes")
    assert(Protocol.report(written :+ 0.toByte).isEmpty)
    val many = Protocol.encode(read.copy(events = Vector.fill(65)(Event(1))))
    assert(Protocol.report(many).isEmpty, "65 events")
    val last = read.copy(first = Protocol.Numbers - 2)
    assert(Protocol.report(Protocol.encode(last)).isEmpty, "numbers past the end")
    assert(Protocol.report(Protocol.encode(last.copy(first = last.first - 1))).nonEmpty)
  }

  "SRV-01: an acknowledgement" should "have twelve bytes: head, life, number" in {
    val ack = Protocol.acknowledgement(Life(0x1234, 0x5678), 0xfedcba98L)
    assert(hex(ack) == "4641010212345678fedcba98")
    assert(Protocol.acknowledged(ack).contains((Life(0x1234, 0x5678), 0xfedcba98L)))
    assert(Protocol.acknowledged(ack.updated(3, 1.toByte)).isEmpty)
  }

  "SRV-12: a command" should "have 32 bytes and the first half of HMAC-SHA-256 over the first 16" in {
    val key     = Array.tabulate(32)(_.toByte)
    val command = Command(Life(0x1234, 0x5678), 0x00010002L, ServerDatagram.DetectorReset, 7)
    val sent    = Protocol.encode(command, key)
    // The code was computed by another implementation (Python's hmac).
    assert(hex(sent) == "46410103123456780001000202000007" + "b26df391568351f5800bd556bbbcd8e4")
    assert(Protocol.command(sent, key).contains(command))
    for (i <- sent.indices; bit <- 0 to 7)
      assert(
        Protocol.command(sent.updated(i, (sent(i) ^ 1 << bit).toByte), key).isEmpty,
        s"bit $bit of byte $i"
      )
    assert(Protocol.command(sent, key.reverse).isEmpty)
    assert(
      Protocol.command(sent.dropRight(1), key).isEmpty && Protocol.command(sent :+ 0.toByte, key).isEmpty
    )
  }
}
