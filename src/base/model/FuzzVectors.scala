package flyframe.model

import java.io.PrintStream
import scala.util.Random
import flyframe.params.EscParams
import flyframe.protocol.Command.{Apwr, Bwr}
import flyframe.protocol.{AppendedLayout, DatagramLayout, EtherType, RecordAckLayout, RecordLayout}
import flyframe.registers.{AlarmRegisters, DlRegisters, RegisterMap, StationRegisters, WatchdogRegisters}

/** Writes operations and what must come of them as lines of text, for `build/flyframe-fuzz` (format:
  * `src/sim/README.md`).
  */
class VectorWriter(p: EscParams, seed: Long, out: PrintStream, val model: EscModel) {
  import VectorWriter._
  private var frames   = 0
  private var lastPort = -1

  // A frame may still be leaving delayed (AP-09): idle nibble times since its end.
  private var leaving = Option.empty[Int]
  out.println(s"H $seed ${p.preset} ${p.ports} ${p.cyclesPerNibble} ${p.dataBusWidth}")

  // Quicker than String.format: every byte of a checkpoint has a line.
  private def hex(value: Int, digits: Int): String = {
    val text = Integer.toHexString(value)
    "0" * (digits - text.length) + text
  }
  private def hexNibbles(nibbles: Seq[Int]): String = nibbles.map(n => Character.forDigit(n, 16)).mkString

  /** Waits until nothing moves. */
  def quiet(): Unit = {
    out.println("Q")
    lastPort = -1
    leaving = None
  }

  /** The receive clock of a port is off by `ppm`, or by what the RX FIFO allows, if that is less. */
  def clockError(port: Int, ppm: Int): Unit = {
    wantedPpm(port) = ppm
    setClocks()
  }
  private val wantedPpm = Array.fill(p.ports)(0)
  private val setPpm    = Array.fill(p.ports)(0)

  /** LP-12 wants 100 ppm, and 50 ppm with the smallest RX FIFO, for frames of 1,522 bytes. Those here have up
    * to 2,048, so that the clocks may be less off.
    */
  private def setClocks(): Unit = {
    val most = if (model.registers.value("rx_fifo_size") < 4) 35 else 74
    for (port <- 0 until p.ports) {
      val ppm = wantedPpm(port).max(-most).min(most)
      if (ppm != setPpm(port)) {
        quiet()
        out.println(s"C $port $ppm")
        setPpm(port) = ppm
      }
    }
  }

  def link(port: Int, up: Boolean): Unit = {
    quiet()
    out.println(s"L $port ${if (up) 1 else 0}")
    model.setLink(port, up)
  }

  /** Without effect where an EEPROM decides it. */
  def pdiOperational(on: Boolean): Unit = if (!p.hasSii) {
    quiet()
    out.println(s"P ${if (on) 1 else 0}")
    model.pdiOperational = on
  }

  def hostWrite(address: Int, byte: Int): Unit = {
    quiet()
    out.println(s"W ${hex(address, 4)} ${hex(byte, 2)}")
    model.hostWrite(address, byte)
    settle()
  }

  /** The comparators of the smoke detector's current give these bits. */
  def detector(current: Int): Unit = {
    quiet()
    out.println(s"D $current")
    model.alarm.foreach(_.setLine(AlarmModel.lineOf(current)))
    settle()
  }

  def advanceUs(us: Int): Unit = {
    quiet()
    out.println(s"A $us")
    model.advanceUs(us)
  }

  // Records whose times the simulated slave has told. They are its own, and take the place of the model's in
  // an acknowledgement.
  private var shown = Map.empty[Int, AlarmModel.Record]

  /** The number of the record that a whole frame acknowledges first of all. */
  private def acknowledged(frame: WireFrame): Option[Int] = {
    val bytes = Receiver.receive(frame).wholeBytes
    val data  = bytes.slice(GuardByte - RecordAckLayout.Guard.offset, bytes.size).map(_.toByte).toArray
    val asks = bytes.size > GuardByte + RecordAckLayout.bytes && frame.symbols.size == 16 + 2 * bytes.size &&
      Fcs.good(bytes) && bytes.slice(12, 14) == Seq(EtherType.EtherCat >> 8, EtherType.EtherCat & 0xff) &&
      bytes(16) == Apwr && bytes.slice(20, 22) == EtherCatFrame.little(AlarmRegisters.Acknowledge)
    for (
      r <- Option.when(asks)(RecordAckLayout.read(data, RecordAckLayout.Sequence).toInt).flatMap(shown.get)
      if RecordAckLayout.read(data, RecordAckLayout.Guard) == (r.time & 0xffff)
    ) yield r.sequence
  }

