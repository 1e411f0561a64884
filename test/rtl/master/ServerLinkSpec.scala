package flyframe.master

import chisel3._
import chisel3.util._
import chiseltest._
import org.scalatest.flatspec.AnyFlatSpec
import scala.util.Random
import flyframe.ethernet.{SettingsBench, UdpReceived}
import flyframe.SharedSimulation
import flyframe.lanes.Lanes
import flyframe.protocol.{AnswerLayout, Layout, NonceLayout, Order, ServerDatagram}
import flyframe.registers.MasterRegisters

/** [[ServerLink]] with its tag unit, which somebody else may need. */
class ServerLinkBench extends SettingsBench(1) {
  private val link  = Module(new ServerLink)
  private val ascon = Module(new AsconTag)
  val data          = IO(Flipped(Valid(UInt(8.W))))
  val offset        = IO(Input(UInt(11.W)))
  val ends          = IO(Input(Bool()))
  val received      = IO(Input(new UdpReceived))
  val take          = IO(Input(Bool()))
  val others        = IO(Input(Bool())) // they need what is shared, and wait until it is free
  val wants         = IO(Output(Bool()))
  val sent          = IO(Input(UInt(32.W)))
  val first         = IO(Input(UInt(32.W)))
  val kept          = IO(Input(UInt(8.W)))
  val lifeAddress   = IO(Input(UInt(3.W)))
  val looks         = IO(Input(Bool()))
  val readAddress   = IO(Input(UInt(6.W)))
  val remove        = IO(Output(chiselTypeOf(link.remove)))
  val alive         = IO(Output(Bool()))
  val newLife       = IO(Output(Bool()))
  val waiting       = IO(Output(Bool()))
  val refused       = IO(Output(Bool()))
  val dropped       = IO(Output(Bool()))
  val lifeData      = IO(Output(UInt(8.W)))
  val readData      = IO(Output(UInt(8.W)))
  private val owns  = RegInit(false.B)  // reset: nobody
  owns                 := link.wants && (owns || !others)
  link.granted         := owns
  ascon.granted        := !owns
  settings.readAddress := VecInit(Seq(Mux(owns, link.settingAddress, ascon.settingAddress)))
  link.setting         := settings.readData(0)
  ascon.setting        := settings.readData(0)
  link.number          := VecInit(Lanes.bytes(Cat(sent, first), 8).reverse)(link.numberAddress)
  link.data            := data
  link.offset          := offset
  link.received.valid  := ends
  link.received.bits   := received
  link.take            := take
  link.kept            := kept
  link.lifeAddress     := lifeAddress
  link.looks           := looks
  link.readAddress     := readAddress
  ascon.in <> link.tagged
  ascon.end      := link.tagEnd
  ascon.tagReady := link.tagReady
  link.tag       := ascon.tag
  wants          := link.wants
  remove         := link.remove
  alive          := link.alive
  newLife        := link.newLife
  waiting        := link.waiting
  refused        := link.refused
  dropped        := link.dropped
  lifeData       := link.life
  readData       := link.readData
}

class ServerLinkSpec extends AnyFlatSpec with SharedSimulation {
  import ServerLinkSpec._

  private class Driver(dut: ServerLinkBench) {
    var acknowledged                     = Vector.empty[Long]
    var alive, servers, refused, dropped = 0
    private def is(b: Bool)              = b.peekBoolean()
    dut.clock.setTimeout(0)
    dut.data.valid.poke(false)
    for (b <- Seq(dut.ends, dut.take, dut.looks, dut.others)) b.poke(false)
    dut.sent.poke(0)
    dut.first.poke(0)
    dut.kept.poke(128)
    for (
      (address, bytes) <- Seq(
        MasterRegisters.MasterKey  -> Key,
        MasterRegisters.MasterLife -> bigEndian(LifeOfMaster, 8),
        MasterRegisters.MasterId   -> bigEndian(Master, 2).reverse
      ); (b, i) <- bytes.zipWithIndex
    ) {
      dut.port.write.poke(true)
      dut.port.address.poke(address + i)
      dut.port.data.poke(b)
      dut.clock.step()
    }
    dut.port.write.poke(false)
    dut.clock.step(100)

