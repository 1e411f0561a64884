package flyframe.rules

import flyframe.mi.{ModelPhys, PhyRegisters}
import flyframe.model._
import flyframe.params.EscParams
import flyframe.protocol.Command._

/** A controller under test, modelled or real: what the rule tests can do to it. */
trait Bench {
  def p: EscParams

  /** The state after power-on, all links up, EEPROM loaded. */
  def reset(): Unit
  def send(port: Int, frame: WireFrame): Option[(Int, SentFrame)]
  def setLink(port: Int, up: Boolean): Unit
  def setLoaded(loaded: Boolean): Unit
  def falseCarrier(port: Int, symbols: Int): Unit
  def hostRead(address: Int): Int
  def hostWrite(address: Int, byte: Int): Unit

  /** All bytes of the word at `address` in one access. */
  def hostReadWord(address: Int): Seq[Int]

  /** The level of the interrupt to the host. */
  def interrupt: Boolean

  /** The levels of the digital outputs, while they are driven; the pin that lets them be has a level. */
  def outputs: Option[Int]
  def setOutputEnable(level: Boolean): Unit

  /** The levels at the digital inputs, and that of the pin by which they are taken. */
  def setDigitalInputs(levels: Int): Unit
  def setInputLatch(level: Boolean): Unit

  /** The levels of the general purpose outputs; the inputs get some. */
  def generalOutputs: BigInt
  def setGeneralInputs(levels: BigInt): Unit

  /** The level of SYNC signal `n`; LATCH signal `n` gets one. */
  def syncLevel(n: Int): Boolean
  def setLatch(n: Int, level: Boolean): Unit

  /** What the line of the smoke detector is in, a code of [[flyframe.protocol.DetectorState]]. */
  def setLine(state: Int): Unit

  /** The configuration of the FPGA is damaged, until a reset. */
  def damage(): Unit
  def advanceMs(ms: Int): Unit
  def advanceUs(us: Int): Unit

  /** The PHYs on the management bus; after power-on one at each port ([[flyframe.mi.Phys]]). */
  def phys: PhyRegisters

  /** Bus or host ask for a reset of the chip. */
  def resetRequested: Boolean

  /** PHYs that are held in reset by themselves, a bit per port. */
  def phyResets: Int

  /** Power-on with an EEPROM of this content; the RTL has not loaded it yet ([[Steps.eepromDone]]). */
  def powerOn(image: Seq[Int]): Unit
}

/** The line of a smoke detector. */
object Line {
  import flyframe.protocol.DetectorState._

  /** What the comparators of its current give in a state. No current at all is an open line. */
  val current: Map[Int, Int] = Map(Normal -> 1, Alarm -> 3, Open -> 0, Short -> 7)
}

/** The content of an EEPROM of 2 KiB: the words 0 to 6 as given, a right checksum, and a pattern. */
object EepromImage {
  def apply(words: Int*): Seq[Int] = {
    val area = words.padTo(7, 0).flatMap(EtherCatFrame.little)
    (area :+ SiiModel.checksum(area) :+ 0) ++ (16 until 2048).map(i => i * 7 + (i >> 8) & 0xff)
  }
}

/** The golden model; with a writer, everything done is recorded for the RTL.
  *
  * @param controller
  *   makes the model, or that of a product
  */
