package flyframe

import flyframe.params.EscParams

/** The ports of a top module as its Verilog has them. */
object VerilogPorts {

  /** Direction, width and name of each. */
  def declared(p: EscParams, verilog: String): Set[(String, Int, String)] = {
    val top  = s"(?s)\\nmodule ${p.topName}\\((.*?)\\);".r.findFirstMatchIn(verilog).get.group(1)
    val port = "(input|output)\\s+(?:\\[(\\d+):0\\])?\\s*(\\w+)".r
    port.findAllMatchIn(top).map(m => (m.group(1), Option(m.group(2)).fold(1)(_.toInt + 1), m.group(3))).toSet
  }
}
