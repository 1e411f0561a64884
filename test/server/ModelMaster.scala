package flyframe.server

import java.net.{DatagramPacket, DatagramSocket, InetAddress, InetSocketAddress, SocketTimeoutException}
import scala.collection.mutable
import scala.util.Random
import flyframe.protocol.{CommandResult, EventKind, ServerDatagram}

/** A master as the server sees it (REP-01 to REP-06), with its host and the network in between.
  *
  * @param faults
  *   how likely a datagram is lost, comes twice or comes late, each, in both directions
  */
final class ModelMaster(
    val life: Life,
    port: Int,
    key: Array[Byte] = new Array[Byte](32),
    faults: Double = 0,
    random: Random = new Random(1),
    socket: DatagramSocket = ModelMaster.socket()
) extends AutoCloseable {
  private val server  = new InetSocketAddress(ModelMaster.loopback, port)
  private val kept    = mutable.Buffer.empty[Event]
  private val late    = mutable.Buffer.empty[() => Unit]
  private var first   = 0L
  private var counter = 0L // of the last command
  private val started = System.nanoTime()

  /** Commands taken; datagrams that were neither commands with a right code nor acknowledgements. */
  val commands = mutable.Buffer.empty[Command]
  var refused  = 0

  /** Events that are not acknowledged yet; all there ever were. */
  def waiting: Int = kept.size
  def all: Long    = first + kept.size

  /** us since the start */
  def time: Long = (System.nanoTime() - started) / 1000 + 1

  def happen(events: Event*): Unit = kept ++= events

  /** Sends a report: the oldest events, or a heartbeat. */
  def report(): Unit = {
    val events = kept.take(ServerDatagram.Most).toVector
    through(Protocol.encode(Report(life, first, events, present = 5, known = 5, time = time)))(send)
  }

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

  /** Reports and listens until all events are acknowledged, or for a minute. */
  def settle(repeatMs: Int = 10): Unit = {
    val end = System.nanoTime() + 60000000000L
    while (kept.nonEmpty && System.nanoTime() < end) {
      report()
      listen(repeatMs)
    }
  }

  private def send(datagram: Array[Byte]): Unit =
    socket.send(new DatagramPacket(datagram, datagram.length, server))

  private def through(datagram: Array[Byte])(deliver: Array[Byte] => Unit): Unit = {
    def happens = random.nextDouble() < faults
    if (happens) late += (() => deliver(datagram))
    else if (!happens) {
      deliver(datagram)
      if (happens) deliver(datagram)
      if (late.nonEmpty && random.nextBoolean()) late.remove(random.nextInt(late.size))()
    }
  }

  private def take(datagram: Array[Byte]): Unit = Protocol.acknowledged(datagram) match {
    case Some((l, number)) =>
      if (l == life && number > first && number <= first + kept.size) {
        kept.remove(0, (number - first).toInt)
        first = number
      }
    case None =>
      Protocol.command(datagram, key) match {
        case Some(c) if c.life == life && c.counter > counter =>
          counter = c.counter
          commands += c
          happen(Event(EventKind.Command, c.code, c.node, (c.counter & 0xffff).toInt, CommandResult.Done))
        case Some(_) => () // sent again
        case None    => refused += 1
      }
  }

  def close(): Unit = socket.close()
}

object ModelMaster {
  val loopback: InetAddress    = InetAddress.getByAddress(Array[Byte](127, 0, 0, 1))
  def socket(): DatagramSocket = new DatagramSocket(new InetSocketAddress(loopback, 0))
}
