package flyframe.transport.ring

import java.io.ByteArrayInputStream
import org.scalatest.flatspec.AnyFlatSpec
import scala.sys.process._
import scala.util.Random
import flyframe.can.{CanFrame, Crc15, Wire}
import flyframe.relay.{LinkBody, LinkFrame, LinkHeader}
import flyframe.transport._

/** The four CRCs of the fibre ring, against `crccheck`, which we did not write. */
class CrcSpec extends AnyFlatSpec {
  private val random = new Random(1)

  /** What crccheck makes of bytes, by the names of its classes. */
  private def crccheck(asked: Seq[(String, Seq[Int])]): Seq[Long] = {
    val text   = asked.map { case (name, bytes) => s"$name ${bytes.map(b => f"$b%02x").mkString}\n" }.mkString
    val python = Seq("build/tools/venv/bin/python", "test/base/transport/ring/crcs.py")
    val lines  = (python #< new ByteArrayInputStream(text.getBytes)).!!.linesIterator.toSeq
    assert(lines.size == asked.size)
    lines.map(java.lang.Long.parseLong(_, 16))
  }

  /** Bits as bytes; where they fill none, zeros in front, which do not change a CRC that begins with 0. */
  private def bytes(bits: Seq[Boolean]): Seq[Int] = {
    val whole = Seq.fill((8 - bits.size % 8) % 8)(false) ++ bits
    whole.grouped(8).map(_.foldLeft(0)((n, bit) => n << 1 | (if (bit) 1 else 0))).toSeq
  }

  private def number(bits: Seq[Boolean]): Long = Sizes.number(bytes(bits))

  private def some(count: Int) = Seq.fill(count)(random.nextInt(256))

  private val frames = Seq.fill(1000) {
    val extended = random.nextBoolean()
    val id       = random.nextInt() & (if (extended) 0x1fffffff else 0x7ff)
    val dlc      = random.nextInt(16)
    if (random.nextInt(5) == 0) CanFrame(id, extended, remote = true, dlc, Nil)
    else CanFrame(id, extended, remote = false, dlc, some(dlc min 8))
  }

  "CAN-09: crccheck" should "find the CRC-15 of any frame" in {
    val wires = frames.map(Wire(_))
    val bits  = wires.map(_.bits.filterNot(_.isStuff).map(_.level == '1').dropRight(15))
    val found = crccheck(bits.map("Crc15" -> bytes(_)))
    assert(found == bits.map(Crc15.of(_).toLong))
    assert(found == wires.map(_.crc.toLong))
  }

  "FR-41: crccheck" should "find the CRC-8 and the CRC-32 of any link frame" in {
    val made = frames.map { f =>
      val header = LinkHeader.of(random.nextInt())
      val body   = LinkBody.of(header, f)
      (header, (0 until body.total).map(body(_)))
    }
    val checks = crccheck(made.map { case (h, _) => "Crc8Autosar" -> bytes(h.bits.dropRight(8)) })
    assert(checks == made.map(_._1.check.toLong))
    assert(checks == made.map { case (h, _) => number(h.bits.takeRight(8)) })
    val crcs = crccheck(made.map { case (h, body) =>
      "Crc32Bzip2" -> bytes(LinkFrame.bits(h.word, 24) ++ body.dropRight(32))
    })
    assert(crcs == made.map { case (_, body) => number(body.takeRight(32)) })
  }

  for (
    (name, make) <- Seq[(String, () => TransportUnderTest)](
      "golden model" -> (() => new TransportModel(TransportParams(2), 0)),
      "program in C" -> (() => new NodeInC(TransportParams(2)))
    )
  )
    "TP-04: crccheck" should s"find the CRC-32 with which the $name opens any message" in {
      val messages = Seq.fill(20)(some(Sizes.Short + 1 + random.nextInt(Sizes.Message - Sizes.Short))) :+
        some(Sizes.Short + 1) :+ some(Sizes.Message)
      val sent = messages.map { message =>
        val transport = make()
        assert(transport.send(1, 3, urgent = false, message, 0))
        transport.poll(0)
        val open = transport.queued().find(f => FrameId.of(f.id).number == Code.Open).get
        transport match {
          case c: NodeInC => c.release()
          case _          =>
        }
        Sizes.number(open.data.drop(4))
      }
      assert(crccheck(messages.map("Crc32" -> _)) == sent)
    }
}