    /** The host reads the mailbox all the time, as fast as it can. */
    var looks         = false
    private var cycle = 0

    def step(cycles: Int = 1): Unit = for (_ <- 1 to cycles) {
      cycle += 1
      if (looks) dut.looks.poke(cycle % 4 == 0)
      if (is(dut.remove.valid)) {
        acknowledged :+= (dut.first.peekInt() + dut.remove.bits.peekInt()).toLong & 0xffffffffL
        dut.first.poke(acknowledged.last)
      }
      if (is(dut.alive)) alive += 1
      if (is(dut.newLife)) servers += 1
      if (is(dut.refused)) refused += 1
      if (is(dut.dropped)) dropped += 1
      dut.clock.step()
    }

    /** A datagram, a byte every four cycles, as from the wire at 50 MHz. */
    def send(bytes: Seq[Int], good: Boolean = true, fromServer: Boolean = true, gap: Int = 1000): Unit = {
      for ((b, i) <- bytes.zipWithIndex) {
        dut.data.valid.poke(true)
        dut.data.bits.poke(b)
        dut.offset.poke(i)
        step()
        dut.data.valid.poke(false)
        step(3)
      }
      dut.received.good.poke(good)
      dut.received.fromServer.poke(fromServer)
      dut.received.length.poke(bytes.size)
      dut.ends.poke(true)
      step()
      dut.ends.poke(false)
      step(gap)
    }
    def sentReports(counter: Long): Unit = dut.sent.poke(counter)
    def waiting: Boolean                 = is(dut.waiting)
    def mailbox: Seq[Int] = (0 until AnswerLayout.bytes).map { i =>
      dut.readAddress.poke(i)
      dut.looks.poke(true)
      dut.clock.step()
      dut.looks.poke(false)
      val byte = dut.readData.peekInt().toInt
      step()
      byte
    }
    def life: Seq[Int] = (0 until 8).map { i =>
      dut.lifeAddress.poke(i)
      step()
      dut.lifeData.peekInt().toInt
    }
    def take(): Unit = {
      dut.take.poke(true)
      step()
      dut.take.poke(false)
    }
    def counts: (Seq[Long], Int, Int, Boolean) = (acknowledged, alive, servers, waiting)
  }

