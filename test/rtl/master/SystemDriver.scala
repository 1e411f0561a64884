package flyframe.master

import scala.collection.mutable
import chiseltest._
import flyframe.ethernet.UdpPackets
import flyframe.model.{SentFrame, WireFrame}
import flyframe.registers.MasterRegisters

/** Runs a [[RecordedMaster]] between a modelled line and a modelled server. Times are slots of 40 ns.
  *
  * @param busCycle
  *   length of a bus cycle
  */
class SystemDriver(dut: RecordedMaster, val line: TimedLine, val server: ServerModel, busCycle: Int) {
  import SystemDriver._
  var slot: Long = 0

  /** Called with the first and last slot of each report and its data, as it leaves. */
  var onReport: (Long, Long, Array[Byte]) => Unit = (_, _, _) => ()

  /** Reports and acknowledgements on their way that are lost, of a hundred. */
  var lossPercent    = 0
  private val random = new scala.util.Random(3)

  private val seen   = Array(0, 0)   // frames of the recorders
  private val free   = Array(0L, 0L) // when the players are
  private val toCome = Array.fill(2)(mutable.Queue.empty[(Long, Vector[Int])])
  dut.clock.setTimeout(0)
  dut.host.req.poke(false)
  dut.restart.poke(false)
  dut.alarm.config_fault.poke(false)
  for (y <- 0 to 1) {
    dut.link(y).poke(true)
    dut.load(y).poke(false)
    dut.playLength(y).poke(0)
  }

  /** Lets time pass. */
  def run(slots: Long): Unit = {
    val end = slot + slots
    while (slot < end) {
      val waiting = (0 to 1).filter(toCome(_).nonEmpty)
      waiting.find(free(_) <= slot) match {
        case Some(y) => load(y)
        case None    => pass(((end +: waiting.map(free(_))).min min (slot + Chunk)) - slot)
      }
      look()
    }
  }
  def cycles(count: Int): Unit = run(count.toLong * busCycle)

  /** Runs until nothing waits at any slave and the server has all events there are. */
  def settle(): Unit = {
    var left = 1000
    var calm = 0
    while (calm < 3) {
      require(left > 0, s"the line does not come to rest: ${line.waiting} records wait")
      val known = server.log.size
      cycles(10)
      left -= 1
      calm = if (line.done && server.log.size == known) calm + 1 else 0
    }
  }

  private def pass(slots: Long): Unit = {
    dut.clock.step(2 * slots.toInt)
    slot += slots
  }

  /** Gives a player its next frame. */
  private def load(port: Int): Unit = {
    val (at, nibbles) = toCome(port).dequeue()
    dut.playLength(port).poke(0)
    dut.load(port).poke(true)
    for ((part, word) <- nibbles.grouped(64).zipWithIndex) {
      dut.playWord.poke(word)
      dut.play.poke(BigInt(part.reverseIterator.map(_.toHexString).mkString, 16))
      pass(1)
    }
    dut.load(port).poke(false)
    val start = at max (slot + 1)
    dut.playStart(port).poke(start)
    dut.playLength(port).poke(nibbles.size)
    free(port) = start + nibbles.size + Gap
  }
  private def play(port: Int, at: Long, frame: WireFrame): Unit =
    toCome(port).enqueue((at, frame.symbols.map(_.nibble)))

  /** Takes what the recorders have. */
  private def look(): Unit = {
    val counts = dut.count.peekInt().toInt
    for (y <- 0 to 1; count = counts >> (16 * y) & 0xffff if count != seen(y)) {
      require((count - seen(y) & 0xffff) == 1, "more frames than one in a chunk")
      seen(y) = count
      dut.port.poke(y == 1)
      dut.bank.poke((count - 1 & 1) == 1)
      val (start, length) = (dut.start.peekInt().toLong, dut.length.peekInt().toInt)
      val nibbles = (0 until length by 16)
        .flatMap { at =>
          dut.word.poke(at / 16)
          val word = dut.nibbles.peekInt()
          (0 until 16).map(i => (word >> (4 * i) & 0xf).toInt)
        }
        .take(length)
        .toVector
      val frame = SentFrame(nibbles.indexOf(0xd), nibbles.drop(nibbles.indexOf(0xd) + 1))
      require(frame.good, s"the master sends a bad frame: $frame")
      if (y == 0) onLine(start, frame) else onPlant(start, start + length - 1, frame)
    }
  }
  private def onLine(start: Long, frame: SentFrame): Unit =
    for ((at, _, back) <- line.send(0, start.toDouble, frame.payload)) play(0, at.ceil.toLong, back.onWire)

