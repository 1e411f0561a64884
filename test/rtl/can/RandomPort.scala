package flyframe.can

import flyframe.can.model.ModelBus
import flyframe.params.CanParams
import flyframe.registers.CanRegisters
import org.scalatest.Assertions
import scala.util.Random

/** A golden model that counts the frames it has sent. */
class Sender extends CanPortModel(CanParams()) {
  var frames = 0
  override def sent(time: Int): Unit = {
    frames += 1
    super.sent(time)
  }
}

/** The RTL and a golden model that hear the same, cycle by cycle. The model is the one on the bus; what it
  * heard and drove is played to the RTL later, and accesses happen to both in the same cycle.
  *
  * @param what
  *   tells of the bus, for messages
  */
class Twin(rtl: RtlPort, what: String) extends Sender with Assertions {
  private val heard = new Array[Boolean](4096)
  private val drove = new Array[Boolean](heard.length)
  private var count = 0

  override def step(level: Boolean): Unit = {
    heard(count) = level
    drove(count) = driven
    count += 1
    super.step(level)
    if (count == heard.length) catchUp()
  }

  /** Of the model. */
  def isOffBus: Boolean  = status % 4 == CanState.BusOff
  def isSending: Boolean = (status & 0x10) != 0
  private def status     = super.read(CanRegisters.PortStarts.head + CanRegisters.Status, 1).head

  /** The RTL comes to the time of the model. */
  def catchUp(): Unit = {
    val start = rtl.cycle
    val found = rtl.replay(heard, count)
    for (i <- 0 until count if found(i) != drove(i)) {
      def around(levels: collection.IndexedSeq[Boolean]) =
        levels.slice(i - 20, i + 60 min count).map(if (_) '1' else '0').mkString
      fail(
        s"\nheard ${around(heard)}\nRTL   ${around(found)}\nmodel ${around(drove)}\n" +
          s"differ in cycle ${start + i} of $what"
      )
    }
    count = 0
  }

  /** An access to the RTL, during which `pass` lets a cycle pass for the model. */
  private def access(begin: => Unit)(pass: () => Unit): Unit = {
    catchUp()
    begin
    do {
      pass()
      catchUp()
    } while (rtl.isAccessing)
  }

  /** Writes a word to both. */
  def writeWord(address: Int, bytes: Seq[Int])(pass: () => Unit): Unit = {
    access(rtl.beginWrite(address, bytes))(pass)
    super.write(address, bytes)
  }

  /** Reads a word of both. What the model has changed lately the RTL may not show yet (CB-09).
    *
    * @return
    *   what the RTL shows
    */
  def compareWord(address: Int)(pass: () => Unit): Seq[Int] = {
    val now    = super.read(address, 4)
    var isSame = true
    def watched(): Unit = {
      pass()
      isSame &&= super.read(address, 4) == now
    }
    // The model's registers take longer to read than anything else.
    for (i <- 1 to CanUnderTest.AccessCycles) if (i % 4 == 0) watched() else pass()
    access(rtl.beginRead(address))(() => watched())
    if (isSame) assert(rtl.wordRead == now, f"at 0x$address%04x in cycle $cycle: $what")
    rtl.wordRead
  }
}

/** Random buses: a port in RTL with its model, and other models; disturbed; and a host that does everything
  * it may.
  */
object RandomPort {
  import CanRegisters._
  private val port = PortStarts.head

  /** Any possible bit timing; few cycles in most bits, as they take time. */
  private def setting(random: Random): (Int, BitSetting) = {
    val few       = Seq(1, 1, 1, 1, 1, 1, 2, 2, 3, 5)(random.nextInt(10))
    val prescaler = if (random.nextInt(200) == 0) random.between(6, 65) else few
    val length    = if (random.nextInt(6) > 0) random.between(8, 13) else random.between(13, 26)
    val least     = (3 + prescaler - 1) / prescaler // CB-15
    val tseg2     = random.between(1, (length - 1 - least min 16) + 1)
    val tseg1     = length - 1 - tseg2
    val three     = tseg1 > 1 && random.nextInt(4) == 0
    (prescaler, BitSetting(tseg1, tseg2, random.between(1, tseg2 + 1), three))
  }

