package flyframe.can

import chisel3._
import chisel3.util._
import chiseltest._
import flyframe.StandingSimulation
import flyframe.params.CanParams

/** A port with what a bench does in each core cycle, in hardware: calls into the simulation take far longer
  * than the simulation itself, so that any time in which the others do nothing new is one.
  */
class PortUnderTest(p: CanParams, isTolerant: Boolean = true) extends Module {

  /** The others are recessive; what they drive is heard whatever the port drives. */
  val others = IO(Input(Bool()))
  val forced = IO(Input(Bool()))

  /** Another level than before: a stretch of time begins, in which others and forced stay. */
  val mark = IO(Input(Bool()))

  /** What was driven since: in its first cycle, how often it changed then (0 to 3), and after how many cycles
    * for the first time; and the last levels, the newest at the right.
    */
  val first   = IO(Output(Bool()))
  val changes = IO(Output(UInt(2.W)))
  val after   = IO(Output(UInt(8.W)))
  val trace   = IO(Output(UInt(PortUnderTest.Longest.W)))

  /** The level that is driven now. */
  val driven = IO(Output(Bool()))

  /** The time begins with the cycle in which it becomes true. */
  val counting = IO(Input(Bool()))
  val us       = IO(Output(UInt(32.W)))

  /** Another level than before: an access with `address` and so on, until `idle`. */
  val go      = IO(Input(Bool()))
  val write   = IO(Input(Bool()))
  val address = IO(Input(UInt(16.W)))
  val be      = IO(Input(UInt(4.W)))
  val wdata   = IO(Input(UInt(32.W)))
  val rdata   = IO(Output(UInt(32.W)))
  val idle    = IO(Output(Bool()))

  private val port = Module(new CanPort(p, 0, isTolerant = isTolerant))
  port.rx := others && (forced || port.tx)
  driven  := port.tx

  private val begins    = mark =/= RegNext(mark, false.B)
  private val cycles    = Reg(UInt(8.W))
  private val before    = RegNext(port.tx)
  private val firstOne  = Reg(Bool())
  private val count     = Reg(UInt(2.W))
  private val firstTime = Reg(UInt(8.W))
  private val history   = Reg(UInt(PortUnderTest.Longest.W))
  history := history ## port.tx
  cycles  := Mux(begins, 1.U, cycles + 1.U)
  when(begins) {
    firstOne := port.tx
    count    := 0.U
  }.elsewhen(before =/= port.tx && count =/= 3.U) {
    count := count + 1.U
    when(count === 0.U) { firstTime := cycles }
  }
  first   := firstOne
  changes := count
  after   := firstTime
  trace   := history

  private val fraction = RegInit(0.U(log2Ceil(p.coreClockMhz).W))
  private val micros   = RegInit(0.U(32.W))
  when(counting) {
    fraction := fraction + 1.U
    when(fraction === (p.coreClockMhz - 1).U) {
      fraction := 0.U
      micros   := micros + 1.U
    }
  }
  port.time := micros
  us        := micros

  private val asks   = RegInit(false.B)
  private val read   = Reg(UInt(32.W))
  private val starts = go =/= RegNext(go, false.B)
  when(starts) { asks := true.B }
  when(port.host.ack) {
    asks := false.B
    read := port.host.rdata
  }
  port.host.req   := (asks || starts)
  port.host.write := write
  port.host.addr  := address
  port.host.be    := be
  port.host.wdata := wdata
  rdata           := read
  idle            := !asks
}

object PortUnderTest {

  /** Cycles of a stretch of time, at most. */
  val Longest = 256
}

/** A [[PortUnderTest]] as testers of CAN controllers meet it. */
class RtlPort(dut: PortUnderTest) extends CanUnderTest {
  private var passed = 0L
  private var mark   = false
  private var go     = false
  private var level  = true
  private var poked  = (true, false)
  private var asked  = 0L // when the access at hand began

  dut.clock.setTimeout(0)
  dut.others.poke(true)
  dut.forced.poke(false)
  dut.mark.poke(false)
  dut.go.poke(false)
  dut.counting.poke(false)
  dut.reset.poke(true.B)
  dut.clock.step(2)
  dut.reset.poke(false.B)
  dut.clock.step(PortMemory.Words + 4) // its memory is cleared
  dut.counting.poke(true)

  def cycle: Long     = passed
  def driven: Boolean = level

  def step(heard: Boolean): Unit = pass(heard, forced = true, 1)

