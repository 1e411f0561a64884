package flyframe.server

import java.net.DatagramSocket
import scala.collection.mutable
import scala.util.Random
import flyframe.protocol.{RingFlag, RingPart, RingResult}

/** A ring's gateway as the server sees it (GW-04 to GW-06), and the network in between.
  *
  * @param faults
  *   how likely a datagram is lost, comes twice or comes late, each, in both directions
  * @param begin
  *   number of its first part
  */
final class ModelGateway(
    val life: Life,
    port: Int,
    key: Array[Byte] = ServerBench.key,
    faults: Double = 0,
    random: Random = new Random(1),
    socket: DatagramSocket = ModelStation.socket(),
    begin: Long = 0
) extends ModelStation(port, faults, random, socket) {
  private val kept    = mutable.Buffer.empty[Part]
  private var first   = begin
  private var counter = 0L // of the last report
  private var echo    = 0L // of the last answer taken
  private var known   = 0L // life of the server
  private var taken   = 0L // counter of the last message of the server

  // Reports by the life of the server that they named; whether one of the right one was answered.
  private val knownThen = mutable.Map.empty[Long, Long]
  private var isProven  = false

  /** Messages of the server, in the order in which they were taken; what is told of each. */
  val sends                    = mutable.Buffer.empty[RingSend]
  var results: RingSend => Int = _ => RingResult.Delivered
  var tells                    = true

  /** Whether the node of a message answers, so that there is a result. */
  var answers: RingSend => Boolean = _ => true

  /** Bits of `RingStatus`. */
  var status = 0

  def waiting: Int = kept.size

  def happen(parts: Part*): Unit = kept ++= parts

  /** A message that a node has for the server, cut as a gateway does. */
  def message(
      source: Int,
      pipe: Int,
      number: Int,
      data: Seq[Byte],
      lifeByte: Int = 5,
      urgent: Boolean = false,
      repeat: Boolean = false
  ): Unit = {
    val flags = (if (urgent) RingFlag.Urgent else 0) | (if (repeat) RingFlag.Repeat else 0)
    happen(
      data.toVector
        .grouped(1400)
        .zipWithIndex
        .map { case (piece, i) =>
          Part(RingPart.Message, source, piece, pipe, number, lifeByte, flags, data.size, 1400 * i)
        }
        .toSeq: _*
    )
  }
  def node(address: Int, bytes: Int*): Unit = happen(
    Part(RingPart.Node, address, bytes.map(_.toByte).toVector)
  )
  def ring(a: Int, b: Int): Unit = happen(Part(RingPart.Ring, 1, Vector(a.toByte, b.toByte)))

  /** Sends a report: as many of the oldest parts as a datagram holds. */
  def report(): Unit = {
    counter += 1
    knownThen(counter) = known
    var parts = kept.toVector
    def made  = RingProtocol.encode(RingReport(life, known, counter, first, taken, status, parts), key)
    while (made.length > RingProtocol.MostBytes) parts = parts.init
    send(made)
  }

  /** Reports and listens until the server has all, or for a minute. */
  def settle(repeatMs: Int = 10): Unit = {
    val end = System.nanoTime() + 60000000000L
    while ((kept.nonEmpty || !isProven) && System.nanoTime() < end) {
      report()
      listen(repeatMs)
    }
  }

  protected def take(datagram: Array[Byte]): Unit = {
    for (a <- Protocol.answer(datagram, key) if a.life == life && a.echo > echo) {
      echo = a.echo
      known = a.server
      isProven = knownThen(echo) == known
      if (a.number > first && a.number <= first + kept.size) {
        kept.remove(0, (a.number - first).toInt)
        first = a.number
      }
    }
    for (s <- RingProtocol.send(datagram, key))
      if (s.life == life && s.server == known && s.counter == taken + 1) {
        taken = s.counter
        sends += s
        val counter = Seq(24, 16, 8, 0).map(n => (s.counter >> n).toByte)
        if (tells && answers(s)) happen(Part(RingPart.Result, 1, (counter :+ results(s).toByte).toVector))
      }
  }
}
