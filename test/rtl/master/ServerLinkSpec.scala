package flyframe.master

import chisel3._
import chiseltest._
import flyframe.SharedSimulation
import org.scalatest.flatspec.AnyFlatSpec

class ServerLinkSpec extends AnyFlatSpec with SharedSimulation {
  private def is(b: Bool) = b.peek().litToBoolean
  private val Server      = 0xc0a801feL

  /** What became of a datagram. */
  private case class Result(acknowledged: Option[Long], refused: Boolean, dropped: Boolean)
  private val nothing = Result(None, refused = false, dropped = false)
  private val refused = nothing.copy(refused = true)

  /** @param takenAt
    *   the host takes the message that waits while this byte comes
    */
  private def give(
      dut: ServerLink,
      bytes: Seq[Int],
      good: Boolean = true,
      from: Long = Server,
      takenAt: Int = -1
  ): Result = {
    dut.master.poke(0x1234)
    dut.boot.poke(0x5678)
    for ((b, i) <- bytes.zipWithIndex) {
      dut.data.valid.poke(true)
      dut.data.bits.poke(b)
      dut.offset.poke(i)
      dut.take.poke(i == takenAt)
      dut.clock.step()
    }
    dut.data.valid.poke(false)
    dut.received.bits.good.poke(good)
    dut.received.bits.length.poke(bytes.size)
    dut.received.bits.fromServer.poke(from == Server)
    dut.received.valid.poke(true)
    val result = Result(
      Option.when(is(dut.acknowledge.valid))(dut.acknowledge.bits.peek().litValue.toLong),
      is(dut.refused),
      is(dut.dropped)
    )
    dut.clock.step()
    dut.received.valid.poke(false)
    result
  }
  private def message(dut: ServerLink): Option[Seq[Int]] = Option.when(is(dut.waiting)) {
    (0 until dut.length.peek().litValue.toInt).map { i =>
      dut.readAddress.poke(i)
      dut.clock.step()
      dut.readData.peek().litValue.toInt
    }
  }
  private def take(dut: ServerLink): Unit = {
    dut.take.poke(true)
    dut.clock.step()
    dut.take.poke(false)
  }
  private def datagram(kind: Int, number: Int = 0x01020304, rest: Seq[Int] = Nil): Vector[Int] =
    Vector(0x46, 0x41, 1, kind, 0x12, 0x34, 0x56, 0x78) ++ (3 to 0 by -1).map(i =>
      number >> (8 * i) & 0xff
    ) ++ rest

  together("mailbox", new ServerLink)(
    "SRV-01: acknowledgements" -> { dut =>
      assert(give(dut, datagram(2)) == nothing.copy(acknowledged = Some(0x01020304L)))
      assert(give(dut, datagram(2, -1)) == nothing.copy(acknowledged = Some(0xffffffffL)))
      assert(!is(dut.waiting))
    },
    "SRV-02: a message waits for the host, others are dropped meanwhile" -> { dut =>
      val first = datagram(3, rest = 1 to 50)
      assert(give(dut, first) == nothing && message(dut).contains(first))
      assert(
        give(dut, datagram(4, rest = 60 to 160)) == nothing.copy(dropped = true) && message(dut).contains(
          first
        )
      )
      assert(give(dut, datagram(2, 7)).acknowledged.contains(7L), "acknowledgements still come through")
      take(dut)
      assert(message(dut).isEmpty)
      val longest = datagram(200, rest = Seq.tabulate(244)(i => i * 7 & 0xff))
      assert(give(dut, longest) == nothing && message(dut).contains(longest))
      take(dut)
    },
    "SRV-02: a message that comes while the host takes another one is not kept in part" -> { dut =>
      val second = datagram(4, rest = 60 to 90)
      for (takenAt <- Seq(0, 1, 11, 12, 30)) {
        assert(give(dut, datagram(3, rest = 1 to 40)) == nothing)
        assert(give(dut, second, takenAt = takenAt) == nothing.copy(dropped = true))
        assert(message(dut).isEmpty)
      }
      assert(give(dut, second) == nothing && message(dut).contains(second))
      take(dut)
    },
    "SRV-03: what is malformed, for others, or too long is refused" -> { dut =>
      for (kind <- Seq(2, 3)) {
        val right = datagram(kind)
        for (i <- 0 until 6 if i != 3)
          assert(give(dut, right.updated(i, right(i) ^ 0x10)) == refused, s"byte $i")
        assert(give(dut, right, good = false) == refused && give(dut, right, from = Server + 1) == refused)
        assert(give(dut, right.take(11)) == refused && give(dut, Seq(0x46)) == refused)
      }
      assert(give(dut, datagram(1)) == refused, "a report")
      assert(give(dut, datagram(2, rest = Seq(0))) == refused, "an acknowledgement with something behind it")
      assert(give(dut, datagram(2).updated(7, 0x79)) == refused, "of an earlier life")
      assert(give(dut, datagram(3, rest = Seq.fill(245)(0))) == refused)
      assert(give(dut, datagram(3, rest = Seq.fill(1460)(0))) == refused)
      assert(!is(dut.waiting))
      assert(give(dut, datagram(2)) == nothing.copy(acknowledged = Some(0x01020304L)))
    }
  )
}
