package flyframe.frame

import chiseltest._
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.SharedSimulation
import flyframe.params.EscParams
import flyframe.registers.RegisterMap

/** What SyncManagers are asked for bytes that are to be read and written, and where these lie by the answers
  * (SM-12, B-52 to B-54).
  */
class FetchSpec extends AnyFlatSpec with SharedSimulation {
  private val p         = EscParams(fmmus = 1, syncManagers = 4, applicationLayer = 1, ramKiB = 8, alarm = 1)
  private val registers = RegisterMap(p)
  private val others    = RegisterMap.unmanagedWords(registers).toSet // in no buffer
  private val random    = new scala.util.Random(1)
  private def any       = random.nextBoolean()

  /** A byte, and what its SyncManager says. */
  private case class Byte(
      address: Int,
      exists: Boolean,
      inManaged: Boolean,
      inMemory: Boolean,
      hit: Boolean,
      index: Int,
      first: Boolean,
      last: Boolean,
      allowed: Boolean,
      inBuffer: Boolean,
      offset: Int
  ) {
    def managed: Boolean     = hit && inManaged
    def may: Boolean         = exists && (!managed || (inMemory && allowed))
    def mayInBuffer: Boolean = managed && inMemory && inBuffer

    /** Where it is, if it is anywhere. */
    def place: Option[Int] = {
      val sum = address + (if (managed && !(first && last)) offset else 0)
      Option.when(sum <= 0xffff && !(managed && others(sum / 4)))(sum)
    }
  }
  private def someByte() = {
    // Around registers that SyncManagers do not act on, at the end of the address space, anywhere.
    val goal    = Seq(0x0f00 + random.nextInt(0x100), 0xfff0 + random.nextInt(0x20), random.nextInt(0x20000))
    val address = random.nextInt(0x10000)
    val offset  = (goal(random.nextInt(3)) - address) max 0
    Byte(address, any, any, any, any, random.nextInt(4), any, any, any, any, offset)
  }

  private def pokeTarget(t: Target, b: Byte): Unit = {
    t.exists.poke(b.exists)
    t.inManaged.poke(b.inManaged)
    t.inMemory.poke(b.inMemory)
    t.area.hit.poke(b.hit)
    t.area.index.poke(b.index)
    t.area.first.poke(b.first)
    t.area.last.poke(b.last)
  }

  /** One byte time: what is asked for the byte that was found before and is now written, and for the one that
    * is read; and the answers. The first time no byte is kept to be written.
    */
  private def byteTime(
      dut: Fetch,
      written: Byte,
      read: Byte,
      next: Byte,
      writes: Boolean,
      reads: Boolean,
      isKept: Boolean = true
  ) =
    for (cycle <- 0 until 8) {
      dut.schedule.cycle.poke(cycle)
      dut.writes.poke(writes)
      dut.reads.poke(reads)
      pokeTarget(dut.readTarget, if (cycle == 5) read else someByte())
      pokeTarget(dut.writeTarget, if (cycle == 5) next else someByte())
      val answered = if (cycle == 4) written else if (cycle == 7) read else someByte()
      dut.answer.allowed.poke(answered.allowed)
      dut.answer.inBuffer.poke(answered.inBuffer)
      dut.offset.poke(answered.offset)
      dut.readAddress.poke(if (cycle == 7) read.address else random.nextInt(0x10000))
      dut.writeAddress.poke(if (cycle == 4) written.address else random.nextInt(0x10000))

      val asked = cycle match {
        case 2 => Option.when(writes && written.managed)(written)
        case 5 => Option.when(reads && read.managed && read.inMemory)(read)
        case _ => None
      }
      assert(dut.ask.valid.peekBoolean() == asked.isDefined, s"cycle $cycle, $written, $read")
      for (b <- asked) {
        val access = dut.ask.access
        assert(dut.ask.number.peekInt() == b.index)
        assert(access.first.peekBoolean() == b.first)
        assert(access.single.peekBoolean() == (b.first && b.last))
        assert(access.write.peekBoolean() == (cycle == 2))
        assert(access.touch.peekBoolean() == (cycle == 5))
        assert(!access.close.peekBoolean())
      }
      dut.clock.step()
      if (cycle == 4 && isKept) check(dut.write, written, wanted = true)
      if (cycle == 7) check(dut.read, read, wanted = reads)
    }

  private def check(found: Fetched, b: Byte, wanted: Boolean): Unit = {
    assert(found.may.peekBoolean() == (b.may && wanted), b)
    assert(found.inBuffer.peekBoolean() == b.mayInBuffer, b)
    val address = found.address.peekInt().toInt
    assert(Option.when(address <= 0xffff)(address) == b.place, f"0x$address%x of $b, 0x${b.address}%x")
    assert(found.index.peekInt() == b.index)
    assert(found.first.peekBoolean() == b.first && found.last.peekBoolean() == b.last)
    assert(found.single.peekBoolean() == (b.first && b.last))
  }

  together("fetch", new Fetch(p, registers))(
    "SM-12, B-52, B-53, B-54: what is asked, and where the byte is" -> { dut: Fetch =>
      var written = someByte()
      byteTime(dut, someByte(), someByte(), written, writes = false, reads = false, isKept = false)
      for (_ <- 0 until 1500) {
        val next = someByte()
        byteTime(dut, written, someByte(), next, writes = any, reads = any)
        written = next
      }
    },
    "a new frame may not access what the last one has fetched" -> { dut: Fetch =>
      val open = someByte().copy(exists = true, hit = false)
      byteTime(dut, open, open, open, writes = false, reads = true, isKept = false)
      byteTime(dut, open, open, open, writes = true, reads = true)
      assert(dut.read.may.peekBoolean() && dut.write.may.peekBoolean())
      dut.schedule.cycle.poke(15)
      dut.newFrame.poke(true)
      dut.clock.step()
      assert(!dut.read.may.peekBoolean() && !dut.write.may.peekBoolean())
    }
  )
}
