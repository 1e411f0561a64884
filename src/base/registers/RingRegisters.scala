package flyframe.registers

import RegisterTable._

/** The registers of ports, bus mode and relay mode of a ring node (FR-10 to FR-63). */
object RingRegisters {
  val Address  = 0x0010
  val Control  = 0x0011
  val State    = 0x0012
  val Ports    = 0x0013
  val UpMs     = 0x0019
  val Losses1  = 0x0020
  val Losses2  = 0x0021
  val Noise1   = 0x0022
  val Noise2   = 0x0023
  val Closings = 0x002c
  val Latches  = 0x002d

  /** Where counters begin: eight words, in which there is nothing else. */
  val Counters = 0x0020

  /** Those of ports and bus mode. */
  val BusCounters: Seq[Int] = Seq(Losses1, Losses2, Noise1, Noise2, Closings, Latches)

  /** Where ports and bus mode have their part of the node's events, see [[NodeRegisters]]. */
  val Events = 0x0040
  val Mask   = 0x0042

  val LinkBit   = 0x0014
  val Confirm   = 0x0016
  val Retries   = 0x0018
  val Life      = 0x001a
  val Time      = 0x001c
  val Distances = 0x0800

  /** Addresses that have a distance. */
  val Sources = 128

  // Bits of the control register, and of the events.
  val Relay         = 0
  val Home          = 1
  val Forced        = 2
  val ClearConflict = 4
  val PortsOff      = 5
  val PortEvent     = 5
  val ModeEvent     = 6
  val ConflictEvent = 7 // of relay mode

  /** Milliseconds until a port comes up, out of reset. */
  val UpMsReset = 10

  /** Out of reset: 2 Mbit/s at 50 MHz, 10 ms, 15 repeats. */
  val LinkBitReset = 25
  val ConfirmReset = 1000
  val RetriesReset = 15

  private def counter(address: Int, name: String, rules: String, text: String) =
    register(address, 1, name, no, r, rules, text, field(name, 7, 0, status, 0, s"$text, up to 255"))

  /** @param addressBits
    *   implemented bits of the address, 4 to 7
    * @param hasRelay
    *   the node has relay mode, too; then it has [[relay]] beside these
    */
  // format: off
  def apply(addressBits: Int, hasRelay: Boolean = false): Seq[Register] = Seq(
    register(Address,  1, "ring_address",  no, rw, "FR-32", "Address of the node",
      field("ring_address",      addressBits - 1, 0, stored, 0,
          s"1 to ${125 min (1 << addressBits) - 1}; 0: not set")),
    register(Control,  1, "ring_control",  no, rw, "FR-22", "Ring control",
      (if (hasRelay) relayControl else Nil) ++ Seq(
      field("ring_home",         1, 1, stored, 0, "1: guard whenever both ports come up"),
      field("ring_forced",       3, 2, stored, 0, "Mode 1, 2 or 3 by force; 0: automatic"),
      field("ring_off",          5, 5, stored, 0, "1: both ports are dark")): _*),
    register(State,    1, "ring_state",    no, r,  "FR-20", "Ring state",
      (if (hasRelay) relayState else Nil) ++ Seq(
      field("ring_mode",         1, 0, status, 0, "Mode 1, 2 or 3"),
      field("ring_guard",        2, 2, status, 0, "1: guard"),
      field("ring_alone",        3, 3, status, 0, "1: no port is up"),
      field("ring_cut_off",      5, 5, status, 0, "1: what the own controller sends is cut off")): _*),
    register(Ports,    1, "ring_ports",    no, r,  "FR-12", "State of the ports",
      field("ring_signal1",      0, 0, status, 0, "1: port 1 has signal"),
      field("ring_search1",      1, 1, status, 0, "1: port 1 hears search"),
      field("ring_up1",          2, 2, status, 0, "1: port 1 is up"),
      field("ring_stuck1",       3, 3, status, 0, "1: port 1 hears dominant for too long"),
      field("ring_signal2",      4, 4, status, 0, "1: port 2 has signal"),
      field("ring_search2",      5, 5, status, 0, "1: port 2 hears search"),
      field("ring_up2",          6, 6, status, 0, "1: port 2 is up"),
      field("ring_stuck2",       7, 7, status, 0, "1: port 2 hears dominant for too long")),
    register(UpMs,     1, "ring_up_ms",    no, rw, "FR-12", "Time until a port comes up",
      field("ring_up_ms",        7, 0, stored, UpMsReset, "Milliseconds of signal without search")),
    counter(Losses1,  "ring_losses1",  "FR-14", "Times that port 1 went down"),
    counter(Losses2,  "ring_losses2",  "FR-14", "Times that port 2 went down"),
    counter(Noise1,   "ring_noise1",   "FR-10", "Times that noise began at port 1"),
    counter(Noise2,   "ring_noise2",   "FR-10", "Times that noise began at port 2"),
    counter(Closings, "ring_closings", "FR-32", "Times that the node, as guard, closed the ring"),
    counter(Latches,  "ring_latches",  "FR-36", "Times that a latch made the node guard")
  )