  together("server link", new ServerLinkBench)(
    "SRV-01: an answer with a right tag acknowledges, once" -> { dut =>
      val d = new Driver(dut)
      assert(d.life == Seq.fill(8)(0))
      d.send(answer(turn = 1, echo = 5, number = 17))
      assert(d.counts == ((Seq(17L), 1, 1, false)) && d.life == bigEndian(ServerLife, 8))
      d.send(answer(turn = 1, echo = 5, number = 17))
      d.send(answer(turn = 2, echo = 5, number = 18))
      d.send(answer(turn = 3, echo = 4, number = 19))
      assert(d.counts == ((Seq(17L), 1, 1, false)) && d.refused == 3)
      d.send(answer(turn = 4, echo = 0x100, number = 20))
      d.send(answer(turn = 5, echo = 0xff, number = 21))
      d.send(answer(turn = 6, echo = 0xfffffffeL, number = 21))
      assert(d.counts == ((Seq(17L, 20L, 21L), 3, 1, false)) && d.refused == 4)
    },
    "SRV-02: an order waits for the host; the same ticket is no second order; a late one is none" -> { dut =>
      val d = new Driver(dut)
      d.sentReports(20)
      val first = answer(1, 20, 0, ticket = 0, order = Order.Silence, node = 0xffff)
      d.send(first)
      assert(d.waiting && d.mailbox == first)
      d.send(answer(2, 21, 0, ticket = 1, order = Order.Reset, node = 7))
      assert(d.waiting && d.mailbox == first, "the first one waits")
      d.take()
      assert(!d.waiting)
      d.send(answer(3, 22, 0, ticket = 0, order = Order.Silence, node = 0xffff))
      assert(!d.waiting)
      d.sentReports(40)
      d.send(answer(4, 23, 9, ticket = 2, order = Order.Reset, node = 7))
      assert(!d.waiting && d.acknowledged.last == 9, "17 reports later")
      val second = answer(5, 24, 9, ticket = 2, order = Order.Test, node = 7, seconds = 300)
      d.send(second)
      assert(d.waiting && d.mailbox == second)
      d.take()
      d.send(answer(6, 25, 9))
      assert(!d.waiting && d.refused == 0)
    },
    "SRV-01: a server with trouble is not alive; another life of it is told" -> { dut =>
      val d = new Driver(dut)
      d.send(answer(1, 1, 3, trouble = 1))
      assert(d.counts == ((Seq(3L), 0, 1, false)))
      d.send(answer(1, 2, 4, server = 0x1122334455667788L))
      assert(d.counts == ((Seq(3L, 4L), 1, 2, false)) && d.life == bigEndian(0x1122334455667788L, 8))
    },
    "SRV-03: whatever is forged, replayed, truncated or mixed changes nothing but a counter" -> { dut =>
      val d      = new Driver(dut)
      val random = new Random(1)
      val old    = (1 to 20).map(i => answer(i, i.toLong, i.toLong, ticket = i.toLong, order = Order.Silence))
      for (a <- old) {
        d.sentReports(20)
        d.send(a)
        d.take()
      }
      val before = d.counts
      assert(before._1.size == 20)
      val box  = d.mailbox
      val many = 2000
      val next = answer(30, 30, 30, ticket = 99, order = Order.Reset)
      for (i <- 1 to many) {
        val forged = random.nextInt(8) match {
          case 0 => old(random.nextInt(old.size))
          case 1 => next.patch(48, Seq.fill(16)(random.nextInt(256)), 16)
          case 2 =>
            val bit = random.nextInt(8 * next.size)
            next.updated(bit / 8, next(bit / 8) ^ 1 << bit % 8)
          case 3 => next.take(random.nextInt(next.size))
          case 4 => next ++ Seq.fill(1 + random.nextInt(100))(0)
          case 5 => old(random.nextInt(old.size)).take(48) ++ next.drop(48)
          case 6 => answer(30, 30, 30, life = random.nextLong())
          case _ => answer(30, 30, 30, key = Seq.fill(16)(random.nextInt(256)))
        }
        d.send(forged, gap = 420 + random.nextInt(300))
      }
      d.step(1000)
      assert(d.counts == before && d.mailbox == box && d.refused == many)
      d.sentReports(30)
      d.send(next)
      assert(d.counts == ((before._1 :+ 30L, 21, 1, true)))
    },
    "SRV-03: datagrams that are bad, or of somebody else, change nothing" -> { dut =>
      val d = new Driver(dut)
      d.send(answer(1, 1, 1), good = false)
      d.send(answer(1, 1, 1), fromServer = false)
      d.send(answer(1, 1, 1, master = Master + 1))
      assert(d.counts == ((Nil, 0, 0, false)) && d.refused == 3)
      d.send(answer(1, 1, 1))
      assert(d.acknowledged == Seq(1))
    },
    "SRV-01, REP-05: numbers of events that are not there acknowledge nothing, at any number" -> { dut =>
      val d      = new Driver(dut)
      val random = new Random(3)
      d.looks = true
      var echo = 0L
      for (
        first <- Seq(0L, 0x7fL, 0xffL, 0xff80L, 0xffffL, 0xfffff0L, 0x12345678L, 0xfffffff0L); _ <- 1 to 12
      ) {
        val kept = random.nextInt(129)
        val ahead = random.nextInt(6) match {
          case 0 => kept.toLong
          case 1 => kept + 1L
          case 2 => random.nextInt(kept + 1).toLong
          case 3 => -1L - random.nextInt(300)
          case 4 => (1L + random.nextInt(255)) << (8 * (1 + random.nextInt(3)))
          case _ => random.nextInt().toLong
        }
        dut.first.poke(first)
        dut.kept.poke(kept)
        d.acknowledged = Vector.empty
        echo += 1
        d.send(answer(1, echo, first + ahead & 0xffffffffL))
        val right = (ahead & 0xffffffffL) <= kept
        assert(
          d.acknowledged == (if (right) Seq(first + ahead & 0xffffffffL) else Nil),
          s"$first, $ahead of $kept"
        )
        assert(d.alive == echo, "it is an answer all the same")
      }
    },
    "SRV-02: an order counts up to 16 reports later, at any number of reports" -> { dut =>
      val d    = new Driver(dut)
      var echo = 0L
      for (
        sent   <- Seq(20L, 0x100L, 0x108L, 0x10000L, 0x1000004L, 0xfffffff0L);
        behind <- Seq(17, 300, 0x10000, 16, 1, 0)
      )
        if (sent - behind > echo) {
          echo = sent - behind
          d.sentReports(sent)
          d.send(answer(1, echo, 0, ticket = echo, order = Order.Silence))
          assert(d.waiting == (behind <= 16), s"$behind of $sent")
          if (d.waiting) d.take()
        }
      assert(echo == 0xfffffff0L && d.refused == 0)
    },
    "SRV-03: among forged answers at the speed of the wire every right one comes through" -> { dut =>
      val d      = new Driver(dut)
      val forged = answer(9, 1000, 1).updated(60, 0)
      // Preamble, headers, FCS and gap are 66 bytes.
      for (i <- 1 to 90)
        d.send(if (i % 3 == 0) answer(i, i.toLong, i.toLong) else forged, gap = 66 * 4 - 1)
      d.step(3000)
      assert(d.acknowledged == (3L to 90L by 3) && d.refused == 60)
    },
    "SRV-03: answers wait while others have what they need; of those that are too many all are counted" -> {
      dut =>
        val d      = new Driver(dut)
        val random = new Random(2)
        d.looks = true
        for (i <- 1 to 20) {
          dut.others.poke(true)
          d.step(random.nextInt(700))
          d.send(answer(2 * i, 2L * i, 2L * i), gap = random.nextInt(700))
          d.send(answer(2 * i + 1, 2L * i + 1, 2L * i + 1), gap = random.nextInt(700))
          dut.others.poke(false)
          d.step(3000)
        }
        assert(d.acknowledged == (2L to 40L by 2) && d.refused == 20)
    }
  )
}

