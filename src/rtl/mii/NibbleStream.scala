package flyframe.mii

import chisel3._

/** What runs between the units on the wire path: one nibble of a frame per nibble slot (40 ns), preamble
  * included.
  *
  * A frame is one nibble or more, slot by slot, and in the slot behind the last one its end, with the
  * verdict. Every stage takes one of these and gives one, so stages can be tested alone, left out or put in
  * another order.
  */
class NibbleStream extends Bundle {

  /** This slot carries a nibble of a frame. */
  val valid = Bool()

  /** The slot is behind the SFD. */
  val payload = Bool()

  /** The nibble: 0x5 in the preamble, 0xD as the end of the SFD, data behind it (low half of a byte first).
    */
  val data = UInt(4.W)

  /** The frame has ended with the slot before; never with `valid`. */
  val end = Bool()

  /** With `end`: the frame is in error (ERR-06). */
  val bad = Bool()

  /** With `end`, and from receivers in every slot behind the SFD: the payload before this slot has an odd
    * number of nibbles.
    */
  val odd = Bool()

  /** The same: the FCS over the whole bytes before this slot is right. */
  val crcGood = Bool()

  /** The slot belongs to a frame. */
  def busy: Bool = valid || end
}

object NibbleStream {

  /** A slot without a frame. */
  def idle: NibbleStream = 0.U.asTypeOf(new NibbleStream)
}
