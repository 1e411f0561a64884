package flyframe.can

import flyframe.params.CanParams
import org.scalatest.flatspec.AnyFlatSpec
import scala.util.Random

/** What all suites of a CAN controller share: they run on the golden model and on the RTL. */
abstract class CanCases extends AnyFlatSpec {
  import CanCases._

  /** Runs `body` with a controller fresh out of reset. */
  protected def withDevice(p: CanParams)(body: CanUnderTest => Unit): Unit

  /** The bit timings to test with; a bit has at least 50 core cycles. */
  protected def rates: Seq[Rate] = Seq(Rate.Fast, Rate.Slow)

  /** Runs `body` on a controller that has just started, is idle and error active, for each bit timing. */
  protected def each(body: LowerTester => Unit): Unit = for (rate <- rates) at(rate)(body)

  /** The same with other bits of the control register. */
  protected def eachWith(control: Int)(body: LowerTester => Unit): Unit =
    for (rate <- rates) at(rate, control)(body)

  protected def at(rate: Rate, control: Int = 0)(body: LowerTester => Unit): Unit =
    withDevice(CanParams()) { device =>
      val t = new LowerTester(device, rate)
      t.start(control)
      t.idle(12)
      body(t)
    }

  /** Runs `body` for each bit timing and each of `variants`, on a controller of its own. */
  protected def all[A](variants: Seq[A])(body: (LowerTester, A) => Unit): Unit =
    for (variant <- variants) each(body(_, variant))

  /** The same with one attempt for each frame. */
  protected def oneShot[A](variants: Seq[A])(body: (LowerTester, A) => Unit): Unit =
    for (variant <- variants) eachWith(OneShot)(body(_, variant))

  // ---- how to get where a case begins ----

  /** A receiver becomes error passive: 17 recessive bits, an error and 16 bits of its flags, and is idle. REC
    * is 129 then.
    */
  protected def passiveReceiver(t: LowerTester): Unit = {
    t.sendWrong(Ours.levels, BadStuff)
    t.play("R" * 16, "0" * 16)
    t.quietly("1" * (6 + 8 + 3))
  }

  /** A transmitter, whose frame is on the wire up to its SOF, becomes error passive: TEC is 128 and the next
    * bit is the first of its passive flag.
    */
  protected def becomesPassive(t: LowerTester, levels: String): Unit = {
    t.hearWrong(levels, levels.indexOf("0", 1))
    t.play("R" * 15, "0" * 15)
  }

  /** A transmitter is error passive with TEC 135, idle, and has nothing to send: of one frame, requested for
    * slot 0, three attempts were needed.
    */
  protected def passiveSender(t: LowerTester): Unit = {
    val wire = Wires.head
    t.request(wire.frame)
    t.awaitSof()
    becomesPassive(t, wire.levels)
    t.quietly("1" * (6 + 8 + 3 + 8))
    t.play("1", "0")
    t.hearWrong(wire.levels, wire.at("dlc"))
    t.quietly("1" * (6 + 8 + 3 + 8))
    t.hear(wire)
    t.quietly("1" * (3 + 8))
    assert((t.state, t.tec) == (CanState.Passive, 135))
  }

  /** A transmitter, whose frame is on the wire up to its SOF, becomes bus-off: an error, its flag, and 31
    * times 8 dominant bits behind it.
    */
  protected def becomesBusOff(t: LowerTester, levels: String): Unit = {
    t.hearWrong(levels, levels.indexOf("0", 1))
    t.activeFlag()
    t.quietly("0" * (31 * 8))
  }

  /** A frame of ours was sent wrong, so that the next bit is the first of a flag. */
  protected def badFrame(t: LowerTester): Unit = t.sendWrong(Ours.levels, BadStuff)
}

object CanCases {
  val ListenOnly     = 2
  val LoopBack       = 4
  val OneShot        = 8
  val RecoversItself = 0x10
  val ThreeSamples   = 0x20

