package flyframe.node

import java.io.{BufferedInputStream, BufferedOutputStream, DataInputStream}
import flyframe.transport.BusFrame
import scala.sys.process.Process

/** The driver of a node's CAN port in C: a child process, driven through its pipes
  * (test/firmware/node/port.c).
  *
  * @param read
  *   reads registers: address, how many
  * @param write
  *   writes registers
  */
class DriverInC(read: (Int, Int) => Seq[Int], write: (Int, Seq[Int]) => Unit) {
  private val process =
    new ProcessBuilder(DriverInC.program).redirectError(ProcessBuilder.Redirect.INHERIT).start()
  private val in  = new DataInputStream(new BufferedInputStream(process.getInputStream))
  private val out = new BufferedOutputStream(process.getOutputStream)

  private def say(n: Long, bytes: Int): Unit = for (i <- 0 until bytes) out.write((n >> 8 * i & 0xff).toInt)
  private def number(bytes: Int): Int        = (0 until bytes).map(i => in.readUnsignedByte() << 8 * i).sum

  /** Carries out a command, and the accesses that the driver makes for it. */
  private def call(command: Char, parameters: (Long, Int)*): (Boolean, BusFrame) = {
    out.write(command)
    parameters.foreach { case (n, bytes) => say(n, bytes) }
    out.flush()
    var kind = number(1).toChar
    while (kind != '=') {
      val (address, length) = (number(2), number(2))
      if (kind == 'r') {
        read(address, length).foreach(out.write)
        out.flush()
      } else write(address, Seq.fill(length)(number(1)))
      kind = number(1).toChar
    }
    val result    = number(1) == 1
    val (id, dlc) = (number(4), number(1))
    (result, BusFrame(id, dlc, Seq.fill(8)(number(1)).take(dlc)))
  }

  def start(address: Int, home: Boolean, kbps: Int, coreMhz: Int): Boolean =
    start(address, home, kbps, coreMhz, relay = false, 0, 0)

  /** In relay mode. */
  def relay(address: Int, kbps: Int, coreMhz: Int, confirmUs: Int = 0, life: Int = 0): Boolean =
    start(address, home = false, kbps, coreMhz, relay = true, confirmUs, life)

  private def start(
      address: Int,
      home: Boolean,
      kbps: Int,
      coreMhz: Int,
      relay: Boolean,
      confirmUs: Int,
      life: Int
  ): Boolean = {
    def flag(set: Boolean) = if (set) 1L else 0L
    call(
      'I',
      address.toLong   -> 1,
      flag(home)       -> 1,
      kbps.toLong      -> 2,
      coreMhz.toLong   -> 1,
      flag(relay)      -> 1,
      confirmUs.toLong -> 4,
      life.toLong      -> 1
    )._1
  }
  def runs(): Boolean = call('G')._1
  def send(frame: BusFrame): Boolean =
    call(
      'S',
      Seq(frame.id.toLong -> 4, frame.dlc.toLong -> 1) ++ frame.data.padTo(8, 0).map(_.toLong -> 1): _*
    )._1
  def waits(id: Int): Boolean = call('W', id.toLong -> 4)._1
  def abort(id: Int): Unit    = call('A', id.toLong -> 4)
  def receive(): Option[BusFrame] = {
    val (is, frame) = call('R')
    Option.when(is)(frame)
  }
  def end(): Unit = process.destroy()
}

object DriverInC {
  private lazy val program: String = {
    val code = Process(Seq("make", "-s", "-f", "test/sim/test.mk", "node-port")).!
    assert(code == 0, "the driver of the CAN port does not compile")
    "build/node-port"
  }
}
