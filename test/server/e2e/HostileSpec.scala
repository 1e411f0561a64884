package flyframe.e2e

import java.net.{DatagramPacket, DatagramSocket, InetAddress, InetSocketAddress, SocketTimeoutException}
import java.nio.file.Paths
import org.scalatest.flatspec.AnyFlatSpec
import scala.util.Random
import flyframe.server.{Command, Event, Options, Protocol, Report}
import flyframe.protocol.{CommandResult, DetectorState, EventKind, ServerDatagram}

/** Datagrams to a master, over a real network, that must have no effect. Without one there are ten thousand
  * of each kind ([[FloodSpec]]).
  */
class HostileSpec extends AnyFlatSpec {
  private val PerKind = 250

  "SRV-02, SRV-03: hostile datagrams to a master" should "be counted and ignored; its line lives" in {
    val folder = AlarmSystem.emptyFolder(Paths.get("build/e2e/hostile"))
    val key    = AlarmSystem.makeKey(folder.resolve("key"))
    val secret = Options.readKey(key).fold(why => fail(why), identity)
    val socket = new DatagramSocket(new InetSocketAddress(InetAddress.getLoopbackAddress, 0))
    socket.setSoTimeout(20)
    val line =
      new AlarmLine(folder, socket.getLocalPort, key, Seq("--bus-cycle-us", "200", "--debounce-us", "20"))
    try {
      var last   = Option.empty[Report]
      var master = Option.empty[InetSocketAddress]
      var events = Vector.empty[Event]
      // As a server does: keeps what is new, acknowledges.
      def listen(): Unit = {
        val packet = new DatagramPacket(new Array[Byte](2048), 2048)
        try {
          socket.receive(packet)
          val report = Protocol.report(packet.getData.take(packet.getLength)).get
          last = Some(report)
          master = Some(packet.getSocketAddress.asInstanceOf[InetSocketAddress])
          events ++= report.events.drop((events.size - report.first).toInt)
          send(Protocol.acknowledgement(report.life, events.size.toLong))
        } catch { case _: SocketTimeoutException => () }
      }
      def send(bytes: Array[Byte]): Unit = socket.send(new DatagramPacket(bytes, bytes.length, master.get))
      def await(what: String)(condition: => Boolean): Unit = {
        val end = System.nanoTime + 150000000000L
        while (!condition) {
          listen()
          assert(System.nanoTime < end, s"$what did not happen: ${line.ask("status")}")
        }
      }
      def order(counter: Int, code: Int, node: Int) =
        Protocol.encode(Command(last.get.life, counter.toLong, code, node), secret)
      def commands              = events.filter(_.kind == EventKind.Command)
      def counted(name: String) = ujson.read(line.ask("status"))("master")(name).num.toInt

      await("all detectors are normal")(events.count(_.kind == EventKind.Detector) == 5)
      val good = order(1000, ServerDatagram.DetectorReset, 3)
      send(good)
      await("a good command is executed")(commands.size == 1)

      val random             = new Random(7)
      def noise(length: Int) = { val b = new Array[Byte](length); random.nextBytes(b); b }
      val kinds = Seq[(String, () => Array[Byte])](
        "noise"     -> (() => noise(1 + random.nextInt(64))),
        "cut off"   -> (() => order(2000, 1, 0xffff).take(12 + random.nextInt(20))),
        "oversized" -> (() => order(2000, 1, 0xffff) ++ noise(1 + random.nextInt(1400))),
        "forged" -> (() => {
          val c = order(2000, 1, 0xffff); val i = 16 + random.nextInt(16);
          c(i) = (c(i) ^ (1 + random.nextInt(255))).toByte; c
        }),
        "replayed" -> (() => if (random.nextBoolean()) good else order(random.nextInt(1001), 1, 0xffff))
      )
      for ((_, make) <- kinds; _ <- 1 to PerKind) {
        send(make())
        if (random.nextInt(20) == 0) listen()
      }
      line.ask("smoke 2 on")
      await("an alarm is reported all the same")(
        events.exists(e => e.kind == EventKind.Detector && e.state == DetectorState.Alarm && e.node == 2)
      )
      send(order(1001, ServerDatagram.AlarmClear, ServerDatagram.AllNodes))
      // Behind what is still on its way the mailbox may be full.
      await("and the next good command is executed") {
        if (counted("accepted") == 1) send(order(1001, ServerDatagram.AlarmClear, ServerDatagram.AllNodes))
        commands.size == 2
      }
      assert(
        commands.map(c => (c.position, c.state)) == Seq(
          ServerDatagram.DetectorReset,
          ServerDatagram.AlarmClear
        ).map(
          _ -> CommandResult.Done
        )
      )
      assert(counted("accepted") == 2)
      for (kind <- Seq("malformed", "forged", "replayed")) assert(counted(kind) > 0, kind)
    } finally {
      line.close()
      socket.close()
    }
  }
}