class ModelBench(
    val p: EscParams,
    writer: EscModel => Option[VectorWriter] = _ => None,
    controller: EscParams => EscModel = new EscModel(_)
) extends Bench {
  private var model  = controller(p)
  private var record = writer(model)
  private var bus    = connected()

  private def connected(): ModelPhys = {
    val phys = new ModelPhys((0 until p.ports).map(p.phyAddress))
    model.phys = phys
    phys
  }
  def phys: PhyRegisters = bus
  def phyResets: Int     = model.phyResets

  def resetRequested: Boolean = model.resetRequested

  def reset(): Unit = {
    model = controller(p)
    record = writer(model)
    bus = connected()
  }
  def send(port: Int, frame: WireFrame): Option[(Int, SentFrame)] =
    record.fold(model.receive(port, frame)) { r =>
      if (p.hasAlarm) r.quiet() // behind a delayed frame none is extended (AP-09)
      r.frame(port, frame)
    }
  def setLink(port: Int, up: Boolean): Unit = record.fold(model.setLink(port, up))(_.link(port, up))
  def setLoaded(loaded: Boolean): Unit = record.fold(model.pdiOperational = loaded)(_.pdiOperational(loaded))
  def falseCarrier(port: Int, symbols: Int): Unit =
    record.fold(model.falseCarrier(port, symbols))(_.falseCarrier(port, symbols))
  def hostRead(address: Int): Int = record.fold(model.hostRead(address))(_.hostRead(address))
  def hostReadWord(address: Int): Seq[Int] =
    record.fold(model.hostRead(address, p.lanes))(_.hostReadWord(address))
  def hostWrite(address: Int, byte: Int): Unit =
    record.fold(model.hostWrite(address, byte))(_.hostWrite(address, byte))
  def interrupt: Boolean                    = model.interrupt
  def outputs: Option[Int]                  = model.digital.outputs
  def setOutputEnable(level: Boolean): Unit = model.digital.enable = level
  def setDigitalInputs(levels: Int): Unit   = model.digital.inputs = levels
  def setInputLatch(level: Boolean): Unit   = model.digital.setLatch(level)
  def generalOutputs: BigInt = {
    val signed = BigInt(model.registers.wide("general_output"))
    if (signed < 0) signed + (BigInt(1) << 64) else signed
  }
  def setGeneralInputs(levels: BigInt): Unit = model.generalInputs(levels.toLong)
  def syncLevel(n: Int): Boolean             = model.clock.exists(_.syncLevel(n))
  def setLatch(n: Int, level: Boolean): Unit = model.clock.foreach(_.setLatch(n, level))
  def damage(): Unit                         = model.alarm.foreach(_.damage())
  def setLine(state: Int): Unit =
    record.fold(model.alarm.foreach(_.setLine(state)))(_.detector(Line.current(state)))
  def advanceMs(ms: Int): Unit = model.advanceMs(ms)
  def advanceUs(us: Int): Unit = record.fold(model.advanceUs(us))(_.advanceUs(us))
  def powerOn(image: Seq[Int]): Unit = {
    model = new EscModel(p, Some(image))
    record = None
    bus = connected()
  }
}

/** One rule test: `name` begins with the IDs of the rules it proves; `needs` tells the parameter sets it
  * makes sense for.
  */
final case class Rule(name: String, needs: EscParams => Boolean, run: Steps => Unit) {

  /** Cannot be recorded as vectors, because time passes in it, or a pin changes that they do not know. */
  def usesTime: Boolean = Seq("temporary", "watchdog", "ALARM-12").exists(name.contains(_))
}

/** A collection of rule tests. */
trait Rules {
  private val collected = scala.collection.mutable.ArrayBuffer.empty[Rule]
  def all: Seq[Rule]    = collected.toSeq

  protected def rule(name: String, needs: EscParams => Boolean = _ => true)(run: Steps => Unit): Unit =
    collected += Rule(name, needs, run)
}

/** A datagram as it came back. */
final case class Reply(bytes: Seq[Int]) {
  private def word(at: Int) = bytes(at) | bytes(at + 1) << 8
  def command: Int          = bytes.head
  def index: Int            = bytes(1)
  def adp: Int              = word(2)
  def ado: Int              = word(4)
  def length: Int           = word(6) & 0x7ff
  def circulating: Boolean  = (word(6) & 0x4000) != 0
  def more: Boolean         = (word(6) & 0x8000) != 0
  def irq: Int              = word(8)
  def data: Seq[Int]        = bytes.slice(10, 10 + length)
  def workingCounter: Int   = word(10 + length)
}

/** What the rule tests say to a bench. Assertions name what was expected and what came. */
class Steps(val bench: Bench) extends org.scalatest.Assertions {
  val p: EscParams = bench.p

  /** Where a frame that entered at port 0 leaves, all links up (LP-07). */
  val nextPort: Int = Seq(3, 1, 2, 0).find(_ < p.ports).get

  /** The bytes that left, FCS included; the frame must be in order and leave at `at`. */
  def good(sent: Option[(Int, SentFrame)], at: Int = nextPort): Seq[Int] = sent match {
    case Some((port, frame)) =>
      assert(port == at, s"frame left at port $port, not $at")
      assert(frame.good && frame.payload.size % 2 == 0, s"frame is not in order: $frame")
      frame.bytes
    case None => fail("nothing left the controller")
  }

  /** What left for a bad frame: odd number of nibbles, FCS wrong (ERR-07). */
  def marked(sent: Option[(Int, SentFrame)]): SentFrame = sent match {
    case Some((_, frame)) =>
      assert(frame.payload.size % 2 == 1, s"no extra nibble: $frame")
      assert(!Fcs.good(frame.bytes), s"FCS is right: $frame")
      frame
    case None => fail("nothing left the controller")
  }

  def send(bytes: Seq[Int], port: Int = 0): Option[(Int, SentFrame)] =
    bench.send(port, WireFrame.withFcs(bytes))