object ServerLinkSpec {
  val Master             = 0x1234
  val ServerLife         = 0x8899aabbccddeeffL
  val Key: Seq[Int]      = (0 until 16).map(i => (i + 1) * 7 & 0xff)
  val LifeOfMaster: Long = (0 until 8).foldLeft(0L)((w, i) => w << 8 | ((i + 3) * 11 & 0xff))

  def bigEndian(value: Long, bytes: Int): Seq[Int] =
    (bytes - 1 to 0 by -1).map(i => (value >>> (8 * i) & 0xff).toInt)

  /** An answer with its tag. */
  def answer(
      turn: Int,
      echo: Long,
      number: Long,
      ticket: Long = 0,
      order: Int = 0,
      node: Int = 0,
      seconds: Int = 0,
      trouble: Int = 0,
      server: Long = ServerLife,
      master: Int = Master,
      life: Long = LifeOfMaster,
      key: Seq[Int] = Key
  ): Seq[Int] = {
    def bytes(layout: Layout, values: (Layout.Field, Long)*) =
      layout.encode(values: _*).toSeq.map(_ & 0xff)
    val message = bytes(
      AnswerLayout,
      AnswerLayout.Magic   -> ServerDatagram.Magic.toLong,
      AnswerLayout.Version -> ServerDatagram.Version.toLong,
      AnswerLayout.Kind    -> ServerDatagram.KindAnswer.toLong,
      AnswerLayout.Master  -> master.toLong,
      AnswerLayout.Life    -> life,
      AnswerLayout.Server  -> server,
      AnswerLayout.Turn    -> turn.toLong,
      AnswerLayout.Echo    -> echo,
      AnswerLayout.Number  -> number,
      AnswerLayout.Ticket  -> ticket,
      AnswerLayout.Order   -> order.toLong,
      AnswerLayout.Trouble -> trouble.toLong,
      AnswerLayout.Node    -> node.toLong,
      AnswerLayout.Seconds -> seconds.toLong
    ).take(AnswerLayout.Tag.offset)
    val nonce = bytes(
      NonceLayout,
      NonceLayout.Life    -> server,
      NonceLayout.Origin  -> ServerDatagram.OfServer.toLong,
      NonceLayout.Counter -> turn.toLong
    )
    message ++ AsconModel.tag(key, nonce, message)
  }
}
