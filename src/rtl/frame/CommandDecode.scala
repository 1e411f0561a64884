package flyframe.frame

import chisel3._
import flyframe.protocol.Command._

/** What the datagram commands (FP section 5) ask of an ESC; `code` is one of [[flyframe.protocol.Command]].
  */
object CommandDecode {

  private def oneOf(code: UInt, codes: Int*): Bool = codes.map(code === _.U).reduce(_ || _)

  /** ADP is a position, 0 = this ESC (FP-14). */
  def byPosition(code: UInt): Bool = oneOf(code, Aprd, Apwr, Aprw, Armw)

  /** ADP is a station address (FP-15). */
  def byStation(code: UInt): Bool = oneOf(code, Fprd, Fpwr, Fprw, Frmw)

  /** Every ESC is addressed (FP-17). */
  def broadcast(code: UInt): Bool = oneOf(code, Brd, Bwr, Brw)

  /** The address is a logical one, for the FMMUs (FP-19). */
  def logical(code: UInt): Bool = oneOf(code, Lrd, Lwr, Lrw)

  /** ADP is incremented on the way (FP-22). */
  def incrementsAdp(code: UInt): Bool = byPosition(code) || broadcast(code)

  /** Reads where addressed. */
  def reads(code: UInt): Bool = oneOf(code, Aprd, Aprw, Fprd, Fprw, Brd, Brw, Lrd, Lrw)

  /** Writes where addressed. */
  def writes(code: UInt): Bool = oneOf(code, Apwr, Aprw, Fpwr, Fprw, Bwr, Brw, Lwr, Lrw)

  /** Reads where addressed, writes everywhere else (FP-24). */
  def readsOneWritesOthers(code: UInt): Bool = oneOf(code, Armw, Frmw)
}
