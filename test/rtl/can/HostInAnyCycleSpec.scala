package flyframe.can

import flyframe.Tier
import flyframe.params.CanParams
import flyframe.registers.CanRegisters._
import org.scalatest.flatspec.AnyFlatSpec

/** What the host does in any cycle around what happens on the bus, a port in RTL beside the golden model: an
  * order and a sample in the same cycle are too rare for random buses.
  */
class HostInAnyCycleSpec extends AnyFlatSpec {
  import CanCases.{ListenOnly, LoopBack, OneShot, RecoversItself, ThreeSamples}
  private val port             = PortStarts.head
  private val frame            = CanFrame(0x555, extended = false, remote = false, 1, Seq(0x5a))
  private val wire             = Wire(frame)
  private def quiet(bits: Int) = "1" * bits

  /** @param slots
    *   that are requested, of which slot 0 with `frame` is first; none: the port hears what the others do
    * @param others
    *   what the others drive, bit by bit, from the SOF on; R: the port hears recessive whatever it drives; G:
    *   dominant, but for the quantum of the sample point
    * @param at
    *   the bit with which something happens; none: it is that the port goes off the bus
    * @param shows
    *   a register that is not 0 behind it, if it has happened
    * @param control
    *   what the port is set to
    */
  private case class Scene(
      name: String,
      slots: Int,
      others: String,
      at: Option[Int],
      shows: Int,
      control: Int = 0
  )
  private object Scene {
    def apply(name: String, slots: Int, others: String, at: Int, shows: Int): Scene =
      new Scene(name, slots, others, Some(at), shows)
  }

  private def counter(name: String) = Counters + CounterNames.indexOf(name)
  private val BitErrors             = counter("bit_errors")
  private val FormErrors            = counter("form_errors")
  private val AckErrors             = counter("ack_errors")
  private val LostArbitrations      = counter("lost_arbitrations")

  private val end                               = wire.levels.length // of the CRC
  private val whole                             = quiet(end) + Wire.Acked + Wire.Eof
  private def dominant(others: String, at: Int) = others.updated(at, '0')
  private val inFrame = for {
    scene <- Seq(
      Scene("the frame begins", slots = 1, whole, 0, Sent),
      Scene(
        "an error in it",
        slots = 1,
        quiet(end).updated(wire.at("id", 1), 'R'),
        wire.at("id", 1),
        BitErrors
      ),
      Scene(
        "arbitration is lost",
        slots = 1,
        dominant(quiet(end), wire.at("id", 2)),
        wire.at("id", 2),
        LostArbitrations
      ),
      Scene("nobody acknowledges", slots = 1, quiet(end + 10), end + 1, AckErrors),
      Scene("the frame is sent", slots = 1, whole, end + 9, Sent),
      Scene("an error in the last bit", slots = 1, dominant(whole, end + 9), end + 9, FormErrors),
      Scene("an overload", slots = 1, whole + "0", end + 10, Sent),
      Scene("it joins another in the intermission", slots = 5, whole + "110", end + 12, Sent),
      Scene("a frame comes", slots = 0, wire.levels + "111" + Wire.Eof, end + 8, RxLevel),
      Scene("a frame comes with an error", slots = 0, wire.levels + "111" + "10", end + 4, FormErrors),
      Scene(
        "a frame comes, and the next begins",
        slots = 0,
        wire.levels + "111" + Wire.Eof + "110",
        end + 12,
        RxLevel
      )
    )
    mode <- Seq(0, OneShot)
  } yield scene.copy(name = s"${scene.name}${if (mode == 0) "" else ", one shot"}", control = mode)

  // Each bit of a SOF and of an active flag is an error, then each SOF.
  private val goesOff = Scene("it goes off the bus", slots = 1, "R" * 460, None, counter("bus_offs"))
  private val glitch = Scene(
    "the acknowledgement has a glitch",
    slots = 1,
    whole.updated(end + 1, 'G'),
    Some(end + 1),
    Sent,
    ThreeSamples
  )
  private val inside =
    for (
      (name, slots, others, at, shows, control) <- Seq(
        ("the frame is acknowledged inside", 1, quiet(end + 14), end + 1, Sent, LoopBack),
        ("the frame is sent inside", 1, quiet(end + 14), end + 9, Sent, LoopBack),
        ("a frame is listened to", 0, wire.levels + "111" + Wire.Eof, end + 1, RxLevel, ListenOnly)
      )
    ) yield Scene(name, slots, others, Some(at), shows, control)
  private val scenes =
    inFrame ++ inside ++ Seq(
      glitch,
      goesOff,
      goesOff.copy(name = s"${goesOff.name} for a time", control = RecoversItself)
    )