  /** The master has got the record on offer, if it has left, as number `tag`. */
  def acknowledge(port: Int, tag: Int): Unit =
    for (r <- model.alarm.flatMap(_.onOffer) if shown.contains(r.sequence)) {
      val data = RecordAckLayout.encode(
        RecordAckLayout.Sequence -> r.sequence.toLong,
        RecordAckLayout.Guard    -> (r.time & 0xffff),
        RecordAckLayout.Tag      -> tag.toLong
      )
      val datagram = Datagram(Apwr, 0, AlarmRegisters.Acknowledge, data.map(_ & 0xff).toSeq)
      frame(port, WireFrame.withFcs(EtherCatFrame(Seq(datagram))))
    }

  /** Waits for the detector where that has no debounce. */
  private def settle(): Unit = model.alarm.map(_.settlingUs).filter(_ > 0).foreach(advanceUs)

  /** The byte the host must read. */
  def hostRead(address: Int): Int = {
    quiet()
    readLine(address)
  }

  private def readLine(address: Int): Int = {
    val isTime = model.isTime(address)
    val byte   = model.hostRead(address)
    if (!isTime) out.println(s"R ${hex(address, 4)} ${hex(byte, 2)}")
    byte
  }

  /** The host must read these bytes, all of one word, in one access. */
  def hostReadWord(address: Int): Seq[Int] = {
    quiet()
    val isTime = (address until address + p.lanes).exists(model.isTime)
    val bytes  = model.hostRead(address, p.lanes)
    if (!isTime)
      out.println(s"R ${hex(address, 4)}" + bytes.map(b => " " + hex(b, 2)).mkString)
    bytes
  }

  def falseCarrier(port: Int, symbols: Int): Unit = {
    quiet()
    out.println(s"I $port $symbols")
    quiet()
    model.falseCarrier(port, symbols)
  }

  /** A frame into `port`, `gap` nibble times after the last; what left, and where. */
  def frame(port: Int, frame: WireFrame, gap: Int = 24): Option[(Int, SentFrame)] = {
    // The frame behind a delayed one has to wait. Whether the next but one has depends on the clocks.
    setClocks()
    val guard = acknowledged(frame)
    if (guard.isDefined) quiet()
    val waits = leaving.exists(_ + gap <= MinimumGap)
    if (port != lastPort || (leaving.isDefined && !waits)) quiet()
    lastPort = port
    model.waiting = waits
    val before = loops
    val errors = frame.symbols.indices.filter(frame.symbols(_).error)
    val marks  = if (errors.isEmpty) "" else errors.mkString(" E", ",", "")
    out.println(
      s"F $frames $port $gap ${hexNibbles(frame.symbols.map(_.nibble))}$marks" +
        guard.fold("")(number => s" G$GuardByte:$number")
    )
    frames += 1
    val offered = model.alarm.flatMap(_.onOffer)
    val sent    = model.receive(port, frame)
    val ext     = model.extension
    val unknown = if (ext.hasTime) " ?" else ext.insertedAt.fold("")(nibble => s" T${nibble + TimeNibble}")
    out.println(sent.fold("X -") { case (y, s) => s"X $y ${s.preamble} ${hexNibbles(s.payload)}$unknown" })
    if (sent.isDefined && ext.insertedAt.isDefined && !ext.hasTime)
      offered.foreach(r => shown += r.sequence -> r)
    if (waits) leaving = Some(Never)
    else if (ext.delayed)
      leaving = Some(if (ext.nibbles >= 32) frame.symbols.size - ext.nibbles else Never)
    settle()
    if (loops != before) quiet() // loops change when the port is idle (B-30)
    sent
  }

  private def loops = (0 until p.ports).map(model.open)

  /** The whole state must be right: all registers, user RAM and the given part of the process data RAM. */
  def checkpoint(ram: Range): Unit = {
    quiet()
    val user      = RegisterMap.UserRamStart until RegisterMap.ProcessRamStart
    val registers = model.registers.addresses.filterNot(UnitTraffic.WatchdogStates.contains(_))
    (registers ++ user ++ ram.filter(_ < RegisterMap.ProcessRamStart + p.ramBytes)).foreach(readLine)
  }
}

object VectorWriter {
  private val MinimumGap = 24
  private val Never      = 1000