  /** The datagrams of a frame, `start` bytes behind its beginning. */
  def replies(bytes: Seq[Int], start: Int = 16): Seq[Reply] = {
    val reply = Reply(bytes.drop(start))
    reply +: (if (reply.more) replies(bytes, start + 12 + reply.length) else Nil)
  }

  /** Sends one frame with these datagrams to port 0 and gives them as they left. */
  def exchange(datagrams: Datagram*): Seq[Reply] = replies(good(send(EtherCatFrame(datagrams))))
  def one(datagram: Datagram): Reply             = exchange(datagram).head

  def read(command: Int, adp: Int, ado: Int, length: Int): Reply = one(
    Datagram(command, adp, ado, Seq.fill(length)(0))
  )
  def write(command: Int, adp: Int, ado: Int, data: Int*): Reply = one(Datagram(command, adp, ado, data))

  def word(address: Int): Int = bench.hostRead(address) | bench.hostRead(address + 1) << 8
  def stationAddress(value: Int): Unit = assert(
    write(Apwr, 0, 0x0010, value & 0xff, value >> 8).workingCounter == 1
  )

  /** Counters by their registers. */
  def invalid(port: Int): Int   = bench.hostRead(0x0300 + 2 * port)
  def rxErrors(port: Int): Int  = bench.hostRead(0x0301 + 2 * port)
  def forwarded(port: Int): Int = bench.hostRead(0x0308 + port)
  def epuErrors: Int            = bench.hostRead(0x030c)
  def lostLinks(port: Int): Int = bench.hostRead(0x0310 + port)
  def dlStatus: Int             = word(0x0110)

  /** Writes the loop settings of all ports, 0x0101, through port 0. */
  def loops(settings: Int): Unit = {
    val way = Seq(3, 1, 2).find(y => y < p.ports && (dlStatus >> (8 + 2 * y) & 1) == 0).getOrElse(0)
    good(send(EtherCatFrame(Seq(Datagram(Bwr, 0, 0x0101, Seq(settings))))), way)
  }

  /** ECAT writes by position; true if it counted. */
  def put(address: Int, data: Int*): Boolean = one(Datagram(Apwr, 0, address, data)).workingCounter == 1

  /** ECAT reads by position; None if it did not count. */
  def get(address: Int, length: Int): Option[Seq[Int]] = {
    val reply = read(Aprd, 0, address, length)
    Option.when(reply.workingCounter == 1)(reply.data)
  }
  def hostGet(address: Int, length: Int): Seq[Int] = (address until address + length).map(bench.hostRead)
  def hostPut(address: Int, data: Int*): Unit =
    data.zipWithIndex.foreach { case (b, i) => bench.hostWrite(address + i, b) }

  /** The datagrams in a frame with a wrong FCS. */
  def spoiled(datagrams: Datagram*): Unit = {
    val bytes = EtherCatFrame(datagrams)
    marked(bench.send(0, WireFrame.ofBytes(bytes ++ Fcs.of(bytes).map(_ ^ 0xff))))
  }

  /** Configures FMMU `n` and activates it. */
  def fmmu(n: Int, logical: Long, length: Int, bits: (Int, Int, Int), physical: Int, kind: Int): Unit = {
    val (start, stop, local) = bits
    val content = (0 until 4).map(i => (logical >> 8 * i & 0xff).toInt) ++ EtherCatFrame.little(length) ++
      Seq(start, stop) ++ EtherCatFrame.little(physical) ++ Seq(local, kind, 1)
    assert(put(0x0600 + 16 * n, content: _*))
  }

  /** Byte-wise. */
  def fmmu(n: Int, logical: Long, length: Int, physical: Int, kind: Int): Unit =
    fmmu(n, logical, length, (0, 7, 0), physical, kind)
  def logical(command: Int, address: Long, data: Int*): Reply = one(Datagram(command, address, data))

  /** Configures SyncManager `n` anew and enables it. */
  def syncManager(n: Int, start: Int, length: Int, control: Int): Unit = {
    assert(put(0x0806 + 8 * n, 0))
    val content = EtherCatFrame.little(start) ++ EtherCatFrame.little(length) ++ Seq(control, 0, 1)
    assert(put(0x0800 + 8 * n, content: _*))
  }

  /** Waits for the EEPROM interface. */
  def eepromDone(): Unit = {
    var left = 100000
    while ((bench.hostRead(0x0503) & 0x80) != 0) {
      left -= 1
      assert(left > 0, "the EEPROM stays busy")
    }
  }
}