  // What relay mode adds to registers of bus mode.
  private lazy val relayControl = Seq(
      field("ring_relay",        0, 0, stored, 0, "1: relay mode; 0: bus mode"),
      field("ring_clear",        4, 4, status, 0, "Write 1: an address conflict is over"))
  private lazy val relayState = Seq(
      field("ring_conflict",     4, 4, status, 0, "1: another node has the address"))

  /** The counters of relay mode with their addresses, bytes and rules. */
  private val relayCounters = Seq(
    (0x0024, 1, "ring_bad_headers1",  "FR-45", "Headers with a wrong check at port 1"),
    (0x0025, 1, "ring_bad_headers2",  "FR-45", "Headers with a wrong check at port 2"),
    (0x0026, 1, "ring_bad_frames1",   "FR-47", "Frames that proved bad at port 1"),
    (0x0027, 1, "ring_bad_frames2",   "FR-47", "Frames that proved bad at port 2"),
    (0x0028, 1, "ring_strays",        "FR-45", "Frames not passed on: no hops left, or no room"),
    (0x0029, 1, "ring_doubles",       "FR-59", "Frames received already"),
    (0x002a, 1, "ring_repeated",      "FR-58", "Own frames repeated"),
    (0x002b, 1, "ring_failed",        "FR-58", "Own frames failed"),
    (0x002e, 1, "ring_aborted",       "FR-47", "Frames ended by an abort"),
    (0x002f, 1, "ring_wrapped",       "FR-45", "Frames sent back by the port by which they came"),
    (0x0030, 4, "ring_passed12",      "FR-45", "Frames passed on from port 1 to port 2"),
    (0x0034, 4, "ring_passed21",      "FR-45", "Frames passed on from port 2 to port 1"),
    (0x0038, 4, "ring_own_sent",      "FR-55", "Own frames sent, without repeats"),
    (0x003c, 4, "ring_own_confirmed", "FR-57", "Own frames confirmed"))

  /** Their names, in the order of the addresses. */
  val RelayCounterNames: Seq[String] = relayCounters.map(_._3)

  /** Their addresses and bytes. */
  val RelayCounters: Seq[(Int, Int)] = relayCounters.map(c => (c._1, c._2))

  /** What only relay mode has, but [[distances]]. */
  val relay: Seq[Register] = Seq(
    register(LinkBit,  2, "ring_link_bit", no, rw, "FR-40", "Bit of the links",
      field("ring_link_bit",     7, 0, stored, LinkBitReset,
        "Core cycles, 25 (at 100 MHz 50) to 250; reads as it counts (RB-26)")),
    register(Confirm,  2, "ring_confirm",  no, rw, "FR-58", "Time until an own frame is repeated",
      field("ring_confirm",     15, 0, stored, ConfirmReset, "In 10 us")),
    register(Retries,  1, "ring_retries",  no, rw, "FR-58", "Repeats of an own frame",
      field("ring_retries",      7, 0, stored, RetriesReset, "How often a frame is repeated")),
    register(Life,     1, "ring_life",     no, rw, "FR-61", "Life of the node",
      field("ring_life",         6, 0, stored, 0, "Number of its start, modulo 128"))
  ) ++ relayCounters.map { case (address, bytes, name, rules, text) =>
    register(address, bytes, name, no, r, rules, text,
      field(name, 8 * bytes - 1, 0, status, 0, if (bytes == 1) s"$text, up to 255" else text))
  }

  /** The distances to all addresses, of relay mode. */
  def distances: Seq[Register] = (0 until Sources).map(distance)

  private def distance(n: Int) =
    register(Distances + 2 * n, 2, s"ring_distance$n", no, r, "FR-60", s"Distance to address $n",
      field(s"ring_distance${n}_1", 7, 0, status, 0, "Hops at port 1; 0: not heard for long"),
      field(s"ring_distance${n}_2", 15, 8, status, 0, "Hops at port 2; 0: not heard for long")
    ).copy(block = Some(Block(n, Sources, 2)))
  // format: on
}
