package flyframe.mii

import chisel3._

/** The Ethernet FCS, a nibble at a time, bits reflected as they travel (least significant first). */
object Crc32 {
  private val polynomial = 0xedb88320L

  /** State before the first nibble. */
  val Start: UInt = "hffffffff".U(32.W)

  /** State behind a frame whose FCS is right. */
  val Residue: UInt = "hdebb20e3".U(32.W)

  /** The state `crc` after the nibble `data`.
    *
    * Linear: with XOR-differences of states and nibbles it gives the difference of the new states.
    */
  def next(crc: UInt, data: UInt): UInt = {
    val feedback = crc(3, 0) ^ data(3, 0)
    // Effect of each feedback bit on the state, four shifts later.
    val effects = (0 until 4).map { bit =>
      val effect =
        (0 until 4).foldLeft(1L << bit)((s, _) => if ((s & 1) == 1) (s >> 1) ^ polynomial else s >> 1)
      Mux(feedback(bit), effect.U(32.W), 0.U)
    }
    effects.foldLeft((crc >> 4).pad(32))(_ ^ _)
  }
}