  private def frame(random: Random): CanFrame = {
    val extended = random.nextBoolean()
    // Few identifiers, so that some are equal.
    val id     = if (random.nextInt(3) == 0) random.nextInt(8) * 0x91 else random.nextInt(0x800)
    val dlc    = random.nextInt(16)
    val remote = random.nextInt(5) == 0
    val data = Seq.fill(CanFrame.size(dlc, remote))(random.nextInt(4) match {
      case 0 => 0
      case 1 => 0xff
      case _ => random.nextInt(256)
    })
    val word = if (extended) id << 18 | random.nextInt(if (random.nextBoolean()) 4 else 1 << 18) else id
    CanFrame(word, extended, remote, dlc, data)
  }

  final class Bus(rtl: RtlPort, seed: Long) {
    private val random         = new Random(seed * 0x9e3779b97f4a7c15L)
    private val (prescaler, s) = setting(random)
    private val count          = 2 + random.nextInt(3)
    private val periods        = Seq.fill(count)(10000 + random.between(-40, 41))
    private val noise          = Seq(0, 0, 3000, 300)(random.nextInt(4)) // bits between disturbances
    val what                   = s"seed $seed, prescaler $prescaler, $s, clocks $periods, noise $noise"
    private val twin           = new Twin(rtl, what)
    private val models         = twin +: Seq.fill(count - 1)(new Sender)
    private val bit            = s.length * prescaler
    private val until          = Array.fill(count)(0L)
    private def hears(node: Int, time: Long, level: Boolean) = {
      if (noise > 0 && random.nextInt(noise * bit) == 0) until(node) = time + random.nextInt(3 * bit) * 10000L
      level ^ time < until(node)
    }
    private val bus = new ModelBus(models, periods, hears)
    private def pass(cycles: Int): Unit = {
      val end = twin.cycle + cycles
      while (twin.cycle < end) bus.run(bus.now + 1)
    }
    private val one = () => pass(1)

    private def little(value: Long, bytes: Int) = (0 until bytes).map(i => (value >> 8 * i & 0xff).toInt)
    private def write(address: Int, bytes: Seq[Int]): Unit = {
      val first = 4 - address % 4
      twin.writeWord(address, bytes.take(first))(one)
      if (bytes.size > first) write(address + first, bytes.drop(first))
    }
    private def timing = little(prescaler - 1, 2) ++ Seq(s.tseg1 - 1, s.tseg2 - 1 | s.sjw - 1 << 4)
    private def modes  = if (s.threeSamples) CanCases.ThreeSamples else 0

    for (m <- models.tail) {
      m.write(port + Timing, timing)
      m.write(FilterStarts.head, little(CanFiltersModel.InUse, 4) ++ little(0, 4))
      m.write(port + Control, Seq(1 | modes | CanCases.RecoversItself))
    }
    write(port + Timing, timing)
    private var special = 0
    private def isQuiet = (twin.read(port + Status, 1).head & 0x30) == 0 // nothing is on the wire
    private def control(): Unit = {
      val recovers = if (random.nextInt(3) > 0) CanCases.RecoversItself else 0
      val one      = if (random.nextInt(4) == 0) CanCases.OneShot else 0
      if (isQuiet)
        special = random.nextInt(12) match {
          case 0 => CanCases.ListenOnly
          case 1 => CanCases.LoopBack
          case _ => 0
        }
      write(port + Control, Seq(1 | modes | recovers | one | special))
    }
    private def filter(): Unit = {
      val bits = Seq(0, 0xc0000000, 0x00000010, 0x40000003)(random.nextInt(4))
      val use  = if (random.nextInt(4) > 0) CanFiltersModel.InUse else 0
      write(
        FilterStarts.head + 8 * random.nextInt(4),
        little(frame(random).word & 0xdfffffffL | use, 4) ++ little(bits, 4)
      )
    }
    filter()
    write(FilterStarts.head + 8 * 4, little(CanFiltersModel.InUse, 4) ++ little(0, 4))
    control()

