package flyframe.can

/** TEC and REC (CAN-30 to CAN-34, CB-07). */
class ConfinementModel {
  private var transmit = 0
  private var receive  = 0

  def tec: Int = transmit
  def rec: Int = receive

  def isBusOff: Boolean  = transmit >= 256
  def isPassive: Boolean = transmit > 127 || receive > 127
  def warns: Boolean     = transmit > 95 || receive > 95

  /** Adds `amount` to the counter of the role. */
  def raise(asTransmitter: Boolean, amount: Int): Unit =
    if (asTransmitter) transmit = (transmit + amount) min 256
    else receive = (receive + amount) min 255

  /** A frame has been sent. */
  def sent(): Unit = transmit = (transmit - 1) max 0

  /** A frame was good up to and with its ACK slot. */
  def received(): Unit = receive = if (receive > 127) 119 else (receive - 1) max 0

  def recover(): Unit = {
    transmit = 0
    receive = 0
  }
}
