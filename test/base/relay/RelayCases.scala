package flyframe.relay

import flyframe.can.CanFrame
import flyframe.registers.{CanRegisters, RingRegisters}
import org.scalatest.flatspec.AnyFlatSpec
import scala.collection.mutable
import scala.collection.mutable.ArrayBuffer

/** A frame as it was read from a link.
  *
  * @param start
  *   number of its start bit
  * @param end
  *   number of the bit behind its last one, the end left out
  */
final case class ReadFrame(start: Int, end: Int, header: LinkHeader, body: Seq[Boolean], isGood: Boolean)

/** A node between two links on which a tester sends and reads. */
class RelayBench(val node: RelayUnderTest, val bit: Int = 25) {
  private val toSend                  = Seq.fill(2)(mutable.Queue.empty[Boolean])
  private val heard                   = Array(true, true)
  private val left                    = Array(0.0, 0.0)
  val bits: Seq[ArrayBuffer[Boolean]] = Seq.fill(2)(ArrayBuffer.empty[Boolean])

  /** The ports that are up. */
  val up: Array[Boolean] = Array(false, false)

  node.passes = () => cycle()

  /** What each port sends comes in at the other one. */
  var isLooped = false

  /** Bits of the tester are longer by so much. */
  var ppm = 0

  private def level(port: Int): Boolean = if (isLooped) node.level(1 - port)
  else {
    if (left(port) < 1) {
      heard(port) = if (toSend(port).isEmpty) true else toSend(port).dequeue()
      left(port) += bit * (1 + ppm / 1e6)
    }
    left(port) -= 1
    heard(port)
  }

  def cycle(): Unit = {
    for (port <- 0 to 1 if node.cycle % bit == bit / 2) bits(port) += node.level(port)
    node.step((level(0), level(1)), (up(0), up(1)))
  }

  def run(count: Int): Unit = for (_ <- 0 until count * bit) cycle()

  /** Runs until all is sent, and what follows from it. */
  def finish(): Unit = {
    while (toSend.exists(_.nonEmpty)) cycle()
    run(400)
  }

  def send(port: Int, levels: Seq[Boolean]): Unit = toSend(port) ++= levels

  /** A frame with its end, and idle bits. */
  def send(port: Int, header: LinkHeader, frame: CanFrame, gap: Int = 1): Unit =
    send(port, RelayBench.levels(header, frame) ++ Seq.fill(LinkFrame.EndBits + gap)(true))

  /** The frames that a port has sent, since bit `from`. */
  def frames(port: Int, from: Int = 0): Seq[ReadFrame] = RelayBench.read(bits(port).toIndexedSeq, from)

  /** The number of the present bit. */
  def now: Int = bits(0).size

  def write(address: Int, bytes: Int*): Unit = node.write(address, bytes)
  def read(address: Int): Int                = node.read(address, 1).head
  def map(which: Int): Int = {
    val bytes = node.read(CanRegisters.PortStarts(0) + which, 2)
    bytes.head | bytes(1) << 8
  }
  def conflict: Boolean = (read(RingRegisters.State) >> 4 & 1) == 1

  def request(slot: Int, frame: CanFrame): Unit = {
    node.write(CanRegisters.SlotStarts(0) + slot * CanRegisters.FrameBytes, frame.bytes())
    node.write(CanRegisters.PortStarts(0) + CanRegisters.Requests, Seq(1 << slot & 0xff, 1 << slot >> 8))
  }

  /** The frames received since. */
  def received(): Seq[CanFrame] = {
    val port   = CanRegisters.PortStarts(0)
    val frames = Seq.newBuilder[CanFrame]
    while (read(port + CanRegisters.RxLevel) > 0) {
      frames += CanFrame.of(node.read(port + CanRegisters.RxFrame, 16))
      write(port + CanRegisters.RxRelease, 0)
    }
    frames.result()
  }

  /** Relay mode with this address; the start of its life has come home. */
  def start(address: Int, confirmUs: Int = 400, life: Int = 5, retries: Int = 15): this.type = {
    write(RingRegisters.Address, address)
    write(RingRegisters.Confirm, confirmUs / 10 & 0xff, confirmUs / 10 >> 8)
    write(RingRegisters.Retries, retries)
    write(RingRegisters.Life, life)
    write(CanRegisters.FilterStarts(0), 0, 0, 0, 0x20, 0, 0, 0, 0)
    write(RingRegisters.Control, 1 << RingRegisters.Relay)
    for (port <- 0 to 1) up(port) = true
    isLooped = true
    run(2 * 2 * confirmUs + 400)
    isLooped = false
    run(20)
    this
  }
}

