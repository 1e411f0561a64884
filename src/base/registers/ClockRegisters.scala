package flyframe.registers

import flyframe.params.EscParams
import RegisterTable._

/** Distributed clocks: the local times at which frames have begun (DC-07). They are there for four ports, as
  * masters read them; of ports that do not exist they are 0.
  */
object ClockRegisters {

  /** A write of this byte has the times of its frame kept. */
  val Trigger = 0x0900

  /** First byte of the time at the processing unit. */
  val Processing = 0x0918

  /** Names of the fields of a port, lowest first, with their bytes. */
  def port(y: Int): Seq[(String, Int)] =
    if (y == 0) Seq("receive_time_port0_low" -> 1, "receive_time_port0_high" -> 3)
    else Seq(s"receive_time_port$y"          -> 4)

  // format: off
  def apply(p: EscParams): Seq[Register] = Seq(
    register(Trigger, 1, "receive_time_trigger",           rw, r, "DC-07", "Receive time of port 0, low",
      field("receive_time_port0_low",    7, 0, kept, 0,
          "A write has the receive times of its frame kept; its data is ignored")),
    register(0x0901, 3, "receive_time_port0",              r, r, "DC-07", "Receive time of port 0, high",
      field("receive_time_port0_high",  23, 0, kept, 0, "Local time, ns"))
  ) ++ (1 to 3).map(y =>
    register(Trigger + 4 * y, 4, s"receive_time_port$y",   r, r, "DC-07", s"Receive time of port $y",
      field(s"receive_time_port$y",     31, 0, kept, 0, "Local time, ns"))
  ) :+
    register(Processing, p.clockBytes, "receive_time_processing_unit", r, r, "DC-07",
        "Receive time of the processing unit",
      field("receive_time_processing_unit", 8 * p.clockBytes - 1, 0, kept, 0, "Local time, ns"))
  // format: on
}
