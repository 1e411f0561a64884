package flyframe.protocol

import java.nio.ByteOrder.LITTLE_ENDIAN

/** The datagram commands (FP section 5): the first byte of a datagram. */
object Command extends Codes("ecat", "Commands of EtherCAT datagrams") {
  val Nop  = code(0, "nop", "nobody does anything")
  val Aprd = code(1, "aprd", "read by position")
  val Apwr = code(2, "apwr", "write by position")
  val Aprw = code(3, "aprw", "read and write by position")
  val Fprd = code(4, "fprd", "read by station address")
  val Fpwr = code(5, "fpwr", "write by station address")
  val Fprw = code(6, "fprw", "read and write by station address")
  val Brd  = code(7, "brd", "all read")
  val Bwr  = code(8, "bwr", "all write")
  val Brw  = code(9, "brw", "all read and write")
  val Lrd  = code(10, "lrd", "read by logical address")
  val Lwr  = code(11, "lwr", "write by logical address")
  val Lrw  = code(12, "lrw", "read and write by logical address")
  val Armw = code(13, "armw", "the one at the position reads, all others write")
  val Frmw = code(14, "frmw", "the one with the station address reads, all others write")
}

/** What every datagram of an EtherCAT frame begins with (FP-12). */
abstract class DatagramFields(name: String, meaning: String) extends Layout(name, meaning, LITTLE_ENDIAN) {
  val Command = field("command", 1, "one of enum protocol_ecat")
  val Index   = field("index", 1, "chosen by the master")
  val Adp     = field("adp", 2, "position or station address; low half of a logical address")
  val Ado     = field("ado", 2, "local address; high half of a logical address")
  val Length  = field("length", 2, "bits 10 to 0: bytes of data; bit 14: circulating; bit 15: more follow")
  val Irq     = field("irq", 2, "event request")
}

/** The header of a datagram; data and working counter follow. */
object DatagramLayout extends DatagramFields("datagram", "The header of an EtherCAT datagram") {

  /** Bytes of the working counter behind the data. */
  val CounterBytes = 2

  /** Bytes of a datagram besides its data. */
  val Overhead = bytes + CounterBytes
}
