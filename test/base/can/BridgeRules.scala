package flyframe.can

import flyframe.params.CanParams
import flyframe.registers.CanRegisters
import org.scalatest.flatspec.AnyFlatSpec
import scala.util.Random

/** Both ports of a node with a bridge, and on the bus of each another controller. All four have the registers
  * of port F.
  */
trait BridgeUnderTest {
  def write(port: Int, address: Int, bytes: Seq[Int]): Unit
  def read(port: Int, address: Int, count: Int): Seq[Int]
  def run(cycles: Int): Unit
  def cycle: Long
}

object BridgeUnderTest {
  val F      = 0
  val T      = 1
  val OnF    = 2
  val OnT    = 3
  val params = CanParams(bridge = true)
}

/** Rules of the bridge (BR-01 to BR-03). */
abstract class BridgeRules extends AnyFlatSpec {
  import BridgeUnderTest._
  import CanRegisters._

  protected def withBridge(body: BridgeUnderTest => Unit): Unit

  /** Frames of the longer tests. */
  protected def frames: Int = 60

  private val port  = PortStarts.head
  private val Run   = 1
  private val Loop  = 1 << 2
  private val Joins = 1 << 6

  private final class Bench(val dut: BridgeUnderTest, seed: Int = 1) {
    val random = new Random(seed)

    def set(p: Int, at: Int, bytes: Int*): Unit = dut.write(p, port + at, bytes)
    def get(p: Int, at: Int, count: Int): Int =
      dut.read(p, port + at, count).zipWithIndex.map { case (b, i) => b << 8 * i }.sum

    /** An entry that takes every frame, or those with an identifier word. */
    def filter(p: Int, entry: Int, word: Option[Int] = None): Unit = {
      def bytes(n: Int) = (0 until 4).map(i => n >> 8 * i & 0xff)
      val (value, mask) = word.fold((0, 0))(w => (w, 0xdfffffff))
      dut.write(
        p,
        FilterStarts.head + entry * FilterBytes,
        bytes(value | CanFiltersModel.InUse) ++ bytes(mask)
      )
    }

    /** 1 Mbit/s, or slower by a factor. */
    def start(p: Int, control: Int, slower: Int = 1): Unit = {
      val t = Rate.Fast.setting
      set(p, Control, 0)
      set(p, Timing, Rate.Fast.prescaler * slower - 1, 0, t.tseg1 - 1, t.tseg2 - 1 | t.sjw - 1 << 4)
      set(p, Control, control)
    }

    /** Ports F and T bridge everything by entry 8, the others receive everything. */
    def begin(control: Int = Run | Joins): Unit = {
      for (p <- Seq(F, T)) filter(p, 8)
      for (p <- Seq(OnF, OnT)) filter(p, 0)
      for (p <- Seq(F, T)) start(p, control)
      for (p <- Seq(OnF, OnT)) start(p, Run)
      dut.run(20 * Rate.Fast.bitCycles)
    }

    def any(): CanFrame = {
      val extended = random.nextBoolean()
      val id       = random.nextInt() & (if (extended) 0x1fffffff else 0x7ff)
      val remote   = random.nextInt(5) == 0
      val dlc      = random.nextInt(16)
      CanFrame(id, extended, remote, dlc, Seq.fill(CanFrame.size(dlc, remote))(random.nextInt(256)))
    }

    def request(p: Int, slot: Int, frame: CanFrame): Unit = {
      dut.write(p, SlotStarts.head + slot * FrameBytes, frame.bytes())
      set(p, Requests + slot / 8, 1 << slot % 8)
    }

    /** Sends a frame by slot 0, and waits until it is sent. */
    def send(p: Int, frame: CanFrame): Unit = {
      request(p, 0, frame)
      await(s"$frame is sent")((get(p, Requests, 2) & 1) == 0)
    }
    def await(what: String, bits: Int = 3000)(holds: => Boolean): Unit = {
      val end = dut.cycle + bits * Rate.Fast.bitCycles
      while (!holds) {
        assert(dut.cycle < end, s"not within $bits bits: $what")
        dut.run(20)
      }
    }

