package flyframe.ethernet

import scala.util.Random
import chisel3._
import chiseltest._
import flyframe.SharedSimulation
import org.pcap4j.packet.namednumber._
import org.scalatest.flatspec.AnyFlatSpec

/** Against packets that pcap4j builds and takes apart. */
class UdpSpec extends AnyFlatSpec with SharedSimulation {
  import UdpPackets._
  private val master      = End(0x021022334455L, 0xc0a80105L, 5005)
  private val server      = End(0x0a0b0c0d0e0fL, 0xc0a801feL, 0x88a5)
  private def is(b: Bool) = b.peekBoolean()
  private def any(random: Random, end: End) =
    End(end.mac ^ random.nextInt(256), random.nextInt() & 0xffffffffL, random.nextInt(0x10000))

  private val fcs = Seq(0xa5, 0x5a, 0xc3, 0x3c) // nobody looks at it
  private case class Got(good: Boolean, payload: Seq[Int], fromServer: Boolean)

  /** What it makes of a frame, with `fcs` behind it; None: it was not for this station. */
  private def receive(dut: PlantBench, bytes: Seq[Int], bad: Boolean = false): Option[Got] = {
    dut.load(master, server)
    var payload = Vector.empty[Int]
    dut.end.valid.poke(false)
    for ((b, i) <- (bytes ++ fcs).zipWithIndex) {
      dut.byte.valid.poke(true)
      dut.byte.bits.poke(b)
      dut.first.poke(i == 0)
      if (is(dut.data.valid)) {
        assert(dut.offset.peekInt() == payload.size)
        payload :+= dut.data.bits.peekInt().toInt
      }
      dut.clock.step()
      dut.byte.valid.poke(false)
      dut.clock.step()
    }
    dut.end.valid.poke(true)
    dut.end.bits.poke(!bad)
    dut.clock.step()
    dut.end.valid.poke(false)
    val r = dut.received
    val got = Option.when(is(r.valid)) {
      val good = is(r.bits.good)
      if (good) assert(r.bits.length.peekInt() == payload.size)
      Got(good, payload, is(r.bits.fromServer))
    }
    dut.clock.step()
    assert(!is(r.valid))
    got
  }

  together("receiving", new PlantBench)(
    "MST-11: datagrams for this end come with their payload and where they are from" -> { dut =>
      val random = new Random(2)
      for (size <- Seq(1, 2, 17, 18, 19, 60, 255, 1472) ++ Seq.fill(20)(1 + random.nextInt(200))) {
        val from    = if (size % 2 == 0) any(random, server).copy(ip = server.ip) else any(random, server)
        val payload = Seq.fill(size)(random.nextInt(256))
        val got     = receive(dut, packet(from, master, payload, udpChecksum = random.nextInt(4) > 0))
        assert(got.contains(Got(good = true, payload, from.ip == server.ip)))
      }
    },
    "MST-11: frames to others are nothing" -> { dut =>
      assert(receive(dut, packet(server, server, Seq(1, 2, 3))).isEmpty)
      assert(receive(dut, packet(server, master.copy(mac = 0xffffffffffffL), Seq(1, 2, 3))).isEmpty)
      assert(receive(dut, packet(server, master, Seq(1, 2, 3))).exists(_.good))
    },
    "MST-11: another address, port or protocol, fragments and bad frames are refused" -> { dut =>
      def refused(bytes: Seq[Int], bad: Boolean = false) = receive(dut, bytes, bad).exists(!_.good)
      val right                                          = packet(server, master, 1 to 40)
      assert(!refused(right) && refused(right, bad = true))
      assert(refused(packet(server, master.copy(ip = master.ip ^ 0x100), 1 to 40)))
      assert(refused(packet(server, master.copy(ip = master.ip ^ 0x1000000), 1 to 40)))
      assert(refused(packet(server, master.copy(port = master.port + 1), 1 to 40)))
      assert(refused(packet(server, master, 1 to 40, protocol = IpNumber.TCP)))
      assert(refused(packet(server, master, 1 to 40, fragment = true)))
      assert(refused(right.dropRight(1)) && refused(right.take(20)) && refused(right.take(41)))
      assert(!refused(right))
    },
    "MST-13: a datagram whose lengths reach into the FCS is refused" -> { dut =>
      // Its last bytes are the first ones of the FCS, so that its checksum is right if they are taken for
      // payload.
      for (size <- Seq(20, 21, 200); missing <- 1 to 4; udpChecksum <- Seq(true, false)) {
        val payload = Seq.tabulate(size - missing)(_ * 7 & 0xff) ++ fcs.take(missing)
        val frame   = packet(server, master, payload, udpChecksum)
        assert(receive(dut, frame).contains(Got(good = true, payload, fromServer = true)))
        assert(receive(dut, frame.dropRight(missing)).exists(!_.good), s"$size bytes, $missing missing")
      }
    },
    "MST-11: a datagram without payload, or with a length that cannot be, is refused" -> { dut =>
      // Without UDP checksum; lengths in the headers of IP and UDP, the IP checksum made anew.
      def of(length: Int, udpLength: Int, bytes: Int) = {
        val made   = packet(server, master, Seq.fill(bytes)(0x11), udpChecksum = false)
        val header = made.slice(14, 34).patch(2, big(length, 2), 2).patch(10, Seq(0, 0), 2)
        val sum    = header.grouped(2).map(w => w(0) << 8 | w(1)).sum
        val check  = 0xffff - (sum - 1) % 0xffff - 1
        made.patch(14, header.patch(10, big(check, 2), 2), 20).patch(38, big(udpLength & 0xffff, 2), 2)
      }
      assert(receive(dut, of(1500, 1480, 1472)).exists(_.good) && receive(dut, of(29, 9, 1)).exists(_.good))
      for (length <- (0 to 28) ++ Seq(1501, 1502, 1536, 2047, 2048, 2048 + 40, 0x8000 + 40, 0xffff))
        for (udpLength <- Seq(length - 20, 1).distinct)
          assert(
            receive(dut, of(length, udpLength, if (length < 1000) 40 else 1990)).exists(!_.good),
            s"lengths $length, $udpLength"
          )
    },
    "MST-11: every wrong bit is noticed of what says whose a datagram is, what it is, and how long" -> {
      dut =>
        val right                   = packet(server, master, Seq.tabulate(9)(_ * 29 & 0xff)).take(51)
        def wrong(i: Int, bit: Int) = receive(dut, right.updated(i, right(i) ^ 1 << bit))
        val looked                  = Seq(12, 13, 14, 16, 17, 20, 21, 23) ++ (30 to 33) ++ (36 to 39)
        for (i <- looked; bit <- 0 until 8 if !(i == 20 && bit == 6)) // that must not be fragmented
          assert(wrong(i, bit).exists(!_.good), s"byte $i, bit $bit")
        for (i <- 26 to 29; bit <- 0 until 8)
          assert(wrong(i, bit).exists(got => got.good && !got.fromServer), s"byte $i, bit $bit")
        assert(receive(dut, right).exists(got => got.good && got.fromServer))
    },
    "MST-11: checksums are not looked at" -> { dut =>
      val right = packet(server, master, 1 to 9)
      for (i <- Seq(24, 25, 40, 41)) assert(receive(dut, right.updated(i, right(i) ^ 1)).exists(_.good))
    }
  )
}
