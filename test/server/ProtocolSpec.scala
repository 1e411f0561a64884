package flyframe.server

import java.util.HexFormat
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.protocol.{EventKind, Order, ReportEndLayout}

class ProtocolSpec extends AnyFlatSpec {
  private def bytes(hex: String)  = HexFormat.of.parseHex(hex.filterNot(_.isWhitespace))
  private def hex(b: Array[Byte]) = HexFormat.of.formatHex(b)
  private val key                 = Array.tabulate[Byte](16)(_.toByte)
  private val life                = Life(0x1234, 0x0123456789abcdefL)
  private val server              = 0xfedcba9876543210L

  // Head with counter 7, events from 0x01020304 on: two; three slaves; then rest, tag, balance. The tag was
  // computed by another implementation (in Python, from the standard).
  private val written = bytes("""
    4641 02 01 1234 0000 0123456789abcdef fedcba9876543210
    00000007 01020304 00000000a0b0c0d0 00010005 00000009 02 03 04 01 02 06 0000
    0007 0001  8000 0002  0000 fffe
    01 03 0004 0005 82 09 00000000f0000001 0000000080000002
    03 05 0002 0003 00 04 0000000000000008 0000000080000003
    00000000000000000000000000000000 b464ede4a9796557449754f20c536870 0000""")
  private val read = Report(
    life,
    server,
    counter = 7,
    first = 0x01020304L,
    Vector(
      Event(EventKind.Detector, 3, 4, 5, 0x82, 9, 0xf0000001L, 0x80000002L),
      Event(EventKind.Line, 5, 2, 3, 0, 4, 8, 0x80000003L)
    ),
    Vector(Reported(7, 1), Reported(0x8000, 2), Reported(0, 0xfffe)),
    time = 0xa0b0c0d0L,
    status = 0x10005,
    lost = 9,
    present = 4,
    selfTest = 1,
    cut = 2,
    refused = 6
  )

  "REP-01: a report" should "be read from its bytes, and be written to the same" in {
    assert(Protocol.report(written).contains(read))
    assert(hex(Protocol.encode(read, key)) == hex(written))
    val short = read.copy(events = Vector.empty, slaves = Vector.empty)
    assert(Protocol.report(Protocol.encode(short, key)).contains(short))
    val long =
      read.copy(events = Vector.fill(32)(read.events.head), slaves = Vector.fill(255)(Reported(1, 2)))
    assert(Protocol.encode(long, key).length == Protocol.MostReportBytes)
    assert(Protocol.report(Protocol.encode(long, key)).contains(long))
  }

  "SRV-11: what is no report" should "not be read: each wrong byte of the header, each other length" in {
    def changed(at: Int, to: Int) = Protocol.report(written.updated(at, to.toByte))
    for (at <- 0 to 3; to <- 0 to 255 if to != (written(at) & 0xff))
      assert(changed(at, to).isEmpty, s"$at $to")
    for (count  <- 0 to 255 if count != 2) assert(changed(48, count).isEmpty, s"$count events")
    for (count  <- 0 to 255 if count != 3) assert(changed(49, count).isEmpty, s"$count slaves")
    for (length <- 0 until written.length)
      assert(Protocol.report(written.take(length)).isEmpty, s"$length bytes")
    assert(Protocol.report(written :+ 0.toByte).isEmpty)
    val many = Protocol.encode(read.copy(events = Vector.fill(33)(Event(1))), key)
    assert(Protocol.report(many).isEmpty, "33 events")
    val last = read.copy(first = Protocol.Numbers - 2)
    assert(Protocol.report(Protocol.encode(last, key)).isEmpty, "numbers past the end")
    assert(Protocol.report(Protocol.encode(last.copy(first = last.first - 1), key)).nonEmpty)
  }

  "SRV-04: the tag of a report" should "cover each bit before the rest, and itself" in {
    def isRight(bytes: Array[Byte]) = Protocol.report(bytes).exists(Protocol.isRight(_, bytes, key))
    assert(isRight(written))
    val end = written.length - ReportEndLayout.bytes
    val tag = end + ReportEndLayout.Tag.offset
    for (i <- (0 until end) ++ (tag until tag + 16); bit <- 0 to 7)
      assert(!isRight(written.updated(i, (written(i) ^ 1 << bit).toByte)), s"bit $bit of byte $i")
    assert(!Protocol.isRight(read, written, key.reverse))
    assert(isRight(written.updated(written.length - 1, 0x55.toByte)), "UDP needs the balance")
  }

  // Order 3 to ID 7 for 300 s, ticket 0x00010002; the tag as above.
  private val answered = bytes("""
    4641 02 02 1234 0000 0123456789abcdef fedcba9876543210
    00000011 00000007 01020306 00010002 03 00 0007 012c 0000 f4ed6b8bbe9d2de2cb64915fd6e40361""")
  private val answer = Answer(life, server, 0x11, 7, 0x01020306L, 0x10002L, Order.Disable, 7, 300)

  "SRV-01: an answer" should "have 64 bytes: head, turn, echo, number, order, tag" in {
    assert(hex(Protocol.encode(answer, key)) == hex(answered) && answered.length == 64)
    assert(Protocol.answer(answered, key).contains(answer))
    val trouble = Protocol.encode(answer.copy(trouble = true), key)
    assert(trouble(41) == 1 && Protocol.answer(trouble, key).exists(_.trouble))
    for (i <- answered.indices; bit <- 0 to 7)
      assert(
        Protocol.answer(answered.updated(i, (answered(i) ^ 1 << bit).toByte), key).isEmpty,
        s"bit $bit of byte $i"
      )
    assert(Protocol.answer(answered, key.reverse).isEmpty)
    assert(
      Protocol.answer(answered.dropRight(1), key).isEmpty && Protocol
        .answer(answered :+ 0.toByte, key)
        .isEmpty
    )
  }
}
