package flyframe.registers

import RegisterTable._

/** The registers of ports and bus mode of a ring node (FR-10 to FR-37). */
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
  val Closings = 0x002a
  val Latches  = 0x002b

  /** Where ports and bus mode have their part of the node's events, see [[NodeRegisters]]. */
  val Events = 0x0040
  val Mask   = 0x0042

  // Bits of the control register, and of the events.
  val Home      = 1
  val Forced    = 2
  val PortsOff  = 5
  val PortEvent = 5
  val ModeEvent = 6

  /** Milliseconds until a port comes up, out of reset. */
  val UpMsReset = 10

  private def counter(address: Int, name: String, rules: String, text: String) =
    register(address, 1, name, no, r, rules, text, field(name, 7, 0, status, 0, s"$text, up to 255"))

  /** @param addressBits
    *   implemented bits of the address, 4 to 7
    */
  // format: off
  def apply(addressBits: Int): Seq[Register] = Seq(
    register(Address,  1, "ring_address",  no, rw, "FR-32", "Address of the node",
      field("ring_address",      addressBits - 1, 0, stored, 0,
          s"1 to ${125 min (1 << addressBits) - 1}; 0: not set")),
    register(Control,  1, "ring_control",  no, rw, "FR-22", "Ring control",
      field("ring_home",         1, 1, stored, 0, "1: guard whenever both ports come up"),
      field("ring_forced",       3, 2, stored, 0, "Mode 1, 2 or 3 by force; 0: automatic"),
      field("ring_off",          5, 5, stored, 0, "1: both ports are dark")),
    register(State,    1, "ring_state",    no, r,  "FR-20", "Ring state",
      field("ring_mode",         1, 0, status, 0, "Mode 1, 2 or 3"),
      field("ring_guard",        2, 2, status, 0, "1: guard"),
      field("ring_alone",        3, 3, status, 0, "1: no port is up"),
      field("ring_cut_off",      5, 5, status, 0, "1: what the own controller sends is cut off")),
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
  // format: on
}