  def base(id: Int, data: Int*): CanFrame = CanFrame(id, extended = false, remote = false, data.size, data)
  def ext(id: Int, data: Int*): CanFrame  = CanFrame(id, extended = true, remote = false, data.size, data)
  def remote(id: Int, extended: Boolean = false, dlc: Int = 0): CanFrame =
    CanFrame(id, extended, remote = true, dlc, Nil)

  /** A frame of each format: what the controller sends, and what the others send. */
  val Frames: Seq[CanFrame] = Seq(base(0x2a5, 0x3c, 0x5a), ext(0x0a5a1234, 0xa5, 0x12))
  val Wires: Seq[Wire]      = Frames.map(Wire(_))

  /** Frames whose identifier begins with 4 dominant, and with 5 recessive bits: with SOF in front a stuff bit
    * follows.
    */
  val JoiningFrames: Seq[CanFrame] =
    Seq(base(0x07a, 0x11), base(0x7d2, 0x22), ext(0x01e51234, 0x11), ext(0x1f451234, 0x22))

  /** A frame of the others that has a stuff bit early. */
  val Ours: Wire = Wire(base(0x0f0, 0x55))

  /** Its first stuff bit. */
  val BadStuff: Int = Ours.stuffBits.head

  private def bytes(dlc: Int, remote: Boolean, named: Seq[Int]) = {
    val size = if (remote) 0 else dlc min 8
    if (named.isEmpty) Seq.fill(size)(0) else named.padTo(size, named.last).take(size)
  }
  private def vector(id: Int, extended: Boolean, rtr: Int, dlc: Int, data: Int*) =
    CanFrame(id, extended, rtr == 1, dlc, bytes(dlc, rtr == 1, data))

  /** Frames with stuff bits everywhere (ISO 16845). */
  val BaseVectors: Seq[Wire] = Seq(
    vector(0x078, extended = false, 0, 8, 0x01, 0xe1),
    vector(0x41f, extended = false, 0, 1, 0x00),
    vector(0x707, extended = false, 0, 15, 0x0f),
    vector(0x360, extended = false, 0, 0),
    vector(0x730, extended = false, 0, 0),
    vector(0x47f, extended = false, 0, 1, 0x1f),
    vector(0x758, extended = false, 0, 0),
    vector(0x777, extended = false, 0, 1, 0x1f),
    vector(0x7ef, extended = false, 1, 2),
    vector(0x3ea, extended = false, 1, 15)
  ).map(Wire(_))

  /** The same with 29-bit identifiers; the second half has r0 recessive, which no transmitter sends. */
  val SendableExtVectors: Seq[Wire] = Seq(
    vector(0x07c30f0f, extended = true, 0, 8, 0x3c),
    vector(0x07c0f0f0, extended = true, 0, 1, 0x00),
    vector(0x1fb80000, extended = true, 0, 1, 0xa0),
    vector(0x00bc540f, extended = true, 1, 0)
  ).map(Wire(_))
  val ExtVectors: Seq[Wire] = SendableExtVectors ++ Seq(
    vector(0x01e31717, extended = true, 0, 15, 0x0f),
    vector(0x01e00ff0, extended = true, 0, 12, 0x1f, 0x0f, 0xe0, 0xf0, 0x7f, 0xe0, 0xff, 0x20),
    vector(0x155d5557, extended = true, 1, 15)
  ).map(Wire(_, r0 = '1'))

  /** Frames of one format with the identifiers that cases 7.1 and 8.1 ask for, each with 0 to 8 bytes. */
  def allLengths(extended: Boolean, seed: Int): Seq[CanFrame] = {
    val random = new Random(seed)
    val ones   = if (extended) 0x1fffffff else 0x7ff
    for {
      id <- Seq(0x15555555 & ones, 0x0aaaaaaa & ones, 0, ones, random.nextInt(ones))
      n  <- 0 to 8
    } yield CanFrame(id, extended, remote = false, n, Seq.fill(n)(random.nextInt(256)))
  }
}
