package flyframe.protocol

/** The datagram commands (FP section 5): the low half of a datagram's first byte. */
object Command {
  val Nop  = 0
  val Aprd = 1
  val Apwr = 2
  val Aprw = 3
  val Fprd = 4
  val Fpwr = 5
  val Fprw = 6
  val Brd  = 7
  val Bwr  = 8
  val Brw  = 9
  val Lrd  = 10
  val Lwr  = 11
  val Lrw  = 12
  val Armw = 13
  val Frmw = 14
}
