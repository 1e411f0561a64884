package flyframe.fibre

import flyframe.params.FibreParams
import flyframe.registers.RingRegisters
import flyframe.registers.RingRegisters._
import org.scalatest.Assertions
import scala.collection.mutable
import scala.util.Random

/** A node in RTL and its golden model that are told the same, compared in each cycle. */
class TwinNode(p: FibreParams, rtl: FibreUnderTest, what: String) extends Assertions {
  val model = new RingPortsModel(p)

  private val writes    = mutable.Queue.empty[(Int, Int)]
  private var isWriting = false

  def setBit(quanta: Int, prescaler: Int): Unit = {
    rtl.setBit(quanta, prescaler)
    model.setBit(quanta, prescaler)
  }

  def write(at: Int, byte: Int): Unit = {
    rtl.write(at, byte)
    writes.enqueue((at, byte))
  }

  def step(drive: Boolean, light1: Int, light2: Int, optical: Int): Unit = {
    def same[A](name: String, ours: A, models: A): Unit =
      if (ours != models) fail(s"cycle ${model.cycle} of $what: $name is $ours, and $models in the model")
    for (port <- 0 to 1) same(s"the light of port ${port + 1}", rtl.light(port), model.light(port))
    same("the level of the bus", rtl.bus(drive), model.bus(drive))
    same("the interrupt", rtl.interrupt, model.interrupt)
    if (model.cycle % 61 == 0)
      for (
        at <- RingRegisters(addressBits = 7).map(_.address) ++ Seq(RingRegisters.Events, RingRegisters.Mask)
      )
        same(f"0x$at%04x", rtl.read(at), model.read(at))
    // A write is done in its second cycle and counts from the next one on; events of that cycle stay.
    val done = if (isWriting) Some(writes.dequeue()) else None
    isWriting = !isWriting && writes.nonEmpty
    for ((at, byte) <- done if at == Events) model.write(at, byte)
    rtl.step(drive, light1, light2, optical)
    model.step(drive, light1, light2, optical)
    for ((at, byte) <- done if at != Events) model.write(at, byte)
  }
}

/** What a port hears: symbols of a neighbour, or what goes wrong. */
class RandomLight(p: FibreParams, random: Random) {
  private val modulator  = new ModulatorModel(p)
  private var tone: Tone = Tone.Recessive
  private var left       = 0
  private var weather    = 0 // 0 symbols, 1 dominant, 2 search, 3 dark, 4 noise
  private var lasts      = 0
  private var flaps      = 0 // losses that are to come soon

  /** The samples of a cycle.
    *
    * @param bit
    *   T in cycles
    */
  def next(bit: Int): Int = {
    if (lasts == 0) {
      val isBad = weather < 2 && random.nextInt(if (flaps > 0) 1 else 14) == 0
      if (isBad) flaps = if (flaps > 0) flaps - 1 else if (random.nextInt(5) == 0) 2 else 0
      weather = if (isBad) random.between(2, 5) else if (random.nextInt(5) == 0) 1 else 0
      lasts =
        if (isBad) random.between(100, 1200)
        else if (flaps > 0) 1000
        else if (weather == 0) random.between(2000, 8000)
        else bit * (if (random.nextInt(3) == 0) 400 else 80)
      left = 0
    }
    lasts -= 1
    if (left == 0) {
      tone = weather match {
        case 0 => if (tone == Tone.Recessive && random.nextBoolean()) Tone.Dominant else Tone.Recessive
        case 1 => Tone.Dominant
        case 2 => Tone.Search
        case _ => Tone.Dark
      }
      left = bit / 2 + random.nextInt(if (random.nextInt(4) == 0) 12 * bit else 2 * bit)
    }
    left -= 1
    modulator.step(tone)
    val all     = (1 << p.samplesPerCycle) - 1
    val samples = if (modulator.light) all else 0
    if (weather == 4) random.nextInt(all + 1)
    else if (random.nextInt(2000) == 0) samples ^ (1 + random.nextInt(all))
    else samples
  }
}

/** Random light, drives and writes for a node and its model. */
object RandomNode {

  /** What has happened in a run, by name: how often. */
  type Happened = Map[String, Int]

  def run(p: FibreParams, rtl: FibreUnderTest, cycles: Long, seed: Long): Happened = {
    val random   = new Random(seed)
    val twin     = new TwinNode(p, rtl, s"seed $seed with $p")
    val model    = twin.model
    val lights   = Seq.fill(2)(new RandomLight(p, random))
    val happened = mutable.Map.empty[String, Int].withDefaultValue(0)
    var bit      = 0
    var drive    = true
    var left     = 0 // cycles of this drive
    var optical  = 3
    var waits    = 0 // cycles of signal without search, and down
    var before   = IndexedSeq.fill(0x50)(0)

    def count(name: String, isSo: Boolean): Unit = if (isSo) happened(name) += 1
    def look(): Unit = {
      val now                        = IndexedSeq.tabulate(0x50)(model.read(_))
      def rises(at: Int, bit: Int)   = (now(at) & ~before(at)) >> bit & 1
      def became(at: Int, bit: Int)  = rises(at, bit) == 1
      def state(at: IndexedSeq[Int]) = at(State) & 3
      for (port <- 0 to 1) {
        count(s"port ${port + 1} up", became(Ports, 4 * port + 2))
        count(s"search at ${port + 1}", became(Ports, 4 * port + 1))
        count(s"stuck at ${port + 1}", became(Ports, 4 * port + 3))
        count(s"noise at ${port + 1}", now(Noise1 + port) != before(Noise1 + port))
      }
      count("closing", now(Closings) != before(Closings))
      count("latch", now(Latches) != before(Latches))
      count("cut off", became(State, 5))
      count("guard", became(State, 2))
      count("alone", became(State, 3))
      for (mode <- 1 to 3) count(s"mode $mode", state(now) == mode && state(before) != mode)
      // Port 1 waits for longer than it takes to come up: three losses.
      val isWaiting = (now(Ports) & 7) == 1 && (now(Control) & 0x20) == 0
      waits = if (isWaiting) waits + 10 else 0
      count("held", waits == 50 * p.coreClockMhz)
      before = now
    }

    twin.write(UpMs, 2)
    for (cycle <- 0L until cycles) {
      if (cycle % 20000 == 0) {
        val (quanta, prescaler) = (random.between(8, 20), random.between(1, 3))
        twin.setBit(if (random.nextInt(8) == 0) 0 else quanta, prescaler) // 0: there is no T
        bit = quanta * prescaler
      }
      if (random.nextInt(4000) == 0) random.nextInt(8) match {
        case 0 => twin.write(Address, random.nextInt(if (random.nextInt(4) > 0) 4 else 128))
        case 1 =>
          twin.write(
            Control,
            random.nextInt(16) & random.nextInt(16) | (if (random.nextInt(4) == 0) 0x20 else 0)
          )
        case 2 | 3 => twin.write(Control, random.nextInt(2) << Home)
        case 4     => twin.write(UpMs, random.nextInt(6))
        case 5     => twin.write(Mask, random.nextInt(256))
        case _     => twin.write(Events, random.nextInt(256))
      }
      if (left == 0) {
        drive = !drive || random.nextInt(3) == 0
        left = bit / 2 + random.nextInt(if (random.nextInt(20) == 0) 60 * bit else 3 * bit)
      }
      left -= 1
      if (random.nextInt(if (optical == 3) 60000 else 200) == 0) optical = 3 & ~random.nextInt(4)
      twin.step(drive, lights(0).next(bit), lights(1).next(bit), optical)
      if (cycle % 10 == 0) look()
    }
    happened.toMap
  }
}