object RelayBench {

  /** The levels of a frame, without its end. */
  def levels(header: LinkHeader, frame: CanFrame): Seq[Boolean] =
    LinkFrame.levels(header, LinkBody.of(header, frame)).toSeq

  private def number(bits: Seq[Boolean]) = bits.foldLeft(0)((n, b) => n << 1 | (if (b) 1 else 0))

  /** Reads frames as the rules have them, not as the model does. */
  def read(bits: IndexedSeq[Boolean], from: Int): Seq[ReadFrame] = {
    val found = Seq.newBuilder[ReadFrame]
    var i     = from
    while (i < bits.size) {
      if (bits(i)) i += 1
      else {
        val start    = i
        val plain    = ArrayBuffer.empty[Boolean]
        var run      = 0
        var isBroken = false
        def total = {
          val head = plain.slice(1 + 40, 1 + 80)
          if (head.size < 40) Int.MaxValue
          else 1 + 80 + 32 + (if (head(1)) 0 else 8 * (number(head.takeRight(4).toSeq) min 8))
        }
        while (i < bits.size && !isBroken && (plain.size < total || run == 5)) {
          val isStuff = run == 5
          val isSame  = i > start && bits(i) == bits(i - 1)
          if (isStuff && isSame) isBroken = true
          else if (!isStuff) plain += bits(i)
          run = if (isSame) run + 1 else 1
          i += 1
        }
        val end    = i
        val body   = plain.drop(41).toSeq
        val hasEnd = bits.slice(end, end + 7).forall(identity)
        // Both CRCs leave a residue of their own behind their field, whatever was in front of it.
        def crc32 = LinkCrc.of((plain.slice(1, 25) ++ body.dropRight(32)).toSeq) == number(body.takeRight(32))
        if (plain.size > 40) {
          val head = plain.slice(1, 41).toSeq
          val h    = LinkHeader.of(number(head.take(32)))
          val isGood =
            !isBroken && plain.size == total && hasEnd && crc32 && number(head.takeRight(8)) == h.check
          found += ReadFrame(start, end, h, body, isGood)
        }
        while (i < bits.size && !bits.slice(i - 7, i).forall(identity)) i += 1
      }
    }
    found.result()
  }
}

/** What all suites of relay mode share: they run on the golden model and on the RTL. */
abstract class RelayCases extends AnyFlatSpec {

  /** Runs `body` with a node fresh out of reset. */
  protected def withNode(body: RelayUnderTest => Unit): Unit

  /** Runs `body` with a node of address 7 in relay mode, both ports up; a bit is 25 cycles. */
  protected def bench(address: Int = 7, retries: Int = 15, confirmUs: Int = 400)(
      body: RelayBench => Unit
  ): Unit = withNode(node => body(new RelayBench(node).start(address, confirmUs, retries = retries)))

  protected def data(id: Int, bytes: Int*): CanFrame =
    CanFrame(id, extended = true, remote = false, bytes.size, bytes)

  /** A header of a data frame from another node. */
  protected def from(source: Int, sequence: Int, direction: Int = 1, hops: Int = 250): LinkHeader =
    LinkHeader(LinkKind.Data, direction, source, sequence, hops)

  /** Bits of `confirmUs` of [[bench]]. */
  protected val confirm = 800

  /** The own frames that a port has sent, since bit `first`. */
  protected def own(b: RelayBench, port: Int, first: Int): Seq[ReadFrame] =
    b.frames(port, first).filter(_.header.source == 7)

  /** A copy of the own frame comes back. */
  protected def home(b: RelayBench, port: Int, direction: Int, sequence: Int, frame: CanFrame): Unit = {
    b.send(port, LinkHeader(0, direction, 7, sequence, 200), frame)
    b.run(260)
  }

  /** Slots of the host, a bit each. */
  protected def pending(b: RelayBench): Int = b.map(CanRegisters.Requests)
  protected def sent(b: RelayBench): Int    = b.map(CanRegisters.Sent)
  protected def failed(b: RelayBench): Int  = b.map(CanRegisters.Failed)

  protected def counter(b: RelayBench, which: Int): Int =
    b.read(RingRegisters.relay.find(_.name == RingRegisters.RelayCounterNames(which)).get.address)
}
