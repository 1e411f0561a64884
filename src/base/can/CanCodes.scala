package flyframe.can

/** Types of bus errors in the last error record (CAN-46); their counters stand in the same order. */
object CanError {
  val None  = 0
  val Bit   = 1
  val Stuff = 2
  val Form  = 3
  val Crc   = 4
  val Ack   = 5
}

/** States in the status register (CAN-33). */
object CanState {
  val Stopped = 0
  val Active  = 1
  val Passive = 2
  val BusOff  = 3
}

/** Where in the bit stream a controller is: the field of the last error record (CB-10). The bits of a field
  * count from 0 in the order on the wire; data bytes are fields of their own.
  */
object CanField {
  val Idle             = 0
  val Sof              = 1
  val Id               = 2 // ID10-0 or ID28-18
  val RtrOrSrr         = 3 // behind it
  val Ide              = 4
  val IdExtension      = 5 // ID17-0
  val Rtr              = 6 // of an extended frame
  val Fdf              = 7 // r0 of a base frame, r1 of an extended one
  val R0               = 8 // of an extended frame
  val Dlc              = 9
  val Crc              = 10
  val CrcDelimiter     = 11
  val AckSlot          = 12
  val AckDelimiter     = 13
  val Eof              = 14
  val Intermission     = 15
  val Suspend          = 16
  val ActiveErrorFlag  = 17
  val PassiveErrorFlag = 18
  val ErrorDelimiter   = 19
  val OverloadFlag     = 20
  val OverloadDelim    = 21
  val Integrating      = 22
  val BusOff           = 23

  /** Of data byte 0; byte n is field 24 + n. */
  val Data = 24
}
