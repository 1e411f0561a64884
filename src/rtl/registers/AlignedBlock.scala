package flyframe.registers

import chisel3._

/** The addresses that differ from `first` in the lowest `bits` bits only. */
final case class AlignedBlock(first: Int, bits: Int) {
  def addresses: Range = first until first + (1 << bits)

  /** `address` is one of them. */
  def holds(address: UInt): Bool = (address >> bits) === (first >> bits).U
}

object AlignedBlock {

  /** The fewest blocks that hold these addresses, and no others, in the order of their addresses. */
  def cover(addresses: Set[Int]): Seq[AlignedBlock] =
    if (addresses.isEmpty) Nil
    else {
      val first = addresses.min
      val largest = Iterator
        .from(0)
        .map(AlignedBlock(first, _))
        .takeWhile(block => block.first % (1 << block.bits) == 0 && block.addresses.forall(addresses))
        .toSeq
        .last
      largest +: cover(addresses -- largest.addresses)
    }
}
