package flyframe.server

import java.net.{DatagramPacket, DatagramSocket, InetAddress, InetSocketAddress, SocketException}
import java.io.IOException
import scala.util.control.NonFatal

/** The UDP socket of the reports: gives every datagram to `receive` and sends answers. A datagram longer than
  * any report arrives cut off, but still too long.
  */
final class UdpLink(socket: DatagramSocket, receive: (Array[Byte], InetSocketAddress) => Unit)
    extends AutoCloseable {
  private val thread = new Thread(() => run(), "reports")

  def port: Int = socket.getLocalPort

  /** Datagrams are taken from now on. */
  def start(): Unit = thread.start()

  private def run(): Unit = {
    val packet =
      new DatagramPacket(new Array[Byte](Protocol.MostReportBytes + 1), Protocol.MostReportBytes + 1)
    while (!socket.isClosed)
      try {
        packet.setLength(packet.getData.length)
        socket.receive(packet)
        val from = packet.getSocketAddress.asInstanceOf[InetSocketAddress]
        receive(packet.getData.take(packet.getLength), from)
      } catch {
        case _: SocketException if socket.isClosed => ()
        // Whatever a datagram brings about, the next one is taken.
        case NonFatal(e) => Console.err.println(s"A datagram could not be taken: $e")
      }
  }

  /** Sends; what cannot be sent is lost, as on the network. */
  def send(datagram: Array[Byte], to: InetSocketAddress): Unit =
    try socket.send(new DatagramPacket(datagram, datagram.length, to))
    catch { case _: IOException => () }

  def close(): Unit = {
    socket.close()
    if (thread.isAlive) thread.join(1000)
  }
}

object UdpLink {

  /** Room for datagrams that wait, bytes, if the system grants so much. */
  private val ReceiveBuffer = 1 << 22

  /** Binds a socket; Left: why that is not possible. */
  def bind(address: InetAddress, port: Int): Either[String, DatagramSocket] =
    try {
      val socket = new DatagramSocket(new InetSocketAddress(address, port))
      socket.setReceiveBufferSize(ReceiveBuffer)
      Right(socket)
    } catch {
      case e: SocketException =>
        Left(s"UDP port $port at ${address.getHostAddress} cannot be used (${e.getMessage}).")
    }
}
