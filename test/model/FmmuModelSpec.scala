package flyframe.model

import org.scalatest.flatspec.AnyFlatSpec

/** Translation by one FMMU, and logical accesses through several. */
class FmmuModelSpec extends AnyFlatSpec {
  private def fmmu(logical: Long, length: Int, bits: (Int, Int, Int), physical: Int, kind: Int = 3) =
    FmmuModel(true, (kind & 1) != 0, (kind & 2) != 0, logical, length, bits._1, bits._2, physical, bits._3)
  private def bytewise(logical: Long, length: Int, physical: Int, kind: Int = 3) =
    fmmu(logical, length, (0, 7, 0), physical, kind)

  /** Memory that notes what is done to it; absent from `limit` on. */
  private class Memory(limit: Int = 0x10000) extends AddressSpace {
    val content: Array[Int]         = Array.fill(0x10000)(0)
    var written: Vector[(Int, Int)] = Vector.empty
    def read(address: Int)          = Option.when(address < limit)(content(address))
    def write(address: Int, byte: Int) = {
      if (address < limit) { content(address) = byte; written :+= address -> byte }
      address < limit
    }
  }

  /** All mapped bits of a byte as (logical bit, local address, local bit). */
  private def bits(f: FmmuModel, logical: Long): Seq[(Int, Int, Int)] = for {
    m <- f.map(logical)
    i <- 0 until 8 if (m.mask >> i & 1) == 1
  } yield (i, m.address, i + m.shift)

  "FMMU-01: the range" should "be length bytes from the start" in {
    val f = bytewise(0x1000, 3, 0x2000)
    assert((0xffeL to 0x1004L).filter(f.covers) == Seq(0x1000L, 0x1001L, 0x1002L))
  }
  "FMMU-02: a run" should "have (length-1)*8 + stop - start + 1 bits at successive local bits" in {
    for {
      length <- 1 to 3; start <- 0 to 7; stop <- 0 to 7; local <- 0 to 7 if length > 1 || stop >= start
    } {
      val f = fmmu(0x500, length, (start, stop, local), 0x1234)
      val all =
        (0 until length).flatMap(d => bits(f, 0x500 + d).map { case (i, a, b) => (8 * d + i, 8 * a + b) })
      assert(all.size == (length - 1) * 8 + stop - start + 1)
      assert(all.map(_._1) == (start until start + all.size))
      assert(all.map(_._2) == (0 until all.size).map(8 * 0x1234 + local + _))
    }
  }
  "FMMU-03: the vector" should "map 14 bits from 0x00010011[3] on to 0x0F01[1] on" in {
    val f = fmmu(0x00010011L, 3, (3, 0, 1), 0x0f01)
    assert(bits(f, 0x00010011L) == (3 to 7).map(i => (i, 0x0f01, i - 2)))
    assert(
      bits(f, 0x00010012L) == Seq((0, 0x0f01, 6), (1, 0x0f01, 7)) ++ (2 to 7).map(i => (i, 0x0f02, i - 2))
    )
    assert(bits(f, 0x00010013L) == Seq((0, 0x0f02, 6)))
  }
  "FMMU-04: byte-wise mapping" should "touch one local byte per logical byte, whole" in {
    assert(bytewise(0x10, 4, 0x1000).map(0x12) == Seq(MappedByte(0x1002, 0, 0xff)))
  }
  "FMMU-05: of several" should "the lowest numbered one act, also if it maps no bit there" in {
    val memory = new Memory
    memory.content(0x1000) = 0x11
    memory.content(0x2000) = 0x22
    val access = new LogicalAccess(Seq(bytewise(0, 1, 0x1000), bytewise(0, 2, 0x2000 - 0)), memory)
    assert(access.read(0).map(_(0)).contains(0x11))
    val empty = new LogicalAccess(Seq(fmmu(0, 1, (5, 2, 0), 0x1000), bytewise(0, 1, 0x2000)), memory)
    assert(empty.read(0).isEmpty && !empty.write(0, 1))
  }
  "FMMU-06: reading and writing" should "use their own FMMUs" in {
    val memory = new Memory
    val access = new LogicalAccess(Seq(bytewise(0, 1, 0x1000, 1), bytewise(0, 1, 0x2000, 2)), memory)
    assert(access.write(0, 0x33) && memory.written == Seq(0x2000 -> 0x33))
    assert(access.read(0).map(_(0xff)).contains(0))
  }
  "FMMU-09, B-46: reading" should "keep unmapped bits, and those of absent bytes" in {
    val memory = new Memory(limit = 0x1001)
    memory.content(0x1000) = 0xff
    val access = new LogicalAccess(Seq(fmmu(0, 1, (0, 7, 4), 0x1000)), memory)
    assert(access.read(0).map(_(0x00)).contains(0x0f))
    assert(access.read(0).map(_(0x50)).contains(0x5f))
    val beyond = new LogicalAccess(Seq(fmmu(0, 1, (0, 7, 4), 0x1001)), memory)
    assert(beyond.read(0).isEmpty)
  }
  "FMMU-10, B-47: bit-wise writing" should "write whole bytes, unmapped bits 0, the parts of a run joined" in {
    val memory = new Memory
    val access = new LogicalAccess(Seq(fmmu(0x00010011L, 3, (3, 0, 1), 0x0f01)), memory)
    memory.content(0x0f01) = 0xff
    memory.content(0x0f02) = 0xff
    Seq(0xff, 0x00, 0xff).zipWithIndex.foreach { case (b, i) => assert(access.write(0x00010011L + i, b)) }
    assert(memory.content(0x0f01) == 0x3e && memory.content(0x0f02) == 0x40)
    assert(memory.written.map(_._1) == Seq(0x0f01, 0x0f01, 0x0f02, 0x0f02))
  }
  "FMMU-11: what nobody maps" should "not be accessible" in {
    val access =
      new LogicalAccess(Seq(bytewise(0x10, 1, 0x1000, 1), bytewise(0x20, 1, 0x1000, 2)), new Memory)
    assert(access.read(0x20).isEmpty && !access.write(0x10, 1) && access.read(0x11).isEmpty)
  }
  "OP-13, B-45: length 0 and the ends of the address spaces" should "map nothing beyond" in {
    assert(!bytewise(0x10, 0, 0x1000).covers(0x10))
    val last = bytewise(0xffffffffL, 2, 0x1000)
    assert(last.covers(0xffffffffL) && !last.covers(0) && !last.covers(0x100000000L))
    val access = new LogicalAccess(Seq(bytewise(0, 4, 0xfffe)), new Memory)
    assert((0 to 3).map(i => access.write(i, 1)) == Seq(true, true, false, false))
  }
}