    /** Takes what has come to a port. */
    def received(p: Int): Seq[CanFrame] = Iterator
      .continually(get(p, RxLevel, 1))
      .takeWhile(_ > 0)
      .map { _ =>
        val frame = CanFrame.of(dut.read(p, port + RxFrame, FrameBytes))
        set(p, RxRelease, 1)
        frame
      }
      .toSeq

    def pending(p: Int): Int = get(p, Requests, 2)
    def dropped(p: Int): Int = get(p, BridgeDropped, 1)
    def settle(): Unit = {
      await("both ports have sent everything", 30000)(pending(F) == 0 && pending(T) == 0)
      dut.run(20 * Rate.Fast.bitCycles)
    }
    def inSlots(p: Int): Seq[CanFrame] = CanParams.BridgeSlots
      .filter(s => (pending(p) >> s & 1) == 1)
      .map(s => CanFrame.of(dut.read(p, SlotStarts.head + s * FrameBytes, FrameBytes)))
  }
  private def bench(body: Bench => Unit): Unit = withBridge(dut => body(new Bench(dut)))

  "BR-01: frames of any kind" should "reach the other bus unchanged and in order, both ways at once" in
    bench { b =>
      b.begin()
      val (there, back) = (Seq.fill(frames)(b.any()), Seq.fill(frames)(b.any()))
      var (gotT, gotF)  = (Seq.empty[CanFrame], Seq.empty[CanFrame])
      for ((x, y) <- there.zip(back)) {
        b.request(OnF, 0, x)
        b.request(OnT, 0, y)
        b.await("both are sent", 6000)((b.pending(OnF) & 1) == 0 && (b.pending(OnT) & 1) == 0)
        // The bridge sends by its own slots, whose frames may overtake each other by their order.
        b.settle()
        gotT ++= b.received(OnT)
        gotF ++= b.received(OnF)
      }
      assert(gotT == there && gotF == back)
      assert(b.dropped(F) == 0 && b.dropped(T) == 0)
      // BR-03: nothing has come back, and nothing is left.
      assert(b.received(OnT).isEmpty && b.received(OnF).isEmpty)
    }

  "BR-01: a frame that the filters 0 to 7 accept" should "stay on its bus, as without the control bit" in
    bench { b =>
      b.begin()
      val (stays, goes) = (CanFrame(0x100, false, false, 1, Seq(1)), CanFrame(0x200, false, false, 1, Seq(2)))
      b.filter(F, 3, Some(stays.word))
      b.send(OnF, stays)
      b.send(OnF, goes)
      b.settle()
      assert(b.received(OnT) == Seq(goes))
      assert(b.received(F) == Seq(stays, goes), "the host gets both")
      b.start(F, Run)
      b.dut.run(20 * Rate.Fast.bitCycles)
      b.send(OnF, goes)
      b.settle()
      assert(b.received(OnT).isEmpty)
    }

  "BR-03: an own frame in loop back that is over with it" should "not be bridged" in bench { b =>
    b.begin()
    val bit   = Rate.Fast.bitCycles
    val frame = CanFrame(0x123, false, false, 0, Nil)

    /** So long behind the request loop back ends, if it does; it is received, and its bus has heard nothing.
      */
    def isReceived(cycles: Int, ends: Boolean): Boolean = {
      b.set(F, Control, Run | Joins | Loop)
      b.dut.run(20 * bit)
      b.request(F, 0, frame)
      b.dut.run(cycles)
      val isThere = b.get(F, RxLevel, 1) > 0
      if (ends) b.set(F, Control, Run | Joins)
      b.dut.run(60 * bit)
      assert(b.received(OnT).isEmpty, s"loop back ends $cycles cycles behind the request")
      b.received(F)
      isThere
    }
    val end = (40 to 90).find(bits => isReceived(bits * bit, ends = false)).get * bit
    for (cycles <- end - 2 * bit to end) isReceived(cycles, ends = true)
  }

