package flyframe.can

/** Types of bus errors in the last error record (CAN-46); their counters stand in the same order. */
object CanError {
  val None  = 0
  val Bit   = 1
  val Stuff = 2
  val Form  = 3
  val Crc   = 4
  val Ack   = 5

  /** By their names in C. */
  val all: Seq[(String, Int)] =
    Seq("none" -> None, "bit" -> Bit, "stuff" -> Stuff, "form" -> Form, "crc" -> Crc, "ack" -> Ack)
}

/** States in the status register (CAN-33). */
object CanState {
  val Stopped = 0
  val Active  = 1
  val Passive = 2
  val BusOff  = 3

  /** By their names in C. */
  val all: Seq[(String, Int)] =
    Seq("stopped" -> Stopped, "active" -> Active, "passive" -> Passive, "bus_off" -> BusOff)
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

  /** By their names in C. */
  val all: Seq[(String, Int)] = Seq(
    "idle"               -> Idle,
    "sof"                -> Sof,
    "id"                 -> Id,
    "rtr_or_srr"         -> RtrOrSrr,
    "ide"                -> Ide,
    "id_extension"       -> IdExtension,
    "rtr"                -> Rtr,
    "fdf"                -> Fdf,
    "r0"                 -> R0,
    "dlc"                -> Dlc,
    "crc"                -> Crc,
    "crc_delimiter"      -> CrcDelimiter,
    "ack_slot"           -> AckSlot,
    "ack_delimiter"      -> AckDelimiter,
    "eof"                -> Eof,
    "intermission"       -> Intermission,
    "suspend"            -> Suspend,
    "active_error_flag"  -> ActiveErrorFlag,
    "passive_error_flag" -> PassiveErrorFlag,
    "error_delimiter"    -> ErrorDelimiter,
    "overload_flag"      -> OverloadFlag,
    "overload_delimiter" -> OverloadDelim,
    "integrating"        -> Integrating,
    "bus_off"            -> BusOff,
    "data"               -> Data
  )
}
