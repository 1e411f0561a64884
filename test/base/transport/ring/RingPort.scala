package flyframe.transport.ring

import flyframe.can.CanFrame
import flyframe.transport.BusFrame

/** A ring of nodes as the transports above it meet it: frames go into slots of port F and come out of its
  * FIFO. Nodes have the addresses from 1 on.
  */
trait RingPort {
  def count: Int

  /** us since the start. */
  def now: Long
  def runUs(us: Int): Unit

  /** A frame is put into a slot that does not wait. */
  def request(node: Int, slot: Int, frame: BusFrame): Unit

  /** The slots that wait or are on the wire, bit by bit. */
  def pending(node: Int): Int

  /** All frames of the FIFO, which is empty then. */
  def received(node: Int): Seq[BusFrame]

  /** All slots are to be given up. */
  def abort(node: Int): Unit

  /** As a host leaves its port that starts. */
  def clear(node: Int): Unit = {
    abort(node)
    received(node)
    ()
  }
}

object RingPort {

  /** Slots that a transport uses. */
  val Slots = 16

  def toCan(f: BusFrame): CanFrame = CanFrame(f.id, extended = true, remote = false, f.dlc, f.data)

  def toBus(f: CanFrame): BusFrame = BusFrame(f.id, f.dlc, f.data)

  /** Filters as the driver in C sets them: data frames of 29 bits to an address. Value, mask. */
  def filters(address: Int): Seq[(Int, Int)] =
    for (to <- Seq(address, 0)) yield (0xa0000000 | to << 21, 0xc0000000 | 0x7f << 21)
}
