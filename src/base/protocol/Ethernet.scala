package flyframe.protocol

/** EtherTypes: what an Ethernet frame carries. */
object EtherType extends Codes("ethertype", "What an Ethernet frame carries") {
  val Ipv4     = code(0x0800, "ipv4", "an IPv4 packet")
  val Arp      = code(0x0806, "arp", "a question for a MAC address, or its answer")
  val Vlan     = code(0x8100, "vlan", "a VLAN tag; the real EtherType follows")
  val EtherCat = code(0x88a4, "ethercat", "an EtherCAT frame; also the number of its UDP port (FP-04)")
}
