package flyframe.model

import flyframe.params.EscParams
import flyframe.registers.RegisterMap

/** A slave controller as the specification and `docs/behaviour.md` describe it: frame in, frame out, state
  * visible.
  *
  * Independent of the RTL: it shares the register and parameter data, no logic.
  */
class EscModel(val p: EscParams) {
  private val portNumbers = 0 until p.ports
  private val links       = Array.fill(p.ports)(true)

  // Auto close: written, or a good frame, since the link came up (LP-04).
  private val released = Array.fill(p.ports)(true)
  private val opened   = Array.fill(p.ports)(true)
  private val memory   = new Array[Int](0x10000)

  /** Process data RAM is open (FP-31). */
  var pdiOperational: Boolean = true

  val registers: ModelRegisters = new ModelRegisters(p, status)

  // A temporary loop setting (B-31): the settings to return to, and the time left.
  private var temporary: Option[(Seq[Int], Int)] = None
  updateLoops()

  // ---- ports ----

  private def setting(port: Int): Int = registers.value(s"loop_port$port")

  private def wanted(port: Int): Boolean = setting(port) match {
    case 0 => links(port)
    case 1 => links(port) && released(port)
    case 2 => true
    case _ => false
  }

  private def updateLoops(): Unit = {
    portNumbers.foreach(y => opened(y) = wanted(y))
    if (!opened.contains(true)) opened(0) = true // recovery port (LP-06)
  }

  /** Frames leave and enter at this port. */
  def open(port: Int): Boolean = opened(port)

  private val Status = "([a-z_]+?)_port(\\d)".r
  private def status(name: String): Int = {
    val set = name match {
      case "pdi_operational"                            => pdiOperational
      case Status("physical_link" | "communication", y) => links(y.toInt)
      case Status("loop_closed", y)                     => !wanted(y.toInt)
    }
    if (set) 1 else 0
  }

  def setLink(port: Int, up: Boolean): Unit = {
    if (links(port) && !up && opened(port) && setting(port) == 0) registers.count(s"lost_link_port$port")
    if (!up) released(port) = false
    links(port) = up
    updateLoops()
  }

  // ---- local side ----

  private def isUserRam(address: Int) =
    address >= RegisterMap.UserRamStart && address < RegisterMap.ProcessRamStart
  private def isMemory(address: Int): Boolean = isUserRam(address) ||
    (pdiOperational && address >= RegisterMap.ProcessRamStart && address < RegisterMap.ProcessRamStart + p.ramBytes)

  /** A byte as the host reads it; 0 where nothing is. */
  def hostRead(address: Int): Int =
    if (isMemory(address)) memory(address)
    else if (registers.pdi(address).readable) registers.byte(address)
    else 0

  def hostWrite(address: Int, byte: Int): Unit =
    if (isMemory(address)) memory(address) = byte
    else if (registers.pdi(address).writable) registers.write(address, byte)

  /** Lets time pass, for temporary loop settings. */
  def advanceMs(ms: Int): Unit = temporary.foreach { case (former, left) =>
    if (ms < left) temporary = Some(former -> (left - ms))
    else {
      temporary = None
      registers.set("temporary_use", 0)
      portNumbers.foreach(y => registers.set(s"loop_port$y", former(y)))
      updateLoops()
    }
  }

  // ---- frames ----

  /** A frame arrives at `port`; what leaves the controller, and where. None: nothing leaves (the loop is
    * closed).
    */
  def receive(port: Int, frame: WireFrame): Option[(Int, SentFrame)] = {
    val received = Receiver.receive(frame)
    val wasOpen  = opened(port)
    val sent     = Option.when(wasOpen)(pass(port, received))
    // Counted when the frame is over: a datagram in it still reads the old values.
    if (wasOpen) {
      registers.count(s"rx_er_port$port", received.rxErrors)
      received.verdict match {
        case Verdict.Invalid   => registers.count(s"invalid_frame_port$port")
        case Verdict.Forwarded => registers.count(s"forwarded_error_port$port")
        case _                 =>
      }
    }
    if (received.good && links(port)) released(port) = true
    updateLoops()
    sent
  }

  /** Symbols with RX_ER outside a frame (HINT-04). */
  def falseCarrier(port: Int, symbols: Int): Unit =
    if (opened(port)) registers.count(s"rx_er_port$port", symbols)

  /** The way from behind loop-back `port` on (LP-08, LP-09). */
  private def pass(port: Int, received: ReceivedFrame): (Int, SentFrame) = {
    val cycle = Seq(3, 1, 2, 0).filter(_ < p.ports)
    val route = (cycle ++ cycle ++ cycle).dropWhile(_ != port).tail

    // After the loop-back of port 0 comes the processing unit, then the cycle starts again.
    def walk(left: Seq[Int], through: Boolean, payload: Vector[Int], bad: Boolean): (Int, SentFrame) = {
      val (now, isBad) = if (through && received.hasSfd) process(payload, bad) else (payload, bad)
      if (through && !received.hasSfd) registers.count("epu_error")
      val next = left.head
      if (!opened(next)) walk(left.tail, next == 0, now, isBad)
      else if (isBad) next -> Transmitter.bad(received.preamble, received.hasSfd, now)
      else next            -> Transmitter.good(received.preamble, now)
    }
    walk(route, port == 0, received.payload, !received.good)
  }

  /** Through the processing unit; the payload behind it, and whether the frame is in error. */
  private def process(payload: Vector[Int], alreadyBad: Boolean): (Vector[Int], Boolean) = {
    var pending  = Vector.empty[(Int, Int)]
    var accepted = 0
    val space = new AddressSpace {
      def read(address: Int): Option[Int] =
        if (address > 0xffff) None
        else if (isMemory(address)) Some(memory(address))
        else Option.when(registers.ecat(address).readable)(registers.byte(address))

      def write(address: Int, byte: Int): Boolean =
        if (address > 0xffff) false
        else if (isMemory(address)) { memory(address) = byte; true }
        else {
          val may = registers.ecat(address).writable && accepted < p.writeLogDepth // B-17
          if (may) { accepted += 1; pending :+= address -> byte }
          may
        }
    }
    val settings = ProcessingSettings(
      stationAddress = registers.value("station_address"),
      alias = Option.when(registers.value("alias_enable") == 1)(registers.value("station_alias")),
      destroyForeign = registers.value("destroy_non_ethercat") == 1,
      circulating = !opened(0) && setting(0) <= 1, // LP-14
      ecatEvents = 0,
      maxSubTelegrams = p.maxSubTelegrams
    )
    val done = new ProcessingUnit(settings, space).process(payload, alreadyBad)
    if (done.bad || done.tooMany) registers.count("epu_error")
    if (!done.bad) commit(pending)
    (done.payload, done.bad)
  }

  /** FP-32: the frame ended well, its register writes take effect. */
  private def commit(writes: Seq[(Int, Int)]): Unit = {
    val before = portNumbers.map(setting)
    writes.foreach { case (address, byte) => registers.write(address, byte) }
    if (writes.exists(_._1 == 0x0101)) portNumbers.foreach(y => if (links(y)) released(y) = true) // B-33
    val asked = registers.value("temporary_use") == 1
    if (!asked) temporary = None
    else if (temporary.isEmpty) temporary = Some(before -> p.temporaryLoopMs)
  }
}
