package flyframe.server

import java.net.{DatagramPacket, DatagramSocket, InetAddress, InetSocketAddress, SocketTimeoutException}
import scala.collection.mutable
import scala.util.Random

/** Somebody who talks with the server by UDP, and the network in between.
  *
  * @param port
  *   of the server
  * @param faults
  *   how likely a datagram is lost, comes twice or comes late, each, in both directions
  */
abstract class ModelStation(port: Int, faults: Double, random: Random, socket: DatagramSocket)
    extends AutoCloseable {
  private val server = new InetSocketAddress(ModelStation.loopback, port)
  private val late   = mutable.Buffer.empty[() => Unit]

  /** A datagram of the server has come. */
  protected def take(datagram: Array[Byte]): Unit

  protected def send(datagram: Array[Byte]): Unit =
    through(datagram)(d => socket.send(new DatagramPacket(d, d.length, server)))

  /** Takes what the server has sent, for so long, ms. */
  def listen(ms: Int): Unit = {
    val end    = System.nanoTime() + ms * 1000000L
    val packet = new DatagramPacket(new Array[Byte](2048), 2048)
    while ({
      val left = (end - System.nanoTime()) / 1000000
      left > 0 && {
        socket.setSoTimeout(left.toInt max 1)
        try {
          packet.setLength(2048)
          socket.receive(packet)
          through(packet.getData.take(packet.getLength))(take)
          true
        } catch { case _: SocketTimeoutException => false }
      }
    }) ()
  }

  private def through(datagram: Array[Byte])(deliver: Array[Byte] => Unit): Unit = {
    def happens = random.nextDouble() < faults
    if (happens) late += (() => deliver(datagram))
    else if (!happens) {
      deliver(datagram)
      if (happens) deliver(datagram)
      if (late.nonEmpty && random.nextBoolean()) late.remove(random.nextInt(late.size))()
    }
  }

  def close(): Unit = socket.close()
}

object ModelStation {
  val loopback: InetAddress    = InetAddress.getByAddress(Array[Byte](127, 0, 0, 1))
  def socket(): DatagramSocket = new DatagramSocket(new InetSocketAddress(loopback, 0))
}
