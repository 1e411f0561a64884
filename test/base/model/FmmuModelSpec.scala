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
    def claim(address: Int) = Option.when(address < limit) { (byte: Int, _: Int) =>
      content(address) = byte
      written :+= address -> byte
      true
    }
  }

  /** A datagram of `length` bytes from `start` on. */
  private def access(memory: Memory, fmmus: Seq[FmmuModel], start: Long = 0, length: Int = 1) =
    new LogicalAccess(start, length, fmmus, memory)

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
    val both = access(memory, Seq(bytewise(0, 1, 0x1000), bytewise(0, 2, 0x2000)))
    assert(both.read(0).map(_(0)).contains(0x11))
    val empty = access(memory, Seq(fmmu(0, 1, (5, 2, 0), 0x1000), bytewise(0, 1, 0x2000)))
    assert(empty.read(0).isEmpty && !empty.write(0, 1))
  }
  "FMMU-06: reading and writing" should "use their own FMMUs" in {
    val memory = new Memory
    val both   = access(memory, Seq(bytewise(0, 1, 0x1000, 1), bytewise(0, 1, 0x2000, 2)))
    assert(both.write(0, 0x33) && memory.written == Seq(0x2000 -> 0x33))
    assert(both.read(0).map(_(0xff)).contains(0))
  }
  "FMMU-09, B-46: reading" should "keep unmapped bits, and those of absent bytes" in {
    val memory = new Memory(limit = 0x1001)
    memory.content(0x1000) = 0xff
    def run = access(memory, Seq(fmmu(0, 1, (0, 7, 4), 0x1000)))
    assert(run.read(0).map(_(0x00)).contains(0x0f))
    assert(run.read(0).map(_(0x50)).contains(0x5f))
    val beyond = access(memory, Seq(fmmu(0, 1, (0, 7, 4), 0x1001)))
    assert(beyond.read(0).isEmpty)
  }
  "FMMU-10, B-47: bit-wise writing" should "write each local byte once and whole, unmapped bits 0" in {
    val memory = new Memory
    memory.content(0x0f01) = 0xff
    memory.content(0x0f02) = 0xff
    val run   = access(memory, Seq(fmmu(0x00010011L, 3, (3, 0, 1), 0x0f01)), 0x00010011L, 3)
    val wrote = Seq(0xff, 0x00, 0xff).zipWithIndex.map { case (b, i) => run.write(i, b) }
    assert(wrote == Seq(false, true, true))
    assert(memory.written == Seq(0x0f01 -> 0x3e, 0x0f02 -> 0x40))
  }
  it should "write what there is when the datagram ends within the run" in {
    val memory = new Memory
    val run    = access(memory, Seq(fmmu(0x100, 3, (0, 7, 4), 0x1000)), 0x100, 2)
    assert(Seq(-1, 0, 1).map(i => run.write(i, 0xff)) == Seq(false, true, true))
    assert(memory.written == Seq(0x1000 -> 0xf0, 0x1001 -> 0xff, 0x1002 -> 0x0f))
  }
  "FMMU-11: what nobody maps" should "not be accessible" in {
    val both =
      access(new Memory, Seq(bytewise(0x10, 1, 0x1000, 1), bytewise(0x20, 1, 0x1000, 2)), length = 0x30)
    assert(both.read(0x20).isEmpty && !both.write(0x10, 1) && both.read(0x11).isEmpty)
  }
  "OP-13, B-45: length 0 and the ends of the address spaces" should "map nothing beyond" in {
    assert(!bytewise(0x10, 0, 0x1000).covers(0x10))
    val last = bytewise(0xffffffffL, 2, 0x1000)
    assert(last.covers(0xffffffffL) && !last.covers(0) && !last.covers(0x100000000L))
    val end = access(new Memory, Seq(bytewise(0, 4, 0xfffe)), length = 4)
    assert((0 to 3).map(i => end.write(i, 1)) == Seq(true, true, false, false))
  }
}