  override def run(others: Boolean, cycles: Int, forced: Boolean): IndexedSeq[Boolean] =
    if (cycles <= PortUnderTest.Longest) pass(others, forced, cycles)
    else
      pass(others, forced, PortUnderTest.Longest) ++
        run(others, cycles - PortUnderTest.Longest, forced)

  private def pass(others: Boolean, forced: Boolean, cycles: Int): IndexedSeq[Boolean] =
    if (cycles == 0) Vector.empty
    else {
      if (poked._1 != others) dut.others.poke(others)
      if (poked._2 != forced) dut.forced.poke(forced)
      poked = (others, forced)
      mark = !mark
      dut.mark.poke(mark)
      dut.clock.step(cycles)
      passed += cycles
      val was = level
      level = dut.driven.peekBoolean()
      if (cycles == 1) Vector(was)
      else
        dut.changes.peekInt().toInt match {
          case 0 => Vector.fill(cycles)(was)
          case 1 =>
            val after = dut.after.peekInt().toInt
            Vector.tabulate(cycles)(i => if (i < after) was else !was)
          case _ =>
            val trace = dut.trace.peekInt()
            Vector.tabulate(cycles)(i => trace.testBit(cycles - 1 - i))
        }
    }

  /** It hears the first `count` levels, a cycle each.
    *
    * @return
    *   what it drove meanwhile
    */
  def replay(heard: Array[Boolean], count: Int): IndexedSeq[Boolean] = {
    val drove = IndexedSeq.newBuilder[Boolean]
    var at    = 0
    while (at < count) {
      var end = at + 1
      while (end < count && heard(end) == heard(at)) end += 1
      drove ++= run(heard(at), end - at, forced = true)
      at = end
    }
    drove.result()
  }

  /** Begins an access of the word at `address`, which lasts some cycles. */
  private def begin(address: Int, write: Boolean, be: Int, data: Long): Unit = {
    dut.address.poke(address)
    dut.write.poke(write)
    dut.be.poke(be)
    dut.wdata.poke(data)
    go = !go
    dut.go.poke(go)
    asked = passed
  }

  /** Begins to write `bytes`, which lie in one word. */
  def beginWrite(address: Int, bytes: Seq[Int]): Unit = {
    val lanes = bytes.indices.map(_ + address % 4)
    val data  = lanes.zip(bytes).map { case (lane, byte) => byte.toLong << 8 * lane }.sum
    begin(address & ~3, write = true, lanes.map(1 << _).sum, data)
  }

  /** Begins to read the word at `address`. */
  def beginRead(address: Int): Unit = begin(address, write = false, 15, 0)

  def isAccessing: Boolean = {
    assert(passed - asked <= CanUnderTest.AccessCycles, s"an access takes ${passed - asked} cycles")
    !dut.idle.peekBoolean()
  }

  /** The bytes that the last access has read. */
  def wordRead: Seq[Int] = {
    val data = dut.rdata.peekInt().toLong
    (0 to 3).map(i => (data >> 8 * i & 0xff).toInt)
  }

  private def finish(): Unit = do pass(others = true, forced = false, 1) while (isAccessing)

  def write(address: Int, bytes: Seq[Int]): Unit = for (word <- words(address, bytes.size)) {
    val inWord = bytes.indices.filter(i => (address + i & ~3) == word)
    beginWrite(address + inWord.head, inWord.map(bytes(_)))
    finish()
  }

  def read(address: Int, count: Int): Seq[Int] =
    words(address, count)
      .flatMap { word =>
        val data =
          if (word == CanUnderTest.TimeAddress) {
            val time = dut.us.peekInt().toLong
            (0 to 3).map(i => (time >> 8 * i & 0xff).toInt)
          } else {
            beginRead(word)
            finish()
            wordRead
          }
        data.zipWithIndex.map { case (byte, i) => word + i -> byte }
      }
      .collect { case (at, byte) if at >= address && at < address + count => byte }

  private def words(address: Int, count: Int) = (address & ~3) until address + count by 4
}

/** One simulation of a port for all suites that need one. */
object CanSimulation {
  private val simulation = new StandingSimulation(new PortUnderTest(CanParams()), this, "port")
  private val onRing =
    new StandingSimulation(new PortUnderTest(CanParams(), isTolerant = false), this, "port on the ring")

  /** Runs `body` with a port fresh out of reset, which is the end of the one before: within a body, too. */
  def apply(p: CanParams, isTolerant: Boolean = true)(body: CanUnderTest => Unit): Unit = {
    require(p == CanParams(), s"the parameters are $p but must be ${CanParams()}.")
    (if (isTolerant) simulation else onRing) (dut => body(new RtlPort(dut)))
  }
}
