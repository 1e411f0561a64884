package flyframe.e2e

import java.net.{DatagramPacket, DatagramSocket, InetAddress, InetSocketAddress, SocketTimeoutException}
import java.nio.file.Paths
import org.scalatest.flatspec.AnyFlatSpec
import scala.util.Random
import flyframe.server.{Answer, Event, Keys, Protocol, Report}
import flyframe.protocol.{CommandResult, DetectorState, EventKind, Order, ServerDatagram}

/** Datagrams to a master, over a real network, that must have no effect. Without one there are ten thousand
  * of each kind ([[FloodSpec]]).
  */
class HostileSpec extends AnyFlatSpec {
  private val PerKind = 250

  "SRV-02, SRV-03: hostile datagrams to a master" should "be counted and ignored; its line lives" in {
    val folder = AlarmSystem.emptyFolder(Paths.get("build/e2e/hostile"))
    val key    = AlarmSystem.makeKey(folder.resolve("key"))
    val secret = Keys.read(key).fold(why => fail(why), identity).of(1).get
    val socket = new DatagramSocket(new InetSocketAddress(InetAddress.getLoopbackAddress, 0))
    socket.setSoTimeout(20)
    val line =
      new AlarmLine(folder, socket.getLocalPort, key, Seq("--bus-cycle-us", "200", "--debounce-us", "20"))
    try {
      var last   = Option.empty[Report]
      var master = Option.empty[InetSocketAddress]
      var events = Vector.empty[Event]
      val server = 0x1234567890abcdefL
      var turn   = 0L
      var ticket = 7L
      // What the next answer orders.
      var wanted = Option.empty[(Int, Int)]
      def answer(): Array[Byte] = {
        turn += 1
        val plain = Answer(last.get.life, server, turn, last.get.counter, events.size.toLong)
        val full = wanted.fold(plain) { case (order, node) =>
          val seconds = if (order == Order.Test) 5 else 0
          plain.copy(ticket = ticket, order = order, node = node, seconds = seconds)
        }
        Protocol.encode(full, secret)
      }
      // As a server does: keeps what is new, answers.
      def listen(): Unit = {
        val packet = new DatagramPacket(new Array[Byte](2048), 2048)
        try {
          socket.receive(packet)
          val datagram = packet.getData.take(packet.getLength)
          val report   = Protocol.report(datagram).get
          assert(Protocol.isRight(report, datagram, secret))
          last = Some(report)
          master = Some(packet.getSocketAddress.asInstanceOf[InetSocketAddress])
          events ++= report.events.drop((events.size - report.first).toInt)
          send(answer())
        } catch { case _: SocketTimeoutException => () }
      }
      def send(bytes: Array[Byte]): Unit = socket.send(new DatagramPacket(bytes, bytes.length, master.get))
      def await(what: String)(condition: => Boolean): Unit = {
        val end = System.nanoTime + 300000000000L
        while (!condition) {
          listen()
          assert(System.nanoTime < end, s"$what did not happen: ${line.ask("status")}")
        }
      }
      def commands = events.filter(_.kind == EventKind.Command)
      def executed(order: Int, node: Int): Unit = {
        val before = commands.size
        ticket += 1
        wanted = Some((order, node))
        await(s"order $order is executed")(commands.size > before)
        wanted = None
      }
      def accepted = ujson.read(line.ask("status"))("master")("orders").num.toInt

      await("all detectors are normal")(events.count(_.kind == EventKind.Detector) >= 5)
      await("all slaves are known")(last.get.slaves.map(_.node) == (1 to 5))
      executed(Order.Test, 3)
      assert(accepted == 1)

      val random             = new Random(7)
      def noise(length: Int) = { val b = new Array[Byte](length); random.nextBytes(b); b }
      // An answer to the last report with an order that must not be executed.
      def evil(): Array[Byte] = Protocol.encode(
        Answer(last.get.life, server, turn + 1000000, last.get.counter, 0, 1000000, Order.Reset, 0xffff),
        secret.reverse
      )
      val old = answer()
      val kinds = Seq[(String, () => Array[Byte])](
        "noise"     -> (() => noise(1 + random.nextInt(64))),
        "cut off"   -> (() => evil().take(12 + random.nextInt(52))),
        "oversized" -> (() => evil() ++ noise(1 + random.nextInt(1400))),
        "forged"    -> (() => evil()),
        "replayed"  -> (() => old)
      )
      for ((_, make) <- kinds; _ <- 1 to PerKind) {
        send(make())
        if (random.nextInt(20) == 0) listen()
      }
      line.ask("smoke 2 on")
      await("an alarm is reported all the same")(
        events.exists(e => e.kind == EventKind.Detector && e.state == DetectorState.Alarm && e.node == 2)
      )
      executed(Order.Silence, ServerDatagram.AllNodes)
      val done = Seq(Order.Test, Order.Silence).map(_ -> CommandResult.Done)
      assert(commands.map(c => (c.position, c.state)) == done)
      assert(accepted == 2 && last.get.refused == 255)
    } finally {
      line.close()
      socket.close()
    }
  }
}