    private val words =
      Seq(Control, Timing, ErrorCounters, LastError, Counters, Counters + 4, RxLevel, Requests, Sent)
    private def act(): Unit = random.nextInt(24) match {
      case n if n < 8 =>
        // One that is pending may be over while the access lasts: is it requested anew, or not? So what it
        // has seen to be free.
        val shown = twin.compareWord(port + Requests)(one)
        val mask  = ~(shown.head | shown(1) << 8) & 0xffff
        val slot  = random.nextInt(16)
        if ((mask >> slot & 1) == 1) {
          write(SlotStarts.head + 16 * slot, frame(random).bytes().take(5))
          write(SlotStarts.head + 16 * slot + 8, Seq.fill(8)(random.nextInt(256)))
          write(
            port + Requests,
            little(1 << slot | (if (random.nextInt(4) == 0) random.nextInt(65536) & mask else 0), 2)
          )
        }
      case n if n < 14 =>
        val m    = models(1 + random.nextInt(count - 1))
        val slot = random.nextInt(16)
        m.write(SlotStarts.head + 16 * slot, frame(random).bytes())
        m.write(port + Requests, little(1 << slot, 2))
      case 14 => write(port + Aborts, little(random.nextInt(65536), 2))
      case 15 => write(port + Command, Seq(random.nextInt(8) match { case 0 => 4; case 1 => 2; case _ => 1 }))
      // Else it might come in between the arrival of a frame and its place in the FIFO.
      case 16 => if (twin.compareWord(port + RxLevel)(one).head > 0) write(port + RxRelease, Seq(1))
      case 17 =>
        // Of those it has seen: another one might be sent in the same moment.
        val seen = twin.compareWord(port + Sent)(one)
        write(port + Sent, little(random.nextLong(1L << 32), 4).zip(seen).map { case (a, b) => a & b })
      case 18 => if (random.nextInt(8) == 0) write(port + Control, Seq(modes)) else control()
      case 19 => if (isQuiet) filter() // CAN-43 leaves open when it acts
      case 20 => twin.compareWord(SlotStarts.head + 4 * random.nextInt(64))(one)
      case 21 => for (i <- 0 to 3) twin.compareWord(port + RxFrame + 4 * i)(one)
      case _  => twin.compareWord(port + words(random.nextInt(words.size)))(one)
    }

    /** Runs, and returns how many frames were on the bus. */
    def run(): Int = {
      for (_ <- 1 to 60) {
        act()
        pass(random.nextInt(100) * bit / (1 + random.nextInt(20)))
      }
      pass(400 * bit)
      for (w <- words) twin.compareWord(port + w)(one)
      while (twin.read(port + RxLevel, 1).head > 0) {
        for (i <- 0 to 3) twin.compareWord(port + RxFrame + 4 * i)(one)
        write(port + RxRelease, Seq(1))
      }
      for (slot <- 0 until 64) twin.compareWord(SlotStarts.head + 4 * slot)(one)
      twin.catchUp()
      models.map(_.frames).sum
    }
  }

  /** Buses until there have been so many frames, or six have gone wrong.
    *
    * @return
    *   frames, buses, and what was wrong
    */
  def run(wanted: Long, first: Long): (Long, Long, Seq[String]) = {
    var frames = 0L
    var seed   = first
    var wrong  = Vector.empty[String]
    while (frames < wanted && wrong.size < 6) {
      try CanSimulation(CanParams()) { rtl => frames += new Bus(rtl.asInstanceOf[RtlPort], seed).run() }
      catch { case e: org.scalatest.exceptions.TestFailedException => wrong :+= e.getMessage }
      seed += 1
    }
    (frames, seed - first, wrong)
  }
}
