package flyframe.mi

import chisel3._

/** An access of the controller itself to the PHY of a port (MI-10). The side that asks holds it until `done`.
  */
class PhyAccess extends Bundle {
  val valid    = Output(Bool())
  val port     = Output(UInt(2.W))
  val register = Output(UInt(5.W))
  val isWrite  = Output(Bool())
  val data     = Output(UInt(16.W))

  /** High for a cycle, with what was read, or that no PHY answered. */
  val done   = Input(Bool())
  val answer = Input(UInt(16.W))
  val silent = Input(Bool())
}

/** Registers of a PHY (IEEE 802.3, clause 22), and values for them. */
object Phy {
  val Control       = 0
  val Status        = 1
  val Advertisement = 4
  val Partner       = 5
  val Gigabit       = 9

  /** Auto-negotiation on and begun anew; fixed 100 Mbit/s full duplex; 100BASE-TX full duplex only. */
  val Restart    = 0x1200
  val Fixed      = 0x2100
  val OnlyFullTx = 0x0101
}