  private def onPlant(start: Long, end: Long, frame: SentFrame): Unit = {
    // Behind the headers of Ethernet, IP and UDP.
    val length = (frame.bytes(38) << 8 | frame.bytes(39)) - 8
    val data   = frame.bytes.slice(42, 42 + length).map(_.toByte).toArray
    onReport(start, end, data)
    def lost = random.nextInt(100) < lossPercent
    if (!lost) server.receive(data).filterNot(_ => lost).foreach { answer =>
      val bytes = UdpPackets.packet(Server, Master, answer.toSeq.map(_ & 0xff))
      play(1, slot + AnswerSlots, WireFrame.withFcs(bytes))
    }
  }

  // ---- the host ----

  private def access(address: Int, write: Boolean, byte: Int): Int = {
    dut.host.addr.poke(address)
    dut.host.write.poke(write)
    dut.host.wdata.poke(byte)
    dut.host.be.poke(1)
    dut.host.req.poke(true)
    // The acknowledgement lasts for one cycle; after a reset it takes 256 (HOST-10).
    var cycles = 0
    def step(): Unit = {
      dut.clock.step()
      cycles += 1
      require(cycles < 290, s"no acknowledgement at $address")
    }
    step()
    while (!dut.host.ack.peekBoolean()) step()
    val result = dut.host.rdata.peekInt().toInt
    dut.host.req.poke(false)
    step()
    if (cycles % 2 == 1) step()
    slot += cycles / 2
    look()
    result
  }
  def read(address: Int, count: Int = 1): Long =
    (0 until count).map(i => access(address + i, write = false, 0).toLong << (8 * i)).sum
  def write(address: Int, bytes: Int*): Unit =
    bytes.zipWithIndex.foreach { case (b, i) => access(address + i, write = true, b) }
  private def word(v: Int, count: Int = 2) = (0 until count).map(i => v >> (8 * i) & 0xff)
  private def address(v: Long, count: Int) = (0 until count).map(i => (v >> (8 * i) & 0xff).toInt).reverse

  /** Starts the master, for the first time or anew, with the number of a life. */
  def start(life: Int): Unit = {
    dut.restart.poke(true)
    pass(8)
    dut.restart.poke(false)
    pass(8)
    // A frame that was cut off reaches nobody.
    for (y <- 0 to 1) seen(y) = dut.count.peekInt().toInt >> (16 * y) & 0xffff
    write(0x0010, address(Server.mac, 6) ++ address(Master.mac, 6): _*)
    write(0x001c, address(Master.ip, 4) ++ address(Server.ip, 4): _*)
    write(0x0024, address(Master.port.toLong, 2) ++ address(Server.port.toLong, 2): _*)
    write(0x0028, word(MasterId) ++ word(life): _*)
    write(0x0030, word(busCycle, 3): _*)
    write(0x0038, word(RepeatMs) ++ word(HeartbeatMs): _*)
    write(0x003d, 1)
    write(0x0094, 0xff, 0xff)
    write(MasterRegisters.MasterKey, ServerModel.Key: _*)
    write(MasterRegisters.MasterLife, address(LifeBase + life, 8): _*)
    for ((node, i) <- line.slaves.map(s => s.hostRead(0x12) | s.hostRead(0x13) << 8).zipWithIndex) {
      write(MasterRegisters.SlaveIndex, i)
      write(MasterRegisters.ExpectedNode, word(node): _*)
    }
    write(0x003c, 7)
  }

  /** A datagram of the host for the line; its working counter, if there was an answer. */
  def request(command: Int, address: Long, data: Seq[Int]): Option[Int] = {
    write(0x0050, command, data.size)
    write(0x0054, (0 until 4).map(i => (address >> (8 * i) & 0xff).toInt): _*)
    write(0x0058, data: _*)
    write(0x0060, 1)
    while ((read(0x0042) & 0x08) == 0) run(busCycle / 4)
    val counter = read(0x0064, 2).toInt
    Option.when(read(0x0062) == 1)(counter)
  }
}

object SystemDriver {
  private val Gap         = 24   // nibbles between two frames
  private val Chunk       = 160  // less than the shortest frame with its gap takes
  private val AnswerSlots = 1250 // 50 us
  private val RepeatMs    = 2
  private val HeartbeatMs = 20
  private val Master      = UdpPackets.End(0x020000000010L, 0xc0a80102L, 4000)
  private val Server      = UdpPackets.End(0x020000000001L, 0xc0a80101L, 4001)
  private val LifeBase    = 0x0123456789abcd00L
  val MasterId            = 0x0102
}