  /** Nibble of an alarm datagram at which the time stands. */
  private val TimeNibble = 2 * (AppendedLayout.Record.offset + RecordLayout.Time.offset)

  /** Byte of a frame with one acknowledgement at which its guard stands. */
  private val GuardByte = 16 + DatagramLayout.bytes + RecordAckLayout.Guard.offset
}

/** Random operations on one controller, with checkpoints. */
object FuzzVectors {

  /** Writes `count` random frames, and what else happens to a controller, from `seed` on. */
  def write(p: EscParams, seed: Long, count: Int, out: PrintStream): Unit = {
    val random    = new Random(seed)
    val model     = new EscModel(p)
    val writer    = new VectorWriter(p, seed, out, model)
    val generator = new FrameGenerator(p, model, random)
    val units     = new UnitTraffic(p, model, random)
    if (p.hasWatchdogs)
      for (address <- Seq(WatchdogRegisters.TimePdi, WatchdogRegisters.TimeProcessData)) // off
        writer.frame(0, WireFrame.withFcs(EtherCatFrame(Seq(Datagram(Bwr, 0, address, Seq(0, 0))))))
    if (p.hasAlarm) {
      writer.detector(1)
      UnitTraffic.secondsOfMode.foreach(writer.hostWrite(_, 0xff)) // a mode lasts
      (AlarmRegisters.Debounce to AlarmRegisters.OffTime + 1)
        .foreach(writer.hostWrite(_, 0)) // no debounce, no off time
    }
    def port() = random.nextInt(p.ports)
    def frame(port: Int) =
      Iterator.continually(generator.next()).find(f => !p.isRmii(port) || f.isOfRmii).get
    def memory() = {
      val start = RegisterMap.ProcessRamStart + 64 * random.nextInt((p.ramBytes / 64) max 1)
      start until start + 64
    }
    var main = 0
    for (i <- 1 to count) {
      random.nextInt(1000) match {
        case r if r < 12 => writer.link(port(), up = random.nextInt(3) > 0)
        case r if r < 15 => writer.pdiOperational(random.nextInt(3) > 0)
        case r if r < 22 => writer.hostWrite(StationRegisters.Alias + random.nextInt(2), random.nextInt(256))
        case r if r < 30 =>
          writer.hostWrite(RegisterMap.UserRamStart + random.nextInt(0x100), random.nextInt(256))
        case r if r < 33 =>
          val address = random.nextInt(RegisterMap.UserRamStart)
          writer.hostWrite(address, UnitTraffic.calm(p, address, random.nextInt(256)))
        case r if r < 38 => writer.falseCarrier(port(), 1 + random.nextInt(20))
        case r if r < 50 => writer.clockError(port(), random.nextInt(201) - 100)
        case r if r < 58 =>
          (0 until p.ports).foreach(y => writer.link(y, up = true)) // back to a network that works
        case r if r < 66 => // the master sets the loops to auto and an address
          writer.pdiOperational(true)
          val content = EtherCatFrame(
            Seq(
              Datagram(Bwr, 0, DlRegisters.Control, Seq(1, 0, 7, random.nextInt(2))),
              Datagram(Bwr, 0, StationRegisters.Address, Seq(random.nextInt(256), random.nextInt(32)))
            )
          )
          (0 until p.ports).foreach(y => writer.frame(y, WireFrame.withFcs(content)))
        case r if r < 120 => main = if (random.nextBoolean()) 0 else port()
        case _            =>
      }
      if (units.exists && random.nextInt(4) == 0) units.host(writer)
      // At times faster than they are acknowledged.
      if (p.hasAlarm && random.nextInt(if (i / 100 % 3 == 0) 2 else 6) == 0)
        writer.detector(random.nextInt(8))
      if (p.hasAlarm && random.nextInt(3) == 0) writer.acknowledge(main, tag = i & 0xffff)
      val gap = random.nextInt(10) match {
        case 0 => 22
        case 1 => 24 + random.nextInt(200)
        case _ => 24
      }
      val sent = writer.frame(main, frame(main), gap)
      // Sometimes the frame comes back, as in a line.
      if (random.nextInt(8) == 0) sent.foreach { case (y, s) =>
        if (y != main) writer.frame(y, s.onWire, 24 + random.nextInt(30))
      }
      if (i % 40 == 0) writer.checkpoint(memory())
    }
    writer.checkpoint(RegisterMap.ProcessRamStart until RegisterMap.ProcessRamStart + p.ramBytes)
  }
}
