package flyframe.transport

import java.io.{BufferedInputStream, BufferedOutputStream, DataInputStream}
import java.util.concurrent.ConcurrentLinkedQueue
import scala.collection.mutable
import scala.sys.process.Process

/** The transport in C: a child process, driven through its pipes (test/firmware/ring/node.c). */
class NodeInC(p: TransportParams, start: Long = 0) extends TransportUnderTest {
  import NodeInC._

  private val child  = acquire()
  private val in     = child.in
  private val out    = child.out
  private val fresh  = mutable.Buffer.empty[BusFrame]
  private val back   = mutable.Buffer.empty[Int]
  private val over   = mutable.Buffer.empty[Ended]
  private var hasOne = false
  begin(p, start)

  private def begin(p: TransportParams, now: Long): Unit = {
    out.write('B')
    say(p.address, 1)
    say(p.life, 1)
    say(p.kbps, 2)
    say(p.pdMs, 2)
    say(p.slots, 1)
    p.hello.foreach(out.write)
    say(now, 8)
  }

  private def say(n: Long, bytes: Int): Unit = for (i <- 0 until bytes) out.write((n >> 8 * i & 0xff).toInt)
  private def number(bytes: Int): Long = (0 until bytes).map(i => in.readUnsignedByte().toLong << 8 * i).sum
  private def bytes(count: Int): Seq[Int] = IndexedSeq.fill(count)(in.readUnsignedByte())
  private def map(): Set[Int] = {
    val raw = bytes(MapBytes)
    (0 to Sizes.LastAddress).filter(a => (raw(a / 8) >> a % 8 & 1) == 1).toSet
  }
  private def command(c: Char): Unit = out.write(c)

  def poll(now: Long): Long = {
    command('P')
    say(now, 8)
    out.flush()
    val due = number(8)
    for (_ <- 0L until number(1)) {
      val (id, dlc) = (number(4).toInt, number(1).toInt)
      fresh += BusFrame(id, dlc, bytes(8).take(dlc))
    }
    for (_ <- 0L until number(1)) back += number(4).toInt
    for (_ <- 0L until number(1)) over += Ended(number(2).toInt, Outcome(number(1).toInt), map())
    hasOne = number(1) == 1
    due
  }

  def receive(frame: BusFrame, now: Long): Unit = {
    command('F')
    say(frame.id, 4)
    say(frame.dlc, 1)
    frame.data.padTo(8, 0).foreach(out.write)
    say(now, 8)
  }

  def left(id: Int): Unit = {
    command('L')
    say(id, 4)
  }

  def queued(): Seq[BusFrame] = drain(fresh)
  def aborted(): Seq[Int]     = drain(back)
  def ended(): Seq[Ended]     = drain(over)

  def send(
      tag: Int,
      destination: Int,
      urgent: Boolean,
      data: Seq[Int],
      now: Long,
      members: Option[Set[Int]]
  ): Boolean = {
    command('S')
    say(now, 8)
    say(tag, 2)
    say(destination, 1)
    say(if (urgent) 1 else 0, 1)
    say(if (members.nonEmpty) 1 else 0, 1)
    val set = members.getOrElse(Set.empty)
    for (i <- 0 until MapBytes) say((0 until 8).filter(b => set(8 * i + b)).map(1 << _).sum, 1)
    say(data.size, 2)
    data.foreach(out.write)
    isTrue()
  }

  def cancel(tag: Int): Unit = {
    command('C')
    say(tag, 2)
  }

  /** As of the last `poll`. */
  def received: Option[Received] = Option.when(hasOne) {
    command('R')
    out.flush()
    val Seq(source, toAll, pipe, n, urgent, repeat) = bytes(6)
    Received(source, toAll == 1, pipe, n, urgent == 1, repeat == 1, bytes(number(2).toInt))
  }

  def take(now: Long, refused: Boolean): Unit = {
    command('T')
    say(if (refused) 1 else 0, 1)
    hasOne = false
  }

  def members(now: Long): Set[Int] = {
    command('M')
    say(now, 8)
    out.flush()
    map()
  }

  def setHello(bytes: Seq[Int], now: Long): Unit = {
    command('H')
    bytes.foreach(out.write)
  }

  def setObject(destination: Int, n: Int, data: Seq[Int], now: Long): Boolean = {
    command('O')
    Seq(destination, n, data.size).foreach(out.write)
    data.padTo(8, 0).take(8).foreach(out.write)
    isTrue()
  }

  def watch(source: Int, n: Int): Boolean = {
    command('W')
    Seq(source, n).foreach(out.write)
    isTrue()
  }

  def forgetValues(): Unit = command('D')

  def value(source: Int, n: Int, now: Long): (Seq[Int], Boolean) = {
    command('V')
    Seq(source, n).foreach(out.write)
    say(now, 8)
    out.flush()
    val Seq(length, old) = bytes(2)
    (bytes(8).take(length), old == 1)
  }

  def count(counter: Counter.Value): Int = {
    command('N')
    out.flush()
    Seq.fill(Counter.maxId)(number(4).toInt)(counter.id)
  }

  private def isTrue() = {
    out.flush()
    number(1) == 1
  }
  private def drain[A](buffer: mutable.Buffer[A]): Seq[A] = {
    val all = buffer.toList
    buffer.clear()
    all
  }

  /** The process is free for another node. */
  def release(): Unit = idle.add(child)
}

object NodeInC {
  private val MapBytes = Sizes.LastAddress / 8 + 1

  /** Built once in a run, as suites run at the same time. */
  private lazy val program: String = {
    val code = Process(Seq("make", "-s", "-f", "test/sim/test.mk", "transport-node")).!
    assert(code == 0, "the transport does not compile")
    "build/transport-node"
  }

  private class Child {
    private val process = new ProcessBuilder(program).redirectError(ProcessBuilder.Redirect.INHERIT).start()
    val in              = new DataInputStream(new BufferedInputStream(process.getInputStream))
    val out             = new BufferedOutputStream(process.getOutputStream, 1 << 16)
  }
  private val idle = new ConcurrentLinkedQueue[Child]

  private def acquire(): Child = Option(idle.poll()).getOrElse(new Child)
}