  /** An order of the host: an address, and what it writes there with this setting. */
  private val orders = Seq[(String, Int, Int => Seq[Int])](
    ("a stop", Control, c => Seq(c)),
    ("a stop with a change of one shot", Control, c => Seq(c ^ OneShot)),
    ("a stop that clears all", Control, _ => Seq(0)),
    ("a change of one shot", Control, c => Seq(1 | c ^ OneShot)),
    ("a change of loop back", Control, c => Seq(1 | c ^ LoopBack)),
    ("a change of listen only", Control, c => Seq(1 | c ^ ListenOnly)),
    ("a change of what bus-off means", Control, c => Seq(1 | c ^ RecoversItself)),
    ("an order to recover", Command, _ => Seq(1)),
    ("an abort", Aborts, _ => Seq(1, 0)),
    ("an abort of all", Command, _ => Seq(4)),
    ("a clear of the counters", Command, _ => Seq(2)),
    ("a request of another slot", Requests, _ => Seq(2, 0)),
    ("a request of all others", Requests, _ => Seq(0xfe, 0xff)) // of one that ends, both ways are right
  )
  private val settings = Seq(BitSetting(6, 3, 3), BitSetting(5, 2, 1))
  private val tier =
    Tier("a host in any cycle around what happens on the bus", "bit timings", test = 1, soak = settings.size)

  /** A whole run, with an order of the host that takes effect in some cycle.
    *
    * @param order
    *   an address, what is written there, and the cycle in which that begins
    * @return
    *   the cycle in which the bit begins with which it happens
    */
  private def run(scene: Scene, s: BitSetting, what: String, order: Option[(Int, Seq[Int], Long)]): Long = {
    var sof     = -1L
    var happens = Long.MaxValue
    CanSimulation(CanParams()) { rtl =>
      val twin  = new Twin(rtl.asInstanceOf[RtlPort], what)
      var opens = Long.MaxValue // the cycle in which the others begin
      val pass = () => {
        if (sof < 0 && (twin.isSending || twin.cycle == opens)) sof = twin.cycle
        val bit   = if (sof < 0) -1 else ((twin.cycle - sof) / s.length).toInt
        val heard = scene.others.lift(bit).getOrElse('1')
        if (happens == Long.MaxValue && sof >= 0)
          for (isNow <- scene.at.map(_ == bit).orElse(Option.when(order.isEmpty)(twin.isOffBus)) if isNow)
            happens = twin.cycle - (if (scene.at.isEmpty) s.length else 0)
        val isGlitch = heard == 'G' && (twin.cycle - sof) % s.length == s.tseg1
        twin.step(heard == 'R' || isGlitch || (heard == '1' && twin.driven))
      }
      def write(address: Int, bytes: Int*): Unit = twin.writeWord(address, bytes)(pass)
      write(port + Timing, 0, 0, s.tseg1 - 1, s.tseg2 - 1 | s.sjw - 1 << 4)
      write(FilterStarts.head, 0, 0, 0, 0x20)
      write(FilterStarts.head + 4, 0, 0, 0, 0)
      // Slot 1 goes before the frame, slot 2 behind it.
      for ((id, slot) <- Seq(0, -1, 1).map(frame.id + _).zipWithIndex) {
        val bytes = frame.copy(id = id).bytes()
        for (i <- Seq(0, 8)) write(SlotStarts.head + 16 * slot + i, bytes.slice(i, i + 4): _*)
        write(SlotStarts.head + 16 * slot + 4, bytes(4))
      }
      write(port + Control, 1 | scene.control)
      if (scene.slots != 0) write(port + Requests, scene.slots, 0) else opens = twin.cycle + 15 * s.length
      for ((address, bytes, cycle) <- order) {
        assert(twin.cycle <= cycle, what)
        while (twin.cycle < cycle) pass()
        write(port + address, bytes: _*)
      }
      val end  = twin.cycle + 16 * s.length // by then a frame has begun, if there is one
      val tail = if (scene.at.isEmpty) Recovery else 30
      while (twin.cycle < end || (sof >= 0 && twin.cycle < sof + (scene.others.length + tail) * s.length))
        pass()
      for (w <- Seq(Control, ErrorCounters, LastError, Counters, Counters + 4, RxLevel, Requests, Sent))
        twin.compareWord(port + w)(pass)
      if (order.isEmpty) assert(twin.read(port + scene.shows, 1).head != 0, s"it has not happened: $what")
    }
    assert(order.nonEmpty || happens != Long.MaxValue, what)
    happens
  }

  /** Bits in which a port that recovers has begun its next frame. */
  private val Recovery = 128 * 11 + 60

  /** Cycles until a write of a register is acknowledged: all slots are looked at one after the other. */
  private def latency(address: Int) = if (address == Requests) 20 else 4

  for ((name, address, bytes) <- orders)
    s"CAN-40, CB-04, CB-06, CB-09: $name in any cycle around what happens" should
      "have the effect that it has in the model" in tier.run(name, tier.size) {
        for {
          scene <- scenes
          s     <- settings.take(tier.size.toInt)
          at    = run(scene, s, s"${scene.name}, $s", None)
          first = at - s.length - latency(address)
          cycle <- first until first + 5 * s.length
        } {
          val what = s"$name, written ${cycle - at} cycles behind the beginning of the bit, $s, ${scene.name}"
          run(scene, s, what, Some((address, bytes(scene.control), cycle)))
        }
      }
}
