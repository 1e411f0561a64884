package flyframe.registers

import org.scalatest.flatspec.AnyFlatSpec
import scala.util.Random

class AlignedBlockSpec extends AnyFlatSpec {
  private def cover(addresses: Int*) =
    AlignedBlock.cover(addresses.toSet).map(block => (block.first, block.addresses.size))

  "Addresses" should "be covered by the largest blocks that begin alike" in {
    assert(cover() == Nil)
    assert(cover(5) == Seq((5, 1)))
    assert(cover(6, 7) == Seq((6, 2)))
    assert(cover(7, 8) == Seq((7, 1), (8, 1)))
    assert(cover(0x900 to 0x93f: _*) == Seq((0x900, 64)))
    assert(cover(1 to 12: _*) == Seq((1, 1), (2, 2), (4, 4), (8, 4), (12, 1)))
  }
  it should "be in one block each, and no other address in any" in {
    val random = new Random(1)
    for (_ <- 1 to 200) {
      val addresses = Set.fill(random.nextInt(100))(random.nextInt(128))
      val blocks    = AlignedBlock.cover(addresses)
      assert(blocks.flatMap(_.addresses).sorted == addresses.toSeq.sorted)
      for (block <- blocks) assert(block.first % block.addresses.size == 0)
    }
  }
}
