package flyframe.mii

import chisel3._

/** What runs between the units on the wire path: one nibble of a frame per nibble slot (40 ns), preamble
  * included.
  *
  * Every stage takes one of these and gives one, so stages can be tested alone, left out or put in another
  * order. The end-of-frame fields are meaningful with `last`; `crcGood` always.
  */
class NibbleStream extends Bundle {

  /** This slot carries a nibble of a frame. */
  val valid = Bool()

  /** The nibble is behind the SFD. */
  val payload = Bool()

  /** The nibble: 0x5 in the preamble, 0xD as the end of the SFD, data behind it (low half of a byte first).
    */
  val data = UInt(4.W)

  /** The frame ends with this nibble. */
  val last = Bool()

  /** With `last`: the frame is in error (ERR-06). */
  val bad = Bool()

  /** The payload up to and with this nibble has an odd number of nibbles. */
  val odd = Bool()

  /** The FCS over the whole bytes up to here is right. */
  val crcGood = Bool()
}

object NibbleStream {

  /** A slot without a frame. */
  def idle: NibbleStream = 0.U.asTypeOf(new NibbleStream)
}
