package flyframe.protocol

/** The datagrams between a master and the server, big endian (REP-01, SRV-01, SRV-12): numbers for RTL,
  * server and host program.
  */
object ServerDatagram {

  /** The first bytes of every datagram; its kind follows. */
  val Magic           = 0x4641
  val Version         = 1
  val KindReport      = 1
  val KindAcknowledge = 2
  val KindCommand     = 3

  /** Bytes of a report before its events, and of an event. */
  val HeaderBytes = 24
  val EventBytes  = 16

  /** Most events of one report. */
  val Most = 64

  /** Bytes of an acknowledgement; of a command, and of it before the code. */
  val AcknowledgementBytes = 12
  val CommandBytes         = 32
  val SignedBytes          = 16

  /** Bytes of the key of a command's code. */
  val KeyBytes = 32

  /** What a command orders. */
  val AlarmClear    = 1
  val DetectorReset = 2

  /** A command with this node ID is for all slaves. */
  val AllNodes = 0xffff
}

/** What became of a command: in an event of kind `Command`, as its state. */
object CommandResult {
  val Done           = 0
  val UnknownCommand = 1
  val NoAnswer       = 2 // from the line
  val NoSuchNode     = 3
}
