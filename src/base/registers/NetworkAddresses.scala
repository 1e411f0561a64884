package flyframe.registers

/** Where a master's addresses in the network stand among its registers (HOST-02). */
object NetworkAddresses {

  /** The address of the first one's register. */
  val First = 0x10

  /** Where things are behind `First`, as in the headers of a UDP datagram to the server: MAC addresses as
    * bytes 0 to 11 of the header, the rest as its bytes 26 to 37.
    */
  val ServerMac  = 0
  val MasterMac  = 6
  val MasterIp   = 12
  val ServerIp   = 16
  val MasterPort = 20
  val ServerPort = 22
}
