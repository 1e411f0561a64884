package flyframe.relay

import flyframe.can.CanFrame
import flyframe.registers.{CanRegisters, RingRegisters}

/** What the host of a node in a ring does. */
object RingHost {
  private val port  = CanRegisters.PortStarts(0)
  private val slots = CanRegisters.SlotStarts(0)

  /** Sets a node up: relay mode, one filter that takes everything. */
  def start(ring: RelayRing, n: Int, address: Int, confirmUs: Int = 10000, life: Int = 1): Unit =
    ring.access(n) { h =>
      h.write(RingRegisters.Address, Seq(address))
      h.write(RingRegisters.LinkBit, Seq(ring.setting.linkBit & 0xff, ring.setting.linkBit >> 8))
      h.write(RingRegisters.Confirm, Seq(confirmUs / 10 & 0xff, confirmUs / 10 >> 8))
      h.write(CanRegisters.FilterStarts(0), Seq(0, 0, 0, 0x20, 0, 0, 0, 0))
      restart(h, life)
    }

  /** The node starts with this life. */
  def restart(h: RelayHostModel, life: Int): Unit = {
    h.write(RingRegisters.Control, Seq(0))
    h.write(RingRegisters.Life, Seq(life))
    h.write(RingRegisters.Control, Seq(1 << RingRegisters.Relay))
  }

  /** The node loses its power: nothing is pending any more. */
  def stop(h: RelayHostModel): Unit = {
    h.write(port + CanRegisters.Command, Seq(4))
    h.write(RingRegisters.Control, Seq(0))
  }

  /** A frame is put into a slot and requested. */
  def request(h: RelayHostModel, slot: Int, frame: CanFrame): Unit = {
    h.write(slots + slot * CanRegisters.FrameBytes, frame.bytes())
    h.write(port + CanRegisters.Requests, Seq(1 << slot & 0xff, 1 << slot >> 8))
  }

  /** A map of slots: requests (pending), sent, failed. */
  def map(h: RelayHostModel, which: Int): Int = {
    val bytes = h.read(port + which, 2)
    bytes.head | bytes(1) << 8
  }
}
