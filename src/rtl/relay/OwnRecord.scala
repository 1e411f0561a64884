package flyframe.relay

import chisel3._

/** What is kept of an own frame on its way. */
class OwnRecord extends Bundle {
  import OwnRecord._

  /** The low bits of its sequence. */
  val sequence = UInt(SequenceBits.W)

  /** How often it has been repeated. */
  val repeats = UInt(8.W)

  /** Units of 10 us until it is repeated; when it is over, all ones. */
  val left = UInt(LeftBits.W)

  /** Its copies. */
  val copies = Vec(2, UInt(2.W))

  /** FR-57, RB-24: it is confirmed. */
  def isHome: Bool = {
    def any(state: Int) = copies.map(_ === state.U).reduce(_ || _)
    any(Home) && !any(Waits) && !any(Sent)
  }
  def waits(port: Int): Bool = copies(port) === Waits.U && !isHome
}

object OwnRecord {
  val SequenceBits = 4
  val LeftBits     = 20

  // States of a copy.
  val None  = 0 // it was not to be sent, or its port has gone down
  val Waits = 1
  val Sent  = 2
  val Home  = 3 // it came back by the port by which it left; both: the frame is confirmed
}
