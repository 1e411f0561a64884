package flyframe.e2e

import java.io.IOException
import java.net.{DatagramPacket, DatagramSocket, InetAddress, InetSocketAddress, SocketException}
import flyframe.protocol.{AnswerLayout, Layout, ReportLayout}

/** Somebody between a master and its server: hears every datagram, lets it pass or not, and sends what he
  * wants, from the addresses of both.
  *
  * @param serverPort
  *   of the server on this computer
  */
final class Attacker(serverPort: Int) extends AutoCloseable {
  private val loopback                        = InetAddress.getByAddress(Array[Byte](127, 0, 0, 1))
  private val server                          = new InetSocketAddress(loopback, serverPort)
  private def socket()                        = new DatagramSocket(new InetSocketAddress(loopback, 0))
  private val (asServer, asMaster, asAnybody) = (socket(), socket(), socket())
  @volatile private var master                = Option.empty[InetSocketAddress]

  /** Datagrams pass. */
  @volatile var passes = true

  /** Those heard last. */
  @volatile var report = Option.empty[Array[Byte]]
  @volatile var answer = Option.empty[Array[Byte]]

  /** Where the master is to send its reports. */
  val port: Int = asServer.getLocalPort

  private val threads = Seq(
    hear(asServer) { (bytes, from) =>
      master = Some(from)
      report = Some(bytes)
      if (passes) asMaster.send(new DatagramPacket(bytes, bytes.length, server))
    },
    hear(asMaster) { (bytes, _) =>
      answer = Some(bytes)
      if (passes) toMaster(bytes)
    }
  )

  private def hear(socket: DatagramSocket)(take: (Array[Byte], InetSocketAddress) => Unit): Thread = {
    val thread = new Thread(() => {
      val packet = new DatagramPacket(new Array[Byte](2048), 2048)
      while (!socket.isClosed)
        try {
          packet.setLength(2048)
          socket.receive(packet)
          val from = packet.getSocketAddress.asInstanceOf[InetSocketAddress]
          take(packet.getData.take(packet.getLength), from)
        } catch {
          case _: SocketException if socket.isClosed => ()
          case _: IOException                        => () // lost, as on any network
        }
    })
    thread.setDaemon(true)
    thread.start()
    thread
  }

  /** Sends to the server, as the master. */
  def toServer(bytes: Array[Byte]): Unit = asMaster.send(new DatagramPacket(bytes, bytes.length, server))

  /** Sends to the master: as the server, or from another port. */
  def toMaster(bytes: Array[Byte], isServer: Boolean = true): Unit = for (to <- master)
    (if (isServer) asServer else asAnybody).send(new DatagramPacket(bytes, bytes.length, to))

  /** Sends to both what cannot be told from the real thing without the key, faster than the master's wire
    * takes it, until it is closed.
    */
  def flood(): AutoCloseable = {
    @volatile var ends = false
    val thread = new Thread(() => {
      var n = 0
      while (!ends) {
        n += 1
        for (bytes <- answer) toMaster(changed(bytes, AnswerLayout.Echo, n))
        for (bytes <- report) toServer(changed(bytes, ReportLayout.Counter, n))
        Thread.sleep(1)
      }
    })
    thread.start()
    () => {
      ends = true
      thread.join()
    }
  }

  /** Its tag does not fit any more. */
  private def changed(datagram: Array[Byte], field: Layout.Field, by: Int) = {
    val bytes = datagram.clone
    bytes(field.last) = (bytes(field.last) + 1 + by % 100).toByte
    bytes
  }

  def close(): Unit = {
    Seq(asServer, asMaster, asAnybody).foreach(_.close())
    threads.foreach(_.join(1000))
  }
}