  "BR-01: a request" should "come at most 20 us behind the end of the frame" in bench { b =>
    b.begin()
    b.start(T, Joins) // stopped: what is requested stays
    for (n <- 0 until 8) {
      val frame = b.any()
      b.send(OnF, frame) // which ends later than for its receiver
      val end = b.dut.cycle
      b.await("the request", 100)(Integer.bitCount(b.pending(T)) == n + 1)
      assert(b.dut.cycle - end < 20 * params.coreClockMhz)
      assert(b.pending(T) == (1 << 9 + n) - (1 << 8), "the lowest free slot")
      assert(b.inSlots(T).contains(frame))
    }
    // Also when the one to be dropped must be found.
    b.send(OnF, CanFrame(0, false, false, 0, Nil))
    val end = b.dut.cycle
    b.await("the first one", 100)(b.dropped(T) == 1)
    assert(b.dut.cycle - end < 20 * params.coreClockMhz)
  }

  "BR-02: with all slots taken" should "drop and count the frame last in CAN order" in bench { b =>
    b.begin()
    b.start(T, Joins)
    val sent = Seq.fill(30)(b.any())
    for (f <- sent) {
      b.send(OnF, f)
      b.dut.run(20 * params.coreClockMhz)
    }
    val best = sent.sortBy(_.order).take(8)
    assert(b.inSlots(T).sortBy(_.order) == best)
    assert(b.dropped(T) == 22 && b.dropped(F) == 0)
    b.start(T, Run | Joins)
    b.settle()
    assert(b.received(OnT) == best, "they leave in CAN order")
    // A frame that is not before the last one is dropped itself, one of the same identifier, too.
    b.start(T, Joins)
    for (n  <- 0 until 8) b.send(OnF, CanFrame(0x100, false, false, 1, Seq(n)))
    for (id <- Seq(0x100, 0x101)) b.send(OnF, CanFrame(id, false, false, 1, Seq(9)))
    b.dut.run(20 * params.coreClockMhz)
    assert(b.inSlots(T).map(_.data.head) == (0 until 8) && b.dropped(T) == 24)
    b.set(T, Command, 2)
    b.dut.run(100)
    assert(b.dropped(T) == 0, "the counter is cleared with the others")
  }

  "BR-02: a bus that is too slow" should "get what is not counted as dropped, each frame once" in bench { b =>
    b.begin()
    for (p <- Seq(T, OnT)) b.start(p, if (p == T) Run | Joins else Run, slower = 4)
    // The host has slots of its own, and does not read its FIFO, which overflows.
    val hosts = Seq.fill(frames / 5)(b.any())
    val sent =
      Seq.tabulate(2 * frames)(n => b.any().copy(dlc = 2, remote = false, data = Seq(n & 0xff, n >> 8)))
    var got = Seq.empty[CanFrame]
    for ((f, n) <- sent.zipWithIndex) {
      b.send(OnF, f)
      if (n % 10 == 0 && (b.pending(T) & 1) == 0) b.request(T, 0, hosts(n / 10))
      got ++= b.received(OnT)
    }
    b.await("everything is sent", 100000)(b.pending(T) == 0)
    b.dut.run(200 * Rate.Fast.bitCycles)
    got ++= b.received(OnT)
    val bridged = got.filter(sent.contains)
    assert(bridged.distinct.size == bridged.size)
    assert(b.dropped(T) > 0 && bridged.size + b.dropped(T) == sent.size)
    assert((got diff bridged).nonEmpty && (got diff bridged).forall(hosts.contains))
    if (sent.size > params.rxFrames) assert(b.get(F, RxLevel, 1) == params.rxFrames)
  }

  "BR-03: own frames" should "not be taken, in loop back neither" in bench { b =>
    b.begin(Run | Joins)
    b.send(F, CanFrame(0x123, false, false, 1, Seq(1)))
    b.settle()
    assert(b.received(OnF).size == 1 && b.received(OnT).isEmpty)
    b.start(F, Run | Joins | Loop)
    b.dut.run(20 * Rate.Fast.bitCycles)
    b.send(F, CanFrame(0x124, false, false, 1, Seq(1)))
    b.settle()
    assert(b.received(F).size == 1 && b.received(OnT).isEmpty)
  }
}
