package flyframe.can

/** A CAN frame (CAN-07).
  *
  * @param id
  *   identifier of 11 or 29 bits
  * @param dlc
  *   0 to 15; above 8 it stands for eight bytes
  * @param data
  *   as many bytes as a data frame with this DLC has; none in a remote frame
  */
final case class CanFrame(id: Int, extended: Boolean, remote: Boolean, dlc: Int, data: Seq[Int]) {
  require(
    id >= 0 && id < (1 << (if (extended) 29 else 11)),
    f"the identifier is 0x$id%x but must be 0 to 0x${if (extended) 0x1fffffff else 0x7ff}%x."
  )
  require(dlc >= 0 && dlc <= 15, s"the DLC is $dlc but must be 0 to 15.")
  require(
    data.size == CanFrame.size(dlc, remote),
    s"the frame has ${data.size} bytes but must have ${CanFrame.size(dlc, remote)}."
  )

  /** The eleven bits in front of RTR or SRR. */
  def baseId: Int = if (extended) id >> 18 else id

  /** Its arbitration field, read as a number: the lower one wins (CAN-41). 32 bits: ID, RTR or SRR, IDE, the
    * extension, its RTR.
    */
  def order: Long = {
    val r = if (remote) 1L else 0L
    if (extended) baseId.toLong << 21 | 3L << 19 | (id & 0x3ffffL) << 1 | r
    else id.toLong << 21 | r << 20
  }

  /** The identifier word: bit 31 extended, 30 remote. */
  def word: Int = id | (if (remote) 1 << 30 else 0) | (if (extended) 1 << 31 else 0)

  /** As it stands in a slot or in the FIFO: 16 bytes.
    *
    * @param filter
    *   filter that matched
    * @param time
    *   time stamp, of which the low 16 bits are kept
    */
  def bytes(filter: Int = 0, time: Int = 0): Seq[Int] =
    (0 until 4).map(i => word >> 8 * i & 0xff) ++ Seq(dlc, filter, time & 0xff, time >> 8 & 0xff) ++
      data.padTo(8, 0)
}

object CanFrame {

  /** Data bytes of a frame. */
  def size(dlc: Int, remote: Boolean): Int = if (remote) 0 else dlc min 8

  /** A frame out of the 16 bytes of a slot. Identifiers of 11 bits: the other bits count for nothing. */
  def of(bytes: Seq[Int]): CanFrame = {
    val word     = (0 until 4).map(i => bytes(i) << 8 * i).sum
    val extended = word < 0
    val remote   = (word >> 30 & 1) == 1
    val dlc      = bytes(4) & 0xf
    CanFrame(
      word & (if (extended) 0x1fffffff else 0x7ff),
      extended,
      remote,
      dlc,
      bytes.slice(8, 8 + size(dlc, remote))
    )
  }
}
