package flyframe.registers

import flyframe.params.EscParams
import RegisterTable._

/** What ports and processing unit count (ERR-01 to ERR-11); used by [[flyframe.port.DataLink]]. A write of
  * one clears all of its group.
  */
object ErrorCounters {
  // format: off
  private def port(y: Int) = Seq(
    register(0x0300 + 2 * y, 2, s"rx_error_port$y",        clr, r, "ERR-02", s"RX error counter port $y",
      field(s"invalid_frame_port$y",    7, 0, counter("rx"),        0, s"Invalid frames received at port $y"),
      field(s"rx_er_port$y",           15, 8, counter("rx"),        0,
          s"Symbols with RX_ER at port $y (ERR-03)")),
    register(0x0308 + y,     1, s"forwarded_error_port$y", clr, r, "ERR-08",
        s"Forwarded RX error counter port $y",
      field(s"forwarded_error_port$y",  7, 0, counter("rx"),        0,
          s"Errors an earlier ESC has marked, seen at port $y")),
    register(0x0310 + y,     1, s"lost_link_port$y",       clr, r, "ERR-11", s"Lost link counter port $y",
      field(s"lost_link_port$y",        7, 0, counter("lost_link"), 0,
          s"Link losses at port $y while its loop is auto"))
  )

  def apply(p: EscParams): Seq[Register] = (0 until p.ports).flatMap(port) :+
    register(0x030c,         1, "epu_error",               clr, r, "ERR-02",
        "ECAT processing unit error counter",
      field("epu_error",                7, 0, counter("epu"),       0,
          "Errors of frames passing the processing unit"))
  // format: on
}
