package flyframe.params

/** What a CAN port is built with.
  *
  * @param rxFrames
  *   frames that the FIFO holds, 16 to 128
  * @param filters
  *   entries of the acceptance filter, 4 to 32
  * @param slots
  *   frames that may wait to be sent; the register map has 16
  * @param coreClockMhz
  *   clock of the port, for the time stamps
  * @param offerCycles
  *   core cycles after which a request counts (CB-08)
  * @param bridge
  *   frames may be passed on to the other port (BR-01)
  * @param hostBytes
  *   bytes of the host's words: 1, 2 or 4
  */
final case class CanParams(
    rxFrames: Int = 64,
    filters: Int = 16,
    slots: Int = 16,
    coreClockMhz: Int = 50,
    offerCycles: Int = 56,
    bridge: Boolean = false,
    hostBytes: Int = 4
) {
  require(
    rxFrames >= 16 && rxFrames <= 128,
    s"rxFrames is $rxFrames but must be 16 to 128 frames."
  )
  require(filters >= 4 && filters <= 32, s"filters is $filters but must be 4 to 32.")
  require(slots == 16, s"slots is $slots but must be 16.")
  require(
    !bridge || filters >= CanParams.BridgeFilters.end,
    s"filters is $filters but must be ${CanParams.BridgeFilters.end} to 32 with a bridge."
  )
  require(Seq(1, 2, 4).contains(hostBytes), s"hostBytes is $hostBytes but must be 1, 2 or 4.")
  require(coreClockMhz > 0, s"coreClockMhz is $coreClockMhz but must be 1 MHz or more.")
}

object CanParams {

  /** Filters of a port whose frames are bridged, and slots of the other one into which they go (BR-01). */
  val BridgeFilters: Range = 8 until 16
  val BridgeSlots: Range   = 8 until 16
}
